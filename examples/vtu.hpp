// Writes frames that ParaView opens: one .vtu (ASCII) for each, with points at rest and displacements, and a
// .pvd that lists them with their times.
#pragma once

#include <cstdint>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace vtu {

// Three floats of each node, in lines.
inline void vectors(std::ofstream &out, const float *first, std::size_t nodes) {
    for (std::size_t node = 0; node < nodes; node++, first += 3)
        out << first[0] << ' ' << first[1] << ' ' << first[2] << '\n';
}

// Both in metres, three floats a node.
inline void write(const std::string &path, const std::vector<float> &points, const float *displacement,
                  const std::vector<std::uint32_t> &tetrahedra) {
    const std::size_t nodes = points.size() / 3, elements = tetrahedra.size() / 4;
    std::ofstream out(path);
    out << "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\">\n<UnstructuredGrid>\n"
        << "<Piece NumberOfPoints=\"" << nodes << "\" NumberOfCells=\"" << elements << "\">\n"
        << "<PointData Vectors=\"displacement\">\n"
        << "<DataArray type=\"Float32\" Name=\"displacement\" NumberOfComponents=\"3\" format=\"ascii\">\n";
    vectors(out, displacement, nodes);
    out << "</DataArray>\n</PointData>\n<Points>\n"
        << "<DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">\n";
    vectors(out, points.data(), nodes);
    out << "</DataArray>\n</Points>\n<Cells>\n<DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">\n";
    for (std::size_t at = 0; at < tetrahedra.size(); at++) out << tetrahedra[at] << (at % 4 == 3 ? '\n' : ' ');
    out << "</DataArray>\n<DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">\n";
    for (std::size_t element = 1; element <= elements; element++) out << 4 * element << '\n';
    out << "</DataArray>\n<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">\n";
    for (std::size_t element = 0; element < elements; element++) out << "10\n";
    out << "</DataArray>\n</Cells>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n";
    if (!out.flush()) throw std::runtime_error(path + ": cannot be written");
}

struct frame {
    double seconds;
    std::string file; // in the folder of the list
};

inline void write_list(const std::string &path, const std::vector<frame> &frames) {
    std::ofstream out(path);
    out << "<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n";
    for (const frame &one : frames)
        out << "<DataSet timestep=\"" << one.seconds << "\" file=\"" << one.file << "\"/>\n";
    out << "</Collection>\n</VTKFile>\n";
    if (!out.flush()) throw std::runtime_error(path + ": cannot be written");
}

} // namespace vtu
