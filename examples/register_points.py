#!/usr/bin/env python3
"""How well a lobe follows 6, 10 and 20 tracked points of its surface, in three states of a truth that is another model (lobe_truth.py), next to
a rigid fit and a thin-plate spline of the same points; and with 2 of 20 points wrong by 15 mm, and what their gaps tell.

    python3 register_points.py [--seeds 5]

Points are far from each other, seen with an error of 0.5 mm an axis; targets are deeper than 6 mm. Needs numpy and scipy.
"""

import argparse
import pathlib

import numpy as np
import supple
from lobe_truth import STATES, error, spread, truth
from scipy.interpolate import RBFInterpolator
from scipy.spatial import cKDTree

ERROR, WRONG, STIFFNESS = 0.0005, 0.015, 1000.0  # m an axis, m, N/m


def errors_of(body, moved, count, wrong, seed):
    """Errors of a rigid fit, a spline and the model; the least gap of a wrong point and the largest of another, mm."""
    random, mesh = np.random.default_rng(seed), body.scene.mesh
    surface = mesh.points[np.unique(mesh.boundary())].astype(float)
    inside = np.einsum("nc,ncx->nx", random.dirichlet(np.ones(4), 3000), mesh.points[random.choice(mesh.tets, 3000)])
    targets = inside[cKDTree(surface).query(inside)[0] > 0.006][:300]
    true, followed = moved.locate(targets).positions, body.locate(targets)
    at = surface[spread(surface, int(random.integers(len(surface))), count)]
    seen = moved.locate(at).positions + random.normal(0.0, ERROR, at.shape)
    bad = random.choice(count, wrong, replace=False)
    away = random.normal(size=(wrong, 3))
    seen[bad] += WRONG * away / np.linalg.norm(away, axis=1, keepdims=True)

    rigid = supple.rigid_fit(at, seen)
    spline = RBFInterpolator(at, seen - at, kernel="linear", degree=1)  # that of thin plates in three dimensions
    pulls = body.pull(at, seen, stiffness=STIFFNESS)
    body.set_displacements(rigid(mesh.points) - mesh.points)
    body.settle(1e-4)
    gaps = 1e3 * np.linalg.norm(pulls.gaps, axis=1)
    pulls.release()
    errors = [error(each, true) for each in (rigid(targets), targets + spline(targets), followed.positions)]
    return [*errors, gaps[bad].min(initial=np.inf), np.delete(gaps, bad).max()]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--mesh", default=pathlib.Path(__file__).parents[1] / "meshes" / "lobe.msh")
    parser.add_argument("--seeds", type=int, default=5, help="runs of each, with other points, errors and targets")
    asked = parser.parse_args()
    mesh = supple.Mesh.read(asked.mesh)
    material = supple.Material.from_moduli(young=3000.0, poisson=0.45, density=1060.0)
    body = supple.Simulation(supple.Scene(mesh, material, element="nodal-strain"), damping=20.0)
    for state in STATES:
        moved = truth(mesh, state)
        for count, wrong in ((6, 0), (10, 0), (20, 0), (20, 2)):
            runs = np.array([errors_of(body, moved, count, wrong, seed) for seed in range(asked.seeds)])
            rigid, spline, model = runs[:, :3].mean(axis=0)
            print(f"  {count:2} points, {wrong} wrong: rigid {rigid:.2f}, thin-plate spline {spline:.2f}, supple {model:.2f} mm", end="")
            told = f"; in {(runs[:, 3] > runs[:, 4]).sum()} of {len(runs)} runs both have the largest gaps" if wrong else ""
            print(told)


if __name__ == "__main__":
    main()
