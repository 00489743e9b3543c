"""Meshes out of files: those that the command reads by the same readers and with the same words, others by meshio, which never ends the
process."""

import subprocess
import sys

import meshio
import numpy as np
import pytest
import supple
from conftest import ROOT, bar

DATA = ROOT / "tests" / "data"
SAME = [
    "gmsh_1.0_ascii.msh", "gmsh_2.2_ascii.msh", "gmsh_2.2_binary.msh", "gmsh_4.1_ascii.msh", "gmsh_4.1_binary.msh", "big_2.2_binary.msh",
    "big_4.1_binary.msh", "meshio_2.2_ascii.msh", "tetgen.1.node", "tetgen.1.ele", "vtk_4.2_ascii.vtk", "vtk_4.2_binary.vtk",
    "vtk_5.1_binary.vtk", "vtk_ascii.vtu", "vtk_base64_zlib.vtu", "vtk_raw.vtu", "vtk_raw_zlib.vtu",
]


def middles(mesh):
    """Middle and region of each tetrahedron, in one order whatever that of the file is."""
    rows = np.column_stack([mesh.points.astype(float)[mesh.tets].mean(axis=1), mesh.regions]).round(5)
    return rows[np.lexsort(rows.T)]


@pytest.mark.parametrize("name", SAME)
def test_every_format_of_the_command_is_read(name):
    """One mesh in the encodings of Gmsh, VTK and TetGen, with its regions; meshio ends the process of the first."""
    lines = [line.split() for line in (DATA / "reference.txt").read_text().splitlines()]
    points = [[float(word) for word in words] for kind, *words in lines if kind == "p"]
    tets = np.array([[int(word) for word in words] for kind, *words in lines if kind == "t"])
    expected = supple.Mesh(points, tets[:, :4], regions=tets[:, 4])
    read = supple.Mesh.read(DATA / name)
    assert len(read.points) == 18 and len(read.tets) == 24 and sorted(set(read.regions.tolist())) == [3, 7]
    assert middles(read) == pytest.approx(middles(expected), abs=1e-5)
    assert supple.Mesh.read(DATA / name, scale=0.001).points == pytest.approx(0.001 * read.points)


MSH = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 9 9 9\n$EndNodes\n$Elements\n1\n"


def test_points_of_no_tetrahedron_are_left_out(tmp_path):
    (tmp_path / "one.msh").write_text(MSH + "40 4 2 1 1 1 2 3 4\n$EndElements\n")
    mesh = supple.Mesh.read(tmp_path / "one.msh")
    assert len(mesh.points) == 4 and mesh.tets.tolist() == [[0, 1, 2, 3]] and mesh.regions.tolist() == [1]


def test_tetrahedra_that_overlap_are_refused(tmp_path, soft):
    """As Gmsh 2.2 writes a volume of two physical groups: it has twice the mass, and no surface to touch."""
    mesh = bar()
    for tets, words in (
        ([*mesh.tets, mesh.tets[7, [3, 0, 2, 1]]], "elements 7, 432 have the same four nodes: list each once"),
        ([*mesh.tets, *mesh.tets], "elements 0, 432 have the same four nodes, one of 432 such places"),
        # A second one on the boundary's face is none; a third at a face within is.
        ([[0, 1, 2, 3], [1, 2, 3, 4], [1, 2, 3, 5]], "elements 0, 1, 2 share a face, which has two sides"),
    ):
        with pytest.raises(supple.InputError, match=words):
            supple.Scene(supple.Mesh(mesh.points, np.array(tets)), soft)
    (tmp_path / "two.msh").write_text(MSH.replace("Elements\n1", "Elements\n2") + "40 4 2 1 1 1 2 3 4\n41 4 2 2 1 1 2 3 4\n$EndElements\n")
    with pytest.raises(supple.InputError, match=r"two.msh: elements 0 and 1 \(counted from 0\) have the same four nodes; list each once"):
        supple.Mesh.read(tmp_path / "two.msh")


REFUSED = [
    ("node.msh", MSH + "40 4 2 1 1 1 2 3 999\n$EndElements\n", ", line 14: element 40 names node 999, which is not one of the file's 5 nodes"),
    ("cut.msh", MSH[:60], ", line "),
    ("empty.vtk", "", ", line 1: "),
    ("none.vtu", "<VTKFile", ", "),
    ("none.msh", None, ": cannot be read: No such file"),
    ("folder.msh", "/", ": cannot be read: it is a folder, a device or a pipe, not a file"),
    ("é.msh", "", ", line 1: "),
]


@pytest.mark.parametrize(("name", "text", "words"), REFUSED)
def test_what_cannot_be_read_is_told_in_the_words_of_the_command(tmp_path, name, text, words):
    path = tmp_path / name
    if text == "/":
        path.mkdir()
    elif text is not None:
        path.write_text(text)
    with pytest.raises(supple.InputError) as caught:
        supple.Mesh.read(path)
    print(caught.value)
    assert str(caught.value).startswith(f"{path}{words}") and len(str(caught.value)) > len(str(path)) + 10


def test_a_bomb_takes_no_memory_and_no_time(tmp_path):
    """The file says of its nodes that they are four thousand millions."""
    (tmp_path / "bomb.msh").write_text(MSH.replace("\n5\n", "\n4000000000\n"))
    program = (
        "import resource, supple, sys\nresource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30))\n"
        "try: supple.Mesh.read(sys.argv[1])\nexcept supple.InputError as problem: print(problem)\n"
    )
    ran = subprocess.run([sys.executable, "-c", program, tmp_path / "bomb.msh"], capture_output=True, text=True, timeout=60)
    print(ran.stdout, ran.stderr)
    assert ran.returncode == 0 and "bomb.msh, line " in ran.stdout


def test_other_formats_are_meshios(tmp_path):
    mesh = bar()
    for name in ("bar.inp", "bar.mesh"):
        mesh.write(tmp_path / name)
        read = supple.Mesh.read(tmp_path / name)
        assert (read.tets == mesh.tets).all() and read.points == pytest.approx(mesh.points, abs=1e-6)


@pytest.mark.parametrize("name", ["bar.vtu", "bar.vtk", "bar.msh", "bar.ele"])
def test_what_is_written_is_read_again_with_its_regions(tmp_path, capfd, name):
    made = bar()
    for regions in (None, np.arange(len(made.tets)) % 3 + 5):
        mesh = supple.Mesh(made.points, made.tets, regions=regions)
        mesh.write(tmp_path / name, np.full_like(made.points, 0.001))
        read = supple.Mesh.read(tmp_path / name)
        assert (read.tets == mesh.tets).all() and read.points == pytest.approx(mesh.points + 0.001, abs=1e-6)
        assert read.regions is None if regions is None else (read.regions == regions).all()
    assert "Warning" not in "".join(capfd.readouterr())


@pytest.mark.parametrize("stop", [SystemExit(1), KeyError("x"), ValueError("no"), meshio.ReadError("no")])
def test_meshio_never_ends_the_process(tmp_path, monkeypatch, stop):
    def fail(*_, **__):
        raise stop

    monkeypatch.setattr(meshio, "read", fail)
    monkeypatch.setattr(meshio, "write", fail)
    with pytest.raises(supple.InputError, match="old.xyz: meshio cannot read it"):
        supple.Mesh.read(tmp_path / "old.xyz")
    with pytest.raises(supple.InputError, match="new.xyz: meshio cannot write it"):
        bar().write(tmp_path / "new.xyz")
