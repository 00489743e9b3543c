// What supple.hpp itself sees of a host's mistakes, and the sentences that it makes of the library's: a cube of cells of 10 mm.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

#include <supple.hpp>

using supple::is_done;
using supple::status;

namespace {

#define CHECK(condition)                                                                                               \
    do {                                                                                                               \
        if (!(condition)) std::printf("%s:%d: not so: %s\n", __FILE__, __LINE__, #condition), std::exit(1);            \
    } while (0)

void sentence(const supple::error &error, const char *expected, int line) {
    char text[200];
    if (std::strcmp(supple::describe(error, text), expected) == 0) return;
    std::printf("line %d: \"%s\" in place of \"%s\"\n", line, text, expected);
    std::exit(1);
}
#define SENTENCE(error, expected) sentence(error, expected, __LINE__)

// A cube of so many cells along each axis, held at its lowest nodes.
struct cube {
    std::uint32_t cells;
    std::vector<float> points;
    std::vector<std::uint32_t> tets;
    std::vector<supple::support> supports;
    std::vector<supple::tissue> tissues{{{500, 5000}, 1000}};

    std::uint32_t node(std::uint32_t x, std::uint32_t y, std::uint32_t z) const { return (z * (cells + 1) + y) * (cells + 1) + x; }

    explicit cube(std::uint32_t of) : cells(of) {
        for (std::uint32_t z = 0; z <= cells; z++)
            for (std::uint32_t y = 0; y <= cells; y++)
                for (std::uint32_t x = 0; x <= cells; x++) {
                    if (z == 0) supports.push_back({node(x, y, z), 7, 0});
                    for (const std::uint32_t at : {x, y, z}) points.push_back(0.01f * float(at));
                }
        const std::uint32_t step[] = {1, cells + 1, (cells + 1) * (cells + 1)};
        const int walks[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 2}, {2, 1}, {1, 0}};
        for (std::uint32_t z = 0; z < cells; z++)
            for (std::uint32_t y = 0; y < cells; y++)
                for (std::uint32_t x = 0; x < cells; x++)
                    for (int walk = 0; walk < 6; walk++) {
                        const std::uint32_t a = node(x, y, z), b = a + step[walks[walk][0]], c = b + step[walks[walk][1]];
                        for (const std::uint32_t at : {a, walk < 3 ? b : c, walk < 3 ? c : b, node(x + 1, y + 1, z + 1)}) tets.push_back(at);
                    }
    }

    supple::body body() const {
        supple::body made;
        made.points = points, made.tetrahedra = tets, made.supports = supports, made.tissues = tissues;
        return made;
    }
};

// A thin ball touches the cut of a body whose upper half is removed, and nothing above it.
void the_boundary_of_what_is_left_can_be_touched() {
    const cube mesh(4);
    const std::size_t elements = mesh.tets.size() / 4;
    std::vector<std::uint8_t> removed(elements, 0);
    std::fill(removed.begin() + long(elements / 2), removed.end(), std::uint8_t(1));
    supple::body body = mesh.body();
    body.removed = removed;
    supple::settings how(supple::steps::exact, 20);
    supple::error why;
    const supple::instrument ball[] = {supple::instrument::sphere(0.005f, supple::pose_at({0.0167f, 0.0133f, 0.03f}))};
    std::vector<std::uint32_t> room(8 * elements);
    CHECK(how.touchable_by(ball, body, {room.data(), 8 * elements - 1}, 0, &why) == status::e_short);
    CHECK(why.value == double(8 * elements - 1) && why.limit == double(8 * elements));
    body.removed = {removed.data(), elements - 1};
    CHECK(how.touchable_by(ball, body, room) == status::e_short);
    body.removed = removed;
    CHECK(is_done(how.touchable_by(ball, body, room)));
    const std::uint32_t count = how.supple_settings::surface.triangle_count;
    CHECK(count == 2 * (2 * 16 + 4 * 8));
    float highest = 0;
    for (std::uint32_t at = 0; at < 3 * count; at++) highest = std::fmax(highest, mesh.points[3 * room[at] + 2]);
    CHECK(highest == 0.01f * 2);

    std::vector<supple::line> place(supple::lines(supple::simulation::size(body, how).value));
    const auto made = supple::simulation::make(place, body, how);
    CHECK(made && is_done(made.value.contact().set(ball)));
    supple::touch felt{};
    for (int frame = 0; frame < 20; frame++) {
        const float height = 0.03f - 3e-4f * float(frame + 1);
        CHECK(is_done(made.value.contact().move(0, supple::pose_at({0.0167f, 0.0133f, height}), 0.01 * frame, 0.01 * (frame + 1))));
        CHECK(is_done(made.value.advance(0.01)) && is_done(made.value.contact().read(0, felt)));
        CHECK(height > 0.0251f ? felt.contacts == 0 : height > 0.0245f || felt.contacts > 0);
    }
    std::printf("mistakes: a ball 1 mm deep in a cut feels %.1f mN\n", 1e3 * double(felt.force[2]));
    CHECK(felt.force[2] > 0);

    // The triangles of before the removal.
    std::vector<std::uint32_t> all(12 * elements);
    const auto before = supple::boundary(mesh.tets, all);
    how.touchable(mesh.points.size() / 3, {{}, {all.data(), 3 * before.value}});
    place.resize(supple::lines(supple::simulation::size(body, how).value));
    const auto refused = supple::simulation::make(place, body, how);
    CHECK(refused.status == status::e_mesh_unused_node && refused.error.node > mesh.node(4, 4, 2));
}

void sentences_name_what_is_wrong() {
    const cube mesh(2);
    const supple::body body = mesh.body();
    supple::settings how(supple::steps::exact, 20), wrong = how;
    how.touchable(mesh.points.size() / 3);
    std::vector<supple::line> place(supple::lines(supple::simulation::size(body, how).value)), spare(place.size());
    const auto made = supple::simulation::make(place, body, how);
    CHECK(made);
    const supple::simulation sim = made.value;
    supple::error why{};
    wrong.tolerance = NAN;
    CHECK(sim.set(wrong, &why) == status::e_negative);
    SENTENCE(why, "a number is negative or not finite: tolerance, nan");
    wrong = how, wrong.damping = -1;
    CHECK(sim.set(wrong, &why) == status::e_negative);
    SENTENCE(why, "a number is negative or not finite: damping, -1");
    wrong = how, wrong.lead_in = INFINITY;
    CHECK(sim.set(wrong, &why) == status::e_negative);
    SENTENCE(why, "a number is negative or not finite: time, inf");

    std::vector<supple::tissue> denser = mesh.tissues;
    denser[0].density = 900;
    CHECK(sim.set_tissues(denser, &why) == status::e_mismatch);
    SENTENCE(why, "objects of scenes with other nodes, a list of another length, or tissue of another density or that remembers other things: "
                  "entry 0, 900, against 1000");
    cube far(2);
    far.points[3] = 1e30f;
    SENTENCE(supple::simulation::make(spare, far.body(), how).error,
             "a number is not finite, or a coordinate is beyond 1e6 m: entry 1, node 1, axis x, 1e+30");
    far = mesh, far.tissues[0].constants[1] = 1e30f;
    const auto stiff = supple::simulation::make(spare, far.body(), how);
    CHECK(stiff.status == status::e_too_stiff && stiff.error.node < 27);

    supple::instrument tools[] = {supple::instrument::field({}, supple::pose_at({0, 0, 1}))};
    CHECK(sim.contact().set(tools, &why) == status::e_field);
    SENTENCE(why, "the bytes of an instrument's field are none, or damaged: instrument 0");
    tools[0] = supple::instrument::sphere(NAN, supple::pose_at({0, 0, 1}));
    CHECK(sim.contact().set(tools, &why) == status::e_instrument);
    SENTENCE(why, "an instrument with a size, friction, time or pose that cannot be: instrument 0, nan");

    // What only a status tells has no value.
    const std::uint32_t one[] = {0, 1, 2, 3};
    std::uint32_t few[3];
    SENTENCE(supple::boundary(one, few).error, "fewer bytes or floats than needed");
}

void pulls_look_at_their_points_weights_and_times() {
    const cube mesh(2);
    std::vector<supple::line> place(supple::lines(supple::simulation::size(mesh.body()).value)), of_pulls(64);
    const auto sim = supple::simulation::make(place, mesh.body());
    CHECK(sim);
    const auto made = supple::pulls::make(of_pulls, sim.value.scene(), 2, 16);
    CHECK(made);
    const supple::pulls pulls = made.value;
    const supple::pull pull{{0.01f, 0.01f, 0.02f}, 0.011f, 100, 0, {0, 0, 0}};
    supple::error why{};
    const supple::span<const float> few(mesh.points.data(), mesh.points.size() - 3);
    CHECK(pulls.add(sim.value.scene(), few, pull, &why) == status::e_short);
    SENTENCE(why, "fewer bytes or floats than needed: 78, against 81");
    CHECK(is_done(pulls.add(sim.value.scene(), mesh.points, pull, &why)));
    CHECK(pulls.turn(sim.value.scene(), few, sim.value.state()) == status::e_short);
    CHECK(is_done(pulls.turn(sim.value.scene(), mesh.points, sim.value.state())));
    const std::uint32_t nodes[] = {25, 26};
    const float without[] = {-1, -1}, with[] = {0.5f, 0.5f}, targets[] = {0.012f, 0.01f, 0.02f, 0.02f, 0.015f, 0.022f};
    CHECK(pulls.add(sim.value.scene(), nodes, without, pull, &why) == status::e_pull);
    SENTENCE(why, "a pull with a point, radius, direction, target, stiffness or most force that cannot be, without nodes, or with weights that "
                  "do not sum up to one: pull 1, -2");
    CHECK(is_done(pulls.add(sim.value.scene(), nodes, with, pull, &why)));
    CHECK(pulls.aim(targets, NAN, 1, &why) == status::e_negative);
    SENTENCE(why, "a number is negative or not finite: time, nan");
    CHECK(is_done(pulls.aim(targets, 0, 0, &why)));

    // The target of the second one alone.
    const float other[] = {0.02f, 0.015f, 0.025f};
    CHECK(pulls.aim_from(2, other, 0, 0, &why) == status::e_mismatch && is_done(pulls.aim_from(1, other, 0, 0, &why)));
    supple::pulled read[2];
    CHECK(is_done(pulls.read(sim.value.state(), read)));
    CHECK(std::fabs(read[0].gap[0] - 0.002f) < 1e-6f && std::fabs(read[1].gap[2] - 0.005f) < 1e-6f);
}

} // namespace

int main() {
    the_boundary_of_what_is_left_can_be_touched();
    sentences_name_what_is_wrong();
    pulls_look_at_their_points_weights_and_times();
    std::puts("mistakes: all seen");
    return 0;
}
