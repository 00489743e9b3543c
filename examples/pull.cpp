// A host whose tracked points draw an organ: a free liver lobe follows six of them, 60 frames a second; each is lost for
// three frames of eighteen.
//     c++ -std=c++17 -O2 -Iinclude examples/pull.cpp -lsupple -o pull
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <supple.hpp>
#include <vector>

#include "gmsh.hpp"

static void done(supple::status status, const char *why = nullptr) {
    if (!supple::is_done(status)) std::fprintf(stderr, "%s\n", why ? why : supple::text(status)), std::exit(1);
}
template <class T> static T made(const supple::result<T> &result) {
    char why[200];
    return done(result.status, supple::describe(result.error, why)), result.value;
}

constexpr std::uint32_t points = 6;
static const float tracked[points][3] = {{0.080f, 0.0f, 0.017f}, {0.02f, -0.035f, 0.006f}, {-0.04f, -0.05f, 0.003f},
                                         {-0.06f, 0.0f, 0.02f},  {0.04f, 0.03f, 0.025f},   {-0.011f, 0.004f, 0.06f}}; // m, at rest

// Where a tracker would see a point: the patient breathes and the front is lifted; m, s.
static void seen(const float at[3], double time, float out[3]) {
    const float breath = 0.008f * std::sin(1.5f * float(time)), lift = 4.0f * at[1] * at[1] * std::fmin(1.0f, float(time));
    out[0] = at[0], out[1] = at[1] + breath, out[2] = at[2] + lift;
}

int main(int count, char **words) {
    const gmsh::mesh mesh = gmsh::read(count > 1 ? words[1] : "meshes/lobe.msh");
    const supple::tissue liver = {{500.0f, 10000.0f}, 1060.0f}; // c, d Pa; kg/m^3
    supple::body body; // no supports, no loads: only the pulls know where it is
    body.points = mesh.points, body.tetrahedra = mesh.tetrahedra, body.element = supple::element::nodal_strain;
    body.law = supple::law::neo_hookean, body.tissues = {&liver, 1};
    const supple::settings how(supple::steps::exact, 20.0f); // damping, 1/s
    std::vector<supple::line> room(supple::lines(made(supple::simulation::size(body, how))));
    const auto lobe = made(supple::simulation::make(room, body, how));

    std::vector<supple::line> more(supple::lines(supple::pulls::size(points, 64 * points)));
    const auto pulls = made(supple::pulls::make(more, lobe.scene(), points, 64 * points));
    for (const auto &at : tracked)
        done(pulls.add(lobe.scene(), mesh.points, {{at[0], at[1], at[2]}, 0.012f, 300.0f, 0.0f, {}})); // m, N/m
    done(lobe.loads().set_pulls(pulls));

    for (int frame = 0; frame < 120; frame++) {
        const double now = frame / 60.0, end = (frame + 1) / 60.0;
        float targets[3 * points];
        for (std::uint32_t n = 0; n < points; n++) seen(tracked[n], end, targets + 3 * n);
        const std::uint32_t lost = std::uint32_t(frame) / 3 % points;
        targets[3 * lost] = std::numeric_limits<float>::quiet_NaN(); // not seen in this frame
        done(pulls.turn(lobe.scene(), mesh.points, lobe.state())); // with the body
        done(pulls.aim(targets, now, end));
        done(lobe.advance(1.0 / 60.0));
        if (frame % 20 < 19) continue;
        supple::pulled read[points];
        done(pulls.read(lobe.state(), read));
        float where[3], apart = 0.0f, most = 0.0f;
        seen(tracked[lost], end, where);
        for (int axis = 0; axis < 3; axis++) apart += (read[lost].point[axis] - where[axis]) * (read[lost].point[axis] - where[axis]);
        for (const auto &each : read) most = std::fmax(most, std::hypot(each.force[0], each.force[1], each.force[2]));
        std::printf("%.2f s: the lost point %u is %.2f mm from where it is; at most %.3f N\n", end, lost, 1e3 * double(std::sqrt(apart)),
                    double(most));
    }
}
