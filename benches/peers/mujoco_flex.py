"""MuJoCo's quadratic flexes: `python mujoco_flex.py a|b OUT.json [--quick]`.

Hexahedral cells of 27 nodes. Masses are Simpson's weights (a flexcomp gives each node the same). Held nodes are `pin`. integrator="discrete" is the only
one that is implicit in position. Damping is that of the mass, set after compilation, because the compiler refuses joint damping of flex bodies. The law is
Saint Venant-Kirchhoff's, the only one of these cells.
- CG 300: up to 300 iterations of conjugate gradients (MuJoCo does 100 unless told otherwise).
- direct: one Newton iteration of the constraint solver, a sparse factorisation. It needs a constraint, here that of a weight apart, and islands off.
"""

import json
import sys
import time
import warnings
from itertools import product
from pathlib import Path

import mujoco
import numpy as np

from scenes import SCENES, nearest

SOLVES = {
    "CG 300": ('iterations="300"', "", False),
    "direct": ('iterations="1" jacobian="sparse"', '<flag island="disable"/>', True),
}
# Cells, nu (none: the scene's), solver, step in ms; the first is the quick one.
SETTINGS = {
    "a": [
        ("4x1x1", 0.45, "CG 300", 2),
        ("4x1x1", 0.45, "direct", 2),
        ("4x1x1", None, "direct", 2),
        ("4x1x1", None, "direct", 8),
        ("8x1x1", 0.45, "CG 300", 2),
        ("8x1x1", 0.45, "direct", 1),
        ("8x1x1", 0.45, "direct", 2),
        ("8x2x2", 0.45, "direct", 2),
        ("8x1x1", None, "direct", 0.5),
        ("8x1x1", None, "direct", 2),
        ("8x1x1", None, "direct", 8),
    ],
    "b": [
        ("4x1x1", 0.45, "CG 300", 2),
        ("4x1x1", 0.45, "direct", 8),
        ("4x1x1", None, "direct", 2),
        ("4x2x2", 0.45, "CG 300", 2),
        ("4x2x2", None, "direct", 4),
    ],
}


def text(numbers):
    return " ".join(repr(float(x)) if isinstance(x, float) else str(x) for x in numbers)


def cell_masses(scene, cells):
    """By the names that a flexcomp gives its bodies."""
    along = [np.zeros(2 * count + 1) for count in cells]
    for weights, count in zip(along, cells):
        for cell in range(count):
            weights[2 * cell : 2 * cell + 3] += np.array([1.0, 4.0, 1.0]) / 6 / count
    whole = scene.density * np.prod(scene.size)
    return {f"b_{i}_{j}_{k}": whole * x * y * z for (i, x), (j, y), (k, z) in product(*map(enumerate, along))}


def box(scene, cells, poisson, solve):
    options, flags, constrained = SOLVES[solve]
    size, planes = np.array(scene.size), [2 * n for n in cells]
    weight = '<body name="weight" pos="1 0 0"><joint name="apart" type="slide"/><geom size="0.01" contype="0" conaffinity="0"/></body>'
    spec = mujoco.MjSpec.from_string(
        f"""<mujoco>
  <option integrator="discrete" solver="Newton" gravity="0 0 {-scene.gravity}" {options}>{flags}</option>
  <worldbody>
    <flexcomp name="b" dim="3" radius="0" mass="1" type="grid" dof="quadratic" cellcount="{text(cells)}"
        count="{text(n + 1 for n in planes)}" spacing="{text(size / planes)}" pos="{text(size / 2)}">
      <elasticity young="{scene.shear * 2 * (1 + poisson)}" poisson="{poisson}"/>
      <contact selfcollide="none" contype="0" conaffinity="0"/>
      <pin gridrange="0 0 0 0 {planes[1]} {planes[2]}"/>
    </flexcomp>
    {weight if constrained else ""}
  </worldbody>
  {'<equality><joint joint1="apart"/></equality>' if constrained else ""}
</mujoco>"""
    )
    mass = cell_masses(scene, cells)
    for body in spec.bodies:
        if body.name in mass:
            body.mass = mass[body.name]
    model = spec.compile()
    data = mujoco.MjData(model)
    model.dof_damping[:] = scene.damping * model.body_mass[model.dof_bodyid]
    mujoco.mj_kinematics(model, data)
    mujoco.mj_flex(model, data)
    return model, data


def row(scene, setting):
    cells, poisson, solve, step = setting
    counts = tuple(map(int, cells.split("x")))
    poisson = poisson or scene.poisson
    model, data = box(scene, counts, poisson, solve)
    places = data.flexvert_xpos.copy()
    points = nearest(places.tolist(), scene.points())

    def moved():
        return (data.flexvert_xpos[points] - places[points]).tolist()

    model.opt.timestep = 1e-3 * step
    swing, spent = [], 0.0
    while data.time < scene.seconds - 1e-9:
        start = time.process_time()
        mujoco.mj_step(model, data)
        spent += time.process_time() - start
        # The positions of the vertices are those before the step.
        mujoco.mj_kinematics(model, data)
        mujoco.mj_flex(model, data)
        swing.append((data.time, moved()))
    kinds = mujoco.mjtWarning
    diverged = any(data.warning[kind].number for kind in (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC))
    # The place of rest does not depend on the step, which damps nearly at once when it is long.
    model, data = box(scene, counts, poisson, "direct")
    model.opt.timestep = 0.02
    for _ in range(150):
        mujoco.mj_step(model, data)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_flex(model, data)
    rest = moved()
    found = {
        "engine": "MuJoCo flex",
        "version": mujoco.__version__,
        "setting": f"quadratic cells, nu {poisson:.3g}, {solve}, {step:g} ms",
        "mesh": f"{cells} cells",
    }
    if diverged or not np.isfinite(rest).all():
        return {**found, "failed": "diverges"}
    return {**found, "rest": rest, "swing": swing, "seconds": spent / scene.seconds}


if __name__ == "__main__":
    mujoco.set_mju_user_warning(lambda _: None)
    warnings.filterwarnings("ignore", message="flex 'b' is not rigid")
    scene = SCENES[sys.argv[1]]
    settings = SETTINGS[scene.name][: 1 if "--quick" in sys.argv else None]
    found = [row(scene, setting) for setting in settings]
    Path(sys.argv[2]).write_text(json.dumps(found))
