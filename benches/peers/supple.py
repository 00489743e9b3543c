"""supple: `python3 supple.py a|b OUT.json PROGRAM [--quick]`; PROGRAM is the command, built in release.

Tetrahedra with nodal strain; exact steps, and long ones of so many times the critical step. Time is the processor time of the command for the whole run less
that of the same command for a step or two, so that start, preparation and files are left out, as they are with the others. Long steps have their guard.
"""

import csv
import json
import resource
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path

from scenes import SCENES, grid

# Cells, and nu where it is not that of the scene: 0.45 in place of 0.499 is what MuJoCo and rapier3d are given as well.
BODIES = {
    "a": [("6x2x2", None), ("13x4x4", None), ("20x6x6", None), ("26x8x8", None), ("13x4x4", 0.45), ("20x6x6", 0.45), ("26x8x8", 0.45)],
    "b": [("6x4x4", None), ("8x6x4", None), ("11x8x6", None), ("15x12x10", None)],
}
METHODS = ["exact", "10x", "20x", "50x", "100x"]
QUICK = {"a": [(("13x4x4", None), "20x")], "b": [(("8x6x4", None), "exact"), (("8x6x4", None), "20x")]}
FRAMES = 100
# The least time of so many runs is taken: of those below 0.1 s, of those below 1 s, of longer ones.
ROUNDS = [(0.1, 15), (1.0, 5), (float("inf"), 2)]
# Below so many seconds of steps the time is that which passes in them, the least of the runs, as the command says it.
SHORT = 0.05


def spent():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def run(program, scene, body, step, end, frames, settle=False):
    """Processor seconds, the summary (or what went wrong), and how far the points have moved at the frames."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "scene.toml")
        points = "".join(f'[[point]]\nname = "p{number}"\nat = {list(point)}\n' for number, point in enumerate(scene.points()))
        how = 'method = "exact"' if step == "exact" else f'method = "long"\nstep = {step}'
        cells, poisson = body
        bulk = 2 * scene.shear * (1 + poisson) / (3 * (1 - 2 * poisson)) if poisson else scene.bulk
        file.write_text(
            f"""gravity = [0.0, 0.0, {-scene.gravity}]
damping = {scene.damping}
[mesh]
shape = "bar"
size = {list(scene.size)}
cells = {list(map(int, cells.split("x")))}
element = "nodal-strain"
[material]
law = "neo-hookean"
c = {scene.shear / 2}
d = {bulk / 2}
density = {scene.density}
[[fix]]
plane = {{ axis = "x", at = 0.0 }}
{points}[time]
{how}
end = {end}
frames = {frames}
{"settle = 3e-6" if settle else ""}
"""
        )
        before = spent()
        done = subprocess.run([program, "simulate", file, "--out", Path(folder, "out")], capture_output=True, text=True, check=False)
        took = spent() - before
        if done.returncode:
            return None, (done.stderr.strip().splitlines() or ["fails"])[-1], None
        with open(Path(folder, "out", "points.csv"), newline="") as rows:
            frames = {}
            for line in csv.DictReader(rows):
                frames.setdefault(float(line["time_s"]), []).append([float(line[name]) for name in ("x_m", "y_m", "z_m")])
        moved = [[[a - b for a, b in zip(p, q)] for p, q in zip(places, scene.points())] for places in frames.values()]
        summary = json.loads(Path(folder, "out", "summary.json").read_text())
        return took, summary, list(zip(frames, moved))


@cache
def rest(program, scene, body):
    """That of exact steps, which long ones reach to 0.4 % (docs/accuracy.md)."""
    _, _, moved = run(program, scene, body, "exact", 1e-4, 1, settle=True)
    return moved[0][1]


def row(scene, body, method, program):
    _, tetrahedra = grid(scene.size, tuple(map(int, body[0].split("x"))))
    found = {
        "engine": "supple",
        "version": "this one",
        "setting": f"nu {body[1] or scene.poisson:.3g}, " + ("exact" if method == "exact" else f"long {method}"),
        "mesh": f"{len(tetrahedra)} tetrahedra",
    }
    _, summary, swing = run(program, scene, body, "exact" if method == "exact" else f'"{method}"', scene.seconds, FRAMES)
    if swing is None:
        return {**found, "failed": summary}
    # Steps as long as those of the run with frames.
    step = summary["step_longest_s"]
    how, short = "exact" if method == "exact" else step, 1.01 * step
    whole, start, elapsed = [], [], []
    while not whole or len(whole) < next(rounds for most, rounds in ROUNDS if min(whole) < most):
        took, all_steps, _ = run(program, scene, body, how, scene.seconds, 1)
        whole.append(took)
        elapsed.append(all_steps["time_s"] / all_steps["real_time_factor"])
        took, few_steps, _ = run(program, scene, body, how, short, 1)
        start.append(took)
    all_steps, few_steps = all_steps["steps"], few_steps["steps"]
    took = (min(whole) - min(start)) * all_steps / (all_steps - few_steps)
    # The difference of two short runs is uncertain by a millisecond.
    if min(elapsed) < SHORT:
        took = min(elapsed)
    return {**found, "rest": rest(program, scene, body), "swing": swing[1:], "seconds": took / scene.seconds}


if __name__ == "__main__":
    scene = SCENES[sys.argv[1]]
    settings = QUICK[scene.name] if "--quick" in sys.argv else [(body, method) for body in BODIES[scene.name] for method in METHODS]
    found = [row(scene, *setting, sys.argv[3]) for setting in settings]
    Path(sys.argv[2]).write_text(json.dumps(found))
