"""Makes the meshes in this folder: one mesh of 24 tetrahedra in every encoding that other programs write.

    python3 -m venv venv && venv/bin/pip install meshio==5.3.5 gmsh==4.15.2 vtk==9.7.2 && venv/bin/python make.py

gmsh needs libGLU (Debian: libglu1-mesa libxrender1 libxcursor1 libxft2 libxinerama1).
"""

import re
import struct
from pathlib import Path

import gmsh
import meshio
import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk

HERE = Path(__file__).parent

# Two cubes of six tetrahedra each, twice; coordinates are exact in float32 and the rows of points are not aligned.
CUBE = [(0, 1, 3, 7), (0, 1, 7, 5), (0, 5, 7, 4), (0, 3, 2, 7), (0, 2, 6, 7), (0, 6, 4, 7)]


def mesh():
    shape = (3, 3, 2)
    at = lambda i, j, k: i + shape[0] * (j + shape[1] * k)
    points = [
        (i + 0.125 * ((j * 5 + k * 3) % 4), 1.5 * j + 0.0625 * k, -0.75 * k + 0.03125 * i)
        for k in range(shape[2])
        for j in range(shape[1])
        for i in range(shape[0])
    ]
    tets, regions = [], []
    for j in range(2):
        for i in range(2):
            corners = [at(i + (c & 1), j + (c >> 1 & 1), c >> 2) for c in range(8)]
            tets += [[corners[c] for c in tet] for tet in CUBE]
            regions += [3 if i == 0 else 7] * 6
    faces = {}
    for a, b, c, d in tets:
        for face in ((a, c, b), (a, b, d), (b, c, d), (a, d, c)):
            faces.setdefault(tuple(sorted(face)), []).append(face)
    triangles = [face[0] for face in faces.values() if len(face) == 1]
    return np.array(points), np.array(tets), np.array(triangles), np.array(regions)


POINTS, TETS, TRIANGLES, REGIONS = mesh()


def reference():
    lines = [f"p {x} {y} {z}" for x, y, z in POINTS]
    lines += [f"t {a} {b} {c} {d} {r}" for (a, b, c, d), r in zip(TETS, REGIONS)]
    lines += [f"f {a} {b} {c}" for a, b, c in TRIANGLES]
    (HERE / "reference.txt").write_text("\n".join(lines) + "\n")


def grid(dtype=np.float64, regions=True, tets=slice(None), more=True):
    """Tetrahedra between triangles, a line and a vertex, as an unstructured grid of VTK."""
    out = vtk.vtkUnstructuredGrid()
    points = vtk.vtkPoints()
    points.SetData(numpy_to_vtk(POINTS.astype(dtype), deep=True))
    out.SetPoints(points)
    cells = [(vtk.VTK_TETRA, t) for t in TETS[tets]]
    values = list(REGIONS[tets])
    if more:
        cells = [(vtk.VTK_LINE, (0, 1))] + [(vtk.VTK_TRIANGLE, t) for t in TRIANGLES] + cells + [(vtk.VTK_VERTEX, (2,))]
        values = [99] * (1 + len(TRIANGLES)) + values + [99]
    for kind, nodes in cells:
        out.InsertNextCell(kind, len(nodes), [int(n) for n in nodes])
    if regions:
        out.GetCellData().AddArray(array("quality", np.linspace(0, 1, len(values))))
        out.GetCellData().AddArray(array("Region", np.array(values, np.int32)))
    out.GetPointData().SetScalars(array("id", np.arange(len(POINTS), dtype=np.int16)))
    shift = array("shift", POINTS.astype(np.float32))
    shift.SetComponentName(0, "east")
    out.GetPointData().SetVectors(shift)
    # Both make VTK write metadata after the array.
    out.GetPoints().GetData().GetRange(-1)
    return out


def array(name, values):
    out = numpy_to_vtk(values, deep=True)
    out.SetName(name)
    return out


def legacy(name, data, binary, version):
    writer = vtk.vtkUnstructuredGridWriter()
    writer.SetInputData(data)
    writer.SetFileName(str(HERE / name))
    writer.SetFileVersion(version)
    writer.SetFileTypeToBinary() if binary else writer.SetFileTypeToASCII()
    writer.Write()


def xml(name, data, mode, compressor=None, wide=False, big=False):
    writer = vtk.vtkXMLUnstructuredGridWriter()
    writer.SetInputData(data)
    writer.SetFileName(str(HERE / name))
    if mode == "ascii":
        writer.SetDataModeToAscii()
    elif mode == "inline":
        writer.SetDataModeToBinary()
    else:
        writer.SetDataModeToAppended()
        writer.SetEncodeAppendedData(mode == "base64")
    compressors = {None: writer.SetCompressorTypeToNone, "zlib": writer.SetCompressorTypeToZLib}
    compressors |= {"lz4": writer.SetCompressorTypeToLZ4, "lzma": writer.SetCompressorTypeToLZMA}
    compressors[compressor]()
    if compressor:
        writer.SetBlockSize(256)  # several blocks, the last one not full
    writer.SetHeaderTypeToUInt64() if wide else writer.SetHeaderTypeToUInt32()
    writer.SetByteOrderToBigEndian() if big else writer.SetByteOrderToLittleEndian()
    writer.Write()


def vtk_files():
    legacy("vtk_4.2_ascii.vtk", grid(), False, vtk.vtkDataWriter.VTK_LEGACY_READER_VERSION_4_2)
    legacy("vtk_4.2_binary.vtk", grid(), True, vtk.vtkDataWriter.VTK_LEGACY_READER_VERSION_4_2)
    legacy("vtk_5.1_ascii_f32.vtk", grid(np.float32), False, vtk.vtkDataWriter.VTK_LEGACY_READER_VERSION_5_1)
    legacy("vtk_5.1_binary.vtk", grid(), True, vtk.vtkDataWriter.VTK_LEGACY_READER_VERSION_5_1)
    xml("vtk_ascii.vtu", grid(), "ascii")
    xml("vtk_inline_f32.vtu", grid(np.float32), "inline")
    xml("vtk_inline_zlib_u64.vtu", grid(), "inline", "zlib", wide=True)
    xml("vtk_base64_big.vtu", grid(), "base64", big=True)
    xml("vtk_base64_zlib.vtu", grid(), "base64", "zlib")
    xml("vtk_raw.vtu", grid(), "raw")
    xml("vtk_raw_u64_big.vtu", grid(), "raw", wide=True, big=True)
    xml("vtk_raw_zlib.vtu", grid(), "raw", "zlib")
    xml("refused_lz4.vtu", grid(), "raw", "lz4")
    xml("refused_lzma.vtu", grid(), "inline", "lzma")
    # Two pieces that both carry all points.
    texts = []
    for part, more in ((slice(0, 10), True), (slice(10, None), False)):
        xml("vtk_pieces.vtu", grid(tets=part, more=more), "ascii")
        texts.append((HERE / "vtk_pieces.vtu").read_text())
    second = re.search(r"<Piece .*</Piece>", texts[1], re.S).group(0)
    (HERE / "vtk_pieces.vtu").write_text(texts[0].replace("</Piece>", "</Piece>\n    " + second))


def meshio_files():
    cells = [("triangle", TRIANGLES), ("tetra", TETS)]
    physical = [np.full(len(TRIANGLES), 99), REGIONS]
    data = meshio.Mesh(POINTS, cells, cell_data={"gmsh:physical": physical, "gmsh:geometrical": physical})
    meshio.vtk.write(HERE / "meshio_4.2_ascii.vtk", data, fmt_version="4.2", binary=False)
    meshio.vtk.write(HERE / "meshio_5.1_ascii.vtk", data, fmt_version="5.1", binary=False)
    meshio.vtk.write(HERE / "meshio_5.1_binary.vtk", data, fmt_version="5.1", binary=True)
    meshio.write(HERE / "meshio_zlib.vtu", data)
    bare = meshio.Mesh(POINTS, [("tetra", TETS)])
    for kind, binary in (("ascii", False), ("binary", True)):
        meshio.gmsh.write(HERE / f"meshio_2.2_{kind}.msh", data, fmt_version="2.2", binary=binary)
        meshio.gmsh.write(HERE / f"meshio_4.1_{kind}_bare.msh", bare, fmt_version="4.1", binary=binary)
    meshio.write(HERE / "meshio_tetgen_bare.node", bare)


def gmsh_files():
    """The same mesh with node numbers that are neither ordered nor without gaps."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add("cubes")
    number = lambda p: (np.asarray(p) * 7 % len(POINTS)) * 10 + 5
    surface = gmsh.model.addDiscreteEntity(2)
    volumes = {r: gmsh.model.addDiscreteEntity(3, boundary=[surface]) for r in (3, 7)}
    gmsh.model.mesh.addNodes(2, surface, number(np.arange(len(POINTS))), POINTS.ravel())
    gmsh.model.mesh.addElementsByType(surface, 2, [], number(TRIANGLES).ravel())
    gmsh.model.addPhysicalGroup(2, [surface], 99)
    for region, volume in volumes.items():
        gmsh.model.mesh.addElementsByType(volume, 4, [], number(TETS[REGIONS == region]).ravel())
        gmsh.model.addPhysicalGroup(3, [volume], region)
    for version in (1.0, 2.2, 4.1, 4.0):
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        for binary in (0, 1):
            gmsh.option.setNumber("Mesh.Binary", binary)
            name = f"gmsh_{version}_{('ascii', 'binary')[binary]}.msh"
            if version == 4.0:
                name = "refused_4.0.msh"
            if (version, binary) not in ((1.0, 1), (4.0, 1)):
                gmsh.write(str(HERE / name))
    gmsh.option.setNumber("Mesh.Binary", 0)

    # A real geometry, whose nodes on curves and surfaces have parameters.
    gmsh.model.add("lens")
    ball = gmsh.model.occ.addSphere(0, 0, 0, 1)
    box = gmsh.model.occ.addBox(0, 0, 0, 2, 2, 2)
    gmsh.model.occ.intersect([(3, ball)], [(3, box)])
    gmsh.model.occ.synchronize()
    gmsh.option.setNumber("Mesh.MeshSizeMin", 1)
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    gmsh.model.mesh.generate(3)
    gmsh.write(str(HERE / "lens_4.1.msh"))
    gmsh.write(str(HERE / "lens.vtk"))
    gmsh.option.setNumber("Mesh.SaveParametric", 1)
    gmsh.write(str(HERE / "lens_parametric.msh"))
    gmsh.option.setNumber("Mesh.Binary", 1)
    gmsh.write(str(HERE / "lens_parametric_binary.msh"))
    gmsh.option.setNumber("Mesh.Binary", 0)
    gmsh.option.setNumber("Mesh.SaveParametric", 0)
    gmsh.model.mesh.setOrder(2)
    gmsh.option.setNumber("Mesh.MshFileVersion", 2.2)
    gmsh.write(str(HERE / "refused_order2.msh"))
    gmsh.write(str(HERE / "refused_order2.vtk"))
    gmsh.finalize()


def big_endian_gmsh():
    """No program on a machine of today writes these."""
    ends = lambda name: f"\n$End{name}\n".encode()
    n, m = len(POINTS), len(TETS)
    out = b"$MeshFormat\n2.2 1 8\n" + struct.pack(">i", 1) + ends("MeshFormat")
    out += f"$Nodes\n{n}\n".encode()
    out += b"".join(struct.pack(">i3d", i + 1, *p) for i, p in enumerate(POINTS)) + ends("Nodes")
    out += f"$Elements\n{m + len(TRIANGLES)}\n".encode()
    out += struct.pack(">3i", 2, len(TRIANGLES), 2)
    out += b"".join(struct.pack(">6i", i + 1, 99, 1, *(t + 1)) for i, t in enumerate(TRIANGLES))
    out += struct.pack(">3i", 4, m, 3)
    out += b"".join(struct.pack(">8i", 100 + i, r, 1, 0, *(t + 1)) for i, (t, r) in enumerate(zip(TETS, REGIONS)))
    (HERE / "big_2.2_binary.msh").write_bytes(out + ends("Elements"))

    out = b"$MeshFormat\n4.1 1 8\n" + struct.pack(">i", 1) + ends("MeshFormat")
    out += b"$Entities\n" + struct.pack(">4Q", 0, 0, 1, 2)
    out += struct.pack(">i6dQiQ", 1, *[0] * 6, 1, 99, 0)
    for region in (3, 7):
        out += struct.pack(">i6dQ2iQi", region + 10, *[0] * 6, 2, region, 50, 1, 1)
    out += ends("Entities") + b"$Nodes\n" + struct.pack(">4Q", 1, n, 1, n) + struct.pack(">3iQ", 2, 1, 0, n)
    out += struct.pack(f">{n}Q", *range(1, n + 1)) + struct.pack(f">{3 * n}d", *POINTS.ravel()) + ends("Nodes")
    out += b"$Elements\n" + struct.pack(">4Q", 3, m + len(TRIANGLES), 1, m + len(TRIANGLES))
    out += struct.pack(">3iQ", 2, 1, 2, len(TRIANGLES))
    out += b"".join(struct.pack(">4Q", 1 + i, *(t + 1)) for i, t in enumerate(TRIANGLES))
    for region in (3, 7):
        tets = TETS[REGIONS == region]
        out += struct.pack(">3iQ", 3, region + 10, 4, len(tets))
        out += b"".join(struct.pack(">5Q", 1000 + i, *(t + 1)) for i, t in enumerate(tets))
    (HERE / "big_4.1_binary.msh").write_bytes(out + ends("Elements"))


def tetgen_files():
    """Numbered from 1, with comments, attributes and boundary markers, as TetGen -A writes them."""
    lines = ["# nodes", f"{len(POINTS)}  3  1  1  # count, dimension, attributes, markers"]
    lines += [f"{i + 1:5d}  {x} {y} {z}  0.5  {i % 2}" for i, (x, y, z) in enumerate(POINTS)]
    (HERE / "tetgen.1.node").write_text("\n".join(lines) + "\n# end\n")
    lines = [f"{len(TETS)}  4  1"]
    lines += [f"{i + 1:5d}  {a + 1} {b + 1} {c + 1} {d + 1}  {r}" for i, ((a, b, c, d), r) in enumerate(zip(TETS, REGIONS))]
    (HERE / "tetgen.1.ele").write_text("\n".join(lines) + "\n# end\n")


reference()
vtk_files()
meshio_files()
gmsh_files()
big_endian_gmsh()
tetgen_files()
