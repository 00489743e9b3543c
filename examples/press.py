#!/usr/bin/env python3
"""Presses the paper's bar from the side with a ball, through the C API, and prints the force on it.

    python3 examples/press.py target/release/libsupple.so

The bar is held at z = 0. The ball comes from outside, goes 3 mm in, slides 5 mm along with friction, and leaves, 60 frames
a second. Needs numpy. Ends with 1 if the ball was never pushed back, or is still touched when it is away.
"""
import ctypes
import sys
from ctypes import POINTER, Structure, byref, c_double, c_float, c_uint32, c_void_p, c_size_t

import numpy as np

from compare import (
    ABI, CELLS, CHECKED, DAMPING, DENSITY, ELEMENTS, EXPONENTIAL, LAW, SIZE, Library, SceneConfig, StepConfig, Support,
    Tissue, bar,
)

SPHERE, RADIUS, FRICTION = 1, 0.015, 0.3  # SUPPLE_SPHERE; m
STEP, FRAME = 1.0 / 60.0 / 500.0, 1.0 / 60.0  # s
# Frame and position of its centre, m: linear in between.
PATH = np.array([(0, -0.0155, 0.06), (12, -0.012, 0.06), (20, -0.012, 0.065), (30, -0.018, 0.065)])


class Pose(Structure):
    _fields_ = [("position", c_float * 3), ("rotation", c_float * 4)]


class Instrument(Structure):
    _fields_ = [
        ("shape", c_uint32), *((name, c_float) for name in ("radius", "length", "friction")), ("pose", Pose),
        ("field", c_void_p), ("field_bytes", c_size_t),
    ]


class Surface(Structure):
    _fields_ = [("nodes", POINTER(c_uint32)), ("triangles", POINTER(c_uint32)), ("node_count", c_uint32), ("triangle_count", c_uint32)]


class Touch(Structure):
    _fields_ = [
        *((name, c_float * 3) for name in ("force", "moment", "mean_force")), ("contacts", c_uint32),
        *((name, c_float) for name in ("depth", "work", "friction_loss")),
    ]


def pose(frame):
    x, z = (np.interp(frame, PATH[:, 0], PATH[:, axis]) for axis in (1, 2))
    return Pose((x, SIZE[1] / 2, z), (0, 0, 0, 1))


def main(path):
    library, element = Library(path), ELEMENTS["nodal-pressure"]
    points, tetrahedra = bar()
    points = np.ascontiguousarray(points.astype(np.float32))
    nodes, elements, tissue = len(points), len(tetrahedra), Tissue(LAW, DENSITY)
    held = [Support(int(node), 7, 0) for node in np.flatnonzero(points[:, 2] == 0.0)]
    held = (Support * len(held))(*held)
    at = points.ctypes.data_as(POINTER(c_float))
    config = SceneConfig(
        ctypes.sizeof(SceneConfig), ABI, EXPONENTIAL, CHECKED, nodes, elements, len(held), 1, at,
        tetrahedra.ctypes.data_as(POINTER(c_uint32)), held, ctypes.pointer(tissue), None, element, 0,
    )
    scene = library.made("supple_scene_init", library.size("supple_scene_size", nodes, elements, 1), byref(config), after=(None,))
    state = library.made("supple_state_init", library.size("supple_state_size", nodes, element), scene)
    loads = library.made("supple_loads_init", library.size("supple_loads_size", 0, 0), scene, c_uint32(0), c_uint32(0))
    # The nodes of the boundary: on the faces of the box.
    faces = np.isclose(points, 0.0).any(axis=1) | np.isclose(points, SIZE.astype(np.float32)).any(axis=1)
    numbers = np.flatnonzero(faces).astype(np.uint32)
    surface = Surface(numbers.ctypes.data_as(POINTER(c_uint32)), None, len(numbers), 0)
    contact = library.made(
        "supple_contact_init", library.size("supple_contact_size", len(numbers), 0, 0), scene, at, byref(surface),
        c_uint32(0), after=(None,),
    )
    ball = Instrument(SPHERE, RADIUS, 0.0, FRICTION, pose(0), None, 0)
    library.call("supple_set_instruments", contact, byref(ball), c_uint32(1), None)
    library.call("supple_set_contact", loads, contact)
    library.call("supple_set_step", scene, state, byref(StepConfig(ctypes.sizeof(StepConfig), ABI, STEP, DAMPING)), None)
    forces, touch = [], Touch()
    for frame in range(int(PATH[-1, 0])):
        times = c_double(frame * FRAME), c_double((frame + 1) * FRAME)
        library.call("supple_move_instrument", contact, c_uint32(0), byref(pose(frame + 1)), *times, None)
        library.call("supple_step", scene, loads, state, c_uint32(round(FRAME / STEP)), None, None)
        library.call("supple_read_touch", contact, c_uint32(0), byref(touch))
        forces.append(list(touch.mean_force))
        if frame % 3 == 2:
            print(f"{(frame + 1) * FRAME:.2f} s: {1e3 * forces[-1][0]:8.3f} mN back, {1e3 * forces[-1][2]:7.3f} mN along, {touch.contacts} nodes")
    forces = np.array(forces)
    return 0 if forces[:, 0].min() < -1e-4 and not forces[-1].any() else 1


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1]))
