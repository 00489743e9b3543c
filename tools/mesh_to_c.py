#!/usr/bin/env python3
"""Turns a mesh, or any file, into a C11 header for programs whose memory is all static.

    tools/mesh_to_c.py meshes/lobe.msh lobe_mesh.h
        LOBE_NODES, LOBE_TETRAHEDRA, lobe_points[][3] (as in the file), lobe_tetrahedra[][4] (from zero)
    tools/mesh_to_c.py --bytes weights/compact-10.weights compact compact.h
        compact[], at a multiple of 64 bytes, its size is sizeof compact

Meshes are Gmsh 2.2 ASCII with nodes numbered from 1 in order; of elements only tetrahedra (type 4) are kept.
"""
import sys
from pathlib import Path


def entries(path, lines, section):
    """Line number and words of each entry of a section."""
    try:
        start = lines.index(section)
        count = int(lines[start + 1])
        return [(at + 1, lines[at].split()) for at in range(start + 2, start + 2 + count)]
    except (ValueError, IndexError):
        sys.exit(f"{path}: no complete section {section}")


def read_msh(path):
    lines = path.read_text().splitlines()
    if "$MeshFormat" not in lines or not lines[lines.index("$MeshFormat") + 1].startswith("2.2 0"):
        sys.exit(f"{path}: not Gmsh 2.2 ASCII")
    points, tetrahedra = [], []
    for line, words in entries(path, lines, "$Nodes"):
        if len(words) != 4 or int(words[0]) != len(points) + 1:
            sys.exit(f"{path}, line {line}: not node {len(points) + 1} with three coordinates")
        points.append([float(word) for word in words[1:]])
    for line, words in entries(path, lines, "$Elements"):
        if words[1] == "4":
            nodes = [int(word) - 1 for word in words[-4:]]
            if not all(0 <= node < len(points) for node in nodes):
                sys.exit(f"{path}, line {line}: a node that is not there, of {len(points)}")
            tetrahedra.append(nodes)
    return points, tetrahedra


def rows(values):
    return "".join("    {" + ", ".join(row) + "},\n" for row in values)


def mesh_header(path):
    name = path.stem.lower().replace("-", "_")
    points, tetrahedra = read_msh(path)
    return (
        f"enum {{ {name.upper()}_NODES = {len(points)}, {name.upper()}_TETRAHEDRA = {len(tetrahedra)} }};\n\n"
        f"static const float {name}_points[{name.upper()}_NODES][3] = {{\n"
        + rows([f"{number!r}f" for number in point] for point in points)
        + f"}};\n\nstatic const uint32_t {name}_tetrahedra[{name.upper()}_TETRAHEDRA][4] = {{\n"
        + rows([str(node) for node in nodes] for nodes in tetrahedra)
        + "};\n"
    )


def bytes_header(path, name):
    data = path.read_bytes()
    lines = (", ".join(map(str, data[at : at + 24])) for at in range(0, len(data), 24))
    body = "".join(f"    {line},\n" for line in lines)
    return f"static const _Alignas(64) unsigned char {name}[{len(data)}] = {{\n{body}}};\n"


def main(words):
    if len(words) == 4 and words[0] == "--bytes":
        source, target = Path(words[1]), Path(words[3])
        text = bytes_header(source, words[2])
    elif len(words) == 2:
        source, target = Path(words[0]), Path(words[1])
        text = mesh_header(source)
    else:
        sys.exit(__doc__)
    target.write_text(f"/* Made by tools/mesh_to_c.py from {source.name}: do not change it here. */\n"
                      f"#include <stdint.h>\n\n{text}")


if __name__ == "__main__":
    main(sys.argv[1:])
