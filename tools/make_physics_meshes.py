#!/usr/bin/env python3
"""Makes meshes/physics/*.msh: irregular meshes by Gmsh of two bodies that `supple-lab physics` judges elements on.

The silicone beam, 100 x 30 x 30 mm along x, y, z from the origin, with about as many tetrahedra as its grids have; and a quarter of
a thick-walled cylinder about z, radii 10 and 20 mm, a layer thick. They are what Gmsh gives, with its own optimisation alone; nodes are
renumbered for locality. Written as Gmsh 2.2 binary in metres, tetrahedra only, without tags, which is the smallest file of that
format. Runs as make_meshes.py does, of which it is a part:

    /tmp/v/bin/python tools/make_physics_meshes.py [OUTPUT_DIR]
"""
import sys
from pathlib import Path

import gmsh
import numpy as np

from make_meshes import MM, mesh_volume, quality, renumber

# Edge lengths asked of Gmsh, mm.
BEAM_EDGES = {"coarse": 8.4, "middle": 4.85, "fine": 3.6}
CYLINDER_EDGES = {"coarse": 4.0, "middle": 2.0, "fine": 1.0}


def build_beam(_):
    gmsh.model.occ.addBox(0, 0, 0, 100 * MM, 30 * MM, 30 * MM)


def build_cylinder(edge):
    outer, inner = (gmsh.model.occ.addCylinder(0, 0, 0, 0, 0, edge, radius * MM, angle=np.pi / 2) for radius in (20, 10))
    gmsh.model.occ.cut([(3, outer)], [(3, inner)])


def write_binary(path, x, tets):
    numbers = np.arange(1, max(len(x), len(tets)) + 1, dtype="<i4")
    nodes = np.zeros(len(x), [("number", "<i4"), ("point", "<f8", 3)])
    nodes["number"], nodes["point"] = numbers[:len(x)], x
    elements = np.column_stack([numbers[:len(tets)], tets + 1]).astype("<i4")
    head = np.array([4, len(tets), 0], "<i4")  # tetrahedra, how many, no tags
    path.write_bytes(b"".join([
        b"$MeshFormat\n2.2 1 8\n", numbers[:1].tobytes(), b"\n$EndMeshFormat\n",
        b"$Nodes\n%d\n" % len(x), nodes.tobytes(), b"\n$EndNodes\n",
        b"$Elements\n%d\n" % len(tets), head.tobytes(), elements.tobytes(), b"\n$EndElements\n"]))


def make(path, build, edge):
    gmsh.initialize(interruptible=False)
    options = {"General.NumThreads": 1, "General.Verbosity": 1, "Mesh.RandomSeed": 1,
               "Mesh.MeshSizeMin": edge, "Mesh.MeshSizeMax": edge}
    for option, value in options.items():
        gmsh.option.setNumber(option, value)
    build(edge)
    gmsh.model.occ.synchronize()
    x, tets, _ = mesh_volume()
    gmsh.finalize()
    x, tets, _ = renumber(x, tets, {})
    write_binary(path, x, tets)
    volume, dihedral, ratio, altitude = quality(x, tets)
    assert volume.min() > 0
    print(f"{path.name}: {len(x)} nodes, {len(tets)} tetrahedra, {path.stat().st_size / 1000:.0f} kB, volume {volume.sum() * 1e6:.4f} cm3, "
          f"smallest dihedral {dihedral.min():.1f} deg, altitude {altitude.min() / MM:.2f} mm (median {np.median(altitude) / MM:.2f}), "
          f"radius ratio {ratio.min():.2f}")


if __name__ == "__main__":
    out = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).resolve().parent.parent / "meshes" / "physics")
    out.mkdir(parents=True, exist_ok=True)
    for body, build, edges in (("beam", build_beam, BEAM_EDGES), ("cylinder", build_cylinder, CYLINDER_EDGES)):
        for name, edge in edges.items():
            make(out / f"{body}-{name}.msh", build, edge * MM)
