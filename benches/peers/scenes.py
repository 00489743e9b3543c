"""The two scenes that every engine is given, and how far an engine is from the truth. Needs nothing but Python.

Both are boxes, held at x = 0, on which gravity acts along -z from the first moment on. Five points of the free end are followed: its corners
and its centre. Lengths are in m, times in s. An error is a distance to the truth, mean over the points (and over the times of the run), in % of the
mean displacement of the truth.
"""

import json
from itertools import permutations, product
from math import prod
from pathlib import Path

HERE = Path(__file__).resolve().parent


class Scene:
    def __init__(self, name, title, size, shear, bulk, density, gravity, damping, seconds, every):
        self.name, self.title, self.size = name, title, size
        self.shear, self.bulk, self.density = shear, bulk, density
        self.gravity, self.damping, self.seconds = gravity, damping, seconds
        # Between two samples of the truth.
        self.every = every
        self.poisson = (3 * bulk - 2 * shear) / (2 * (3 * bulk + shear))
        self.young = 2 * shear * (1 + self.poisson)

    def points(self):
        _, across, up = self.size
        return [(self.size[0], y, z) for y, z in [(0, 0), (across, 0), (0, up), (across, up), (across / 2, up / 2)]]


YOUNG, POISSON = 263_824.0, 0.499
SCENES = {
    # That of `supple-lab physics --scene silicone-beam`.
    "a": Scene(
        "a", "silicone beam", (0.1, 0.03, 0.03), YOUNG / (2 * (1 + POISSON)), YOUNG / (3 * (1 - 2 * POISSON)), 1070.0, 9.80709, 6.0, 0.3, 0.002
    ),
    # That of `supple-lab cost`, turned so that its held side is x = 0.
    "b": Scene("b", "soft cuboid", (0.15, 0.12, 0.08), 1680.0, 82_000.0, 1060.0, 9.81, 15.0, 1.0, 0.01),
}


def grid(size, cells):
    """Nodes and tetrahedra of a box, six a cell around its diagonal, in the order of supple's bar."""
    counts = [n + 1 for n in cells]
    nodes = [tuple(size[a] * at[2 - a] / cells[a] for a in range(3)) for at in product(*(range(n) for n in reversed(counts)))]
    tetrahedra = []
    for z, y, x in product(*(range(n) for n in reversed(cells))):
        for order in permutations(range(3)):
            at, tetrahedron = [x, y, z], []
            for axis in [None, *order]:
                if axis is not None:
                    at[axis] += 1
                tetrahedron.append(at[0] + counts[0] * (at[1] + counts[1] * at[2]))
            odd = sum(order[i] > order[j] for i in range(3) for j in range(i + 1, 3)) % 2
            tetrahedra.append([tetrahedron[0], tetrahedron[2], tetrahedron[1], tetrahedron[3]] if odd else tetrahedron)
    return nodes, tetrahedra


def nearest(nodes, points):
    """Indices of the nodes at the points, which must be nodes."""
    found = []
    for point in points:
        distances = [sum((a - b) ** 2 for a, b in zip(node, point)) for node in nodes]
        best = min(range(len(nodes)), key=distances.__getitem__)
        assert distances[best] < 1e-12, f"no node at {point}"
        found.append(best)
    return found


def masses(scene, nodes, tetrahedra):
    """A quarter of each tetrahedron at its corners."""
    found = [0.0] * len(nodes)
    each = scene.density * scene.size[0] * scene.size[1] * scene.size[2] / len(tetrahedra)
    for tetrahedron in tetrahedra:
        for node in tetrahedron:
            found[node] += each / 4
    return found


def truth(scene):
    """{"error": [rest, swing] in %, "rest": displacements of the points, "swing": those at every `every` seconds}."""
    return json.loads((HERE / "truth.json").read_text())[scene.name]


def distance(one, other):
    """Mean over the points."""
    return sum(sum((a - b) ** 2 for a, b in zip(p, q)) ** 0.5 for p, q in zip(one, other)) / len(one)


def size(displacements):
    return distance(displacements, [(0, 0, 0)] * len(displacements))


def at(curve, time):
    """Displacements at a time, by the cubic through the four samples around it."""
    after = next((number for number, (sample, _) in enumerate(curve) if sample >= time), len(curve) - 1)
    first = max(0, min(after - 2, len(curve) - 4))
    near = curve[first : first + 4]
    weights = []
    for number, (one, _) in enumerate(near):
        others = [other for place, (other, _) in enumerate(near) if place != number]
        weights.append(prod((time - other) / (one - other) for other in others))
    return [[sum(w * moved[p][a] for w, (_, moved) in zip(weights, near)) for a in range(3)] for p in range(len(near[0][1]))]


def errors(scene, rest, swing):
    """Errors in % at rest and over the swing: displacements at times, which need not be the truth's."""
    known = truth(scene)
    curve = [(0.0, [[0.0] * 3] * len(rest)), *((time, moved) for time, moved in swing if time > 0)]
    apart = moved = 0.0
    for number, right in enumerate(known["swing"]):
        apart += distance(at(curve, number * scene.every), right)
        moved += size(right)
    return 100 * distance(rest, known["rest"]) / size(known["rest"]), 100 * apart / moved
