"""Training data of random organs, over the processes of this machine or the machines of a Dask cluster, restartable:

    python3 examples/random_organs.py FOLDER --organs 1000
    python3 examples/random_organs.py FOLDER --organs 1000 --scheduler tcp://HOST:8786

Each organ is a bent ellipsoid of its own size, stiffness and Poisson's ratio, held at one side and pulled at the other by a force that
rises and falls, with exact steps. `FOLDER/organ-00017.npz` then holds, for each frame, what a learned step sees and must say
(Meister et al. 2018, section 2), in the axes of the organ:

    points (n, 3) m, tets (m, 4), mass (n,) kg, step D s, time (f,) s
    displacement, velocity, force (f, n, 3): u m, (u(t) - u(t-D)) / D m/s, load less what the elements resist N
    acceleration (f, n, 3): (u(t+D) - 2 u(t) + u(t-D)) / D^2 m/s^2

A file appears whole or not at all; organs whose file is there are not computed again. Organ N is the same on every machine. Needs
`supple` and `dask[distributed]`.
"""

import argparse
import os
import pathlib
import tempfile

import numpy as np
import supple
from dask.distributed import Client, LocalCluster, as_completed

FRAMES, END = 100, 0.5  # s
MULTIPLE = 10  # D over the exact step


def random_organ(seed):
    """A mesh, its material, which nodes are held and which pulled, and the force, N."""
    random = np.random.default_rng(seed)
    box = supple.Mesh.box([2.0, 2.0, 2.0], [8, 8, 8])
    cube = box.points.astype(float) - 1.0
    x, y, z = cube.T
    ball = np.column_stack([
        x * np.sqrt(1 - y**2 / 2 - z**2 / 2 + y**2 * z**2 / 3),
        y * np.sqrt(1 - z**2 / 2 - x**2 / 2 + z**2 * x**2 / 3),
        z * np.sqrt(1 - x**2 / 2 - y**2 / 2 + x**2 * y**2 / 3),
    ])
    half = random.uniform([0.04, 0.025, 0.02], [0.07, 0.04, 0.03])  # m
    points = ball * half
    points[:, 2] += random.uniform(-0.15, 0.15) * points[:, 0] ** 2 / half[0]
    mesh = supple.Mesh(points, box.tets)
    material = supple.Material.from_moduli(random.uniform(2e3, 1e4), random.uniform(0.40, 0.47), density=1060.0)
    held, pulled = ball[:, 0] < -0.75, ball[:, 0] > 0.9
    direction = random.normal(size=3)
    return mesh, material, held, pulled, random.uniform(0.05, 0.2) * direction / np.linalg.norm(direction)


def motion(seed):
    """The arrays of an organ."""
    mesh, material, held, pulled, newton = random_organ(seed)
    scene = supple.Scene(mesh, material, fixed=held)
    step = 0.5 * supple.Simulation(scene).critical_step
    simulation = supple.Simulation(scene, step=step, damping=20.0)
    every, long = max(MULTIPLE, round(END / FRAMES / step)), MULTIPLE * step
    rows = []
    for frame in range(FRAMES):
        share = np.sin(np.pi * frame / FRAMES)
        simulation.set_forces(pulled, share * newton / pulled.sum())
        simulation.take(every)
        saved = simulation.save()
        shapes = [simulation.displacements.astype(np.float64)]
        # The moment itself, D later, and 2 D later; the middle one is the sample.
        for _ in range(2):
            simulation.take(MULTIPLE)
            shapes.append(simulation.displacements.astype(np.float64))
            if len(shapes) == 2:
                time, force = simulation.time, simulation.forces.copy()
        before, now, after = shapes
        rows.append((time, now, (now - before) / long, force, (after - 2.0 * now + before) / long**2))
        simulation.restore(saved)
    times, *fields = (np.array(column) for column in zip(*rows))
    mass = np.zeros(len(mesh.points))
    np.add.at(mass, mesh.tets, material.density * mesh.volumes[:, None] / 4.0)
    names = ("displacement", "velocity", "force", "acceleration")
    arrays = {name: field.astype(np.float32) for name, field in zip(names, fields)}
    return {"points": mesh.points, "tets": mesh.tets, "mass": mass, "step": long, "time": times, **arrays}


def path_of(folder, seed):
    return pathlib.Path(folder) / f"organ-{seed:05}.npz"


def compute(folder, seed):
    """Writes the file of an organ, whole or not at all. Gives the largest displacement, m."""
    arrays = motion(seed)
    handle, partial = tempfile.mkstemp(dir=folder, prefix=".organ-", suffix=".tmp")
    try:
        with os.fdopen(handle, "wb") as file:
            np.savez_compressed(file, **arrays)
            file.flush()
            os.fsync(file.fileno())
        os.replace(partial, path_of(folder, seed))
    except BaseException:
        os.unlink(partial)
        raise
    return seed, float(np.linalg.norm(arrays["displacement"], axis=2).max())


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--organs", type=int, default=1000)
    parser.add_argument("--scheduler", help="of a Dask cluster, whose machines see the folder; else processes of this machine")
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes of this machine")
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    for partial in asked.folder.glob(".organ-*.tmp"):
        partial.unlink()  # of a run that was killed
    left = [seed for seed in range(asked.organs) if not path_of(asked.folder, seed).exists()]
    print(f"{asked.organs - len(left)} of {asked.organs} organs are there", flush=True)
    if not left:
        return
    cluster = asked.scheduler or LocalCluster(n_workers=asked.workers, threads_per_worker=1, dashboard_address=None)
    with Client(cluster) as client:
        folder = str(asked.folder.resolve())
        for done in as_completed([client.submit(compute, folder, seed, retries=2) for seed in left]):
            seed, moved = done.result()
            print(f"organ {seed}: moved by {1e3 * moved:.1f} mm", flush=True)
    if not asked.scheduler:
        cluster.close()


if __name__ == "__main__":
    main()
