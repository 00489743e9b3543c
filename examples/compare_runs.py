"""How far two runs of `supple simulate` on one mesh are apart at their ends:

    python3 examples/compare_runs.py REFERENCE OTHER

Folders with final.csv. Prints mean and largest distance of the nodes (mm), and the mean over the error of not moving at all. Needs numpy.
"""

import pathlib
import sys

import numpy as np


def displacements(folder):
    """Of each node, m."""
    path = pathlib.Path(folder) / "final.csv"
    table = np.genfromtxt(path, delimiter=",", names=True)
    return np.column_stack([table[name] for name in ("ux", "uy", "uz")])


def main():
    reference, other = (displacements(folder) for folder in sys.argv[1:3])
    if reference.shape != other.shape:
        sys.exit(f"error: {len(reference)} and {len(other)} nodes: these are runs of two meshes")
    off, moved = (np.linalg.norm(vectors, axis=1) for vectors in (other - reference, reference))
    share = 100.0 * off.mean() / moved.mean()
    print(f"{1e3 * off.mean():.3f} mm apart on average, {1e3 * off.max():.3f} mm at node {off.argmax()}: {share:.1f} % of not moving")


main()
