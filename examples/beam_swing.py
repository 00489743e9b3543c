"""What a silicone beam is made of, from films of its swing: Young's modulus, one or two terms of relaxation, damping.

    python3 examples/beam_swing.py DATA [--terms 2] [--out out/swing] [--supple target/release/supple]

DATA is the folder of examples/personalise_beam.py. The constants are fitted on the first film of each load, the markers' heights over
time, and shown on all four. The films' clock knows the release to 20 ms only: the start of each film is fitted with them, and for the other
two films afterwards, with the constants held. Lowest points are those of a parabola through three frames, rest is the mean of the last half
second. Docs: docs/personalisation.md. Needs nothing but Python 3.9.
"""

import argparse
import json
import pathlib
import subprocess

from beam import MARKERS, at_end, on_upper_edge, recording, scene

FILMS = {"gravity-a": 0.3, "gravity-b": 0.3, "load-52g-a": 0.58, "load-52g-b": 0.58}  # s that are fitted: two swings
FITTED = ("gravity-a", "load-52g-a")
WEIGHT = 0.052015  # kg
CELLS = (13, 4, 4)
ELEMENT = "nodal-strain"
REST = 2.0  # s after which the film's end is said to be at rest


def film(path):
    """Times (s), and for each marker its place at the start and its displacement up (m) at these."""
    times, markers = recording(path)
    return times, {marker: (place, [up for _, _, up in moved]) for marker, (place, moved) in markers.items()}


def write_measured(path, times, markers, end):
    lines = ["name,time_s,x_m,y_m,z_m,ux_m,uy_m,uz_m"]
    for marker, ((x, y, z), up) in markers.items():
        for time, metre in zip(times, up):
            if 0.0 < time <= end:
                lines.append(f"{marker},{time:.2f},{x:.6f},{y:.6f},{z:.6f},,,{metre:.6f}")
        (rest,) = at_end(times, [[metre] for metre in up])
        lines.append(f"{marker},{REST},{x:.6f},{y:.6f},{z:.6f},,,{rest:.6f}")
    path.write_text("\n".join(lines) + "\n")


def write_scene(path, name, young, terms, damping):
    series = ", ".join(f"[{share!r}, {seconds!r}]" for share, seconds in terms)
    text = f"damping = {damping!r}\n" + scene(ELEMENT, CELLS, young, f"prony = [{series}]\n" if terms else "")
    if name.startswith("load"):
        text += on_upper_edge(CELLS, WEIGHT, lambda kilogram: ("[[mass]]", f"kilogram = {kilogram!r}"))
    path.write_text(text + f"[time]\nend = {REST}\n")


def parameter(name, start, least, most, scene=None):
    text = f'[[parameter]]\nname = "{name}"\nstart = {start!r}\nmin = {least!r}\nmax = {most!r}\n'
    return text + (f'scene = "{scene}"\n' if scene else "")


def fit(folder, names, parameters, supple):
    text = "".join(parameters) + "".join(parameter("clock", 0.01, -0.02, 0.03, f"{name}.toml") for name in names)
    text += "".join(f'[[case]]\nscene = "{name}.toml"\nmeasured = "{name}.csv"\n' for name in names)
    (folder / "fit.toml").write_text(text)
    run = subprocess.run([supple, "fit", folder / "fit.toml", "--out", folder / "fit.json"], capture_output=True, text=True)
    if run.returncode:
        raise SystemExit(run.stderr)
    return json.loads((folder / "fit.json").read_text())


def lowest(times, heights):
    """Of the first swing, by a parabola."""
    index = min(range(1, len(heights) - 1), key=heights.__getitem__)
    a, b, c = heights[index - 1 : index + 2]
    return b - (c - a) ** 2 / (8 * (a - 2 * b + c))


def compared(case, end):
    """Shares (%) by which rest and lowest point are off, means of the markers, and the root mean square of the curves, mm."""
    rest, low, squares = [], [], []
    for marker in MARKERS:
        points = [point for point in case["points"] if point["name"] == marker]
        swing = [point for point in points if point["time_s"] <= end]
        times = [point["time_s"] for point in swing]
        simulated, measured = ([point[key][2] for point in swing] for key in ("simulated_m", "measured_m"))
        low.append(100 * (lowest(times, simulated) / lowest(times, measured) - 1))
        squares += [(here - there) ** 2 for here, there in zip(simulated, measured)]
        rest += [100 * (point["simulated_m"][2] / point["measured_m"][2] - 1) for point in points if point["time_s"] > end]
    return sum(rest) / len(rest), sum(low) / len(low), 1e3 * (sum(squares) / len(squares)) ** 0.5


def apart(one, other):
    """The least root mean square distance of the left marker's curves of two films of a load, either clock shifted, mm."""
    (times, first), (_, second) = one, other
    first, second = first["left"][1], second["left"][1]
    count, most = sum(time <= 0.58 for time in times), 4
    best = []
    for shift in range(-most * 10, most * 10 + 1):
        total = 0.0
        for index in range(most, count):
            place, part = divmod(index * 10 + shift, 10)
            here = second[place] + part / 10 * (second[place + 1] - second[place])
            total += (first[index] - here) ** 2
        best.append(1e3 * (total / (count - most)) ** 0.5)
    return min(best)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=pathlib.Path, help="folder with the films")
    parser.add_argument("--terms", type=int, nargs="*", default=[0, 1, 2], help="numbers of terms to be fitted")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("out/swing"), help="folder for scenes and results")
    parser.add_argument("--supple", default="target/release/supple", help="the command")
    asked = parser.parse_args()
    films = {name: film(asked.data / f"{name}.csv") for name in FILMS}
    for load in ("gravity", "load-52g"):
        print(f"{load}: the two films are {apart(films[f'{load}-a'], films[f'{load}-b']):.2f} mm apart")
    for count in asked.terms:
        folder = asked.out / f"{count}-terms"
        folder.mkdir(parents=True, exist_ok=True)
        start = [(0.15, 0.008), (0.12, 0.3)][2 - count :] if count else []
        for name, end in FILMS.items():
            write_measured(folder / f"{name}.csv", *films[name], end)
            write_scene(folder / f"{name}.toml", name, 3e5, start, 6.0)
        parameters = [parameter("material.young", 3e5, 1e5, 1e6), parameter("damping", 6.0, 0.0, 30.0)]
        for term, (share, seconds) in enumerate(start):
            parameters.append(parameter(f"material.prony[{term}][0]", share, 0.001, 0.45))
            parameters.append(parameter(f"material.prony[{term}][1]", seconds, 0.001, 3.0))
        found = fit(folder, FITTED, parameters, asked.supple)
        print(f"\n{count} terms, fitted on {' and '.join(FITTED)}, {found['simulations']} simulations:")
        for value in found["parameters"]:
            print(f"- {value['name']}: {value['value']:.5g}, standard error {value['standard_error'] or float('nan'):.2g}")
        values = [value["value"] for value in found["parameters"]]
        cases = dict(zip(FITTED, found["cases"]))
        others = [name for name in FILMS if name not in FITTED]
        terms = list(zip(values[2 : 2 + 2 * count : 2], values[3 : 3 + 2 * count : 2]))
        for name in others:
            write_scene(folder / f"{name}.toml", name, values[0], terms, values[1])
        cases.update(zip(others, fit(folder, others, [], asked.supple)["cases"]))
        print("\n| film | | rest, % | lowest point, % | curve, mm rms |\n|---|---|---|---|---|")
        for name, end in FILMS.items():
            rest, low, curve = compared(cases[name], end)
            print(f"| {name} | {'fitted' if name in FITTED else ''} | {rest:+.1f} | {low:+.1f} | {curve:.2f} |")


if __name__ == "__main__":
    main()
