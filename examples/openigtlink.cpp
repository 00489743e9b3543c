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
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <map>
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

constexpr float RADIUS = 0.010f, FRICTION = 0.3f, DAMPING = 20.0f, FRAME = 1.0f / 60.0f; // m, 1/s, s
constexpr float MILLI = 0.001f;

struct alignas(supple::align) line {
    unsigned char bytes[supple::align];
};
std::vector<line> room(std::size_t bytes) { return std::vector<line>(bytes / supple::align + 1); }

void done(supple::status status) {
    if (!supple::is_done(status)) throw std::runtime_error(supple::text(status));
}
template <class T> T made(const supple::result<T> &result) {
    char why[200];
    if (!result) throw std::runtime_error(supple::describe(result.error, why));
    return result.value;
}

// The triangles that belong to one tetrahedron only, with their outsides outside.
std::vector<std::array<std::uint32_t, 3>> boundary(const std::vector<std::uint32_t> &tetrahedra) {
    static constexpr int faces[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
    std::map<std::array<std::uint32_t, 3>, std::optional<std::array<std::uint32_t, 3>>> found;
    for (std::size_t at = 0; at < tetrahedra.size(); at += 4)
        for (const auto &face : faces) {
            const std::array<std::uint32_t, 3> corners = {tetrahedra[at + face[0]], tetrahedra[at + face[1]], tetrahedra[at + face[2]]};
            auto sorted = corners;
            std::sort(sorted.begin(), sorted.end());
            const auto [entry, is_new] = found.emplace(sorted, corners);
            if (!is_new) entry->second.reset();
        }
    std::vector<std::array<std::uint32_t, 3>> outer;
    for (const auto &[sorted, corners] : found)
        if (corners) outer.push_back(*corners);
    return outer;
}

// The lobe, the ball, and the memory of both.
class tissue {
public:
    explicit tissue(const std::string &path) : mesh_(gmsh::read(path)), triangles_(boundary(mesh_.tetrahedra)) {
        const auto nodes = std::uint32_t(mesh_.points.size() / 3), elements = std::uint32_t(mesh_.tetrahedra.size() / 4);
        std::vector<supple::support> supports; // the back hangs on the diaphragm
        for (std::uint32_t node = 0; node < nodes; node++)
            if (mesh_.points[3 * node + 1] > 0.030f) supports.push_back({node, 7, 0});
        const supple::tissue liver = {{1500.0f, 8.023f, 40000.0f}, 1060.0f}; // a Pa, b, d Pa; kg/m^3
        supple::body body;
        body.law = supple::law::exponential, body.points = mesh_.points, body.tetrahedra = mesh_.tetrahedra;
        body.supports = supports, body.tissues = {&liver, 1};
        for (const auto &triangle : triangles_)
            for (const std::uint32_t node : triangle) place_.emplace(node, 0);
        for (auto &[node, place] : place_) place = std::uint32_t(surface_.size()), surface_.push_back(node);

        memory_ = {room(supple::scene::size(nodes, elements)), room(supple::state::size(nodes)), room(supple::loads::size(0, 0)),
                   room(supple::contact::size(std::uint32_t(surface_.size())))};
        scene_ = made(supple::scene::make(memory_[SCENE], body));
        state_ = made(supple::state::make(memory_[STATE], scene_));
        loads_ = made(supple::loads::make(memory_[LOADS], scene_, 0, 0));
        contact_ = made(supple::contact::make(memory_[CONTACT], scene_, mesh_.points, {surface_}));
        done(loads_.set_contact(contact_));
        steps_ = unsigned(2.0f * FRAME / made(state_.critical_step(scene_)).seconds) + 1;
        done(state_.set_step(scene_, FRAME / float(steps_), DAMPING));
        moved_.resize(mesh_.points.size());
        kept_ = {memory_[STATE], memory_[CONTACT]};
    }

    // One frame towards a pose; without one the ball is not there yet. What the ball feels, in words.
    std::string frame(const std::optional<supple::pose> &to) {
        std::copy(memory_[STATE].begin(), memory_[STATE].end(), kept_[0].begin());
        std::copy(memory_[CONTACT].begin(), memory_[CONTACT].end(), kept_[1].begin());
        if (to && is_there_) done(contact_.move(0, *to, now_, now_ + double(FRAME)));
        else if (to) put(*to);
        supple::report report{};
        const supple::status status = state_.step(scene_, loads_, steps_, &report);
        if (!supple::is_done(status)) {
            // Steps of the frame may have been taken before one was refused.
            std::copy(kept_[0].begin(), kept_[0].end(), memory_[STATE].begin());
            std::copy(kept_[1].begin(), kept_[1].end(), memory_[CONTACT].begin());
            return std::string("0 0 0 N, 0 nodes, ") + supple::text(status);
        }
        now_ = report.time;
        is_there_ |= to.has_value();
        supple::touch felt{};
        if (is_there_) done(contact_.read(0, felt));
        char words[200];
        std::snprintf(words, sizeof words, "%.6f %.6f %.6f N, %u nodes, %s", double(felt.mean_force[0]), double(felt.mean_force[1]),
                      double(felt.mean_force[2]), felt.contacts, supple::text(status));
        return words;
    }

    // The surface as it is, mm.
    igtl::PolyDataMessage::Pointer surface() {
        done(state_.copy_displacements(moved_));
        auto points = igtl::PolyDataPointArray::New();
        for (const std::uint32_t node : surface_) {
            const float *rest = &mesh_.points[3 * node], *way = &moved_[3 * node];
            points->AddPoint((rest[0] + way[0]) / MILLI, (rest[1] + way[1]) / MILLI, (rest[2] + way[2]) / MILLI);
        }
        auto polygons = igtl::PolyDataCellArray::New();
        for (const auto &triangle : triangles_) {
            igtlUint32 corners[3];
            for (int corner = 0; corner < 3; corner++) corners[corner] = place_.at(triangle[std::size_t(corner)]);
            polygons->AddCell(3, corners);
        }
        auto message = igtl::PolyDataMessage::New();
        message->SetDeviceName("Tissue");
        message->SetPoints(points);
        message->SetPolygons(polygons);
        return message;
    }

private:
    enum { SCENE, STATE, LOADS, CONTACT };

    void put(const supple::pose &at) {
        const supple::instrument ball[] = {supple::instrument::sphere(RADIUS, at, FRICTION)};
        done(contact_.set(ball));
    }

    gmsh::mesh mesh_;
    std::vector<std::array<std::uint32_t, 3>> triangles_;
    std::map<std::uint32_t, std::uint32_t> place_; // of a node in the surface
    std::vector<std::uint32_t> surface_;
    std::array<std::vector<line>, 4> memory_;
    std::array<std::vector<line>, 2> kept_; // state and contact before the frame: they hold no pointers into themselves
    std::vector<float> moved_;
    supple::scene scene_;
    supple::state state_;
    supple::loads loads_;
    supple::contact contact_;
    bool is_there_ = false; // the ball
    unsigned steps_ = 0;
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
        worst = std::max(worst, spent), late += spent > 1000.0 * double(FRAME);
        if (!send(socket, lobe.surface().GetPointer()) || !send(socket, reaction.GetPointer())) break;
        next += std::chrono::microseconds(std::lround(1e6 * double(FRAME)));
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
