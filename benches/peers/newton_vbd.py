"""VBD of Newton (Warp) on the CPU: `python newton_vbd.py a|b OUT.json [--quick]`.

Linear tetrahedra, stable neo-Hookean law with the scene's Lame constants, no collisions. VBD knows no damping by the mass: velocities are multiplied
between steps, which costs next to nothing. A run that would take longer than LIMIT s is given up and says so.
"""

import json
import math
import sys
import time
from pathlib import Path

import newton
import numpy as np
import warp as wp

from scenes import SCENES, grid, masses, nearest

# Cells, nu (none: the scene's), iterations, step in ms: the notes of the engine's examples have 10 iterations and ten steps in a frame of 1/60 s.
SETTINGS = {
    "a": [("13x4x4", None, 10, 1000 / 600), ("13x4x4", None, 50, 1000 / 600), ("13x4x4", 0.45, 10, 1000 / 600)],
    "b": [("8x6x4", None, 10, 1000 / 600), ("8x6x4", None, 50, 1000 / 600), ("15x12x10", None, 10, 1000 / 600)],
}
LIMIT = 100.0


@wp.kernel
def slow(velocities: wp.array(dtype=wp.vec3), share: float):
    tid = wp.tid()
    velocities[tid] = share * velocities[tid]


def row(scene, setting):
    cells, poisson, iterations, step = setting
    nu = poisson or scene.poisson
    step *= 1e-3
    nodes, tetrahedra = grid(scene.size, tuple(map(int, cells.split("x"))))
    builder = newton.ModelBuilder(gravity=(0.0, 0.0, -scene.gravity))
    builder.add_soft_mesh(
        pos=wp.vec3(0.0, 0.0, 0.0),
        rot=wp.quat_identity(),
        scale=1.0,
        vel=wp.vec3(0.0, 0.0, 0.0),
        vertices=[wp.vec3(*node) for node in nodes],
        indices=np.array(tetrahedra).ravel().tolist(),
        density=scene.density,
        k_mu=scene.shear,
        k_lambda=2 * scene.shear * nu / (1 - 2 * nu),
        k_damp=0.0,
        add_surface_mesh_edges=False,
    )
    for node, mass in enumerate(masses(scene, nodes, tetrahedra)):
        builder.particle_mass[node] = 0.0 if nodes[node][0] == 0.0 else mass
    builder.color()
    model = builder.finalize()
    solver = newton.solvers.SolverVBD(model=model, iterations=iterations, particle_enable_self_contact=False, particle_enable_tile_solve=False)
    state, other, control = model.state(), model.state(), model.control()
    points = nearest(nodes, scene.points())
    places, share = np.array(nodes)[points], math.exp(-scene.damping * step)
    found = {
        "engine": "Newton VBD",
        "version": f"{newton.__version__}, warp {wp.config.version}",
        "setting": f"nu {nu:.3g}, {iterations} iterations, {1e3 * step:.3g} ms",
        "mesh": f"{len(tetrahedra)} tetrahedra",
    }
    rest_at = scene.seconds + 10 / scene.damping
    swing, spent, rest, began = [], 0.0, None, None
    for count in range(1, math.ceil(rest_at / step) + 1):
        start = time.process_time()
        state.clear_forces()
        solver.step(state, other, control, None, step)
        state, other = other, state
        wp.launch(slow, dim=len(nodes), inputs=[state.particle_qd, share], device="cpu")
        # The first step compiles.
        if count > 1 and count * step <= scene.seconds + 1e-9:
            spent += time.process_time() - start
        began = began or time.process_time()
        rest = (state.particle_q.numpy()[points] - places).tolist()
        swing.append((count * step, rest))
        if not np.isfinite(rest).all() or np.abs(rest).max() > 10:
            return {**found, "failed": f"diverges at {count * step:.2f} s"}
        if time.process_time() - began > LIMIT:
            if count * step < scene.seconds:
                each = (time.process_time() - began) / (count * step)
                return {**found, "failed": f"given up after {LIMIT:.0f} s at {count * step:.2f} s; {each:.0f} s/s", "swing": swing, "seconds": each}
            break
    return {**found, "rest": rest, "swing": [s for s in swing if s[0] <= scene.seconds + 1e-9], "seconds": spent / scene.seconds}


if __name__ == "__main__":
    wp.config.quiet = True
    wp.init()
    wp.set_device("cpu")
    scene = SCENES[sys.argv[1]]
    settings = SETTINGS[scene.name][: 1 if "--quick" in sys.argv else None]
    found = [row(scene, setting) for setting in settings]
    Path(sys.argv[2]).write_text(json.dumps(found))
