#!/usr/bin/env python3
"""Registration from points of a part of the surface, which no one has paired with points of the CT: as a camera or a swept probe gives them.

    python3 register_surface.py [--seeds 5] [--state retracted] [--part 0.06]

Each of the points draws the nearest point of the model's surface, along its normal, so that it slides; then the nearest points are looked for
again. With 3 or 6 points that are paired, as landmarks are, it is much better. The truth is another model (lobe_truth.py), targets are deeper
than 6 mm, points are seen with an error of 0.5 mm an axis. Needs numpy and scipy.
"""

import argparse
import pathlib

import numpy as np
import supple
from lobe_truth import STATES, error, truth
from scipy.cluster.vq import kmeans2
from scipy.spatial import cKDTree

ROUNDS, COUNT, ERROR = 5, 300, 0.0005  # points; m an axis
ALONG, ACROSS, PAIRED = 50.0, 3.0, 1000.0  # N/m a point: along the normal, along all directions, and with a pair
# Points of a triangle.
WEIGHTS = np.array([(i, j, 4 - i - j) for i in range(5) for j in range(5 - i)]) / 4.0


def surface_of(mesh, nodes):
    """Points of the surface, with these places of the nodes, and the normals there, of any length."""
    corners = nodes[mesh.boundary()]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return (WEIGHTS @ corners).reshape(-1, 3), np.repeat(normals, len(WEIGHTS), axis=0)


def follow_surface(body, cloud, begin, pairs=None):
    """Registers a body that is free to a cloud of points (m), from a rigid motion on, and with pairs (points at rest, seen)."""
    mesh = body.scene.mesh
    body.set_displacements(begin(mesh.points) - mesh.points)
    held = body.pull(*pairs, stiffness=PAIRED) if pairs else None
    for _ in range(ROUNDS):
        surface, normals = surface_of(mesh, body.positions)
        nearest = cKDTree(surface).query(cloud)[1]
        at, gaps = surface_of(mesh, mesh.points)[0][nearest], cloud - surface[nearest]
        sliding = [body.pull(at, stiffness=ALONG, along=normals[nearest])]
        if not pairs:  # else it may slide away as a whole
            sliding.append(body.pull(at, stiffness=ACROSS))
        for each in sliding:
            each.move(each.points + gaps)  # its point is the mean of nodes, and not quite that of the surface
        body.settle(1e-4)
        for each in sliding:
            each.release()
    if held:
        held.release()


def rigid_icp(mesh, cloud, begin):
    """What is nearest is paired, again and again, without deformation."""
    at, _ = surface_of(mesh, mesh.points)
    for _ in range(50):
        begin = supple.rigid_fit(at[cKDTree(begin(at)).query(cloud)[1]], cloud)
    return begin


def seen_of(moved, part, random):
    """Points of what is seen from above and from the front, within `part` (m) of the middle, with errors; nodes of that; its share."""
    fine, corners = moved.scene.mesh, moved.scene.mesh.boundary()
    rest, _ = surface_of(fine, fine.points)
    normals = np.cross(*(fine.points[corners[:, n]] - fine.points[corners[:, 0]] for n in (1, 2)))
    areas = 0.5 * np.linalg.norm(normals, axis=1)
    middles = rest.reshape(len(corners), -1, 3).mean(axis=1)
    is_seen = (normals @ [0.0, -0.6, 0.8] > 0.2 * areas) & (np.linalg.norm(middles - [0.01, 0.0, 0.03], axis=1) < part)
    chosen = random.choice(len(corners), COUNT, p=is_seen * areas / areas[is_seen].sum())
    cloud = np.einsum("nc,ncx->nx", random.dirichlet(np.ones(3), COUNT), moved.positions[corners[chosen]])
    return cloud + random.normal(0.0, ERROR, cloud.shape), fine.points[np.unique(corners[is_seen])], areas[is_seen].sum() / areas.sum()


def errors_of(body, moved, part, seed):
    """Errors of all ways to register, and the share of the surface that is seen."""
    random, mesh = np.random.default_rng(seed), body.scene.mesh
    cloud, candidates, share = seen_of(moved, part, random)
    inside = np.einsum("nc,ncx->nx", random.dirichlet(np.ones(4), 6000), mesh.points[random.choice(mesh.tets, 6000)])
    targets = inside[cKDTree(surface_of(mesh, mesh.points)[0]).query(inside)[0] > 0.006][:300]
    true, followed, found = moved.locate(targets).positions, body.locate(targets), {}
    for count in (3, 6):
        centres, _ = kmeans2(candidates.astype(float), count, minit="++", seed=random)
        at = candidates[cKDTree(candidates).query(centres)[1]]
        pairs = at, moved.locate(at).positions + random.normal(0.0, ERROR, at.shape)
        rigid = supple.rigid_fit(*pairs)
        found[f"rigid of {count}"] = error(rigid(targets), true)
        if count == 3:
            found["rigid ICP"] = error(rigid_icp(mesh, cloud, rigid)(targets), true)
            follow_surface(body, cloud, rigid)
            found["surface"] = error(followed.positions, true)
        body.set_displacements(rigid(mesh.points) - mesh.points)
        pulls = body.pull(*pairs, stiffness=PAIRED)
        body.settle(1e-4)
        pulls.release()
        found[f"{count} pairs"] = error(followed.positions, true)
        follow_surface(body, cloud, rigid, pairs)
        found[f"surface and {count} pairs"] = error(followed.positions, true)
    return found, share


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--mesh", default=pathlib.Path(__file__).parents[1] / "meshes" / "lobe.msh")
    parser.add_argument("--state", nargs="+", choices=STATES, default=STATES)
    parser.add_argument("--seeds", type=int, default=1, help="runs of each state, with other points, pairs, errors and targets")
    parser.add_argument("--part", type=float, default=0.06, help="radius of the part of the surface that is seen, m")
    asked = parser.parse_args()
    mesh = supple.Mesh.read(asked.mesh)
    material = supple.Material.from_moduli(young=3000.0, poisson=0.45, density=1060.0)
    body = supple.Simulation(supple.Scene(mesh, material, element="nodal-strain"), damping=20.0)
    for state in asked.state:
        moved = truth(mesh, state)
        runs = [errors_of(body, moved, asked.part, seed) for seed in range(asked.seeds)]
        print(f"{state}, {100 * runs[0][1]:.0f} % of the surface; mean over {asked.seeds} of target registration errors, mm:")
        for name in runs[0][0]:
            each = [found[name] for found, _ in runs]
            print(f"  {name:22} {np.mean(each):.2f} ({min(each):.2f} to {max(each):.2f})")


if __name__ == "__main__":
    main()
