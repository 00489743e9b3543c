// A host for tracked instruments (OpenIGTLink 2, http://openigtlink.org): a client, such as 3D Slicer, a tracker's server or a script,
// sends TRANSFORM messages "Instrument", the pose of a ball of 10 mm radius; a liver lobe gives way. Each frame, 60 a second, it gets
//
//     POLYDATA "Tissue"    the surface of the lobe as it is now: points and triangles
//     STRING   "Reaction"  force of the tissue on the ball (N, x y z), how many nodes it pushes, the status of the frame in words
//
// Lengths are mm in messages, as OpenIGTLink has them, in the axes of the mesh; m in the library. A pose from which the library cannot
// step (too fast, or inside the body) is refused: ball and tissue stay as they were before the frame, and "Reaction" says why.
//
//     apt-get install libopenigtlink-dev
//     c++ -std=c++17 -O2 -Iinclude -isystem /usr/include/openigtlink examples/openigtlink.cpp -lsupple -lOpenIGTLink -lpthread -o openigtlink
//     ./openigtlink [--port 18944] [--mesh meshes/lobe.msh]
#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <igtlMessageHeader.h>
#include <igtlPolyDataMessage.h>
#include <igtlServerSocket.h>
#include <igtlStringMessage.h>
#include <igtlTransformMessage.h>

#include <supple.hpp>

#include "gmsh.hpp"

namespace {

constexpr float RADIUS = 0.010f, FRICTION = 0.3f, DAMPING = 20.0f, MILLI = 0.001f; // m, 1/s
constexpr double FRAME = 1.0 / 60.0; // s

void done(supple::status status) {
    if (!supple::is_done(status)) throw std::runtime_error(supple::text(status));
}
template <class T> T made(const supple::result<T> &result) {
    char why[200];
    if (!result) throw std::runtime_error(supple::describe(result.error, why));
    return result.value;
}

// The lobe, the ball, and the memory of both.
class tissue {
public:
    explicit tissue(const std::string &path)
        : mesh_(gmsh::read(path)), triangles_(gmsh::boundary(mesh_.tetrahedra)), surface_(gmsh::nodes_of(triangles_)),
          moved_(mesh_.points.size()) {
        const std::size_t nodes = mesh_.points.size() / 3;
        std::vector<supple::support> supports; // the back hangs on the diaphragm
        for (std::size_t node = 0; node < nodes; node++)
            if (mesh_.points[3 * node + 1] > 0.030f) supports.push_back({std::uint32_t(node), 7, 0});
        const supple::tissue liver = {{1500.0f, 8.023f, 40000.0f}, 1060.0f}; // a Pa, b, d Pa; kg/m^3
        supple::body body;
        body.law = supple::law::exponential, body.points = mesh_.points, body.tetrahedra = mesh_.tetrahedra;
        body.supports = supports, body.tissues = {&liver, 1};
        auto how = supple::settings(supple::steps::exact, DAMPING).touchable(nodes, {surface_});
        memory_.resize(supple::lines(made(supple::simulation::size(body, how))));
        lobe_ = made(supple::simulation::make(memory_, body, how));
        // Steps of one length, which leaves room for tissue that stiffens: those that are chosen become ever shorter where a pose jumps
        // into the body, and crush what is in its way; these are refused at once.
        how.seconds = 0.5f * made(lobe_.state().critical_step(lobe_.scene())).seconds;
        done(lobe_.set(how));
    }

    // One frame towards a pose; without one the ball is not there yet. What the ball feels, in words.
    std::string frame(const std::optional<supple::pose> &to) {
        kept_.assign(memory_.begin(), memory_.begin() + std::ptrdiff_t(supple::lines(lobe_.bytes())));
        if (to && is_there_) done(lobe_.contact().move(0, *to, now_, now_ + FRAME));
        else if (to) put(*to);
        supple::sim_report report{};
        const supple::status status = lobe_.advance(FRAME, &report);
        if (!supple::is_done(status)) {
            // Steps of the frame may have been taken before one was refused.
            std::copy(kept_.begin(), kept_.end(), memory_.begin());
            return std::string("0 0 0 N, 0 nodes, ") + supple::text(status);
        }
        now_ = report.call.time;
        is_there_ |= to.has_value();
        supple::touch felt{};
        if (is_there_) done(lobe_.contact().read(0, felt));
        char words[200];
        std::snprintf(words, sizeof words, "%.6f %.6f %.6f N, %u nodes, %s", double(felt.mean_force[0]), double(felt.mean_force[1]),
                      double(felt.mean_force[2]), felt.contacts, supple::text(status));
        return words;
    }

    // The surface as it is, mm.
    igtl::PolyDataMessage::Pointer surface() {
        done(lobe_.state().copy_positions(mesh_.points, moved_));
        auto points = igtl::PolyDataPointArray::New();
        for (const std::uint32_t node : surface_) {
            const float *at = &moved_[3 * node];
            points->AddPoint(at[0] / MILLI, at[1] / MILLI, at[2] / MILLI);
        }
        auto polygons = igtl::PolyDataCellArray::New();
        for (const gmsh::triangle &triangle : triangles_) {
            igtlUint32 corners[3];
            for (std::size_t corner = 0; corner < 3; corner++)
                corners[corner] = igtlUint32(std::lower_bound(surface_.begin(), surface_.end(), triangle[corner]) - surface_.begin());
            polygons->AddCell(3, corners);
        }
        auto message = igtl::PolyDataMessage::New();
        message->SetDeviceName("Tissue");
        message->SetPoints(points);
        message->SetPolygons(polygons);
        return message;
    }

private:
    void put(const supple::pose &at) {
        const supple::instrument ball[] = {supple::instrument::sphere(RADIUS, at, FRICTION)};
        done(lobe_.contact().set(ball));
    }

    gmsh::mesh mesh_;
    std::vector<gmsh::triangle> triangles_;
    std::vector<std::uint32_t> surface_;
    std::vector<float> moved_; // positions of all nodes, m
    std::vector<supple::line> memory_, kept_; // of the simulation; what of it was in use before the frame
    supple::simulation lobe_;
    bool is_there_ = false; // the ball
    double now_ = 0.0; // s
};

// The latest pose that a client has sent; read by another thread than that of the steps.
class receiver {
public:
    explicit receiver(igtl::Socket::Pointer socket) : socket_(socket), thread_([this] { receive(); }) {}
    ~receiver() {
        socket_->CloseSocket();
        thread_.join();
    }

    std::optional<supple::pose> latest() {
        const std::lock_guard<std::mutex> guard(mutex_);
        return pose_;
    }

    bool is_connected() {
        const std::lock_guard<std::mutex> guard(mutex_);
        return is_connected_;
    }

private:
    void receive() {
        auto header = igtl::MessageHeader::New();
        for (;;) {
            header->InitPack();
            if (socket_->Receive(header->GetPackPointer(), header->GetPackSize()) != header->GetPackSize()) break;
            header->Unpack();
            if (std::string(header->GetDeviceType()) != "TRANSFORM" || std::string(header->GetDeviceName()) != "Instrument") {
                socket_->Skip(int(header->GetBodySizeToRead()), 0);
                continue;
            }
            auto transform = igtl::TransformMessage::New();
            transform->SetMessageHeader(header);
            transform->AllocatePack();
            const int size = transform->GetPackBodySize();
            if (socket_->Receive(transform->GetPackBodyPointer(), size) != size) break;
            if ((transform->Unpack(1) & igtl::MessageHeader::UNPACK_BODY) == 0) continue; // a wrong checksum
            igtl::Matrix4x4 matrix;
            transform->GetMatrix(matrix);
            supple::pose pose = supple::pose_at({matrix[0][3] * MILLI, matrix[1][3] * MILLI, matrix[2][3] * MILLI});
            igtl::MatrixToQuaternion(matrix, pose.rotation);
            if (!std::isfinite(pose.position[0] + pose.position[1] + pose.position[2])) continue;
            const std::lock_guard<std::mutex> guard(mutex_);
            pose_ = pose;
        }
        const std::lock_guard<std::mutex> guard(mutex_);
        is_connected_ = false;
    }

    igtl::Socket::Pointer socket_;
    std::mutex mutex_;
    std::optional<supple::pose> pose_;
    bool is_connected_ = true;
    std::thread thread_; // last: it uses the others
};

bool send(igtl::Socket::Pointer socket, igtl::MessageBase::Pointer message) {
    message->Pack();
    return socket->Send(message->GetPackPointer(), message->GetPackSize()) == 1;
}

// Serves one client until it leaves.
void serve(igtl::Socket::Pointer socket, const std::string &mesh) {
    using clock_type = std::chrono::steady_clock;
    tissue lobe(mesh);
    receiver poses(socket);
    double worst = 0.0; // ms
    long frames = 0, late = 0;
    for (auto next = clock_type::now(); poses.is_connected(); frames++) {
        const auto start = clock_type::now();
        auto reaction = igtl::StringMessage::New();
        reaction->SetDeviceName("Reaction");
        reaction->SetString(lobe.frame(poses.latest()).c_str());
        const double spent = std::chrono::duration<double, std::milli>(clock_type::now() - start).count();
        worst = std::max(worst, spent), late += spent > 1000.0 * FRAME;
        if (!send(socket, lobe.surface().GetPointer()) || !send(socket, reaction.GetPointer())) break;
        next += std::chrono::microseconds(std::lround(1e6 * FRAME));
        std::this_thread::sleep_until(next);
    }
    std::printf("%ld frames, the worst of %.1f ms, %ld too late\n", frames, worst, late);
    std::fflush(stdout);
}

} // namespace

int main(int count, char **words) {
    std::string mesh = "meshes/lobe.msh";
    int port = 18944;
    for (int at = 1; at + 1 < count; at += 2) {
        const std::string word = words[at];
        if (word == "--port") port = std::atoi(words[at + 1]);
        else if (word == "--mesh") mesh = words[at + 1];
        else return std::fprintf(stderr, "%s: no such option\n", word.c_str()), 2;
    }
    std::signal(SIGPIPE, SIG_IGN); // a client that leaves
    auto server = igtl::ServerSocket::New();
    if (server->CreateServer(port) < 0) return std::fprintf(stderr, "port %d: cannot be opened\n", port), 1;
    std::printf("waits for a client at port %d\n", server->GetServerPort());
    std::fflush(stdout);
    try {
        for (;;)
            if (auto socket = server->WaitForConnection(1000); socket.IsNotNull())
                serve(socket.GetPointer(), mesh);
    } catch (const std::exception &problem) {
        return std::fprintf(stderr, "error: %s\n", problem.what()), 1;
    }
}
