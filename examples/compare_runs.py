"""How far a run of `supple simulate` is from a reference on the same mesh, over time and at the end:

    python3 examples/compare_runs.py REFERENCE OTHER

Folders with frames.pvd, final.csv and summary.json. Prints mean and largest distance of the nodes (mm), and the mean over the error of not
moving at all. Between its frames the reference goes in straight lines: give it many. Ends with 1 if the runs end at different times.
Needs numpy and meshio.
"""

import json
import pathlib
import sys
import xml.etree.ElementTree as xml

import meshio
import numpy as np


def frames(folder):
    """Times (s) and displacements of all nodes (m)."""
    sets = xml.parse(folder / "frames.pvd").iter("DataSet")
    files = [(float(entry.get("timestep")), entry.get("file")) for entry in sets if "instruments" not in entry.get("file")]
    return np.array([time for time, _ in files]), np.array([meshio.read(folder / name).point_data["displacement"] for _, name in files])


def ending(folder):
    summary = json.loads((folder / "summary.json").read_text())
    return summary["time_s"], summary["status"]


def at(time, times, shapes):
    """The reference at a time, in a straight line between two frames."""
    after = int(np.clip(np.searchsorted(times, time), 1, len(times) - 1))
    share = (time - times[after - 1]) / (times[after] - times[after - 1])
    return shapes[after - 1] + np.clip(share, 0.0, 1.0) * (shapes[after] - shapes[after - 1])


def main():
    if len(sys.argv) != 3 or sys.argv[1].startswith("-"):
        sys.exit(__doc__.strip())
    reference, other = (pathlib.Path(name) for name in sys.argv[1:])
    (times, shapes), (other_times, other_shapes) = frames(reference), frames(other)
    if shapes.shape[1:] != other_shapes.shape[1:]:
        sys.exit(f"error: {shapes.shape[1]} and {other_shapes.shape[1]} nodes: these are runs of two meshes")
    (end, status), (other_end, other_status) = ending(reference), ending(other)
    # Steps of a network end where they end; a run that was stopped lacks a frame or more.
    together = abs(end - other_end) < 0.5 * np.diff(other_times).max()
    print(f"{reference}: {end:.3f} s, {status}; {other}: {other_end:.3f} s, {other_status}")
    common = other_times <= max(times) * (1.0 + 1e-6)
    exact = np.array([at(time, times, shapes) for time in other_times[common]])
    off = 1e3 * np.linalg.norm(other_shapes[common] - exact, axis=2)
    still = 1e3 * np.linalg.norm(exact, axis=2).mean()
    worst, node = np.unravel_index(off.argmax(), off.shape)
    print(
        f"over time: {off.mean():.3f} mm apart on average, {100.0 * off.mean() / still:.1f} % of not moving; "
        f"at most {off.mean(axis=1).max():.3f} mm on average, {off.max():.3f} mm at node {node} at {other_times[common][worst]:.3f} s"
    )
    if not together:
        sys.exit("the runs do not end at the same time: they are compared until then")
    share = 100.0 * off[-1].mean() / (1e3 * np.linalg.norm(exact[-1], axis=1).mean())
    print(f"at the end: {off[-1].mean():.3f} mm apart on average, {off[-1].max():.3f} mm at node {off[-1].argmax()}: {share:.1f} % of not moving")


main()
