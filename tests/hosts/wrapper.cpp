// Every function of supple.hpp once, on a single tetrahedron, with the sentences for what is refused.
//
//     c++ -std=c++17 -Wall -Wextra -Werror -pedantic -Iinclude tests/hosts/wrapper.cpp -lsupple -o wrapper
//     ./wrapper weights/compact-10.weights
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <vector>

#include <supple.hpp>

using supple::is_done;
using supple::status;

static_assert(std::is_trivially_copyable_v<supple::scene> && sizeof(supple::scene) == sizeof(void *));
static_assert(!std::is_convertible_v<const std::vector<float> &, supple::span<float>>);
static_assert(!std::is_convertible_v<const std::vector<float> &, supple::memory>);
static_assert(std::is_convertible_v<const std::vector<float> &, supple::bytes>);
static_assert(supple::scene::size(4, 1) % supple::align == 0);
static_assert(sizeof(supple::line) == supple::align && alignof(supple::line) == supple::align);
static_assert(supple::lines(0) == 0 && supple::lines(1) == 1 && supple::lines(128) == 2 && supple::lines(129) == 3);
static_assert(std::is_trivially_copyable_v<supple::simulation> && sizeof(supple::simulation) == sizeof(void *));
static_assert(supple::scene::size(4, 1, 1, supple::element::nodal_strain) ==
              supple::scene::size(4, 1) + SUPPLE_PATCHES_SIZE(4, 1, 1));

namespace {

int wrong = 0;

void expect(bool held, const char *what, int line) {
    if (held) return;
    std::printf("line %d: not %s\n", line, what);
    wrong = 1;
}
#define EXPECT(condition) expect(static_cast<bool>(condition), #condition, __LINE__)

void expect_sentence(const supple::error &error, const char *sentence, int line) {
    char text[160];
    expect(std::strcmp(supple::describe(error, text), sentence) == 0, sentence, line);
    if (std::strcmp(text, sentence) != 0) std::printf("         but %s\n", text);
}
#define EXPECT_SENTENCE(error, sentence) expect_sentence(error, sentence, __LINE__)

alignas(supple::align) unsigned char scene_memory[supple::scene::size(4, 1)];
alignas(supple::align) unsigned char loads_memory[supple::loads::size(2, 1)];
alignas(supple::align) unsigned char state_memory[supple::state::size(4)];
alignas(supple::align) unsigned char other_memory[supple::state::size(4)];
alignas(supple::align) unsigned char learned_memory[supple::learned::size(4, true)];
// Long steps, and what compares with them, need a mesh that is large enough for a lattice.
alignas(supple::align) unsigned char cube_memory[supple::scene::size(64, 162)], cube_state_memory[supple::state::size(64)];
alignas(supple::align) unsigned char cube_loads_memory[supple::loads::size(2, 1)];
alignas(supple::align) unsigned char large_memory[1 << 20], guard_memory[1 << 20], adaptive_memory[1 << 21], reaction_memory[1 << 14];

const float points[] = {0, 0, 0, 0.01f, 0, 0, 0, 0.01f, 0, 0, 0, 0.01f};
const std::uint32_t tetrahedra[] = {0, 1, 2, 3}, turned[] = {0, 2, 1, 3}, outside[] = {0, 1, 2, 9};
const supple::support supports[] = {{0, 7, 0}, {1, 7, 0}, {2, 3, 1}};
const std::uint32_t supports_followed[] = {0, 1};
const supple::tissue tissue = {{500, 25000}, 1000};

supple::body tetrahedron() {
    supple::body body;
    body.points = points;
    body.tetrahedra = tetrahedra;
    body.supports = supports;
    body.tissues = {&tissue, 1};
    return body;
}

// A cube of n cells of 10 mm along each axis, held at its foot.
struct grid {
    std::uint32_t n;
    std::vector<float> at;
    std::vector<std::uint32_t> tets;
    std::vector<supple::support> held;

    explicit grid(std::uint32_t cells) : n(cells) {
        const std::uint32_t side = n + 1;
        for (std::uint32_t node = 0; node < side * side * side; node++) {
            for (const std::uint32_t cell : {node % side, node / side % side, node / side / side}) at.push_back(0.01f * float(cell));
            if (node < side * side) held.push_back({node, 7, 0});
        }
        const std::uint32_t step[] = {1, side, side * side};
        for (std::uint32_t cell = 0; cell < n * n * n; cell++) {
            const std::uint32_t a = cell % n + side * (cell / n % n) + side * side * (cell / n / n);
            for (const auto &[first, second] : {std::pair{0, 1}, {1, 2}, {2, 0}, {1, 0}, {2, 1}, {0, 2}}) {
                const bool even = (first + 1) % 3 == second;
                const std::uint32_t b = a + step[first], c = b + step[second];
                tets.insert(tets.end(), {a, even ? b : c, even ? c : b, a + 1 + side + side * side});
            }
        }
    }

    supple::body body() const {
        supple::body body = tetrahedron();
        body.points = at, body.tetrahedra = tets, body.supports = held;
        return body;
    }
};

void scenes() {
    supple::body body = tetrahedron();
    body.points = {points, 11};
    EXPECT_SENTENCE(supple::scene::make(scene_memory, body).error, "fewer bytes or floats than needed: 11, against 12");
    body = tetrahedron();
    body.tetrahedra = turned;
    EXPECT(supple::scene::make(scene_memory, body).status == status::e_mesh_inverted);
    EXPECT_SENTENCE(supple::scene::make(scene_memory, body).error,
                    "an element has a negative volume: element 0, -1.66667e-07 m^3");
    body.winding = supple::winding::normalised;
    EXPECT(supple::scene::make(scene_memory, body));
    body.tetrahedra = outside;
    EXPECT_SENTENCE(supple::scene::make(scene_memory, body).error,
                    "a node that does not exist: entry 0, node 9, against 4");
    EXPECT(supple::scene::make({scene_memory + 1, 64}, tetrahedron()).status == status::e_misaligned);
    EXPECT(supple::scene().describe().status == status::e_null);
}

void acting(supple::scene scene, supple::loads loads) {
    supple::error error;
    std::vector<supple::force> forces(3, {3, {0.01f, 0, 0}, 0});
    EXPECT(loads.set_forces(forces, &error) == status::e_capacity);
    EXPECT_SENTENCE(error, "more than there is room for: 3, against 2");
    forces.pop_back();
    forces[1].ramp = -1;
    EXPECT(loads.set_forces(forces, &error) == status::e_negative);
    EXPECT_SENTENCE(error, "a number is negative or not finite: entry 1, -1");
    forces[1].ramp = 0;
    EXPECT(is_done(loads.set_forces(forces)));
    const supple::motion up[] = {{2, 4, {0, 0, 0.001f}, 0}}, aside[] = {{2, 3, {0, 0.0001f, 0}, 0}};
    EXPECT(loads.set_motions(scene, up, &error) == status::e_not_held);
    EXPECT_SENTENCE(error, "a motion along an axis that no moving support holds: motion 0, node 2, axis z");
    EXPECT(is_done(loads.set_motions(scene, aside)));
    EXPECT(is_done(loads.set_gravity({0, 0, -9.81f})));
}

void moving(supple::scene scene, supple::loads loads, supple::state state) {
    supple::error error;
    supple::report report;
    EXPECT(state.step(scene, loads, 1) == status::e_no_step);
    const auto critical = state.critical_step(scene);
    EXPECT(critical && critical.value.node == 3);
    EXPECT(state.set_step(scene, 1, 0, &error) == status::e_unstable);
    EXPECT(error.node == 3 && error.limit == double(critical.value.seconds));
    EXPECT(is_done(state.set_step(scene, 0.5f * critical.value.seconds, 20)));
    EXPECT(is_done(state.step(scene, loads, 100, &report)) && report.steps == 100);
    EXPECT(state.now() && state.now().value.steps == 100 && state.now().value.seconds == report.time);

    std::vector<float> displacements(12), others(12);
    EXPECT(is_done(state.copy_displacements(displacements)) && displacements[7] == 0.0001f);
    EXPECT(state.displacements() && state.displacements().value[3][0] == displacements[9]);
    EXPECT(is_done(state.copy_positions(points, others)) && others[9] == points[9] + displacements[9]);
    EXPECT(state.copy_positions({points, 3}, others) == status::e_short);
    EXPECT(is_done(state.copy_velocities(others)) && others[9] != 0.0f && others[0] == 0.0f);
    EXPECT(is_done(state.copy_forces(others)) && others[9] != 0.0f);
    EXPECT(state.copy_forces({others.data(), 11}) == status::e_short);

    std::vector<unsigned char> saved(supple::state::saved_size(4));
    const auto other = supple::state::make(other_memory, scene);
    EXPECT(is_done(state.save(saved)) && other && is_done(other.value.restore(saved)));
    EXPECT(is_done(state.step(scene, loads, 50)) && is_done(other.value.step(scene, loads, 50)));
    EXPECT(is_done(state.copy_displacements(displacements)) && is_done(other.value.copy_displacements(others)));
    EXPECT(displacements == others);
    EXPECT_SENTENCE(supple::state::make({other_memory, 8}, scene).error, "fewer bytes or floats than needed");
    EXPECT(is_done(state.reset()) && state.now().value.steps == 0);
}

void large(const std::vector<float> &at, supple::scene scene, supple::loads loads, supple::state state) {
    supple::large_steps steps;
    steps.seconds = 0.01f;
    supple::report report;
    const auto bytes = supple::large::size(scene, at, steps);
    EXPECT(bytes && bytes.value <= sizeof large_memory);
    EXPECT_SENTENCE(supple::large::size(scene, {at.data(), 9}, steps).error, "fewer bytes or floats than needed: 9, against 192");
    const auto made = supple::large::make(large_memory, scene, state, at, steps);
    EXPECT(made && is_done(made.value.step(scene, loads, state, 3, &report)) && report.added_mass > 0.0f);
    EXPECT(is_done(state.reset()));
}

void learned(supple::scene scene, supple::loads loads, supple::state state, const char *path) {
    std::ifstream file(path, std::ios::binary);
    const std::vector<char> weights(std::istreambuf_iterator<char>(file), {});
    const auto refused = supple::learned::make(learned_memory, scene, {weights.data(), 8}, true);
    EXPECT(refused.status == status::e_weights_short);
    const auto made = supple::learned::make(learned_memory, scene, weights, true);
    EXPECT(made);
    const auto facts = made.value.describe();
    EXPECT(facts && facts.value.seconds > 0.0f && facts.value.fell_back == 0);
    EXPECT(is_done(state.set_step(scene, 0.5f * facts.value.seconds, facts.value.damping)));
    EXPECT(made.value.step(scene, loads, state, 1) == status::e_not_led);
    supple::report report;
    EXPECT(is_done(made.value.lead(scene, loads, state, 10.0 * facts.value.seconds, &report)) && report.steps == 20);
    EXPECT(is_done(made.value.step(scene, loads, state, 5, &report)));
    EXPECT(is_done(made.value.fall_back(state)) && made.value.describe().value.fell_back == 1);
    EXPECT(is_done(made.value.reset()));
    EXPECT(is_done(state.reset()));
}

void judged(const std::vector<float> &at, supple::scene scene, supple::loads loads, supple::state state) {
    const auto exact = 0.5f * state.critical_step(scene).value.seconds;
    EXPECT(is_done(state.set_step(scene, exact, 20)));
    supple::guarded_steps guarded;
    guarded.seconds = exact;
    guarded.damping = 20;
    const auto bytes = supple::guard::size(scene, at);
    EXPECT(bytes && bytes.value <= sizeof guard_memory);
    EXPECT_SENTENCE(supple::guard::size(scene, {at.data(), 9}).error, "fewer bytes or floats than needed: 9, against 192");
    const auto guard = supple::guard::make(guard_memory, scene, state, at, guarded);
    const auto reaction = supple::reaction::make(reaction_memory, scene, {supports_followed, 2}, 20);
    EXPECT(guard && reaction && supple::reaction::size(64) <= sizeof reaction_memory);
    supple::estimate estimate{};
    supple::reaction_force force{};
    EXPECT(is_done(reaction.value.follow(scene, state, force)) && force.known == 0);
    for (int frame = 0; frame < 30; frame++) {
        EXPECT(is_done(state.step(scene, loads, 3)));
        EXPECT(is_done(guard.value.follow(scene, loads, state, &estimate)));
    }
    EXPECT(estimate.known == 1 && estimate.mean > 0.0f && estimate.allowed > 0.0f);
    EXPECT(is_done(reaction.value.follow(scene, state, force)) && force.known == 1);
    EXPECT(is_done(state.reset()));
}

void adaptive(const std::vector<float> &at, supple::scene scene, supple::loads loads, supple::state state) {
    supple::large_steps longest;
    longest.seconds = 0.01f;
    const auto bytes = supple::adaptive::size(scene, at, longest);
    EXPECT(bytes && bytes.value <= sizeof adaptive_memory);
    const auto made = supple::adaptive::make(adaptive_memory, scene, state, at, longest, 1e-4f);
    EXPECT(made);
    supple::report report;
    supple::adaptive_report taken{};
    EXPECT(is_done(made.value.advance(scene, loads, state, 0.01f, &report, &taken)));
    EXPECT(taken.exact > 0 && report.time > 0.0099 && report.time < 0.0101);
    EXPECT(!supple::adaptive::make(adaptive_memory, scene, state, at, longest, -1.0f));
    EXPECT(is_done(state.reset()));
}

// A mesh in millimetres, whose points are not those of another scene.
void remarked(supple::scene scene, supple::loads loads, supple::state state) {
    supple::remark remarks[8];
    const auto count = supple::remarks(scene, points, remarks, loads);
    EXPECT(count && count.value == 0);
    std::vector<float> millimetres(points, points + 12);
    for (float &metre : millimetres) metre *= 1000;
    supple::body body = tetrahedron();
    body.points = millimetres;
    alignas(supple::align) static unsigned char memory[sizeof scene_memory];
    const auto large = supple::scene::make(memory, body);
    EXPECT(supple::remarks(large.value, millimetres, remarks, loads) && remarks[0].kind == SUPPLE_REMARK_SIZE);
    EXPECT(std::strstr(supple::text(remarks[0]), "metres"));
    EXPECT_SENTENCE(supple::guard::make(guard_memory, scene, state, millimetres, {1e-4f, 0, 1, 0}).error,
                    "points that the scene was not built from: element 0");
}

// A force that is far too large, a support that jumps, and a state that has to be stopped.
void refused(supple::scene scene, supple::loads loads, supple::state state) {
    EXPECT(is_done(state.set_step(scene, 0.5f * state.critical_step(scene).value.seconds, 20)));
    supple::report report;
    const supple::force huge[] = {{3, {0.001f, 0, 0}, 0}, {3, {0, 0, 1e6f}, 0}};
    EXPECT(is_done(loads.set_forces(huge)));
    EXPECT(state.step(scene, loads, 1, &report) == status::e_diverged_force);
    EXPECT(report.error.index == 1 && report.error.node == 3 && report.error.value == 1e6);
    EXPECT(is_done(loads.set_forces({huge, 1})));
    EXPECT(is_done(state.step(scene, loads, 10)));
    EXPECT(is_done(state.stop(scene)));
    std::vector<float> velocities(12, 1.0f);
    EXPECT(is_done(state.copy_velocities(velocities)) && velocities == std::vector<float>(12, 0.0f));
    EXPECT(is_done(state.step(scene, loads, 10)));
}

// A cube loses its top layer, then becomes stiffer, in motion.
void changed() {
    const grid mesh(3);
    const auto how = supple::settings(supple::steps::exact, 20);
    supple::body body = mesh.body();
    const std::size_t elements = mesh.tets.size() / 4, words = supple::lines(supple::simulation::size(body, how).value);
    std::vector<supple::line> first(words), second(words);
    const auto whole = supple::simulation::make(first, body, how);
    EXPECT(whole && is_done(whole.value.loads().set_gravity({1, 0, 0})) && is_done(whole.value.advance(0.05)));
    std::vector<std::uint8_t> removed(elements, 0);
    std::fill(removed.end() - long(elements / 3), removed.end(), std::uint8_t(1));
    body.removed = {removed.data(), 3};
    EXPECT(supple::simulation::size(body, how).status == status::e_short);
    body.removed = removed;
    const auto part = supple::simulation::make(second, body, how);
    EXPECT(part && part.value.scene().describe().value.elements == elements - elements / 3);
    supple::error error;
    EXPECT(part.value.carry_on(part.value, how) == status::e_overlap);
    EXPECT(is_done(part.value.carry_on(whole.value, how, &error)) && part.value.state().now().value.seconds > 0.049);
    EXPECT(is_done(part.value.advance(0.05)) && is_done(whole.value.advance(0.05)));
    supple::tissue stiff[] = {body.tissues.data()[0]};
    stiff[0].constants[0] *= 2;
    EXPECT(is_done(part.value.set_tissues(stiff)) && is_done(part.value.set_tissues(stiff, how)));
    EXPECT(is_done(part.value.scene().set_tissues(stiff)) && is_done(part.value.state().carry_on(part.value.scene())));
    stiff[0].density *= 2;
    EXPECT(part.value.set_tissues(stiff, how, &error) == status::e_mismatch && is_done(part.value.advance(0.05)));
}

// All of it in one memory: what is refused, a ball that presses, a copy that goes on, and other steps.
void simulated(const char *path) {
    const grid mesh(3);
    const auto build = [](const supple::settings &how, supple::memory place) {
        return supple::simulation::make(place, tetrahedron(), how);
    };
    const auto exact = supple::settings(supple::steps::exact, 20).touchable(4, {}, 2);
    EXPECT(exact.damping == 20 && exact.grips == 2 && supple::settings().guard == 1 && supple::settings().surface.node_count == 0);
    auto beyond = supple::settings(supple::steps::long_steps, 20).touchable(4, {{&tetrahedra[1], 3}});
    beyond.seconds = 0.01f;
    EXPECT(beyond.surface.nodes == &tetrahedra[1] && beyond.surface.node_count == 3 && beyond.surface.triangle_count == 0);
    const auto few = supple::simulation::size(tetrahedron(), exact), bytes = supple::simulation::size(tetrahedron(), beyond);
    EXPECT(few && bytes && bytes.value > few.value);
    supple::body body = tetrahedron();
    body.points = {points, 11};
    EXPECT_SENTENCE(supple::simulation::size(body).error, "fewer bytes or floats than needed: 11, against 12");
    auto wrong = exact;
    wrong.tolerance = -1;
    EXPECT_SENTENCE(supple::simulation::size(tetrahedron(), wrong).error, "a number is negative or not finite: tolerance, -1");
    std::vector<supple::line> memory(supple::lines(bytes.value)), copy(memory.size());
    const auto tight = build(exact, {memory.data(), 640});
    EXPECT(tight.status == status::e_short && tight.error.value == 640 && tight.error.limit == double(few.value));
    EXPECT(build(supple::settings().touchable(5), memory).error.limit == 4);
    (wrong = exact).seconds = 1;
    EXPECT(build(wrong, memory).status == status::e_unstable);
    const supple::simulation none;
    EXPECT(none.advance(0.01) == status::e_null && !none.state().now() && none.bytes() == 0);

    const auto made = build(exact, {memory.data(), few.value});
    const supple::simulation sim = made.value;
    EXPECT(made && sim.bytes() <= few.value && sim.scene().describe().value.nodes == 4);
    const auto at = [](float height) { return supple::pose_at({0.001f, 0.001f, height}); };
    const supple::instrument ball[] = {supple::instrument::sphere(0.004f, at(0.0145f))};
    EXPECT(is_done(sim.contact().set(ball)) && is_done(sim.loads().set_gravity({0, 0, -9.81f})));
    supple::sim_report report;
    const auto press = [&](supple::simulation of, float from) {
        const double now = of.state().now().value.seconds;
        EXPECT(is_done(of.contact().move(0, at(from - 0.001f), now, now + 0.01)));
        EXPECT(is_done(of.advance(0.01, &report)) && report.exact == report.call.steps && report.exact > 0);
        supple::touch felt;
        EXPECT(is_done(of.contact().read(0, felt)));
        return felt.mean_force[2];
    };
    EXPECT(press(sim, 0.0145f) > 0);
    EXPECT(report.call.time > 0.0099 && report.call.time < 0.0101 && report.shortest > 0 && report.shortest <= report.longest);
    std::memcpy(copy.data(), memory.data(), sim.bytes());
    const auto copied = supple::simulation::copy_in(copy);
    const float force = press(sim, 0.0135f), same = press(copied, 0.0135f);
    EXPECT(force == same && copied.contact().raw() != sim.contact().raw());
    EXPECT(sim.advance(-1, &report) == status::e_negative);
    EXPECT_SENTENCE(report.call.error, "a number is negative or not finite: -1");
    supple::error error;
    EXPECT(sim.set(beyond, &error) == status::e_short && error.value == double(few.value) && error.limit > error.value);
    EXPECT(press(sim, 0.0125f) > 0);

    auto steps = supple::settings(supple::steps::long_steps, 20);
    steps.seconds = 0.01f;
    std::vector<supple::line> cube(supple::lines(supple::simulation::size(mesh.body(), steps).value));
    const auto longer = supple::simulation::make(cube, mesh.body(), steps);
    EXPECT(longer && is_done(longer.value.loads().set_gravity({0, 0, -9.81f})));
    for (int frame = 0; frame < 30; frame++) EXPECT(is_done(longer.value.advance(0.02, &report)) && report.long_steps == 2);
    EXPECT(report.estimate.known == 1 && report.longest == 0.01f && is_done(longer.value.set(exact)));

    std::ifstream file(path, std::ios::binary);
    const std::vector<char> weights(std::istreambuf_iterator<char>(file), {});
    auto network = supple::settings(supple::steps::learned).use_weights(weights);
    network.lead_in = 0.05;
    std::vector<supple::line> room(supple::lines(supple::simulation::size(mesh.body(), network).value));
    const auto led = supple::simulation::make(room, mesh.body(), network);
    EXPECT(led && led.value.learned().describe().value.seconds > 0 && longer.value.learned().raw() == nullptr);
    EXPECT(led.value.contact().raw() == nullptr && is_done(led.value.loads().set_gravity({0, 0, -1})));
    EXPECT(is_done(led.value.advance(0.1, &report)) && report.exact > 0 && report.learned > 0);
    EXPECT(build(supple::settings(supple::steps::learned).use_weights({weights.data(), 8}), room).status == status::e_weights_short);
}

// A ball as large as an edge is long presses the top of a cube of cells of 10 mm, between its nodes: the mean upward force of the last
// frame, with what the helper lets it touch, with nodes alone, and with triangles.
void thin() {
    const grid mesh(4);
    const auto &[n, at, tets, held] = mesh;
    const supple::body cube = mesh.body();
    std::vector<std::uint32_t> faces(3 * tets.size());
    const auto found = supple::boundary(tets, faces);
    EXPECT(found && found.value == 6 * 2 * n * n);
    EXPECT(supple::boundary(tets, {faces.data(), 12}).status == status::e_short);

    const auto place = [](float height) { return supple::pose_at({0.0167f, 0.0133f, height}); };
    const supple::instrument ball[] = {supple::instrument::sphere(0.01f, place(0.0501f))}, large[] = {supple::instrument::sphere(0.02f, place(0.0601f))};
    const auto force = [&](const supple::settings &how) {
        std::vector<supple::line> memory(supple::lines(supple::simulation::size(cube, how).value));
        const auto made = supple::simulation::make(memory, cube, how);
        EXPECT(made && is_done(made.value.contact().set(ball)));
        supple::touch felt{};
        for (int frame = 0; frame < 20; frame++) {
            EXPECT(is_done(made.value.contact().move(0, place(0.0501f - 1e-4f * float(frame + 1)), 0.01 * frame, 0.01 * (frame + 1))));
            EXPECT(is_done(made.value.advance(0.01)) && is_done(made.value.contact().read(0, felt)));
        }
        supple::remark remarks[8];
        const auto count = supple::remarks(made.value.scene(), at, remarks, made.value.loads());
        const bool told = count && count.value > 0 && remarks[count.value - 1].kind == SUPPLE_REMARK_THIN;
        EXPECT(told == (how.surface.triangle_count == 0));
        if (told) EXPECT(remarks[count.value - 1].value == double(0.01f) && remarks[count.value - 1].index == 0);
        return double(felt.mean_force[2]);
    };
    supple::settings by_itself(supple::steps::exact, 20.0f), alone = by_itself, given = by_itself;
    supple::error why;
    EXPECT(is_done(by_itself.touchable_by(large, cube, faces)) && by_itself.surface.triangle_count == 0);
    EXPECT(by_itself.touchable_by(ball, cube, {faces.data(), 12}, 0, &why) == status::e_short);
    const supple::instrument none[] = {supple::instrument::sphere(-1, place(0))};
    EXPECT(by_itself.touchable_by(none, cube, faces, 0, &why) == status::e_instrument && why.value == -1);
    EXPECT(is_done(by_itself.touchable_by(ball, cube, faces, 0, &why)));
    EXPECT(is_done(why.status == SUPPLE_OK ? status::ok : status::e_null));
    alone.touchable(at.size() / 3), given.touchable(at.size() / 3, {{}, {faces.data(), 3 * found.value}});
    const double helped = force(by_itself), nodes = force(alone), triangles = force(given);
    std::printf("wrapper: a ball as large as an edge feels %.1f mN, with nodes alone %.1f mN\n", 1e3 * helped, 1e3 * nodes);
    EXPECT(helped == triangles && helped > 0 && nodes < 0.5 * helped);

    // A traction on one side adds up to pressure times area.
    std::vector<supple::force> forces(found.value * 3);
    std::vector<std::uint32_t> top;
    for (std::size_t face = 0; face < found.value; face++) {
        bool above = true;
        for (int corner = 0; corner < 3; corner++) above = above && at[3 * faces[3 * face + std::size_t(corner)] + 2] > 0.039f;
        if (above) top.insert(top.end(), &faces[3 * face], &faces[3 * face] + 3);
    }
    const auto pressed = supple::traction(at, top, {0, 0, -100}, 0.1f, forces);
    float sum = 0;
    for (std::size_t each = 0; each < pressed.value; each++) sum += forces[each].newton[2];
    EXPECT(pressed && pressed.value == 3 * 2 * n * n && sum < -0.1599f && sum > -0.1601f && forces[0].ramp == 0.1f);
    EXPECT(supple::traction(at, top, {0, 0, -100}, -1, forces).status == status::e_negative);
    EXPECT(supple::traction(at, top, {0, 0, -100}, 0, {forces.data(), 2}).status == status::e_short);
    top[4] = 999;
    EXPECT_SENTENCE(supple::traction(at, top, {0, 0, -100}, 0, forces).error, "a node that does not exist: entry 1, node 999, against 125");
}

// Points that follow a state, and its displacement field.
void followed(const grid &cube, supple::scene scene, supple::loads loads, supple::state moved) {
    EXPECT(is_done(moved.set_step(scene, 0.5f * moved.critical_step(scene).value.seconds, 0)) && is_done(moved.step(scene, loads, 20)));
    std::vector<supple::line> work(supple::lines(supple_locate_size(std::uint32_t(cube.tets.size() / 4))));
    const float places[] = {0.005f, 0.006f, 0.007f, 0.005f, 0.006f, -0.01f};
    supple::followed_point located[2];
    const auto found = supple::locate(cube.at, cube.tets, {places, 6}, work, {located, 2});
    EXPECT(found && found.value == 2 && located[0].distance == 0 && std::fabs(located[1].distance - 0.01f) < 1e-7f);
    EXPECT(supple::locate(cube.at, cube.tets, {places, 6}, work, {located, 1}).status == status::e_short);
    float now[6], fast[6];
    EXPECT(is_done(supple::follow(moved, {located, 2}, {now, 6}, {fast, 6})) && now[0] != places[0] && fast[0] != 0);
    EXPECT(is_done(supple::follow(moved, {located, 2}, {now, 6}, {})));
    EXPECT(supple::follow(moved, {located, 2}, {now, 5}, {}) == status::e_short);
    supple::error why{};
    located[1].nodes[2] = 999;
    EXPECT(supple::follow(moved, {located, 2}, {now, 6}, {}, &why) == status::e_index && why.index == 1 && why.node == 999);

    supple::image_grid around{{-0.01, -0.01, -0.01}, {0.005, 0.005, 0.005}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {8, 8, 8}};
    const auto bytes = supple::displacement_field_size(around, 0);
    std::vector<supple::line> scratch(supple::lines(bytes.value));
    std::vector<float> field(3 * 512);
    supple_vectors from{};
    EXPECT(bytes && supple_displacements(moved.raw(), &from) == SUPPLE_OK);
    using kind = supple::field_kind;
    const auto covered = supple::displacement_field(cube.at, cube.tets, from, kind::inverse, around, 0, scratch, field);
    EXPECT(covered && covered.value > 8 && covered.value < 512 && field[3 * (7 * 64 + 3 * 8 + 3)] < 0);
    EXPECT(supple::displacement_field(cube.at, cube.tets, from, kind::forward, around, 0, scratch, {field.data(), 9}).status == status::e_short);
    around.spacing[1] = -1;
    EXPECT_SENTENCE(supple::displacement_field_size(around, 0).error,
                    "the grid of an image that cannot be: its origin, spacing, directions or number of points: axis y, -1");
    EXPECT(is_done(moved.reset()));
}

// A cube under a pressure on all sides, at rest; and from displacements.
void pressed_at_rest() {
    const grid mesh(3);
    const supple::body body = mesh.body();
    const supple::settings how(supple::steps::exact);
    std::vector<supple::line> memory(supple::lines(supple::simulation::size(body, how).value));
    const auto made = supple::simulation::make(memory, body, how);
    EXPECT(made);
    const supple::simulation sim = made.value;
    std::vector<std::uint32_t> room(body.tetrahedra.size() / 4 * 12);
    const auto found = supple::boundary(body.tetrahedra, room);
    const supple::span<const std::uint32_t> faces(room.data(), 3 * found.value);
    std::vector<supple::line> own(supple::lines(supple::pressure::size(static_cast<std::uint32_t>(found.value))));
    const auto pressed = supple::pressure::make(own, sim.scene(), body.points, faces);
    EXPECT(found && pressed && is_done(sim.loads().set_pressure(pressed.value)));
    const supple::pressure pressure = pressed.value;
    const auto before = pressure.volume(sim.state());
    EXPECT(is_done(pressure.set(200.0f)) && before && before.value > 0);
    std::vector<supple::line> scratch(supple::lines(supple_settle_size(sim.scene().describe().value.nodes)));
    supple::settled settled;
    EXPECT(is_done(sim.settle(1e-6f, 10000, scratch, &settled)) && settled.remaining < 1e-6f && settled.steps > 0);
    const auto after = pressure.volume(sim.state());
    EXPECT(after.value < before.value && pressure.now(sim.state()).value == 200.0f);
    EXPECT(is_done(pressure.fill(static_cast<float>(before.value), 1e5f)) && is_done(sim.settle(1e-6f, 10000, scratch)));
    EXPECT(pressure.volume(sim.state()).value > after.value && pressure.fill(-1.0f, 1.0f) == status::e_negative);
    EXPECT(sim.settle(0.0f, 1, scratch) == status::e_negative);
    EXPECT(pressure.set(1.0f, 0.0f, 7) == status::e_capacity);
    std::vector<float> moved(body.points.size(), 1e-5f);
    EXPECT(is_done(sim.state().set_displacements(sim.scene(), moved)));
    moved.pop_back();
    EXPECT(sim.state().set_displacements(sim.scene(), {moved.data(), 3}) == status::e_mismatch);
    EXPECT(is_done(sim.loads().set_pressure({})));
}

// A cube that relaxes: sizes, a saved state, and the sentences for series that cannot be.
void relaxes() {
    const grid cube(3);
    supple::body body = cube.body();
    supple::prony series{{0.5f, 0.2f, 0}, {0.01f, 0.1f, 0}};
    body.prony = {&series, 1};
    std::vector<supple::line> place(supple::lines(supple::scene::size(64, 162, 1, supple::element::nodal_pressure, true)));
    const std::size_t room = supple::state::relaxation_size(64, 162, 1, supple::element::nodal_pressure, 2);
    std::vector<supple::line> of_state(supple::lines(supple::state::size(64) + room));
    EXPECT(supple::scene::make({place.data(), supple::scene::size(64, 162)}, body).status == status::e_short);
    const auto scene = supple::scene::make(place, body);
    EXPECT(scene && supple::state::make({of_state.data(), supple::state::size(64)}, scene.value).status == status::e_short);
    const auto state = supple::state::make(of_state, scene.value);
    EXPECT(state && is_done(state.value.set_step(scene.value, 1e-4f, 0)));
    EXPECT(is_done(state.value.step(scene.value, {}, 3)));
    const auto bytes = state.value.saved_size();
    EXPECT(bytes && bytes.value > supple::state::saved_size(64));
    std::vector<unsigned char> saved(bytes.value);
    EXPECT(is_done(state.value.save(saved)) && is_done(state.value.restore(saved)));
    series.share[1] = -0.2f;
    EXPECT_SENTENCE(supple::scene::make(place, body).error,
                    "a tissue relaxes by a share that is not positive, or by more than may relax in sum: tissue 0, term 1, -0.2, against 0.99");
    series.share[1] = 0.2f, series.seconds[0] = 0;
    EXPECT_SENTENCE(supple::scene::make(place, body).error,
                    "a tissue relaxes with a time that is not between a microsecond and a million seconds: tissue 0, term 0, 0 s, against 1e-06 s");
    const supple::tissue two[] = {tissue, tissue};
    const std::vector<std::uint16_t> of_element(162);
    body.tissues = two, body.tissue_of_element = of_element;
    EXPECT(supple::scene::make(place, body).status == status::e_short);
}

// A cube with fibres: sizes, what holds it, and the sentences for fibres that cannot be.
void has_fibres() {
    const grid cube(3);
    supple::body body = cube.body();
    supple::fibres fibres{{2e4f, 16}, {0, 0}, {0, 0}};
    std::vector<float> directions;
    for (int element = 0; element < 162; element++)
        for (const float component : {0.0f, 0.0f, 2.0f, 1.0f, 0.0f, 0.0f}) directions.push_back(component);
    body.fibres = {&fibres, 1}, body.directions = directions;
    const std::size_t room = supple::scene::size(64, 162, 1, supple::element::nodal_pressure, false, true);
    EXPECT(room > supple::scene::size(64, 162));
    std::vector<supple::line> place(supple::lines(room)), of_state(supple::lines(supple::state::size(64)));
    EXPECT(supple::scene::make({place.data(), supple::scene::size(64, 162)}, body).status == status::e_short);
    const auto scene = supple::scene::make(place, body);
    const auto facts = scene.value.describe();
    EXPECT(scene && facts && facts.value.bytes == room);
    const auto state = supple::state::make(of_state, scene.value);
    EXPECT(state && is_done(state.value.set_step(scene.value, 1e-4f, 0)));
    EXPECT(is_done(state.value.step(scene.value, {}, 3)));
    fibres.fibres[1] = -16;
    EXPECT_SENTENCE(supple::scene::make(place, body).error, "a constant of fibres is not a finite positive number: tissue 0, fibres, -16");
    fibres.fibres[1] = 16, fibres.coupling[0] = 200;
    EXPECT_SENTENCE(supple::scene::make(place, body).error,
                    "a constant of fibres is not a finite positive number: tissue 0, coupling, 0");
    fibres.coupling[1] = 11, directions[6 * 7 + 3] = 0;
    EXPECT_SENTENCE(supple::scene::make(place, body).error, "the directions of the fibres in an element are zero, parallel or missing: element 7");
    body.directions = {directions.data(), 6 * 161};
    EXPECT(supple::scene::make(place, body).status == status::e_short);
    body.directions = {};
    EXPECT_SENTENCE(supple::scene::make(place, body).error, "the directions of the fibres in an element are zero, parallel or missing");
    const supple::tissue two[] = {tissue, tissue};
    const std::vector<std::uint16_t> of_element(162);
    body.tissues = two, body.tissue_of_element = of_element;
    EXPECT(supple::scene::make(place, body).status == status::e_short);
}

} // namespace

int main(int count, char **words) {
    if (count != 2) return std::puts("wrapper: the weight file of a network is missing"), 2;
    EXPECT(supple::is_of_this_abi() && supple::version()[0] != '\0');
    EXPECT(is_done(supple::set_level(supple::current_level())));
    EXPECT(std::strcmp(supple::text(status::ok), "done") == 0);
    pressed_at_rest();
    char tiny[5];
    EXPECT(std::strcmp(supple::describe({SUPPLE_E_NULL, supple::none, 0, 0, 0, 0}, tiny), "a po") == 0);

    scenes();
    const auto scene = supple::scene::make(scene_memory, tetrahedron());
    const auto state = supple::state::make(state_memory, scene.value);
    const auto loads = supple::loads::make(loads_memory, scene.value, 2, 1);
    EXPECT(scene && state && loads);
    EXPECT(scene.value.describe().value.bytes == sizeof scene_memory);
    acting(scene.value, loads.value);
    moving(scene.value, loads.value, state.value);
    learned(scene.value, loads.value, state.value, words[1]);
    const grid cube(3);
    const auto body = supple::scene::make(cube_memory, cube.body());
    const auto moved = supple::state::make(cube_state_memory, body.value);
    const auto pulled = supple::loads::make(cube_loads_memory, body.value, 2, 1);
    EXPECT(body && moved && pulled && is_done(pulled.value.set_gravity({3, 0, 0})));
    large(cube.at, body.value, pulled.value, moved.value);
    followed(cube, body.value, pulled.value, moved.value);
    judged(cube.at, body.value, pulled.value, moved.value);
    adaptive(cube.at, body.value, pulled.value, moved.value);
    remarked(scene.value, loads.value, state.value);
    refused(scene.value, loads.value, state.value);
    simulated(words[1]);
    changed();
    thin();
    relaxes();
    has_fibres();
    std::puts(wrong ? "wrapper: not as expected" : "wrapper: as expected");
    return wrong;
}
