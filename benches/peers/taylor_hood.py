"""Taylor-Hood elements of NGSolve with supple's law: `python taylor_hood.py a|b OUT.json [--quick]`, and the truth: `python taylor_hood.py truth FOLDER`.

c (I1bar - 3) + p (J - 1) - p^2 / (4 d), displacements of one order above the pressure's, implicit midpoint rule in time, Newton's method, and a
direct solver. By symmetry one half of the box is enough: cells are along, across a half, and up.

The truth (truth.json) of scene A is of hexahedra of order 3 (they come to rest within 0.2 % of each other on 4 x 1 x 2 and 6 x 2 x 3 cells), extrapolated
from steps of 1 and 0.5 ms. That of scene B is of tetrahedra of order 2: the edge of the held side that is pressed together makes them converge in first
order of the size of the cells, so displacements are extrapolated from two meshes and two steps. FOLDER keeps the runs, and takes those that it has.
"""

import json
import sys
import time
from pathlib import Path

import ngsolve as ng
from ngsolve.meshes import MakeStructured3DMesh

from scenes import HERE, SCENES, distance, size


class Box:
    def __init__(self, scene, cells, order, hexahedra):
        self.scene = scene
        length, across, up = scene.size
        self.mesh = MakeStructured3DMesh(
            hexes=hexahedra, nx=cells[0], ny=cells[1], nz=cells[2], mapping=lambda x, y, z: (length * x, across / 2 * y, up * z)
        )
        # Netgen's names of x = 0 and y = the middle.
        motion = ng.VectorH1(self.mesh, order=order, dirichletx="back", dirichlety="back|right", dirichletz="back")
        self.space = motion * ng.H1(self.mesh, order=order - 1)
        self.now, self.old, self.velocity = (ng.GridFunction(self.space) for _ in range(3))
        u, p = self.space.TrialFunction()
        c, d = scene.shear / 2, scene.bulk / 2
        deformation = ng.Id(3) + ng.Grad(u)
        j = ng.Det(deformation)
        energy = c * (j ** (-2 / 3) * ng.InnerProduct(deformation, deformation) - 3) + p * (j - 1) - p * p / (4 * d)
        self.load = ng.Parameter(1.0)
        energy = energy.Compile()
        weight = self.load * scene.density * scene.gravity * u[2]
        self.dx = ng.dx(bonus_intorder=2)
        self.inertia = ng.Parameter(0.0)
        self.before = ng.GridFunction(self.space)
        # Of the midpoint: inertia * |u - before|^2 / 2.
        apart = u - self.before.components[0]
        self.form = ng.BilinearForm(self.space, symmetric=True)
        self.form += ng.Variation((energy + weight + 0.5 * self.inertia * ng.InnerProduct(apart, apart)) * self.dx)

    def solve(self):
        """True if Newton's method converges."""
        residual, step = self.now.vec.CreateVector(), self.now.vec.CreateVector()
        first = None
        for _ in range(15):
            self.form.AssembleLinearization(self.now.vec)
            self.form.Apply(self.now.vec, residual)
            step.data = self.form.mat.Inverse(self.space.FreeDofs(), inverse="sparsecholesky") * residual
            self.now.vec.data -= step
            size = step.Norm()
            first = first or size
            # The error that is left is that share squared.
            if size <= 1e-3 * first and size < 1e-2:
                return True
            if not size < 1e3 * first:
                return False
        return False

    def rest(self):
        self.inertia.Set(0.0)
        load, more, good = 0.0, 0.25, self.now.vec.CreateVector()
        while load < 1.0:
            good.data = self.now.vec
            self.load.Set(min(1.0, load + more))
            if self.solve():
                load, more = min(1.0, load + more), 1.5 * more
            else:
                self.now.vec.data, more = good, more / 2
                if more < 1e-3:
                    raise SystemExit("Newton's method does not converge")
        return self.sample()

    def sample(self):
        motion = self.now.components[0]
        _, across, up = self.scene.size
        found = []
        for x, y, z in self.scene.points():
            there = motion(self.mesh(x * (1 - 1e-9), min(y, across - y) * (1 - 1e-9), z * (1 - 1e-9)))
            found.append([there[0], there[1] if y <= across / 2 else -there[1], there[2]])
        return found

    def swing(self, step):
        scene = self.scene
        for function in (self.now, self.old, self.velocity):
            function.vec[:] = 0.0
        density, damping = scene.density, scene.damping
        found, spent = [(0.0, self.sample())], 0.0
        for number in range(1, round(scene.seconds / step) + 1):
            start = time.process_time()
            # m (u - old - h/2 v) 2 / h^2 ... = force(u) at the midpoint u, with damping on (u - old) 2 / h.
            inertia = density * (4 / step**2 + 2 * damping / step)
            self.inertia.Set(inertia)
            self.before.vec.data = self.old.vec + (density * 2 / step / inertia) * self.velocity.vec
            self.now.vec.data = self.old.vec + (0.5 * step) * self.velocity.vec
            self.now.components[1].vec.data = self.old.components[1].vec
            if not self.solve():
                raise SystemExit(f"Newton's method does not converge at {number * step} s")
            pressure = self.now.components[1].vec.CreateVector()
            pressure.data = self.now.components[1].vec
            # In place, as the terms of a sum are added in turn.
            self.velocity.vec.data *= -1.0
            self.velocity.vec.data += (4 / step) * (self.now.vec - self.old.vec)
            self.old.vec.data *= -1.0
            self.old.vec.data += 2.0 * self.now.vec
            self.old.components[1].vec.data = pressure
            self.now.vec.data = self.old.vec
            spent += time.process_time() - start
            found.append((number * step, self.sample()))
        return found, spent / scene.seconds


def run(folder, scene, cells, order, hexahedra, step):
    """Rest and swing, kept in the folder. Without a step there is no swing."""
    kept = Path(folder, f"{scene}-{'x'.join(map(str, cells))}-{order}-{step}.json")
    if not kept.exists():
        box = Box(SCENES[scene], cells, order, hexahedra)
        found = {"rest": box.rest()}
        if step:
            found["swing"], found["seconds"] = box.swing(step)
        kept.write_text(json.dumps(found))
    return json.loads(kept.read_text())


def beyond(fine, coarse, share):
    """fine + share * (fine - coarse), of displacements."""
    return [[f + share * (f - c) for f, c in zip(one, other)] for one, other in zip(fine, coarse)]


def curve(found, every):
    """Displacements at each `every` seconds."""
    step = found["swing"][1][0]
    return [moved for _, moved in found["swing"][:: round(every / step)]]


def apart(one, other):
    """Of two curves, in % of their motion."""
    return 100 * sum(map(distance, one, other)) / sum(map(size, one))


def truths(folder):
    every = SCENES["a"].every
    coarse, fine = (curve(run(folder, "a", (4, 1, 2), 3, True, step), every) for step in (0.001, 0.0005))
    swing = [beyond(f, c, 1 / 3) for f, c in zip(fine, coarse)]
    rest, other = (run(folder, "a", cells, 3, True, 0.002) for cells in ((4, 1, 2), (6, 2, 3)))
    cells = apart(curve(rest, every), curve(other, every))
    found = {"a": {"error": [100 * distance(rest["rest"], other["rest"]) / size(rest["rest"]), cells + apart(swing, fine)], "rest": rest["rest"], "swing": swing}}

    every = SCENES["b"].every
    eight, twelve = (run(folder, "b", cells, 2, False, 0.01) for cells in ((8, 2, 4), (12, 3, 6)))
    sixteen, short = run(folder, "b", (16, 4, 8), 2, False, 0), run(folder, "b", (8, 2, 4), 2, False, 0.005)
    # Errors as 1/16 to 1/8, and as 1/12 to 1/8.
    rest = beyond(sixteen["rest"], eight["rest"], 1)
    other = beyond(twelve["rest"], eight["rest"], 2)
    cells = [beyond(f, c, 2) for f, c in zip(curve(twelve, every), curve(eight, every))]
    long, short = curve(eight, every), curve(short, every)
    swing = [[[a + 4 / 3 * (s - l) for a, l, s in zip(*point)] for point in zip(*at)] for at in zip(cells, long, short)]
    # What the other pair of meshes says, and half of what was added to the finest mesh.
    error = max(100 * distance(rest, other) / size(rest), 50 * distance(rest, sixteen["rest"]) / size(rest))
    found["b"] = {"error": [error, error + apart(swing, cells) / 4], "rest": rest, "swing": swing}
    return found


SETTINGS = {
    "a": [((4, 1, 2), 2, False, 0.004), ((4, 1, 2), 2, False, 0.002), ((8, 2, 4), 2, False, 0.004)],
    "b": [((4, 1, 2), 2, False, 0.02), ((8, 2, 4), 2, False, 0.02)],
}


def row(scene, cells, order, hexahedra, step):
    box = Box(scene, cells, order, hexahedra)
    rest = box.rest()
    swing, seconds = box.swing(step)
    shape = f"{cells[0]}x{2 * cells[1]}x{cells[2]} cells"
    return {
        "engine": "NGSolve Taylor-Hood",
        "version": ng.__version__,
        "setting": f"{'Q' if hexahedra else 'P'}{order}/{'Q' if hexahedra else 'P'}{order - 1}, {1e3 * step:g} ms",
        "mesh": f"half of {shape}",
        "rest": rest,
        "swing": swing,
        "seconds": seconds,
    }


if __name__ == "__main__":
    ng.SetNumThreads(1)
    if sys.argv[1] == "truth":
        Path(sys.argv[2]).mkdir(parents=True, exist_ok=True)
        found = truths(sys.argv[2])
        rounded = json.loads(json.dumps(found), parse_float=lambda text: float(f"{float(text):.4e}"))
        (HERE / "truth.json").write_text(json.dumps(rounded, separators=(",", ":")).replace("]],[[", "]],\n[[") + "\n")
        print({scene: known["error"] for scene, known in found.items()})
    else:
        scene = SCENES[sys.argv[1]]
        settings = SETTINGS[scene.name][: 1 if "--quick" in sys.argv else None]
        found = [row(scene, *setting) for setting in settings]
        Path(sys.argv[2]).write_text(json.dumps(found))
