"""rapier3d's soft bodies: `python3 rapier.py a|b OUT.json PROGRAM [--quick]`; PROGRAM is `rapier/`, built in release.

Linear tetrahedra of stable neo-Hookean law or corotated, damping of the scene, no colliders, no sleep. Its steps are of 1/60 s with four substeps unless
told otherwise. It is given the scene in cm, as in 32 bits it gives cells below 1.2e-7 cubic units no stiffness.
- constraints: rows for each cell, swept Gauss-Seidel; "sweeps" are the additional ones that a soft body may ask for (3 are the default).
- FEM: implicit Euler, conjugate gradients up to a number of iterations (20 are the default).
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

from scenes import SCENES, grid, masses, nearest

# Cells, nu (none: the scene's), solver, law, substeps of 1/60 s, sweeps, iterations of conjugate gradients.
SETTINGS = {
    "a": [
        ("13x4x4", None, "fem", "neo-hookean", 4, 3, 1000),
        ("13x4x4", 0.45, "fem", "neo-hookean", 4, 3, 1000),
        ("13x4x4", None, "constraints", "neo-hookean", 4, 3, 0),
        ("13x4x4", None, "constraints", "neo-hookean", 32, 3, 0),
        ("13x4x4", 0.45, "constraints", "neo-hookean", 4, 3, 0),
        ("13x4x4", 0.45, "constraints", "neo-hookean", 16, 3, 0),
        ("20x6x6", 0.45, "fem", "neo-hookean", 4, 3, 1000),
        ("13x4x4", None, "constraints", "corotational", 4, 3, 0),
    ],
    "b": [
        ("8x6x4", None, "constraints", "neo-hookean", 4, 3, 0),
        ("8x6x4", None, "constraints", "neo-hookean", 4, 30, 0),
        ("8x6x4", None, "constraints", "neo-hookean", 16, 3, 0),
        ("15x12x10", None, "constraints", "neo-hookean", 4, 3, 0),
        ("8x6x4", None, "fem", "neo-hookean", 4, 3, 100),
        ("15x12x10", None, "fem", "neo-hookean", 4, 3, 100),
    ],
}


def version():
    lock = (Path(__file__).parent / "rapier/Cargo.toml").read_text()
    return lock.split('rapier3d = { version = "=')[1].split('"')[0]


def row(scene, setting, program):
    cells, poisson, solver, law, substeps, sweeps, iterations = setting
    nodes, tetrahedra = grid(scene.size, tuple(map(int, cells.split("x"))))
    points = nearest(nodes, scene.points())
    nu = poisson or scene.poisson
    with tempfile.NamedTemporaryFile("w", suffix=".txt") as mesh:
        for node, mass in zip(nodes, masses(scene, nodes, tetrahedra)):
            mesh.write(f"{node[0]!r} {node[1]!r} {node[2]!r} {mass!r}\n")
        mesh.write("\n" + "".join(" ".join(map(str, tetrahedron)) + "\n" for tetrahedron in tetrahedra))
        mesh.flush()
        numbers = [2 * scene.shear * (1 + nu), nu, scene.damping, scene.gravity]
        ends = [1 / 60, substeps, sweeps, iterations, scene.seconds, scene.seconds + 12 / scene.damping]
        words = [program, mesh.name, *numbers, solver, law, *ends, *points]
        lines = subprocess.run(list(map(str, words)), check=True, capture_output=True, text=True).stdout.splitlines()
    found = {
        "engine": f"rapier3d {'FEM' if solver == 'fem' else solver}",
        "version": version(),
        "setting": f"{law}, nu {nu:.3g}, 1/60 s x {substeps}, {f'CG {iterations}' if solver == 'fem' else f'{sweeps} sweeps'}",
        "mesh": f"{len(tetrahedra)} tetrahedra",
    }
    stopped = lines[0] == "stopped"
    if stopped:
        lines = lines[1:]
    swing = []
    for line in lines[1:]:
        time, *places = map(float, line.split())
        swing.append((time, [[places[3 * at + axis] - nodes[point][axis] for axis in range(3)] for at, point in enumerate(points)]))
    rest = swing[-1][1]
    far = max(abs(x) for displacement in rest for x in displacement)
    if not far < 10 * scene.size[0]:
        return {**found, "failed": "diverges"}
    if stopped:
        return {**found, "failed": f"given up at {swing[-1][0]:.2f} s"}
    return {**found, "rest": rest, "swing": [s for s in swing if s[0] <= scene.seconds + 1e-6], "seconds": float(lines[0])}


if __name__ == "__main__":
    scene = SCENES[sys.argv[1]]
    settings = SETTINGS[scene.name][: 1 if "--quick" in sys.argv else None]
    found = [row(scene, setting, sys.argv[3]) for setting in settings]
    Path(sys.argv[2]).write_text(json.dumps(found))
