"""Young's modulus of a filmed silicone beam from its shape at rest under two loads, and how well it predicts.

    python3 examples/personalise_beam.py DATA [--out out/beam] [--supple target/release/supple]

DATA is the folder with the recordings `gravity-a.csv`, `gravity-b.csv`, `load-52g-a.csv`, `load-52g-b.csv` (motion capture of the Soft
Robotics Lab, ETH Zurich, srl-ethz/diffPD_sim2real): time_s, and for each marker its place in m. The beam, 30 x 30 x 100 mm, is clamped at
x = -0.1 m there and at x = 0 in the mesh. Displacements are those from the first frame to the mean of the last half second.

Each fit is a folder of OUT with scene files, measured points and `fit.toml`, and is made by `supple fit`. The table tells, for each
element and mesh, what was fitted, on what, and how far the markers are from where they were measured, also under the load that the fit did
not know. A marker is measured along the beam and upwards: both loads are vertical, and what it
moves across (up to 0.9 mm in one recording, 0.3 mm in the others) no model of a straight beam can have. Docs: docs/personalisation.md. Needs nothing but Python 3.9.
"""

import argparse
import json
import pathlib
import subprocess

from beam import at_end, on_upper_edge, recording, scene

LOADS = {"gravity": ("gravity-a", "gravity-b"), "52g": ("load-52g-a", "load-52g-b")}
WEIGHT = 0.51012  # N
# Cells along, across and up.
MESHES = {"1,248": (13, 4, 4), "4,320": (20, 6, 6)}
START = 100e3  # Pa


def at_rest(path):
    """Place at the start and displacement at rest (m) of each marker."""
    times, markers = recording(path)
    return {marker: (place, at_end(times, moved)) for marker, (place, moved) in markers.items()}


def write_points(path, data, recordings):
    lines = ["name,x_m,y_m,z_m,ux_m,uy_m,uz_m"]
    for recording in recordings:
        for marker, (place, moved) in at_rest(data / f"{recording}.csv").items():
            x, _, z = moved
            lines.append(",".join([f"{recording} {marker}", *(f"{value:.6f}" for value in place), f"{x:.6f}", "", f"{z:.6f}"]))
    path.write_text("\n".join(lines) + "\n")


def write_scene(path, element, cells, load):
    text = scene(element, cells, START)
    if load == "52g":
        text += on_upper_edge(cells, -WEIGHT, lambda newton: ("[[force]]", f"newton = [0.0, 0.0, {newton}]"))
    path.write_text(text + "[time]\nend = 1.0\n")


def fit(folder, data, element, cells, on, supple, nu=False):
    """The result of a fit on some of the loads; the others are predicted."""
    folder.mkdir(parents=True, exist_ok=True)
    text = f'[[parameter]]\nname = "material.young"\nstart = {START}\nmin = 2e4\nmax = 2e6\n'
    if nu:
        text += '[[parameter]]\nname = "material.poisson"\nstart = 0.48\nmin = 0.3\nmax = 0.4995\n'
    for load, recordings in LOADS.items():
        write_scene(folder / f"{load}.toml", element, cells, load)
        write_points(folder / f"{load}.csv", data, recordings)
        text += f'[[case]]\nscene = "{load}.toml"\nmeasured = "{load}.csv"\n'
        if load not in on:
            text += "left_out = true\n"
    (folder / "fit.toml").write_text(text)
    run = subprocess.run([supple, "fit", folder / "fit.toml", "--out", folder / "fit.json"], capture_output=True, text=True)
    if run.returncode:
        raise SystemExit(run.stderr)
    return json.loads((folder / "fit.json").read_text())


def mm(distances):
    return "-" if distances is None else f"{1e3 * distances['rms_m']:.2f} / {1e3 * distances['worst_m']:.2f}"


def worst_of_means(case):
    """The worst marker, mm, in the mean of the recordings."""
    squares = {}
    for axis in (0, 2):
        of_markers = {}
        for point in case["points"]:
            apart = point["simulated_m"][axis] - point["measured_m"][axis]
            of_markers.setdefault(point["name"].split()[-1], []).append(apart)
        for marker, apart in of_markers.items():
            squares[marker] = squares.get(marker, 0.0) + (sum(apart) / len(apart)) ** 2
    return 1e3 * max(squares.values()) ** 0.5


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("data", type=pathlib.Path, help="folder with the recordings")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("out/beam"), help="folder for scenes and results")
    parser.add_argument("--supple", default="target/release/supple", help="the command")
    asked = parser.parse_args()
    print("| element | tetrahedra | fitted on | E, kPa | standard error | gravity, mm: rms / worst | 52 g, mm: rms / worst |", end="")
    print(" load not fitted, mm: worst / worst in the mean of its recordings | simulations |")
    print("|---|---|---|---|---|---|---|---|---|")
    for element in ("nodal-strain", "nodal-pressure"):
        for tetrahedra, cells in MESHES.items():
            for on in (("gravity", "52g"), ("gravity",), ("52g",)):
                name = f"{element}-{tetrahedra.replace(',', '')}-{'-'.join(on)}"
                found = fit(asked.out / name, asked.data, element, cells, on, asked.supple)
                young, of_loads = found["parameters"][0], [mm(case["distances"]) for case in found["cases"]]
                out = found["left_out"]
                predicted = [case for load, case in zip(LOADS, found["cases"]) if load not in on]
                worst = f"{1e3 * out['worst_m']:.2f} / {worst_of_means(predicted[0]):.2f}" if predicted else "-"
                cells_of_table = [element, tetrahedra, " and ".join(on), f"{young['value'] / 1e3:.1f}", f"{young['standard_error'] / 1e3:.1f}"]
                print("|", " | ".join([*cells_of_table, *of_loads, worst, str(found["simulations"])]), "|", flush=True)
    found = fit(asked.out / "poisson", asked.data, "nodal-strain", MESHES["1,248"], tuple(LOADS), asked.supple, nu=True)
    print("\nE and nu together (nodal strain, 1,248 tetrahedra):")
    for parameter in found["parameters"]:
        print(f"- {parameter['name']}: {parameter['value']:.6g}, standard error {parameter['standard_error'] or float('nan'):.3g}")
    for sentence in found["cannot_tell"]:
        print(f"- {sentence}")


if __name__ == "__main__":
    main()
