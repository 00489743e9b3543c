#!/usr/bin/env python3
"""Mean distance between two results of `supple simulate` on one mesh, and how far the first one moved, in mm.

    python3 docs/scenes/distance.py out/a/final.csv out/b/final.csv
"""
import csv
import math
import sys


def displacements(path):
    with open(path, newline="") as file:
        return [[float(row[name]) for name in ("ux", "uy", "uz")] for row in csv.DictReader(file)]


first, second = (displacements(path) for path in sys.argv[1:3])
if len(first) != len(second):
    sys.exit(f"{len(first)} and {len(second)} nodes: not the same mesh")
moved = sum(math.hypot(*u) for u in first) / len(first)
distance = sum(math.dist(u, v) for u, v in zip(first, second)) / len(first)
print(f"moved {1e3 * moved:.1f} mm, distance {1e3 * distance:.1f} mm, mean over {len(first)} nodes")
