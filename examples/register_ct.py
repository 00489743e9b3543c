#!/usr/bin/env python3
# %% [markdown]
# An image-guided intervention, with data of our own. Before it: a CT of a liver lobe with a tumour and vessels, and its mesh. During it: where
# twenty points of the surface are seen, with an error. Wanted: where the tumour is now, and the CT as it would look now.
#
# The truth is another model: eight times as many elements, of another kind, an exponential law, gravity and supports, none of which the
# registration knows. It only has the points: they pull a free body of any soft tissue to where they are.
#
#     python register_ct.py [lobe.msh [folder]]
#
# Needs numpy, scipy, SimpleITK and matplotlib.

# %%
import pathlib
import sys
import time

import matplotlib
import numpy as np
import SimpleITK as sitk
import supple
from lobe_truth import error, spread, truth
from scipy.interpolate import RBFInterpolator

matplotlib.use("Agg")
import matplotlib.pyplot as plt

MESH = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "meshes/lobe.msh")
OUT = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else "out")
ERROR = 0.0005  # m an axis, of the tracked points
SPACING = 2.0  # mm, of the CT
TUMOUR, RADIUS = np.array([0.005, 0.0, 0.032]), 0.008  # m
random = np.random.default_rng(1)
OUT.mkdir(parents=True, exist_ok=True)


# %% The CT: tissue, vessels that branch from a trunk, a tumour; Hounsfield-like numbers. Mesh coordinates are LPS metres.
mesh = supple.Mesh.read(MESH)
low, high = 1e3 * mesh.points.min(axis=0) - 24.0, 1e3 * mesh.points.max(axis=0) + 16.0
grid = sitk.Image([int(n) for n in np.ceil((high - low) / SPACING)], sitk.sitkFloat32)
grid.SetOrigin(low.tolist())
grid.SetSpacing([SPACING] * 3)
places = 1e-3 * supple.Grid.of(grid).points().reshape(-1, 3)
still = supple.Simulation(supple.Scene(mesh, supple.Material.from_moduli(3000.0, 0.45, density=1060.0), element="nodal-strain"), damping=20.0)
inside = still.locate(places).distances == 0.0
trunk = np.array([[-0.045, 0.02, 0.025], [-0.01, 0.008, 0.03], [0.03, -0.005, 0.022], [0.06, 0.0, 0.02]])
branch = np.array([[-0.01, 0.008, 0.03], [-0.02, -0.025, 0.018]])
vessels = np.concatenate([a + (b - a) * np.linspace(0, 1, 60)[:, None] for line in (trunk, branch) for a, b in zip(line, line[1:])])
of_vessel = np.array([np.min(((vessels - place) ** 2).sum(axis=1)) < 0.0025**2 for place in places])
values = np.where(inside, 60.0, -100.0)
values[inside & of_vessel] = 160.0
values[np.linalg.norm(places - TUMOUR, axis=1) < RADIUS] = 110.0
shape = sitk.GetArrayFromImage(grid).shape
ct = sitk.GetImageFromArray((values + random.normal(0.0, 5.0, len(values))).reshape(shape).astype(np.float32))
ct.CopyInformation(grid)
labels = sitk.GetImageFromArray(inside.reshape(shape).astype(np.uint8))
labels.CopyInformation(grid)

# %% The truth: the lobe hangs from a patch of its back, lies on two pads, and is turned.
moved = truth(mesh, "packed")
targets = np.concatenate([places[inside & of_vessel][:: max(1, (inside & of_vessel).sum() // 100)], TUMOUR + random.normal(0, 0.003, (50, 3))])
where = moved.locate(targets).positions.astype(float)

# %% Points of the surface, far from each other, seen with an error.
surface = mesh.points[np.unique(mesh.boundary())].astype(float)
tracked = surface[spread(surface, 0, 20)]
seen = moved.locate(tracked).positions + random.normal(0.0, ERROR, tracked.shape)


# %% Registration: a rigid fit to begin with, then the points pull.
body, followed = still, still.locate(targets)
print(f"target registration error, mm: {error(targets, where):.2f} not moved")
for count in (6, 10, 20):
    at, to = tracked[:count], seen[:count]
    rigid = supple.rigid_fit(at, to)
    spline = RBFInterpolator(at, to - at, kernel="linear", degree=1)  # that of thin plates in three dimensions
    pulls = body.pull(at, to, stiffness=1000.0)
    body.set_displacements(rigid(mesh.points) - mesh.points)
    begin = time.perf_counter()
    settled = body.settle(1e-4)
    took = time.perf_counter() - begin
    errors = [error(each, where) for each in (rigid(targets), targets + spline(targets), followed.positions)]
    print("{} points: rigid {:.2f}, thin-plate spline {:.2f}, supple {:.2f}".format(count, *errors), end="; ")
    print(f"{settled.steps} steps, {1e3 * took:.0f} ms, {settled.status}")
    if count < 20:
        pulls.release()

# %% A point that is wrong shows by its gap.
wrong = seen.copy()
wrong[7] += [0.0, 0.015, 0.0]
pulls.move(wrong)
body.settle(1e-4)
gaps = 1e3 * np.linalg.norm(pulls.gaps, axis=1)
print(f"one point 15 mm off: {error(followed.positions, where):.2f} mm; its gap {gaps[7]:.1f} mm, others at most {np.delete(gaps, 7).max():.1f} mm")
pulls.move(seen)
body.settle(1e-4)

# %% The CT as it looks now, and the field as a transform that 3D Slicer opens.
field = body.field(ct, "inverse")
warped = field.warp(ct)
ideal = moved.field(ct, "inverse").warp(ct)
supple.write_image(ct, OUT / "ct.nii.gz")
supple.write_image(labels, OUT / "labels.nii.gz")
supple.write_image(ideal, OUT / "ct-true.nii.gz")
np.savetxt(OUT / "points.csv", 1e3 * np.hstack([tracked, seen]), "%.3f", ",")
supple.write_image(warped, OUT / "ct-now.nii.gz")
field.write(OUT / "ct-now.h5")
now, best = sitk.GetArrayFromImage(warped), sitk.GetArrayFromImage(ideal)
print(f"warped CT against the true one: {np.abs(now - best).mean():.1f} of {np.abs(sitk.GetArrayFromImage(ct) - best).mean():.1f} units before")

# %% A slice through the tumour.
at = ct.TransformPhysicalPointToIndex((1e3 * where[-50:].mean(axis=0)).tolist())
fig, axes = plt.subplots(1, 3, figsize=(12, 2.6))
for axis, (title, image) in zip(axes, [("CT before", sitk.GetArrayFromImage(ct)), ("CT moved by the points", now), ("CT moved by the truth", best)]):
    axis.imshow(image[:, at[1], :], cmap="gray", vmin=-100, vmax=180, origin="lower", aspect="equal")
    axis.set_title(title)
    axis.axis("off")
fig.tight_layout()
fig.savefig(OUT / "register-ct.png", dpi=120)
print(f"results: {OUT}")
