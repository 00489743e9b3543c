// A host in C++ that shows tissue 60 times a second: a liver lobe hangs from its back; a sphere comes from above, presses
// its dome, slides 4 mm sideways with friction and leaves, over and over. Each frame moves on by 1/60 s; the host reads the
// status, with what a guard says of long steps, and the force on the sphere. All memory is there before the first frame.
//
//     c++ -std=c++17 -O2 -Iinclude examples/instrument.cpp -lsupple -o instrument
//     ./instrument [--mesh FILE] [--method exact|long] [--frames N] [--out DIR] [--realtime] [--jitter N]
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
constexpr int FRAMES_A_PICTURE = 6;
const std::map<std::string, supple::steps> STEPS = {{"exact", supple::steps::exact}, {"long", supple::steps::long_steps}};

struct options {
    std::string mesh = "meshes/lobe.msh", method = "long", out;
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
    if (STEPS.count(chosen.method) == 0)
        throw std::runtime_error("--method " + chosen.method + ": not exact or long");
    return chosen;
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

double milliseconds(clock_type::duration time) {
    return std::chrono::duration<double, std::milli>(time).count();
}

// The body with all that moves it.
struct host {
    gmsh::mesh mesh;
    std::vector<supple::line> memory; // of the simulation
    supple::settings settings;
    supple::simulation lobe;
    std::array<float, 3> start = {}; // of the sphere, m

    explicit host(const options &chosen) : mesh(gmsh::read(chosen.mesh)), settings(STEPS.at(chosen.method), DAMPING) {
        const std::size_t nodes = mesh.points.size() / 3;
        const auto at = [&](std::size_t node) { return &mesh.points[3 * node]; };
        std::size_t top = 0;
        std::vector<supple::support> supports;
        for (std::size_t node = 0; node < nodes; node++) {
            top = at(node)[2] > at(top)[2] ? node : top;
            if (at(node)[1] > BACK) supports.push_back({std::uint32_t(node), 7, 0});
        }
        start = {at(top)[0], at(top)[1], at(top)[2] + RADIUS + ABOVE};

        const std::vector<std::uint32_t> surface = gmsh::nodes_of(gmsh::boundary(mesh.tetrahedra));
        settings.touchable(nodes, {surface});
        if (chosen.method == "long") settings.seconds = FRAME / LARGE_STEPS;
        supple::body body;
        body.law = supple::law::exponential, body.points = mesh.points, body.tetrahedra = mesh.tetrahedra;
        body.supports = supports, body.tissues = {&LIVER, 1};
        memory.resize(supple::lines(made("size", supple::simulation::size(body, settings))));
        lobe = made("lobe", supple::simulation::make(memory, body, settings));
        const supple::instrument sphere[] = {supple::instrument::sphere(RADIUS, supple::pose_at(start), FRICTION)};
        done("sphere", lobe.contact().set(sphere));
        done("gravity", lobe.loads().set_gravity({0.0f, 0.0f, -9.81f}));
    }

    // One frame: the sphere goes evenly to where it is at the frame's end, the tissue follows.
    supple::status frame(long number, supple::sim_report &report) {
        const double begin = double(number - 1) / RATE, end = double(number) / RATE;
        const auto moved = way(end);
        const auto pose = supple::pose_at({start[0] + moved[0], start[1] + moved[1], start[2] + moved[2]});
        done("sphere", lobe.contact().move(0, pose, begin, end));
        return lobe.advance(1.0 / RATE, &report);
    }

    // What the sphere feels, N.
    supple::touch touch() const {
        supple::touch felt{};
        done("touch", lobe.contact().read(0, felt));
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

// Single steps of the kind that the frames had, each followed by as much fixed work.
void measure_jitter(host &host, const supple::sim_report &frames, long count) {
    // Without a guard, and of one length without looks at the critical step: half of it, as tissue may stiffen meanwhile.
    supple::settings settings = host.settings;
    settings.guard = 0;
    settings.seconds = frames.exact > 0 ? 0.5f * frames.shortest : frames.shortest;
    done("steps", host.lobe.set(settings));
    const auto step = [&] { done("step", host.lobe.advance(double(settings.seconds))); };
    const auto microseconds = [](clock_type::time_point since) { return 1000.0 * milliseconds(clock_type::now() - since); };
    jitter steps, work;
    steps.times.resize(std::size_t(count)), work.times.resize(std::size_t(count));
    auto start = clock_type::now();
    for (int warm = 0; warm < 1000; warm++) step();
    const double of_step = microseconds(start) / 1000.0;
    start = clock_type::now();
    volatile double sum = additions(1000000);
    const long as_long = long(1e6 * of_step / microseconds(start));
    for (std::size_t at = 0; at < steps.times.size(); at++) {
        start = clock_type::now();
        step();
        steps.times[at] = microseconds(start);
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
                host.mesh.tetrahedra.size() / 4, chosen.method.c_str(), host.lobe.bytes());
    std::puts("second  mean ms  worst ms  steps  least volume  energy excess  most force on the sphere x, y, z N  nodes  status");

    const std::size_t floats = host.mesh.points.size();
    const long pictures = chosen.out.empty() ? 0 : chosen.frames / FRAMES_A_PICTURE;
    std::vector<float> kept(floats * static_cast<std::size_t>(pictures));
    double sum = 0.0, worst = 0.0, worst_of_all = 0.0;
    long late = 0, steps = 0;
    float volume = 1.0f, excess = 0.0f;
    supple::touch most{};
    supple::status remark = supple::status::ok;
    supple::sim_report report{};
    const auto start = clock_type::now();
    for (long frame = 1; frame <= chosen.frames; frame++) {
        const auto before = clock_type::now();
        const supple::status status = host.frame(frame, report);
        const double time = milliseconds(clock_type::now() - before);
        if (!supple::is_done(status)) {
            char why[200];
            std::printf("frame %ld, %.4f s: %s\n", frame, report.call.time, supple::describe(report.call.error, why));
            throw std::runtime_error("the motion was stopped");
        }
        sum += time, worst = std::max(worst, time), late += time > BUDGET, steps += report.call.steps;
        volume = std::min(volume, report.call.least_volume_ratio), excess = std::max(excess, report.call.energy_excess);
        remark = status == supple::status::ok ? remark : status;
        const supple::touch felt = host.touch();
        const auto size = [](const supple::touch &of) { return std::hypot(of.mean_force[0], of.mean_force[1], of.mean_force[2]); };
        most = size(felt) > size(most) ? felt : most;
        if (frame % FRAMES_A_PICTURE == 0 && pictures > 0) {
            float *to = &kept[floats * std::size_t(frame / FRAMES_A_PICTURE - 1)];
            done("displacements", host.lobe.state().copy_displacements({to, floats}));
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
    if (chosen.jitter > 0) measure_jitter(host, report, chosen.jitter);
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
