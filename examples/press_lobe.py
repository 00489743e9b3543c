# %% [markdown]
# # A ball on a liver lobe
# Cells for an editor that knows `# %%`, or `python3 examples/press_lobe.py [MESH [FOLDER]]`. Needs `supple`, `meshio` and `matplotlib`.
# The lobe hangs from its back; a ball comes down onto its dome, slides along it with friction, and leaves, 60 frames a second.

# %%
import pathlib
import sys
import time

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import supple

LOBE = pathlib.Path(__file__).parent.parent / "meshes" / "lobe.msh"
mesh = supple.Mesh.read(sys.argv[1] if len(sys.argv) > 1 else LOBE)
out = pathlib.Path(sys.argv[2] if len(sys.argv) > 2 else "out/press-lobe")
out.mkdir(parents=True, exist_ok=True)
liver = supple.Material("exponential", a=1500.0, b=8.023, d=40000.0, density=1060.0)
scene = supple.Scene(mesh, liver, fixed=mesh.points[:, 1] > 0.030, element="nodal-strain")
print(scene, scene.facts)

# %% The ball: where it is (m) at which time (s), linear in between.
RADIUS, FRAME = 0.010, 1.0 / 60.0
top = mesh.points[mesh.points[:, 2].argmax()].astype(float)
TIMES = [0.0, 0.4, 0.8, 1.0]
WAY = np.array([[0.0, 0.0, 0.0005], [0.0, 0.0, -0.006], [0.004, 0.0, -0.006], [0.004, 0.0, 0.004]])


def ball_at(seconds):
    return top + [0.0, 0.0, RADIUS] + [np.interp(seconds, TIMES, WAY[:, axis]) for axis in range(3)]


# %% The motion, frame by frame, with exact steps.
simulation = supple.Simulation(scene, damping=20.0)
simulation.set_instruments([supple.Instrument.sphere(RADIUS, ball_at(0.0), friction=0.3)])
rows, start = [], time.perf_counter()
for frame in range(1, 67):
    simulation.move(0, ball_at(frame * FRAME), within=FRAME)
    report = simulation.advance(FRAME)
    assert report.ok, report
    touch = simulation.touch(0)
    rows.append((report.time, *touch.mean_force, np.linalg.norm(simulation.displacements, axis=1).max()))
    if frame == 40:
        simulation.write(out / "pressed.vtu")
        pressed = simulation.displacements.copy()
table = np.array(rows)
print(f"{simulation.time:.2f} s in {time.perf_counter() - start:.2f} s; at most {table[:, 3].max():.3f} N up, {1e3 * table[:, 4].max():.2f} mm")

# %% A picture.
figure, (force, shape) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
for column, name in ((1, "along x"), (2, "along y"), (3, "up")):
    force.plot(table[:, 0], table[:, column], label=name)
force.set(xlabel="time, s", ylabel="force on the ball, N")
force.legend()
moved = 1e3 * (mesh.points + pressed)
triangles = mesh.boundary()
a, b, c = moved[triangles].transpose(1, 0, 2)
triangles = triangles[np.cross(b - a, c - a)[:, 1] < 0.0]  # those that face the eye
colours = shape.tripcolor(moved[:, 0], moved[:, 2], triangles, 1e3 * np.linalg.norm(pressed, axis=1), shading="gouraud")
shape.set(xlabel="x, mm", ylabel="z, mm", aspect="equal", title="after 0.67 s")
figure.colorbar(colours, ax=shape, label="displacement, mm")
figure.savefig(out / "press-lobe.png", dpi=150)
print(f"written: {out / 'press-lobe.png'}, {out / 'pressed.vtu'}")
