// Reads what the examples need of a Gmsh mesh, in version 2.2 as text: nodes, and tetrahedra (elements of type 4); others
// are left out. Finds the boundary of these. Nodes must have the numbers 1, 2, 3 and so on. Not read: versions 1 and 4.1 and
// anything binary, which the command supple reads; Gmsh turns them into this one with
// `gmsh IN.msh -save -format msh22 -o OUT.msh`.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace gmsh {

struct mesh {
    std::vector<float> points;             // three coordinates of each node, in the file's unit
    std::vector<std::uint32_t> tetrahedra; // four nodes of each element, from zero
};

// Throws std::runtime_error with file, line and what is wrong there.
inline mesh read(const std::string &path) {
    std::ifstream file(path);
    if (!file) throw std::runtime_error(path + ": cannot be opened");
    std::string text, section;
    std::size_t line = 0;
    const auto problem = [&](const std::string &what) {
        return std::runtime_error(path + ", line " + std::to_string(line) + ": " + what);
    };
    const auto next = [&] { return line++, static_cast<bool>(std::getline(file, text)); };
    mesh read;
    if (!next() || text.rfind("$MeshFormat", 0) != 0 || !next() || text.rfind("2.2 0", 0) != 0)
        throw problem("not a Gmsh 2.2 file in text; versions 1 and 4.1 and binary files are not read here: "
                      "turn them into it with `gmsh IN.msh -save -format msh22 -o OUT.msh`");
    while (next()) {
        const bool nodes = text.rfind("$Nodes", 0) == 0, elements = text.rfind("$Elements", 0) == 0;
        if (!nodes && !elements) continue;
        next();
        const unsigned long count = std::strtoul(text.c_str(), nullptr, 10);
        for (unsigned long entry = 0; entry < count; entry++) {
            if (!next()) throw problem("the file ends before entry " + std::to_string(entry + 1));
            std::istringstream words(text);
            unsigned long number = 0, type = 0, tags = 0, skipped = 0, node = 0;
            words >> number;
            if (nodes) {
                float x = 0, y = 0, z = 0;
                if (!(words >> x >> y >> z) || number != entry + 1)
                    throw problem("not node " + std::to_string(entry + 1) + " with three coordinates");
                read.points.insert(read.points.end(), {x, y, z});
                continue;
            }
            words >> type >> tags;
            if (type != 4) continue;
            while (tags-- > 0) words >> skipped;
            for (int corner = 0; corner < 4; corner++) {
                if (!(words >> node) || node < 1) throw problem("not an element with four nodes");
                read.tetrahedra.push_back(static_cast<std::uint32_t>(node - 1));
            }
        }
    }
    if (read.points.empty() || read.tetrahedra.empty()) throw problem("no nodes or no tetrahedra up to here");
    return read;
}

using triangle = std::array<std::uint32_t, 3>;

// The triangles of the boundary, which belong to one tetrahedron only, with their outsides outside.
inline std::vector<triangle> boundary(const std::vector<std::uint32_t> &tetrahedra) {
    static constexpr std::size_t faces[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};
    std::map<triangle, std::vector<triangle>> found; // by their nodes in order
    for (std::size_t at = 0; at < tetrahedra.size(); at += 4)
        for (const auto &face : faces) {
            const triangle corners = {tetrahedra[at + face[0]], tetrahedra[at + face[1]], tetrahedra[at + face[2]]};
            triangle sorted = corners;
            std::sort(sorted.begin(), sorted.end());
            found[sorted].push_back(corners);
        }
    std::vector<triangle> outer;
    for (const auto &[sorted, same] : found)
        if (same.size() == 1) outer.push_back(same[0]);
    return outer;
}

// The nodes of triangles, in order.
inline std::vector<std::uint32_t> nodes_of(const std::vector<triangle> &triangles) {
    std::set<std::uint32_t> nodes;
    for (const triangle &corners : triangles) nodes.insert(corners.begin(), corners.end());
    return {nodes.begin(), nodes.end()};
}

} // namespace gmsh
