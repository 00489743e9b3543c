"""Tissue that relaxes."""

import numpy as np
import pytest
import supple
from conftest import ROOT, bar

PRONY = [[0.5, 0.05], [0.2, 0.5]]


def relaxing(soft, prony):
    return supple.Material("neo-hookean", **soft.constants, density=soft.density, prony=prony)


def hanging(soft, method="exact", element="nodal-strain", **more):
    mesh = bar(cells=(2, 2, 6))
    scene = supple.Scene(mesh, relaxing(soft, PRONY), fixed=mesh.points[:, 2] < 1e-6, element=element)
    return supple.Simulation(scene, method, damping=20.0, gravity=(0.5, 0.0, 0.0), **more)


def test_the_force_on_a_sheared_bar_falls_as_the_closed_form(soft):
    """A shear keeps the volume, so that all of its stress relaxes: the first force times 1 - sum g (1 - e^(-t / tau))."""
    mesh = bar(cells=(2, 2, 4))
    top, inner = mesh.points[:, 2] > 0.0599, np.linalg.norm(mesh.points - [0.01, 0.01, 0.03], axis=1) < 1e-6
    assert inner.sum() == 1
    step, shear = 5e-4, 0.1
    shape = np.zeros_like(mesh.points)
    shape[:, 0] = shear * mesh.points[:, 2]
    for element in ("linear", "nodal-pressure", "nodal-strain"):
        scene = supple.Scene(mesh, relaxing(soft, PRONY), moved=~inner, element=element)
        simulation = supple.Simulation(scene, step=step)
        simulation.set_displacements(shape)
        forces = []
        for _ in range(100):
            simulation.take(1)
            forces.append(simulation.forces[top, 0].sum())
        time = step * np.arange(100)
        factor = 1.0 - sum(share * (1.0 - np.exp(-time / seconds)) for share, seconds in PRONY)
        off = abs(np.array(forces) / forces[0] / factor - 1.0).max()
        stiffness = 2.0 * soft.constants["c"] * shear * 0.02**2
        print(f"{element}: {forces[0]:.4g} N at first, {-stiffness:.4g} expected, then {off:.1e} off")
        assert off < 1e-5 and abs(forces[0]) == pytest.approx(stiffness, rel=1e-3)


@pytest.mark.parametrize("method", ["exact", "long", "auto"])
def test_a_body_creeps_to_where_it_settles(soft, method):
    simulation, settled = hanging(soft, method), hanging(soft)
    at_once = supple.Simulation(supple.Scene(simulation.scene.mesh, soft, fixed=simulation.scene.mesh.points[:, 2] < 1e-6, element="nodal-strain"))
    at_once.gravity = (0.5, 0.0, 0.0)
    assert settled.settle(1e-6).at_rest and at_once.settle(1e-6).at_rest
    for _ in range(150):
        simulation.advance(0.02)
    way, stiff = settled.displacements[:, 0].max(), at_once.displacements[:, 0].max()
    print(f"{method}: {1e3 * stiff:.3f} mm at once, {1e3 * way:.3f} mm settled, {1e3 * simulation.displacements[:, 0].max():.3f} mm after 3 s")
    # Adaptive steps are right to their tolerance, 0.3 mm on average over the nodes, 1 mm at the end.
    most = 1e-3 if method == "auto" else 0.05 * float(way)
    assert way > 1.5 * stiff and simulation.displacements[:, 0].max() == pytest.approx(way, abs=most)


def test_a_saved_state_goes_on_to_the_bit(soft):
    simulation = hanging(soft, step=2e-4)
    simulation.advance(0.05)
    saved = simulation.save()
    simulation.advance(0.05)
    end = simulation.displacements.copy()
    simulation.restore(saved)
    simulation.advance(0.05)
    assert (simulation.displacements == end).all()
    plain = supple.Simulation(supple.Scene(simulation.scene.mesh, soft, element="nodal-strain"))
    with pytest.raises(supple.InputError, match="that remembers other things"):
        plain.restore(saved)
    with pytest.raises(supple.InputError, match="that remembers other things"):
        simulation.restore(plain.save())


def test_tissue_remembers_when_elements_go_or_are_ablated(soft):
    """A crept body that loses a corner stays where it is; forgotten, it would spring back by more than half of its way."""
    for change in ("remove", "ablate"):
        simulation = hanging(soft)
        simulation.settle(1e-6)
        way, mesh = simulation.displacements[:, 0].max(), simulation.scene.mesh
        corner = [int(mesh.points[mesh.tets].mean(axis=1)[:, 2].argmax())]
        if change == "remove":
            simulation.remove(corner)
        else:
            simulation.ablate(corner, relaxing(soft, ()), 0.02)
        for _ in range(10):
            simulation.advance(0.02)
        print(f"{change}: {1e3 * way:.3f} mm, then {1e3 * simulation.displacements[:, 0].max():.3f} mm")
        assert simulation.displacements[:, 0].max() == pytest.approx(way, rel=0.05)


def test_one_of_two_tissues_relaxes(soft):
    mesh = bar(cells=(2, 2, 6))
    mesh = supple.Mesh(mesh.points, mesh.tets, regions=np.where(mesh.points[mesh.tets][:, :, 2].mean(axis=1) < 0.03, 1, 2))
    ways = []
    for lower, upper in [((), ()), (PRONY, ()), (PRONY, PRONY)]:
        materials = {1: relaxing(soft, lower), 2: relaxing(soft, upper)}
        simulation = supple.Simulation(supple.Scene(mesh, materials, fixed=mesh.points[:, 2] < 1e-6), gravity=(0.5, 0.0, 0.0))
        assert simulation.settle(1e-6).at_rest
        ways.append(simulation.displacements[:, 0].max())
    assert ways[0] < 0.8 * ways[1] and ways[1] < 0.99 * ways[2]


@pytest.mark.parametrize(
    ("prony", "words"),
    [
        ([[0.5, 1.0, 2.0]], r"prony: its shape is \(1, 3\), it must be up to three rows"),
        ([[0.1, 1.0]] * 4, r"prony: its shape is \(4, 2\)"),
        ("soft", "prony: not rows of a share and a time"),
        ([[0.0, 1.0]], "term 0 has the share 0"),
        ([[0.1, 1.0], [-0.2, 1.0]], "relaxes by a share that is not positive.*: entry 0, term 1, value -0.2, against 0.99"),
        ([[0.1, 1.0], [0.9, 1.0]], "more than may relax in sum: entry 0, value 1, against 0.99"),
        ([[0.1, 1.0], [0.2, 0.0]], "a time that is not between a microsecond and a million seconds: entry 0, term 1, value 0, against 1e-06"),
    ],
)
def test_series_that_cannot_be_are_refused_in_words(soft, prony, words):
    with pytest.raises(supple.InputError, match=words):
        supple.Scene(bar(), relaxing(soft, prony))


def test_learned_steps_do_not_know_it():
    mesh = bar(cells=(8, 8, 17), size=(0.05, 0.05, 0.1))
    material = supple.Material("exponential", a=59.0, b=8.023, d=60000.0, density=1000.0, prony=[[0.5, 1.0]])
    assert "relaxes by 0.5 in 1 s" in repr(material)
    scene = supple.Scene(mesh, material, fixed=mesh.points[:, 2] < 1e-6, element="linear")
    weights = ROOT / "weights" / "compact-10.weights"
    simulation = supple.Simulation(scene, "learned", weights=weights, fallback=False, lead_in=0.03)
    with pytest.raises(supple.Diverged, match="learned steps do not know tissue that relaxes"):
        simulation.advance(0.1)
