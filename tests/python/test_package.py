"""The package itself: views without copies, errors that name place and value, files, threads, the ten lines of its docstring."""

import copy
import gc
import pickle
import threading
import time
import warnings

import meshio
import numpy as np
import pytest
import supple
from conftest import ROOT, bar


def test_displacements_are_a_view_that_stays_sound(soft):
    simulation = supple.Simulation(supple.Scene(bar(), soft), gravity=(0.0, 0.0, -9.81))
    view = simulation.displacements
    assert view.base is not None and view.dtype == np.float32 and not view.flags.writeable
    with pytest.raises(ValueError):
        view[0, 0] = 1.0
    simulation.advance(0.01)
    fallen = view[:, 2].mean()
    assert fallen < -1e-4 and view is simulation.displacements
    del simulation
    gc.collect()
    assert view[:, 2].mean() == fallen


def test_the_arrays_of_a_mesh_stay_as_they_are(soft):
    tets, regions = bar().tets.copy(), np.arange(len(bar().tets), dtype=np.int32)
    mesh = supple.Mesh(bar().points.copy(), tets, regions=regions)
    for kept in (mesh.points, mesh.tets, mesh.regions):
        with pytest.raises(ValueError, match="read-only"):
            kept *= 2
    # Arrays of the caller are still the caller's.
    tets[:], regions[:] = 0, 0
    assert (mesh.tets == bar().tets).all() and (mesh.regions == np.arange(len(tets))).all()


def test_what_does_nothing_cannot_be_assigned(soft):
    mesh = bar()
    scene = supple.Scene(mesh, soft, fixed=mesh.points[:, 2] < 1e-6)
    simulation = supple.Simulation(scene)
    pressure, pulls = simulation.add_pressure(mesh.boundary(), 0.0), simulation.pull(mesh.points[-1:])
    for thing, name in [
        *((simulation, name) for name in ("damping", "step", "tolerance", "gravty", "scene", "method", "displacements")),
        *((scene, name) for name in ("fixed", "element", "mesh", "facts")),
        *((mesh, name) for name in ("points", "tets", "regions", "scale")),
        *((soft, name) for name in ("density", "law", "young")),
        (pressure, "ramp"), (pulls, "stiffness"), (supple.LocalForce(), "stifness"),
        (simulation.reaction([0]), "damping"), (simulation.locate([[0.0, 0.0, 0.0]]), "rest"),
    ]:  # fmt: skip
        with pytest.raises(AttributeError, match=f"{type(thing).__name__}.{name} cannot be set") as caught:
            setattr(thing, name, 20.0)
    print(caught.value)
    with pytest.raises(AttributeError, match="Simulation.damping cannot be set, only gravity: make a new Simulation"):
        simulation.damping = 20.0
    with pytest.raises(ValueError, match="read-only"):
        simulation.gravity[0] = 1.0
    simulation.gravity, pressure.pascal = (1.0, 0.0, 0.0), 5.0
    assert simulation.gravity.tolist() == [1.0, 0.0, 0.0] and pressure.pascal == 5.0
    # Copies, and what other processes get.
    assert copy.deepcopy(soft).density == soft.density and (pickle.loads(pickle.dumps(mesh)).tets == mesh.tets).all()


def test_the_version_is_that_of_the_kernel():
    assert supple.__version__ == supple.version()


def test_the_ten_lines_of_the_docstring_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lobe.msh").write_bytes((ROOT / "meshes" / "lobe.msh").read_bytes())
    lines = [line[4:] for line in supple.__doc__.splitlines() if line.startswith("    ")]
    assert sum(bool(line.strip()) for line in lines) <= 10
    names = {}
    exec("\n".join(lines), names)
    for page in ("README.md", "docs/python.md"):
        shown = (ROOT / page).read_text().split("```python\n")[1].split("```")[0]
        assert [line for line in shown.splitlines() if line] == [line for line in lines if line], page
    picture = (ROOT / "docs/python.md").read_text().split("```python\n")[2].split("```")[0]
    monkeypatch.setenv("MPLBACKEND", "agg")
    exec(picture, names)
    assert (tmp_path / "deformed.png").stat().st_size > 10_000
    written = meshio.read("deformed.vtu")
    moved = np.linalg.norm(written.point_data["displacement"], axis=1)
    assert moved.max() > 0.005
    rest = meshio.read("lobe.msh").points
    assert written.points - written.point_data["displacement"] == pytest.approx(rest, abs=1e-6)


def test_meshes_of_meshio_come_in(tmp_path):
    mesh = bar()
    cells = [("tetra", mesh.tets[:100].astype(int)), ("triangle", np.array([[0, 1, 2]])), ("tetra", mesh.tets[100:].astype(int))]
    points = np.vstack([[[9.0, 9.0, 9.0]], mesh.points])
    whole = meshio.Mesh(points, [(kind, data + 1) for kind, data in cells])
    read = supple.Mesh.from_meshio(whole, scale=0.5)
    assert (read.tets == mesh.tets).all() and read.points == pytest.approx(0.5 * mesh.points)
    with pytest.raises(supple.InputError, match="no tetrahedra of four nodes, only triangle"):
        supple.Mesh.from_meshio(meshio.Mesh(points, [("triangle", np.array([[0, 1, 2]]))]))


def test_the_boundary_is_closed_and_outside(lobe):
    triangles = lobe.boundary()
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    assert (counts == 2).all()
    a, b, c = lobe.points.astype(float)[triangles].transpose(1, 0, 2)
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0 == pytest.approx(lobe.volumes.sum(), rel=1e-5)


def test_slips_of_units_are_warned_of_at_the_first_step(lobe):
    tissue = supple.Material.from_moduli(young=10_000.0, poisson=0.45, density=1060.0)
    millimetres = supple.Mesh(1e3 * lobe.points, lobe.tets)
    soft = supple.Material.from_moduli(young=3.0, poisson=0.45, density=1.06)
    held = lobe.points[:, 1] > 0.03
    for scene, words in [
        (supple.Scene(millimetres, tissue, fixed=held), "unusual size of the body: are its points in metres"),
        (supple.Scene(lobe, soft, fixed=held), "unusual density"),
        (supple.Scene(lobe, soft, fixed=held), "unusual Young's modulus"),
        (supple.Scene(lobe, tissue, fixed=lobe.points[:, 1] > 30.0), "no node is fixed"),
    ]:
        with pytest.warns(RuntimeWarning, match=words):
            supple.Simulation(scene).advance(1e-5)
    simulation = supple.Simulation(supple.Scene(lobe, tissue, fixed=held))
    assert simulation.remarks() == []
    pulls = simulation.pull(lobe.points[np.flatnonzero(held)[:1]], radius=1e-6)
    assert simulation.remarks() == ["pull 0: a pull all of whose nodes are held: it moves nothing"]
    pulls.release()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulation.advance(1e-3)


def said_in(what):
    """The warnings of a call."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        what()
    return [str(each.message) for each in said]


def test_lengths_in_millimetres_are_warned_of_once(soft):
    mesh = bar()
    top = np.flatnonzero(mesh.points[:, 2] > 0.059)
    scene = supple.Scene(mesh, soft, fixed=mesh.points[:, 2] < 1e-9, moved=top)

    def made(**asked):
        return supple.Simulation(scene, damping=20.0, **asked)

    simulation = made(method="auto", tolerance=0.5)
    assert simulation.remarks() == ["tolerance 0.5 m is large for a body that is 0.0663 m across: is it in metres? (1 mm is 0.001 m)"]
    assert [words[:36] for words in said_in(lambda: made().settle(0.1))] == ["settle: to within 0.1 m is large for"]
    assert "displacements: up to 5 m is large" in said_in(lambda: made().set_displacements(np.full_like(mesh.points, [5, 0, 0])))[0]
    assert "pulls: radius 12 m is large" in said_in(lambda: made().pull(mesh.points[:1], radius=12.0))[0]
    # As many motions and targets as there are nodes, and what is after them.
    simulation = made()
    simulation.set_motions(top, [0.0, 0.0, 5.0], ramp=100.0)
    simulation.pull(mesh.points[top], 1e3 * mesh.points[top])
    simulation.set_instruments([supple.Instrument.sphere(5.0, (0.0, 0.0, 70.0))])
    said = simulation.remarks()
    assert len(top) == 16 and [words.split(":")[0] for words in said] == ["motion 0", "instrument 0", "pull 0"], said
    assert said[0].endswith(", the first of 16") and "far away from its point" in said[2] and "far away from the body" in said[1]


def test_a_part_that_nothing_holds_is_warned_of(soft):
    one = bar()
    points, tets = np.concatenate([one.points, one.points + [0, 0, 0.06]]), np.concatenate([one.tets, one.tets + len(one.points)])
    scene = supple.Scene(supple.Mesh(points, tets), soft, fixed=points[:, 2] < 1e-9)
    words = "the mesh has 2 parts that share no node, and nothing holds 1 of them, of up to 144 nodes"
    simulation = supple.Simulation(scene)
    assert said_in(lambda: simulation.advance(1e-4))[0].startswith(words)
    simulation.pull(points[-1:], radius=0.01)
    assert simulation.remarks() == [], "a pull holds it"
    simulation = supple.Simulation(scene)
    simulation.remove(np.arange(len(one.tets), len(tets)))
    assert simulation.remarks() == []


REFUSED = [
    (lambda mesh, soft: supple.Scene(supple.Mesh([*mesh.points, [0, 0, 1]], mesh.tets), soft), "node 144 belongs to no element.* numpy.unique"),
    (lambda mesh, soft: supple.Simulation(supple.Scene(mesh, soft), "long", cells=(2000,) * 3), "GiB of memory are needed, .* fewer cells"),
    (lambda mesh, soft: supple.Mesh.box([1.0, 1.0, 1.0], [2.7, 1, 1]), r"cells \[2.7, 1, 1\]: they must be three whole numbers, at least 1"),
    (lambda mesh, soft: supple.Mesh.box([1.0, 1.0, 1.0], [2, 0, 1]), r"cells \[2, 0, 1\]"),
    (lambda mesh, soft: supple.Mesh.box([1.0, 1.0, 1.0], 3), "cells 3: they must be three"),
    (lambda mesh, soft: supple.Mesh(mesh.points, mesh.tets.astype(float)), "integers of shape"),
    (lambda mesh, soft: supple.Mesh(mesh.points[:, :2], mesh.tets), r"points: its shape is \(144, 2\)"),
    (lambda mesh, soft: supple.Mesh(mesh.points, mesh.tets + 100), "element .* has nodes .* there are 144 nodes"),
    (lambda mesh, soft: supple.Mesh(np.where(mesh.points > 0.05, np.nan, mesh.points), mesh.tets), "points: row 7 .* not finite"),
    (lambda mesh, soft: supple.Mesh(mesh.points, mesh.tets, scale=0.0), "scale 0.0"),
    (lambda mesh, soft: supple.Scene(supple.Mesh(mesh.points, mesh.tets[:, [0, 2, 1, 3]]), soft), "negative volume: entry 0"),
    (lambda mesh, soft: supple.Scene(mesh, soft, fixed=[0, 144]), "fixed: entry 1 is node 144, there are 144 nodes"),
    (lambda mesh, soft: supple.Scene(mesh, soft, fixed=np.ones(7, bool)), r"a mask of shape \(7,\)"),
    (lambda mesh, soft: supple.Scene(mesh, soft, fixed=[0], moved=[0]), "node 0 is both"),
    (lambda mesh, soft: supple.Scene(mesh, soft, element="cubic"), "element 'cubic'"),
    (lambda mesh, soft: supple.Scene(mesh, soft, fixed=[0], axes="xw"), "axes 'xw'"),
    (lambda mesh, soft: supple.Scene(mesh, soft, fixed=[0], axes=1), "fixed: axes 1, they are letters of 'xyz'"),
    (lambda mesh, soft: supple.Scene(mesh, soft, fixed=[0], axes=["xy"]), r"fixed: axes \['xy'\], they are letters"),
    (lambda mesh, soft: supple.Scene(mesh, soft, fixed=range(144)), "the scene: "),
    (lambda mesh, soft: supple.Material("neo-hookean", c=1.0, density=1.0), "c are given, c, d are needed"),
    (lambda mesh, soft: supple.Material("rubber", density=1.0), "law 'rubber'"),
    (lambda mesh, soft: supple.Scene(mesh, supple.Material("neo-hookean", c=-1.0, d=1.0, density=1.0)), "the scene: .* value -1"),
    (lambda mesh, soft: supple.Material.from_moduli(1e3, 0.5, density=1.0), "Poisson's ratio 0.5: it must be above -1 and below 0.5"),
    (lambda mesh, soft: supple.Material.from_moduli(1e3, -2.0, density=1.0), "Poisson's ratio -2.0: it must be above -1 and below 0.5"),
    (lambda mesh, soft: supple.Mesh(mesh.points, mesh.tets, regions=[1 << 40] * len(mesh.tets)), "regions: element 0 is of 1099511627776, .* 32 bits"),
]


@pytest.mark.parametrize(("attempt", "words"), REFUSED)
def test_what_cannot_be_is_refused_in_words(soft, attempt, words):
    with pytest.raises(supple.InputError, match=words) as caught:
        attempt(bar(), soft)
    print(caught.value)


def test_a_mask_of_integers_is_refused_wherever_nodes_are_chosen(soft):
    mesh = bar()
    for count in (1, 16, len(mesh.points) - 1):
        mask = np.arange(len(mesh.points)) < count
        elements = np.arange(len(mesh.tets)) < count
        for kind in (np.uint8, np.int64):
            simulation = supple.Simulation(supple.Scene(mesh, soft, fixed=[0]))
            for attempt in (
                lambda: supple.Scene(mesh, soft, fixed=mask.astype(kind)),
                lambda: supple.Scene(mesh, soft, moved=mask.astype(kind)),
                lambda: supple.Scene(mesh, soft, removed=elements.astype(kind)),
                lambda: simulation.set_forces(mask.astype(kind), [0.0, 0.0, 1.0]),
                lambda: simulation.set_motions(mask.astype(kind), [0.0, 0.0, 1.0]),
                lambda: simulation.reaction(mask.astype(kind)),
                lambda: simulation.remove(elements.astype(kind)),
                lambda: simulation.ablate(elements.astype(kind), soft, 0.0),
            ):
                with pytest.raises(supple.InputError, match=r"zeros and ones .* mask.astype\(bool\) or numpy.flatnonzero\(mask\)"):
                    attempt()
    # Of a scene of two elements these are numbers.
    pair = supple.Mesh([[0, 0, 0], [0.01, 0, 0], [0, 0.01, 0], [0, 0, 0.01], [0.01, 0.01, 0.01]], [[0, 1, 2, 3], [1, 2, 3, 4]])
    with pytest.raises(supple.InputError, match="the scene: "):
        supple.Scene(pair, soft, removed=[0, 1])


def test_what_a_node_that_is_named_twice_means(soft):
    """A support is one whatever it is named, forces add up, and a node cannot go to two places."""
    mesh = bar(cells=(2, 2, 4))
    base, tip = np.flatnonzero(mesh.points[:, 2] < 1e-6), len(mesh.points) - 1
    once, twice = (supple.Simulation(supple.Scene(mesh, soft, fixed=nodes, moved=[tip])) for nodes in (base, [*base, *base]))
    for simulation, nodes, newton in ((once, [tip - 1], 0.002), (twice, [tip - 1, tip - 1], 0.001)):
        simulation.set_forces(nodes, [newton, 0.0, 0.0])
        simulation.set_motions([tip, tip], [0.0, 0.001, 0.0])
    reactions = once.reaction(base), twice.reaction([*base, *base])
    for simulation in (once, twice):
        simulation.advance(0.02)
    assert abs(once.displacements).max() > 1e-4 and (once.displacements == twice.displacements).all()
    one, other = (reaction.force() for reaction in reactions)
    assert (one.newton == other.newton).all() and abs(one.newton).max() > 0.0
    with pytest.raises(supple.InputError, match=f"motions: entries 0 and 1 are both node {tip}, .* only one of them can hold"):
        once.set_motions([tip, tip], [[0.0, 0.001, 0.0], [0.0, 0.002, 0.0]])


def test_steps_are_refused_in_words(soft):
    mesh = bar()
    scene = supple.Scene(mesh, soft, fixed=mesh.points[:, 2] < 1e-6)
    with pytest.raises(supple.UnstableStep, match="above the critical step: node") as caught:
        supple.Simulation(scene, step=0.1).advance(0.1)
    assert caught.value.limit is not None and 1e-5 < caught.value.limit < 1e-2 and caught.value.node is not None
    with pytest.raises(supple.InputError, match="step -0.001: it must be a positive number"):
        supple.Simulation(scene, "long", step=-0.001)
    with pytest.raises(supple.InputError, match="tolerance nan: it must be a positive number"):
        supple.Simulation(scene, "auto", tolerance=np.nan)
    with pytest.raises(supple.InputError, match="method 'fast'"):
        supple.Simulation(scene, "fast")
    with pytest.raises(supple.InputError, match="nowhere.weights: cannot be read"):
        supple.Simulation(scene, "learned", weights="nowhere.weights")
    with pytest.raises(supple.InputError, match="pyproject|not a weight file"):
        supple.Simulation(scene, "learned", weights=__file__)
    simulation = supple.Simulation(scene)
    for seconds in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(supple.InputError, match="advance by"):
            simulation.advance(seconds)
    with pytest.raises(supple.InputError, match="take: exact steps without a length"):
        simulation.take(3)
    for count in (0, -5, 1.5):
        with pytest.raises(supple.InputError, match=f"take {count} steps: it must be a whole number, at least 1"):
            supple.Simulation(scene, step=1e-4).take(count)
    with pytest.raises(supple.InputError, match=r"newton: its shape is \(2, 3\), it must be \(1, 3\)"):
        simulation.set_forces([3], np.zeros((2, 3)))
    with pytest.raises(supple.InputError, match="motions: .* node 5"):
        simulation.set_motions([5], [0.001, 0.0, 0.0])
    with pytest.raises(supple.InputError, match="no instruments"):
        simulation.touch(0)
    simulation.set_instruments([supple.Instrument.sphere(0.004, [0.01, 0.01, 0.08])])
    for index in (-1, 1):
        with pytest.raises(supple.InputError, match=f"instrument {index}: there are 1, counted from 0"):
            simulation.move(index, [0.0, 0.0, 0.1], within=0.1)
    # What was refused is not asked for again.
    simulation.set_motions([], np.zeros((0, 3)))
    simulation.set_forces([3], [1e-4, 0.0, 0.0])
    assert simulation.advance(1e-3).ok


# Of another kind than asked for, or beyond what can be: what is refused, and its words, which name it and its value.
SIMULATED = [
    (lambda scene, sim: supple.Simulation(scene.mesh), "scene <supple.Mesh: .*: it must be a Scene"),
    (lambda scene, sim: supple.Scene("lobe.msh", scene.material), "mesh 'lobe.msh': it must be a Mesh"),
    (lambda scene, sim: supple.Scene(scene.mesh, 1e4), "material 10000.0: it must be a Material"),
    (lambda scene, sim: supple.Material.from_moduli("1e4", 0.45, density=1e3), "Young's modulus '1e4': it must be a number"),
    (lambda scene, sim: supple.Material("neo-hookean", c=1e3, d=[1e4], density=1e3), r"d \[10000.0\]: it must be a number"),
    (lambda scene, sim: supple.Simulation(scene, damping=-1), "damping -1: it must be zero or a positive number, 1/s"),
    (lambda scene, sim: supple.Simulation(scene, lead_in=-1), "lead_in -1: it must be zero or a positive number, s"),
    (lambda scene, sim: supple.Simulation(scene, step="auto"), "step 'auto': it must be a number"),
    (lambda scene, sim: supple.Simulation(scene, "long", cells=(-1, 1, 1)), r"cells \(-1, 1, 1\): they must be three whole numbers, at least 1"),
    (lambda scene, sim: supple.Simulation(scene, "long", cells=(1.5, 1, 1)), r"cells \(1.5, 1, 1\)"),
    (lambda scene, sim: supple.Simulation(scene, "long", cells=4), "cells 4"),
    (lambda scene, sim: supple.Simulation(scene, "long", cells=(100, 100, 100)), r"long, cells \(100, 100, 100\): "),
    (lambda scene, sim: supple.Simulation(scene, most_steps="all"), "most_steps 'all': it must be a number"),
    (lambda scene, sim: sim.advance("a"), "seconds 'a': it must be a number"),
    (lambda scene, sim: sim.settle(None), "metre None: it must be a number"),
    (lambda scene, sim: sim.settle(1e-5, most_steps=1e12), "most_steps 1000000000000.0: it must be a whole number"),
    (lambda scene, sim: sim.set_forces([1], [1, 0, 0], ramp=[0.1, 0.2]), r"ramp \[0.1, 0.2\]: it must be a number"),
    (lambda scene, sim: sim.set_motions([1], [1, 0, 0], ramp=-1.0), "ramp -1.0: it must be zero or a positive number, s"),
    (lambda scene, sim: sim.set_tractions(scene.mesh.boundary(), [1, 0, 0], ramp=np.nan), "ramp nan: it must be zero or a positive number, s"),
    (lambda scene, sim: sim.add_pressure(scene.mesh.boundary(), [1, 2]), r"pascal \[1, 2\]: it must be a number"),
    (lambda scene, sim: sim.pull([[0.01, 0.01, 0.03]], stiffness=[1, 2]), r"stiffness \[1, 2\]: it must be one number, N/m, or one for each of 1 points"),
    (lambda scene, sim: sim.pull([[0.01, 0.01, 0.03]], radius="1 cm"), "radius '1 cm': it must be a number"),
    (lambda scene, sim: sim.set_instruments(supple.Instrument.sphere(0.01, [0, 0, 0.2])), "instruments: Instrument is given, a list of Instrument is needed"),
    (lambda scene, sim: sim.set_instruments([scene]), "instruments: entry 0 is <supple.Scene: "),
    (lambda scene, sim: sim.pull([[0.01, 0.01, 0.08]] * 2, stiffness=[100.0, -5.0]), "stiffness of row 1: -5 N/m, it must be from 0 to 1e\\+06"),
    (lambda scene, sim: supple.Material.from_moduli(0.0, 0.3, density=1000.0), "Young's modulus 0.0: it must be a positive number"),
    (lambda scene, sim: sim.set_instruments([supple.Instrument.sphere("1", [0, 0, 0.2])]), "radius '1': it must be a number"),
    (lambda scene, sim: sim.set_instruments([supple.Instrument.sphere(0, [0, 0, 0.2])]), "instruments: entry 0: radius 0: it must be a positive number, m"),
    (lambda scene, sim: sim.set_instruments([supple.Instrument.capsule(0.01, -1, [0, 0, 0.2])]), "instruments: entry 0: length -1: it must be a positive number, m"),
    (lambda scene, sim: sim.set_instruments([supple.Instrument.plane([0, 0, -0.2], friction=-1)]), "instruments: entry 0: friction -1: it must be zero or a positive number"),
    (lambda scene, sim: sim.set_motions([], np.zeros((0, 3)), axes=1), "motions: axes 1, they are letters of 'xyz'"),
    (lambda scene, sim: sim.restore("x"), "restore 'x': it must be the bytes that save gave"),
    (lambda scene, sim: sim.restore(None), "restore None: it must be the bytes that save gave"),
    (lambda scene, sim: sim.restore(sim.save()[:-8]), r"restore of 7048 bytes, where save gives 7056: fewer"),
    (lambda scene, sim: sim.add_pressure(scene.mesh.boundary(), np.nan), "pressure nan Pa, ramp 0.0 s: a number is not finite"),
    (lambda scene, sim: sim.reaction([]), "reaction: there are no nodes: name some that the scene fixes or moves"),
    (lambda scene, sim: sim.exchange(scene.mesh), "exchange with <supple.Mesh: .*: it must be a Scene"),
    (lambda scene, sim: sim.ablate([0], 1e4, 1.0), "ablate to 10000.0: it must be a Material"),
    (lambda scene, sim: sim.reaction([0, 20]), "reaction: entry 1 is node 20, which the scene neither fixes nor moves"),
]


@pytest.mark.parametrize(("attempt", "words"), SIMULATED)
def test_what_is_refused_is_named_with_its_value(soft, attempt, words):
    mesh = bar()
    scene = supple.Scene(mesh, soft, fixed=mesh.points[:, 2] < 1e-6)
    simulation = supple.Simulation(scene, damping=20.0)
    with pytest.raises(supple.InputError, match=words) as caught:
        attempt(scene, simulation)
    print(caught.value)
    assert simulation.advance(1e-3).ok and not simulation.displacements.any()


def test_forces_on_320_nodes_take_less_than_50_us(lobe, liver):
    simulation = supple.Simulation(supple.Scene(lobe, liver, fixed=lobe.points[:, 1] > 0.03))
    nodes, newton = np.arange(320), np.full((320, 3), 1e-5)
    times = []
    for _ in range(200):
        start = time.perf_counter()
        simulation.set_forces(nodes, newton)
        times.append(time.perf_counter() - start)
    print(f"{1e6 * min(times):.1f} us")
    assert min(times) < 50e-6


def test_a_step_that_cannot_be_believed_is_not_taken(soft):
    mesh = bar()
    simulation = supple.Simulation(supple.Scene(mesh, soft, fixed=mesh.points[:, 2] < 1e-6), damping=20.0)
    simulation.set_forces([140], [0.001, 0.0, 0.0])
    simulation.advance(0.1)
    before = simulation.displacements.copy()
    simulation.set_forces([140], [1e6, 0.0, 0.0])
    with pytest.raises(supple.Diverged, match="node 140") as caught:
        simulation.advance(0.1)
    print(caught.value)
    assert np.isfinite(simulation.displacements).all() and abs(simulation.displacements - before).max() < 0.01
    simulation.set_forces([140], [0.001, 0.0, 0.0])
    assert simulation.advance(0.01).time > 0.1


def test_steps_leave_other_threads_running(lobe, liver):
    """Python goes on while the kernel steps; two simulations of one scene run at the same time."""
    scene = supple.Scene(lobe, liver, fixed=lobe.points[:, 1] > 0.03)
    simulations = [supple.Simulation(scene, step=1e-4, damping=20.0, gravity=(0.0, 0.0, -9.81)) for _ in range(2)]
    threads = [threading.Thread(target=each.advance, args=(0.3,)) for each in simulations]
    for thread in threads:
        thread.start()
    ticks = 0
    while any(thread.is_alive() for thread in threads):
        time.sleep(0.001)
        ticks += 1
    assert ticks > 20
    first, second = (each.displacements for each in simulations)
    assert (first == second).all() and abs(first).max() > 0.001
