// A host in C++ that shows tissue 60 times a second: a liver lobe hangs from its back; a sphere comes from above, presses
// its dome, slides 4 mm sideways with friction and leaves, over and over. Each frame takes the same steps for 1/60 s; the
// host reads the status and the force on the sphere. All memory is there before the first frame.
//
//     c++ -std=c++17 -O2 -Iinclude examples/instrument.cpp -lsupple -o instrument
//     ./instrument [--mesh FILE] [--method exact|damped] [--frames N] [--out DIR] [--realtime] [--jitter N]
//
// Run from the repository it finds meshes/lobe.msh itself. --out leaves frames for ParaView, ten a second. --realtime
// waits for the clock between frames. --jitter N then times N single steps, and after each a fixed piece of work of the
// same length: what that varies by is the machine. A mesh of your own must be a Gmsh 2.2 file in text (gmsh.hpp).
#include <array>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <supple.hpp>

#include "gmsh.hpp"
#include "vtu.hpp"

namespace {

using clock_type = std::chrono::steady_clock;

constexpr int RATE = 60;                          // frames a second
constexpr float FRAME = 1.0f / RATE;              // s
constexpr float BUDGET = 1000.0f * FRAME;         // ms
constexpr supple::tissue LIVER = {{1500.0f, 8.023f, 40000.0f}, 1060.0f}; // a Pa, b, d Pa; density kg/m^3
constexpr float DAMPING = 20.0f;                  // 1/s
constexpr float BACK = 0.030f;                    // nodes behind this plane hang on the diaphragm, m
constexpr float RADIUS = 0.010f, FRICTION = 0.3f; // of the sphere, m
constexpr float ABOVE = 0.004f, DEPTH = 0.018f;   // how far above the dome it begins, and how far down it goes, m: the lobe sags by 10 mm
constexpr unsigned LARGE_STEPS = 4;               // a frame: each some 20 critical steps
// Of the critical step at rest. Tissue that is deformed is stiffer: on this path its limit falls to 0.53. To ask for it
// again would take as long as some six steps in each frame.
constexpr float EXACT_SHARE = 0.5f;
constexpr int FRAMES_A_PICTURE = 6;

struct options {
    std::string mesh = "meshes/lobe.msh", method = "damped", out;
    long frames = 240, jitter = 0;
    bool realtime = false;
};

options read_options(int count, char **words) {
    options chosen;
    for (int at = 1; at < count; at++) {
        const std::string word = words[at];
        if (word == "--realtime") {
            chosen.realtime = true;
            continue;
        }
        if (at + 1 == count) throw std::runtime_error(word + ": no such option, or without its value");
        const std::string value = words[++at];
        const auto number = [&](long least) {
            char *end = nullptr;
            const long whole = std::strtol(value.c_str(), &end, 10);
            if (*end != '\0' || whole < least)
                throw std::runtime_error(word + " " + value + ": not a number of at least " +
                                         std::to_string(least));
            return whole;
        };
        if (word == "--mesh") chosen.mesh = value;
        else if (word == "--method") chosen.method = value;
        else if (word == "--out") chosen.out = value;
        else if (word == "--frames") chosen.frames = number(1);
        else if (word == "--jitter") chosen.jitter = number(1000);
        else throw std::runtime_error(word + ": no such option");
    }
    if (chosen.method != "exact" && chosen.method != "damped")
        throw std::runtime_error("--method " + chosen.method + ": not exact or damped");
    return chosen;
}

// Memory for an object of the library, from the heap.
struct alignas(supple::align) line {
    unsigned char bytes[supple::align];
};
std::vector<line> room(std::size_t bytes) {
    return std::vector<line>((bytes + sizeof(line) - 1) / sizeof(line));
}

// What was made; the end of the program if it was not.
template <class T> T made(const char *what, const supple::result<T> &result) {
    char sentence[200];
    if (!result) throw std::runtime_error(std::string(what) + ": " + supple::describe(result.error, sentence));
    return result.value;
}

void done(const char *what, supple::status status) {
    if (!supple::is_done(status)) throw std::runtime_error(std::string(what) + ": " + supple::text(status));
}

// From 0 to 1 with neither a jump nor a kink.
double smooth(double share) { return 0.5 - 0.5 * std::cos(3.14159265358979 * std::clamp(share, 0.0, 1.0)); }

// How far the sphere has moved after so many seconds, m: down, sideways, up again, a rest.
std::array<float, 3> way(double seconds) {
    const double now = std::fmod(seconds, 2.0), out = smooth((now - 1.0) / 0.5);
    const double in = smooth(now / 0.5) - out, aside = smooth((now - 0.5) / 0.5) - out;
    return {float(0.004 * aside), 0.0f, float(-DEPTH * in)};
}

// The nodes of the boundary: those of triangles that belong to one tetrahedron only.
std::vector<std::uint32_t> boundary(const std::vector<std::uint32_t> &tetrahedra) {
    std::map<std::array<std::uint32_t, 3>, int> faces;
    for (std::size_t at = 0; at < tetrahedra.size(); at += 4)
        for (std::size_t left_out = 0; left_out < 4; left_out++) {
            std::array<std::uint32_t, 3> face = {};
            for (std::size_t corner = 0, n = 0; corner < 4; corner++)
                if (corner != left_out) face[n++] = tetrahedra[at + corner];
            std::sort(face.begin(), face.end());
            faces[face]++;
        }
    std::set<std::uint32_t> nodes;
    for (const auto &[face, count] : faces)
        if (count == 1) nodes.insert(face.begin(), face.end());
    return {nodes.begin(), nodes.end()};
}

double milliseconds(clock_type::duration time) {
    return std::chrono::duration<double, std::milli>(time).count();
}

// The body with all that moves it.
struct host {
    gmsh::mesh mesh;
    std::vector<line> scene_room, loads_room, state_room, contact_room, large_room;
    supple::scene scene;
    supple::loads loads;
    supple::state state;
    supple::contact contact;
    std::array<float, 3> start = {}; // of the sphere, m
    double now = 0.0;                // s
    supple::large large; // not used by the exact step
    bool exact;
    unsigned steps = LARGE_STEPS; // a frame

    explicit host(const options &chosen) : mesh(gmsh::read(chosen.mesh)), exact(chosen.method == "exact") {
        const std::vector<float> &points = mesh.points;
        const auto nodes = static_cast<std::uint32_t>(points.size() / 3);
        const auto at = [&](std::uint32_t node) { return &points[3 * node]; };
        std::uint32_t top = 0;
        for (std::uint32_t node = 1; node < nodes; node++) top = at(node)[2] > at(top)[2] ? node : top;
        std::vector<supple::support> supports;
        for (std::uint32_t node = 0; node < nodes; node++)
            if (at(node)[1] > BACK) supports.push_back({node, 7, 0});
        start = {at(top)[0], at(top)[1], at(top)[2] + RADIUS + ABOVE};

        const auto elements = static_cast<std::uint32_t>(mesh.tetrahedra.size() / 4);
        const std::vector<std::uint32_t> surface = boundary(mesh.tetrahedra);
        scene_room = room(supple::scene::size(nodes, elements));
        loads_room = room(supple::loads::size(0, 0));
        state_room = room(supple::state::size(nodes));
        contact_room = room(supple::contact::size(static_cast<std::uint32_t>(surface.size())));
        supple::body body;
        body.law = supple::law::exponential;
        body.points = points;
        body.tetrahedra = mesh.tetrahedra;
        body.supports = supports;
        body.tissues = {&LIVER, 1};
        scene = made("scene", supple::scene::make(scene_room, body));
        loads = made("loads", supple::loads::make(loads_room, scene, 0, 0));
        state = made("state", supple::state::make(state_room, scene));
        contact = made("contact", supple::contact::make(contact_room, scene, points, {surface}));
        const supple::instrument sphere[] = {supple::instrument::sphere(RADIUS, supple::pose_at(start), FRICTION)};
        done("sphere", contact.set(sphere));
        done("contact", loads.set_contact(contact));
        done("gravity", loads.set_gravity({0.0f, 0.0f, -9.81f}));
        if (exact) {
            const float longest = EXACT_SHARE * made("critical step", state.critical_step(scene)).seconds;
            steps = static_cast<unsigned>(std::ceil(FRAME / longest));
            done("step", state.set_step(scene, FRAME / float(steps), DAMPING));
            return;
        }
        supple::large_steps wanted;
        wanted.seconds = FRAME / LARGE_STEPS;
        wanted.damping = DAMPING;
        large_room = room(made("damped", supple::large::size(scene, points, wanted)));
        large = made("damped", supple::large::make(large_room, scene, state, points, wanted));
    }

    std::size_t bytes() const {
        return sizeof(line) * (scene_room.size() + loads_room.size() + state_room.size() + contact_room.size() +
                               large_room.size());
    }

    supple::status step(unsigned count, supple::report &report) {
        if (exact) return state.step(scene, loads, count, &report);
        return large.step(scene, loads, state, count, &report);
    }

    // One frame: the sphere goes evenly to where it is at the frame's end, the tissue follows.
    supple::status frame(double end, supple::report &report) {
        const auto moved = way(end);
        const auto pose = supple::pose_at({start[0] + moved[0], start[1] + moved[1], start[2] + moved[2]});
        done("sphere", contact.move(0, pose, now, end));
        const supple::status status = step(steps, report);
        now = report.time;
        return status;
    }

    // What the sphere feels, N.
    supple::touch touch() const {
        supple::touch felt{};
        done("touch", contact.read(0, felt));
        return felt;
    }
};

// Times single steps while the sphere stands still. The project's goal: 999 of 1000 within 1.5 times the median.
struct jitter {
    std::vector<double> times;

    double part(double share) const { return times[std::size_t(share * double(times.size() - 1))]; }

    void print(const char *what) {
        std::sort(times.begin(), times.end());
        std::printf("%s: median %.1f us, p99 %.1f us, p99.9 %.1f us, most %.1f us; p99.9 / median %.2f\n", what, part(0.5),
                    part(0.99), part(0.999), times.back(), part(0.999) / part(0.5));
    }
};

// Additions that wait for each other, and for nothing else: what the machine itself makes of a fixed piece of work.
double additions(long count) {
    double sum = 1.0;
    for (long at = 0; at < count; at++) sum = sum * 0.999 + 0.1;
    return sum;
}

// Single steps, each followed by as much fixed work.
void measure_jitter(host &host, long count) {
    const auto microseconds = [](clock_type::time_point since) { return 1000.0 * milliseconds(clock_type::now() - since); };
    jitter steps, work;
    steps.times.resize(std::size_t(count)), work.times.resize(std::size_t(count));
    supple::report report;
    auto start = clock_type::now();
    for (int warm = 0; warm < 1000; warm++) done("step", host.step(1, report));
    const double step = microseconds(start) / 1000.0;
    start = clock_type::now();
    volatile double sum = additions(1000000);
    const long as_long = long(1e6 * step / microseconds(start));
    for (std::size_t at = 0; at < steps.times.size(); at++) {
        start = clock_type::now();
        const supple::status status = host.step(1, report);
        steps.times[at] = microseconds(start);
        done("step", status);
        start = clock_type::now();
        sum = additions(as_long);
        work.times[at] = microseconds(start);
    }
    (void)sum;
    steps.print((std::to_string(count) + " single steps").c_str());
    work.print("as many times fixed work in between");
}

void run(const options &chosen) {
    if (!supple::is_of_this_abi()) throw std::runtime_error("supple.h and the library are of different versions");
    host host(chosen);
    std::printf("%zu nodes, %zu tetrahedra, %s steps, %zu bytes for the library\n", host.mesh.points.size() / 3,
                host.mesh.tetrahedra.size() / 4, chosen.method.c_str(), host.bytes());
    std::puts("second  mean ms  worst ms  steps  least volume  energy excess  most force on the sphere x, y, z N  nodes  status");

    const std::size_t floats = host.mesh.points.size();
    const long pictures = chosen.out.empty() ? 0 : chosen.frames / FRAMES_A_PICTURE;
    std::vector<float> kept(floats * static_cast<std::size_t>(pictures));
    double sum = 0.0, worst = 0.0, worst_of_all = 0.0;
    long late = 0, steps = 0;
    float volume = 1.0f, excess = 0.0f;
    supple::touch most{};
    supple::status remark = supple::status::ok;
    const auto start = clock_type::now();
    for (long frame = 1; frame <= chosen.frames; frame++) {
        const auto before = clock_type::now();
        supple::report report{};
        const supple::status status = host.frame(double(frame) / RATE, report);
        const double time = milliseconds(clock_type::now() - before);
        if (!supple::is_done(status)) {
            std::printf("frame %ld, %.4f s, node %lu: %s\n", frame, report.time, 0ul + report.node,
                        supple::text(status));
            throw std::runtime_error("the motion was stopped");
        }
        sum += time, worst = std::max(worst, time), late += time > BUDGET, steps += report.steps;
        volume = std::min(volume, report.least_volume_ratio), excess = std::max(excess, report.energy_excess);
        remark = status == supple::status::ok ? remark : status;
        const supple::touch felt = host.touch();
        const auto size = [](const supple::touch &of) { return std::hypot(of.mean_force[0], of.mean_force[1], of.mean_force[2]); };
        most = size(felt) > size(most) ? felt : most;
        if (frame % FRAMES_A_PICTURE == 0 && pictures > 0) {
            float *to = &kept[floats * std::size_t(frame / FRAMES_A_PICTURE - 1)];
            done("displacements", host.state.copy_displacements({to, floats}));
        }
        if (frame % RATE == 0 || frame == chosen.frames) {
            const long frames = frame % RATE == 0 ? RATE : frame % RATE;
            std::printf("%6.2f  %7.2f  %8.2f  %5ld  %12.3f  %13.3g  %17.3f %8.3f %8.3f  %5lu  %s\n",
                        double(frame) / RATE, sum / double(frames), worst, steps, double(volume), double(excess),
                        double(most.mean_force[0]), double(most.mean_force[1]), double(most.mean_force[2]),
                        0ul + most.contacts, supple::text(remark));
            most = {};
            worst_of_all = std::max(worst_of_all, worst);
            sum = worst = 0.0, steps = 0, volume = 1.0f, excess = 0.0f, remark = supple::status::ok;
        }
        if (chosen.realtime)
            std::this_thread::sleep_until(start + frame * std::chrono::nanoseconds(1000000000 / RATE));
    }
    std::printf("worst frame %.2f ms of %.1f ms; %ld of %ld frames too late\n", worst_of_all, double(BUDGET), late,
                chosen.frames);

    if (pictures > 0) {
        std::filesystem::create_directories(chosen.out);
        std::vector<vtu::frame> list;
        for (long picture = 0; picture < pictures; picture++) {
            const double seconds = double((picture + 1) * FRAMES_A_PICTURE) / RATE;
            list.push_back({seconds, "frame" + std::to_string(picture) + ".vtu"});
            vtu::write(chosen.out + "/" + list.back().file, host.mesh.points,
                       &kept[floats * std::size_t(picture)], host.mesh.tetrahedra);
        }
        vtu::write_list(chosen.out + "/frames.pvd", list);
        std::printf("%ld frames in %s/frames.pvd\n", pictures, chosen.out.c_str());
    }
    if (chosen.jitter > 0) measure_jitter(host, chosen.jitter);
}

} // namespace

int main(int count, char **words) {
    try {
        run(read_options(count, words));
    } catch (const std::exception &problem) {
        std::fprintf(stderr, "instrument: %s\n", problem.what());
        return 1;
    }
    return 0;
}
