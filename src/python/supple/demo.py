"""The demonstration: a liver lobe under a ball that presses it and slides along it, for a second, in exact and in long steps."""

from __future__ import annotations

import dataclasses
import pathlib
import time

import numpy as np
from numpy.typing import NDArray

from .instruments import Instrument
from .mesh import Mesh
from .scene import Material, Scene
from .simulation import Simulation

FRAME, FRAMES = 1.0 / 60.0, 60
RADIUS = 0.010
# Where the ball is from where it touches the dome (m), at which time (s).
TIMES = (0.0, 0.6, 1.0)
WAY = ((0.0, 0.0, 0.001), (0.0, 0.0, -0.008), (0.006, 0.0, -0.008))
# The picture: pixels a metre, and where the origin and the second body are.
SCALE, LEFT, BOTTOM, APART = 3000.0, 220.0, 250.0, 500.0


@dataclasses.dataclass
class Run:
    method: str
    steps: int
    seconds: float # of this machine
    newton: float # at most
    displacements: NDArray[np.float32]
    status: str
    ball: NDArray[np.float64] # where it is at the end


def run(mesh: Mesh, method: str) -> Run:
    liver = Material("exponential", a=1500.0, b=8.023, d=40_000.0, density=1060.0)
    scene = Scene(mesh, liver, fixed=mesh.points[:, 1] > 0.030)
    simulation = Simulation(scene, method, damping=20.0)
    top = mesh.points[mesh.points[:, 2].argmax()] + [0.0, 0.0, RADIUS]
    way = [top + [np.interp(FRAME * frame, TIMES, axis) for axis in zip(*WAY)] for frame in range(FRAMES + 1)]
    simulation.set_instruments([Instrument.sphere(RADIUS, way[0], friction=0.3)])
    steps, newton, words, start = 0, 0.0, set(), time.perf_counter()
    for ball in way[1:]:
        simulation.move(0, ball, within=FRAME)
        report = simulation.advance(FRAME)
        steps += report.steps
        words.add(report.status)
        newton = max(newton, float(np.linalg.norm(simulation.touch(0).mean_force)))
    seconds = time.perf_counter() - start
    status = ", ".join(sorted(words))
    return Run(method, steps, seconds, newton, simulation.displacements.copy(), status, way[-1])


def picture(mesh: Mesh, runs: list[Run]) -> str:
    """The surfaces that face the eye in front, far ones first, blue where they rest and red where they have moved the most, as SVG."""
    most = max(float(np.linalg.norm(each.displacements, axis=1).max()) for each in runs)
    shapes = []
    for column, each in enumerate(runs):
        moved = mesh.points + each.displacements
        corners = mesh.boundary()
        a, b, c = moved[corners].transpose(1, 0, 2)
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        share = np.linalg.norm(each.displacements, axis=1)[corners].mean(axis=1) / most
        light = 0.6 + 0.4 * normal @ [-0.4, -0.6, 0.7] # from the left, above and in front
        colours = (255 * light[:, None] * np.stack([0.35 + 0.65 * share, 0.55 - 0.3 * share, 0.95 - 0.75 * share], axis=1)).clip(0, 255).astype(int)
        x, y = (LEFT + APART * column + SCALE * moved[:, 0]), (BOTTOM - SCALE * moved[:, 2])
        # The eye looks along y.
        for face in np.argsort(-moved[corners, 1].mean(axis=1)):
            if normal[face, 1] < 0.0:
                points = " ".join(f"{x[node]:.1f},{y[node]:.1f}" for node in corners[face])
                colour = "#{:02x}{:02x}{:02x}".format(*colours[face])
                shapes.append(f'<polygon points="{points}" fill="{colour}" stroke="{colour}"/>')
        ball = (LEFT + APART * column + SCALE * each.ball[0], BOTTOM - SCALE * each.ball[2])
        shapes.append(f'<circle cx="{ball[0]:.1f}" cy="{ball[1]:.1f}" r="{SCALE * RADIUS:.1f}" fill="#999" fill-opacity="0.6"/>')
        shapes.append(f'<text x="{LEFT + APART * column:.0f}" y="{BOTTOM + 50:.0f}" text-anchor="middle">{each.method} steps</text>')
    size = f'width="{APART * len(runs):.0f}" height="{BOTTOM + 70:.0f}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="sans-serif" font-size="20">\n' + "\n".join(shapes) + "\n</svg>\n"


def demo(out: pathlib.Path) -> str:
    """Runs it, writes the picture and gives the table."""
    mesh = Mesh.read(pathlib.Path(__file__).with_name("lobe.msh"))
    runs = [run(mesh, method) for method in ("exact", "long")]
    out.write_text(picture(mesh, runs), encoding="utf-8")
    lines = [f"a liver lobe of {len(mesh.tets)} tetrahedra under a ball, {FRAME * FRAMES:.0f} s",
             "steps    number   ms a step   s   force, N   moved, mm   from exact, mm   status"]
    for each in runs:
        moved = 1e3 * np.linalg.norm(each.displacements, axis=1).max()
        apart = 1e3 * np.linalg.norm(each.displacements - runs[0].displacements, axis=1).mean()
        lines.append(f"{each.method:<6} {each.steps:>8} {1e3 * each.seconds / each.steps:>11.3f} {each.seconds:>5.2f} {each.newton:>8.2f} {moved:>11.1f} {apart:>16.3f}   {each.status}")
    return "\n".join([*lines, f"the picture: {out}"])
