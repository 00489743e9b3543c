"""The filmed silicone beam, for personalise_beam.py and beam_swing.py: its recordings and its scene.

The recordings `gravity-a.csv`, `gravity-b.csv`, `load-52g-a.csv`, `load-52g-b.csv` (motion capture of the Soft Robotics Lab, ETH Zurich,
srl-ethz/diffPD_sim2real) have time_s, and for each marker its place in m. The beam, 30 x 30 x 100 mm, is clamped at x = -0.1 m there and
at x = 0 in the mesh.
"""

import csv

MARKERS = ("top", "left", "right")
POISSON = 0.499


def recording(path):
    """Times (s), and for each marker its place at the start in the mesh and its displacements from there, m."""
    with open(path, newline="") as file:
        rows = [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]
    markers = {}
    for marker in MARKERS:
        columns = [f"{marker}_{axis}_m" for axis in "xyz"]
        x, y, z = place = [rows[0][column] for column in columns]
        markers[marker] = ([x + 0.1, y, z], [[row[column] - start for column, start in zip(columns, place)] for row in rows])
    return [row["time_s"] for row in rows], markers


def at_end(times, displacements):
    """The mean displacement of the last half second, m."""
    late = [moved for time, moved in zip(times, displacements) if time >= times[-1] - 0.5]
    return [sum(axis) / len(late) for axis in zip(*late)]


def scene(element, cells, young, more=""):
    """A scene file of the beam under gravity, up to its material, which `more` ends, and its support."""
    c, d = young / (4 * (1 + POISSON)), young / (6 * (1 - 2 * POISSON))
    return f"""gravity = [0.0, 0.0, -9.80709]
[mesh]
shape = "bar"
size = [0.1, 0.03, 0.03]
cells = {list(cells)}
element = "{element}"
[material]
law = "neo-hookean"
c = {c!r}
d = {d!r}
density = 1070.0
{more}[[fix]]
plane = {{ axis = "x", at = 0.0 }}
"""


def on_upper_edge(cells, whole, entry):
    """Entries of a scene file for the upper edge of the free end, where each node has half of the way to its neighbours: `entry` gives
    one of its share of `whole`."""
    share, inner, width = whole / cells[1], 0.01 / cells[1], 0.03
    text = ""
    for low, high, part in ((inner, width - inner, share), (0.0, 0.0, share / 2), (width, width, share / 2)):
        head, value = entry(part)
        text += f"{head}\nbox = {{ min = [0.1, {low}, 0.03], max = [0.1, {high}, 0.03] }}\n{value}\n"
    return text
