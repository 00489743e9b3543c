// A host with an instrument of its own, as short as it gets: a ball comes down onto a liver lobe and leaves, 60 frames a second.
//     c++ -std=c++17 -O2 -Iinclude examples/press.cpp -lsupple -o press
#include <cstdio>
#include <cstdlib>
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

int main(int count, char **words) {
    const gmsh::mesh mesh = gmsh::read(count > 1 ? words[1] : "meshes/lobe.msh");
    std::vector<supple::support> supports; // the back hangs on the diaphragm
    for (std::uint32_t node = 0; node < mesh.points.size() / 3; node++)
        if (mesh.points[3 * node + 1] > 0.030f) supports.push_back({node, 7, 0});
    const supple::tissue liver = {{1500.0f, 8.023f, 40000.0f}, 1060.0f}; // a Pa, b, d Pa; kg/m^3
    supple::body body;
    body.points = mesh.points, body.tetrahedra = mesh.tetrahedra, body.supports = supports;
    body.law = supple::law::exponential, body.tissues = {&liver, 1};
    const auto at = [](float height) { return supple::pose_at({-0.010f, 0.004f, height}); };
    const supple::instrument tools[] = {supple::instrument::sphere(0.010f, at(0.073f), 0.3f)}; // m, friction
    auto how = supple::settings(supple::steps::exact, 20.0f); // damping, 1/s
    std::vector<std::uint32_t> faces(3 * mesh.tetrahedra.size());
    done(how.touchable_by(tools, body, faces)); // all nodes, and triangles where the ball is thinner than edges are long
    std::vector<supple::line> room(supple::lines(made(supple::simulation::size(body, how))));
    const auto lobe = made(supple::simulation::make(room, body, how));
    done(lobe.contact().set(tools));
    for (int frame = 0; frame < 60; frame++) {
        const float down = 0.010f * float(frame < 30 ? frame : 60 - frame) / 30.0f; // m
        done(lobe.contact().move(0, at(0.073f - down), frame / 60.0, (frame + 1) / 60.0));
        done(lobe.advance(1.0 / 60.0));
        supple::touch felt;
        done(lobe.contact().read(0, felt));
        if (frame % 6 == 5) std::printf("%.2f s: %.3f N up, %u nodes\n", (frame + 1) / 60.0, double(felt.mean_force[2]), felt.contacts);
    }
}
