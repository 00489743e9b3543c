// A host with an instrument of its own, as short as it gets: a ball comes down onto a liver lobe and leaves, 60 frames a second.
//     c++ -std=c++17 -O2 -Iinclude examples/press.cpp -lsupple -o press
#include <cstdio>
#include <cstdlib>
#include <vector>

#include <supple.hpp>

#include "gmsh.hpp"

struct alignas(supple::align) line {
    unsigned char bytes[supple::align];
};
static std::vector<line> room(std::size_t bytes) { return std::vector<line>(bytes / supple::align + 1); }
static void stop(const char *why) { std::fprintf(stderr, "%s\n", why), std::exit(1); }
static void done(supple::status status) {
    if (!supple::is_done(status)) stop(supple::text(status));
}
template <class T> static T made(const supple::result<T> &result) {
    char why[200];
    if (!result) stop(supple::describe(result.error, why));
    return result.value;
}

int main(int count, char **words) {
    const gmsh::mesh mesh = gmsh::read(count > 1 ? words[1] : "meshes/lobe.msh");
    const auto nodes = std::uint32_t(mesh.points.size() / 3), elements = std::uint32_t(mesh.tetrahedra.size() / 4);
    std::vector<supple::support> supports; // the back hangs on the diaphragm
    for (std::uint32_t node = 0; node < nodes; node++)
        if (mesh.points[3 * node + 1] > 0.030f) supports.push_back({node, 7, 0});
    const supple::tissue liver = {{1500.0f, 8.023f, 40000.0f}, 1060.0f}; // a Pa, b, d Pa; kg/m^3
    supple::body body;
    body.law = supple::law::exponential, body.points = mesh.points, body.tetrahedra = mesh.tetrahedra;
    body.supports = supports, body.tissues = {&liver, 1};

    auto scene_room = room(supple::scene::size(nodes, elements)), state_room = room(supple::state::size(nodes));
    auto loads_room = room(supple::loads::size(0, 0)), contact_room = room(supple::contact::size(nodes));
    const auto scene = made(supple::scene::make(scene_room, body));
    const auto state = made(supple::state::make(state_room, scene));
    const auto loads = made(supple::loads::make(loads_room, scene, 0, 0));
    const auto contact = made(supple::contact::make(contact_room, scene, mesh.points)); // any node may be touched
    const auto place = [](float height) { return supple::pose_at({-0.010f, 0.004f, height}); };
    const supple::instrument tools[] = {supple::instrument::sphere(0.010f, place(0.073f), 0.3f)}; // m, friction
    done(contact.set(tools));
    done(loads.set_contact(contact));
    const auto steps = unsigned(2.0f / 60.0f / made(state.critical_step(scene)).seconds) + 1;
    done(state.set_step(scene, 1.0f / 60.0f / float(steps), 20.0f)); // s, damping 1/s

    for (int frame = 0; frame < 60; frame++) {
        const float down = 0.010f * float(frame < 30 ? frame : 60 - frame) / 30.0f; // m
        done(contact.move(0, place(0.073f - down), frame / 60.0, (frame + 1) / 60.0));
        supple::report report;
        done(state.step(scene, loads, steps, &report));
        supple::touch felt;
        done(contact.read(0, felt));
        if (frame % 6 == 5) std::printf("%.2f s: %.3f N up, %u nodes\n", report.time, double(felt.mean_force[2]), felt.contacts);
    }
    return 0;
}
