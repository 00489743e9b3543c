#!/usr/bin/env python3
"""Moves the paper's bar through the C API, from Python, and through the command, and compares the two.

    python3 examples/compare.py target/release/libsupple.so target/release/supple [ELEMENT]

The bar (50 x 50 x 100 mm, 6,528 tetrahedra) is held at z = 0, twisted by a force at each corner of its end
and pulled at the middle of it, for 0.15 s. ELEMENT is linear, nodal-pressure (if nothing is said) or nodal-strain.
Needs numpy. Ends with 1 if a node is further off than a millionth of the largest displacement.
"""
import ctypes
import subprocess
import sys
import tempfile
from ctypes import POINTER, Structure, byref, c_double, c_float, c_int32, c_size_t, c_uint8, c_uint16, c_uint32, c_void_p
from pathlib import Path

import numpy as np

ABI, ALIGN, EXPONENTIAL, CHECKED = 7, 64, 1, 0  # SUPPLE_... in include/supple.h
ELEMENTS = {"linear": 0, "nodal-pressure": 1, "nodal-strain": 2}
SIZE, CELLS = np.array([0.05, 0.05, 0.1]), (8, 8, 17)  # m
LAW, DENSITY, DAMPING = (59.0, 8.023, 60000.0), 1000.0, 20.0  # a Pa, b, d Pa; kg/m^3; 1/s
FORCE, PULL, RAMP = 0.3, 0.005, 0.2  # N, m, s
STEP, STEPS = 3e-5, 5000
ALLOWED = 1e-6  # of the largest displacement


class Support(Structure):
    _fields_ = [("node", c_uint32), ("axes", c_uint32), ("moves", c_uint32)]


class Tissue(Structure):
    _fields_ = [("constants", c_float * 4), ("density", c_float)]


class SceneConfig(Structure):
    _fields_ = [
        *((name, c_uint32) for name in ("struct_size", "abi", "law", "winding")),
        *((name, c_uint32) for name in ("nodes", "elements", "supports", "tissues")),
        ("points", POINTER(c_float)), ("tetrahedra", POINTER(c_uint32)), ("support", POINTER(Support)),
        ("tissue", POINTER(Tissue)), ("tissue_of_element", POINTER(c_uint16)),
        ("element", c_uint32), ("reserved", c_uint32), ("removed", POINTER(c_uint8)), ("prony", POINTER(c_float)),
        ("fibres", POINTER(c_float)), ("directions", POINTER(c_float)),
    ]


class StepConfig(Structure):
    _fields_ = [("struct_size", c_uint32), ("abi", c_uint32), ("seconds", c_float), ("damping", c_float)]


class Force(Structure):
    _fields_ = [("node", c_uint32), ("newton", c_float * 3), ("ramp", c_float)]


class Motion(Structure):
    _fields_ = [("node", c_uint32), ("axes", c_uint32), ("metre", c_float * 3), ("ramp", c_float)]


def node_at(i, j, k):
    return i + (CELLS[0] + 1) * (j + (CELLS[1] + 1) * k)


def bar():
    """Points, m, and tetrahedra: each cell is cut in six around its diagonal, in the order of the command."""
    orders = [((0, 1, 2), 1), ((1, 2, 0), 1), ((2, 0, 1), 1), ((0, 2, 1), 0), ((2, 1, 0), 0), ((1, 0, 2), 0)]
    grid = [(i, j, k) for k in range(CELLS[2] + 1) for j in range(CELLS[1] + 1) for i in range(CELLS[0] + 1)]
    # To float32 and to whole nanometres, as the command does, so that both start from the same bits.
    points = (SIZE.astype(np.float32) * np.array(grid, dtype=float) / CELLS).astype(np.float32)
    points = np.round(points.astype(float), 9)
    tetrahedra = []
    for k, j, i in np.ndindex(CELLS[2], CELLS[1], CELLS[0]):
        for order, even in orders:
            corner, nodes = [i, j, k], [node_at(i, j, k)]
            for axis in order:
                corner[axis] += 1
                nodes.append(node_at(*corner))
            a, b, c, d = nodes
            tetrahedra.append((a, b, c, d) if even else (a, c, b, d))
    return points, np.array(tetrahedra, dtype=np.uint32)


def loads():
    """Forces of a twist at the four corners, N, and the node that is pulled."""
    x, y, z = CELLS
    corners = {(0, 0): (1, -1), (x, 0): (1, 1), (x, y): (-1, 1), (0, y): (-1, -1)}
    forces = [(node_at(i, j, z), (FORCE * u, FORCE * v, 0.0)) for (i, j), (u, v) in corners.items()]
    return forces, node_at(x // 2, y // 2, z)


def scene_file(element, forces, pulled):
    lines = [
        f"damping = {DAMPING}", "[mesh]", 'shape = "bar"', f"size = {SIZE.tolist()}", f"cells = {list(CELLS)}",
        f'element = "{element}"',
        "[material]", 'law = "exponential"', "a = {}\nb = {}\nd = {}".format(*LAW), f"density = {DENSITY}",
        "[[fix]]", 'plane = { axis = "z", at = 0.0 }',
        "[[move]]", f"nodes = [{pulled}]", f"metre = [0.0, 0.0, {PULL}]", f"ramp = {RAMP}",
    ]
    for node, newton in forces:
        lines += ["[[force]]", f"nodes = [{node}]", f"newton = {list(newton)}", f"ramp = {RAMP}"]
    lines += ["[time]", f"step = {STEP}", f"end = {STEP * STEPS:.6f}", "frames = 1"]
    return "\n".join(lines) + "\n"


class Library:
    """The functions that are needed here, with an exception for every refusal."""

    def __init__(self, path):
        self.functions = ctypes.CDLL(str(Path(path).resolve()))
        self.functions.supple_status_text.restype = ctypes.c_char_p
        if self.functions.supple_abi() != ABI:
            sys.exit(f"{path}: interface {self.functions.supple_abi()}, this script is for {ABI}")
        self.kept = []

    def size(self, name, *counts):
        function = getattr(self.functions, name)
        function.restype = c_size_t
        return function(*map(c_uint32, counts))

    def call(self, name, *arguments):
        status = getattr(self.functions, name)(*arguments)
        if status < 0:
            sys.exit(f"{name}: {self.functions.supple_status_text(c_int32(status)).decode()}")

    def made(self, name, size, *arguments, after=()):
        """An object in aligned memory that stays as long as this does; `after` follows the place for it."""
        memory = ctypes.create_string_buffer(size + ALIGN)
        self.kept.append(memory)
        start = -(-ctypes.addressof(memory) // ALIGN) * ALIGN
        made = c_void_p()
        self.call(name, c_void_p(start), c_size_t(size), *arguments, byref(made), *after)
        return made


def moved_by_library(path, element, points, tetrahedra, forces, pulled):
    library, element = Library(path), ELEMENTS[element]
    nodes, elements = len(points), len(tetrahedra)
    # As in the command: around the middle of the body, where float32 is finest.
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    local = np.ascontiguousarray((points - centre).astype(np.float32))
    held = [Support(int(node), 7, 0) for node in np.flatnonzero(points[:, 2] == 0.0)]
    held = (Support * (len(held) + 1))(*held, Support(pulled, 7, 1))
    tissue = Tissue(LAW, DENSITY)
    config = SceneConfig(
        ctypes.sizeof(SceneConfig), ABI, EXPONENTIAL, CHECKED, nodes, elements, len(held), 1,
        local.ctypes.data_as(POINTER(c_float)), tetrahedra.ctypes.data_as(POINTER(c_uint32)), held,
        ctypes.pointer(tissue), None, element, 0, None,
    )
    size = library.size("supple_scene_size", nodes, elements, 1)
    if element == ELEMENTS["nodal-strain"]:
        size += library.size("supple_patches_size", nodes, elements, 1)
    scene = library.made("supple_scene_init", size, byref(config), after=(None,))
    state = library.made("supple_state_init", library.size("supple_state_size", nodes, element), scene)
    size = library.size("supple_loads_size", len(forces), 1)
    acting = library.made("supple_loads_init", size, scene, c_uint32(len(forces)), c_uint32(1))
    pushes = (Force * len(forces))(*(Force(node, newton, RAMP) for node, newton in forces))
    library.call("supple_set_forces", acting, pushes, c_uint32(len(forces)), None)
    motion = Motion(pulled, 7, (0.0, 0.0, PULL), RAMP)
    library.call("supple_set_motions", acting, scene, byref(motion), c_uint32(1), None)
    step = StepConfig(ctypes.sizeof(StepConfig), ABI, STEP, DAMPING)
    library.call("supple_set_step", scene, state, byref(step), None)
    library.call("supple_step", scene, acting, state, c_uint32(STEPS), None, None)
    displacement = np.empty((nodes, 3), dtype=np.float32)
    out = displacement.ctypes.data_as(POINTER(c_float))
    library.call("supple_copy_displacements", state, out, c_size_t(displacement.size))
    time = c_double()
    library.call("supple_state_time", state, byref(time), None)
    print(f"moved for            {time.value:.6f} s in {STEPS} steps")
    return displacement


def moved_by_command(path, scene):
    with tempfile.TemporaryDirectory() as folder:
        file, out = Path(folder) / "bar.toml", Path(folder) / "out"
        file.write_text(scene)
        answer = subprocess.run([path, "simulate", file, "--out", out], capture_output=True, text=True)
        if answer.returncode != 0:
            sys.exit(f"{path} simulate ended with {answer.returncode}: {answer.stderr.strip()}")
        return np.loadtxt(out / "final.csv", delimiter=",", skiprows=1)


def main(words):
    if len(words) not in (2, 3) or words[2:3] not in ([], *([element] for element in ELEMENTS)):
        sys.exit(__doc__)
    library, command, element = (*words, "nodal-pressure")[:3]
    points, tetrahedra = bar()
    forces, pulled = loads()
    mine = moved_by_library(library, element, points, tetrahedra, forces, pulled)
    theirs = moved_by_command(command, scene_file(element, forces, pulled))
    if theirs.shape != (len(points), 7) or not np.allclose(theirs[:, 1:4], points, rtol=0.0, atol=1e-9):
        sys.exit(f"{command}: its nodes are not those of this script")
    # The file has the fewest digits that name a float32.
    moved = theirs[:, 4:].astype(np.float32).astype(float)
    apart = np.linalg.norm(mine - moved, axis=1)
    most = np.linalg.norm(moved, axis=1).max()
    print(f"largest displacement {most:.6e} m")
    print(f"largest difference   {apart.max():.3e} m at node {apart.argmax()}: {apart.max() / most:.1e} of it")
    if not apart.max() <= ALLOWED * most:
        sys.exit(f"more than {ALLOWED:g} of the largest displacement")


if __name__ == "__main__":
    main(sys.argv[1:])
