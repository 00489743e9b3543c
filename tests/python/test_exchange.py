"""Tissue that changes while it moves: resection, ablation, and what is refused."""

import warnings

import numpy as np
import pytest
import supple
from conftest import bar


def scene_of(mesh, material, element="nodal-strain", **more):
    return supple.Scene(mesh, material, fixed=mesh.points[:, 2] < 1e-6, element=element, **more)


def centres(mesh):
    return mesh.points[mesh.tets].mean(axis=1)


def momentum_of(mesh, velocities, stay):
    share = np.zeros(len(mesh.points))
    np.add.at(share, mesh.tets[stay], mesh.volumes[stay, None] / 4.0)
    return 1000.0 * (share[:, None] * velocities).sum(axis=0)


@pytest.mark.parametrize("element", ["linear", "nodal-pressure", "nodal-strain"])
@pytest.mark.parametrize("method", ["exact", "long"])
def test_elements_go_and_the_rest_goes_on(soft, element, method):
    mesh = bar(cells=(4, 4, 12))
    gone = (centres(mesh)[:, 2] > 0.03) & (centres(mesh)[:, 0] > 0.01)
    simulation = supple.Simulation(scene_of(mesh, soft, element), method, damping=30.0, gravity=(2.0, 0.0, 0.0), guard=False)
    simulation.set_forces([len(mesh.points) - 1], [0.0, 1e-5, 0.0])
    simulation.advance(0.05)
    before, old = momentum_of(mesh, simulation.velocities, ~gone), simulation.displacements
    time, moved = simulation.time, old.copy()
    simulation.remove(gone)
    assert simulation.time == time and (simulation.displacements == moved).all()
    # Nodes that are alone stand still, the others keep their velocity.
    assert momentum_of(mesh, simulation.velocities, ~gone) == pytest.approx(before, rel=1e-5, abs=1e-9)
    alone = np.setdiff1d(np.arange(len(mesh.points)), mesh.tets[~gone])
    assert len(alone) > 10 and not simulation.velocities[alone].any()
    for _ in range(100):
        assert simulation.advance(0.02).ok
    never = supple.Simulation(scene_of(mesh, soft, element, removed=gone), method, damping=30.0, gravity=(2.0, 0.0, 0.0), guard=False)
    for _ in range(102):
        never.advance(0.02)
    left = np.unique(mesh.tets[~gone])
    off = np.linalg.norm(simulation.displacements - never.displacements, axis=1)[left].max()
    way = np.linalg.norm(never.displacements[left], axis=1).max()
    print(f"{element}, {method}: {1e3 * off:.4f} of {1e3 * way:.2f} mm")
    assert off < 0.02 * way and abs(simulation.displacements[alone] - moved[alone]).max() < 1e-8
    # What was a view is one of the former motion.
    assert (old == moved).all()


def test_an_ablation_ends_where_a_body_is_that_was_so_from_the_start(soft):
    mesh = bar(cells=(3, 3, 10))
    region = (centres(mesh)[:, 2] > 0.015) & (centres(mesh)[:, 2] < 0.04)
    stiff = supple.Material.from_moduli(15000.0, 0.45, density=1000.0)
    simulation = supple.Simulation(scene_of(mesh, soft), damping=30.0, gravity=(4.0, 0.0, 0.0))
    simulation.advance(0.2)
    simulation.ablate(np.flatnonzero(region), stiff, 0.4)
    seen = set()
    for _ in range(100):
        simulation.advance(0.02)
        seen.add(float(simulation.scene._tissues["constants"][1, 0]))
    assert len(seen) == 21 and max(seen) == pytest.approx(stiff.constants["c"]) and not simulation._ablations
    parts = supple.Mesh(mesh.points, mesh.tets, regions=region.astype(int))
    always = supple.Simulation(scene_of(parts, {0: soft, 1: stiff}), damping=30.0, gravity=(4.0, 0.0, 0.0))
    always.advance(2.2)
    off, way = abs(simulation.displacements - always.displacements).max(), abs(always.displacements).max()
    print(f"{1e3 * off:.4f} of {1e3 * way:.2f} mm")
    assert off < 0.002 * way
    # Again, and at once: at rest it is that of the soft bar; and with some of it removed.
    simulation.ablate(region, soft, 0.0)
    soft_bar = supple.Simulation(scene_of(mesh, soft), damping=30.0, gravity=(4.0, 0.0, 0.0))
    assert simulation.settle(1e-5).at_rest and soft_bar.settle(1e-5).at_rest
    assert always.settle(1e-5).at_rest
    off, between = (abs(each.displacements - soft_bar.displacements).max() for each in (simulation, always))
    print(f"at rest {1e3 * off:.3f} mm off the soft bar, the stiff one {1e3 * between:.3f} mm")
    assert off < 0.1 * between
    simulation.remove(np.flatnonzero(centres(mesh)[:, 2] > 0.05))
    assert simulation.advance(0.1).ok and len(simulation.scene._tissues) == 3


def test_fields_and_points_are_those_of_what_is_left(soft):
    """A slab is cut out and the gap closes: living tissue lies where removed elements would be."""
    mesh = supple.Mesh.box((0.02, 0.02, 0.08), (3, 3, 16))
    heights = centres(mesh)[:, 2]
    gone = (heights > 0.03) & (heights < 0.05) & (centres(mesh)[:, 0] > 0.006)
    simulation = supple.Simulation(scene_of(mesh, soft), damping=30.0, gravity=(1.5, 0.0, 0.0))
    simulation.remove(np.flatnonzero(gone))
    simulation.advance(0.5)
    shape = simulation.scene._mesh_of_tissue()
    assert len(shape.tets) == (~gone).sum()
    grid = supple.Grid((-5.0, -5.0, -2.0), (2.0, 2.0, 2.0), (30, 15, 45))
    left = supple.displacement_field(shape, simulation.displacements, grid, "inverse", axes="LPS")
    assert (simulation.field(grid, "inverse").values == left.values).all()
    points = simulation.locate([[0.015, 0.01, 0.04], [0.01, 0.01, 0.01]])
    assert points.distances[0] > 1e-3 and points.distances[1] == 0.0 and not gone[points.elements].any()


def test_what_is_written_is_what_is_left(soft, tmp_path):
    mesh = bar()
    mesh = supple.Mesh(mesh.points, mesh.tets, regions=np.arange(len(mesh.tets)))
    simulation = supple.Simulation(scene_of(mesh, soft), gravity=(1.0, 0.0, 0.0))
    gone = centres(mesh)[:, 2] > 0.03
    simulation.advance(0.01)
    simulation.remove(gone)
    simulation.write(tmp_path / "left.vtu")
    left = supple.Mesh.read(tmp_path / "left.vtu")
    assert (left.regions == np.flatnonzero(~gone)).all()
    assert left.points == pytest.approx(simulation.positions[np.unique(mesh.tets[~gone])], abs=1e-7)


@pytest.mark.parametrize("kinds", [3, 6])
def test_tissues_that_meet_finely_find_their_memory(soft, kinds):
    """Where elements of a tissue meet in edges and corners only, a node has more neighbours than the size takes for usual."""
    mesh = bar(cells=(8, 8, 8))
    region = np.random.default_rng(0).integers(0, kinds, len(mesh.tets))
    material = [supple.Material.from_moduli(3000.0 + 100.0 * kind, 0.45, density=1000.0) for kind in range(kinds)]
    mixed = supple.Scene(supple.Mesh(mesh.points, mesh.tets, regions=region), dict(enumerate(material)), fixed=mesh.points[:, 2] < 1e-6)
    assert supple.Simulation(mixed, gravity=(0.0, 0.0, -1.0)).advance(0.01).ok
    ablated = supple.Simulation(scene_of(mesh, soft), gravity=(0.0, 0.0, -1.0))
    for kind in range(1, kinds):
        ablated.ablate(region == kind, material[kind], 0.001)
        assert ablated.advance(0.002).ok
    ablated.exchange(mixed)
    assert ablated.advance(0.002).ok


def test_instruments_and_pulls_follow(soft):
    mesh = bar(cells=(4, 4, 12))
    simulation = supple.Simulation(scene_of(mesh, soft), damping=30.0)
    simulation.set_instruments([supple.Instrument.sphere(0.008, (0.01, 0.01, 0.08))], grips=30)
    pulls = simulation.pull([[0.01, 0.0, 0.06], [0.0, 0.01, 0.04]], [[0.01, -0.005, 0.06], [-0.004, 0.01, 0.04]], radius=0.006)
    simulation.advance(0.1)
    assert (np.linalg.norm(pulls.forces, axis=1) > 1e-3).all()
    simulation.remove(centres(mesh)[:, 2] > 0.045)
    # The new surface is 15 mm lower.
    simulation.move(0, (0.01, 0.01, 0.045 + 0.008 - 0.003), within=0.4)
    for _ in range(25):
        simulation.advance(0.02)
    touch = simulation.touch(0)
    middle = np.flatnonzero(np.isclose(mesh.points, [0.01, 0.01, 0.045], atol=1e-6).all(axis=1))
    print(touch.force, simulation.displacements[middle])
    assert touch.force[2] > 1e-3 and simulation.displacements[middle[0], 2] < -0.0015
    assert not pulls.forces[0].any() and np.linalg.norm(pulls.forces[1]) > 1e-3


def test_what_cannot_be_is_refused_and_the_motion_goes_on(soft):
    mesh, other = bar(), bar(size=(0.02, 0.02, 0.05))
    exponential = supple.Material("exponential", a=1500.0, b=8.0, d=40000.0, density=1060.0)
    simulation, undisturbed = (supple.Simulation(scene_of(mesh, soft), gravity=(1.0, 0.0, 0.0)) for _ in range(2))
    for each in (simulation, undisturbed):
        each.advance(0.05)
    driven = supple.Simulation(supple.Scene(mesh, soft, moved=[0]))
    driven.set_motions([0], (0.001, 0.0, 0.0))
    bad = supple.Material("neo-hookean", c=float("nan"), d=1.0, density=1000.0)
    for wrong, words in [
        (lambda: simulation.exchange(scene_of(other, soft)), "exchange: .*node"),
        (lambda: simulation.remove([len(mesh.tets)]), f"remove: entry 0 is element {len(mesh.tets)}"),
        (lambda: simulation.remove(np.ones(len(mesh.tets), bool)), "the scene: "),
        (lambda: simulation.remove(np.ones(3, bool)), r"a mask of shape \(3,\), there are \d+ elements"),
        (lambda: simulation.ablate([0], exponential, 1.0), "another law"),
        (lambda: simulation.ablate([], soft, 1.0), "there are no elements"),
        (lambda: simulation.ablate([0], soft, -1.0), "-1.0 s"),
        (lambda: simulation.ablate([0], bad, 1.0), "finite and positive"),
        (lambda: driven.exchange(scene_of(mesh, soft)), r"exchange: node .* has a motion, .* set_motions\(\[\], \(0, 0, 0\)\)"),
    ]:
        with pytest.raises(supple.InputError, match=words):
            wrong()
    for each in (simulation, undisturbed):
        each.advance(0.05)
    assert (simulation.displacements == undisturbed.displacements).all()


def test_an_ablation_tells_of_what_it_leaves(soft):
    simulation = supple.Simulation(scene_of(bar(), soft))
    other = supple.Material.from_moduli(9000.0, 0.45, density=5000.0, prony=[[0.5, 0.1]], fibres=[1e3, 1.0])
    with pytest.warns(RuntimeWarning, match="ablate: density and prony and fibres of the material differ .* exchange a scene of it"):
        simulation.ablate([0], other, 0.1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulation.ablate([1], supple.Material.from_moduli(9000.0, 0.45, density=soft.density), 0.1)


def test_reset_and_restore_go_back_in_motion_alone(soft):
    """The tissue stays as it is: an ablation under way ends where it is, unless it had begun by the time that is restored."""
    mesh, stiff = bar(cells=(2, 2, 6)), supple.Material.from_moduli(15000.0, 0.45, density=1000.0)
    everything = np.ones(len(mesh.tets), bool)
    made = lambda: supple.Simulation(scene_of(mesh, soft), damping=20.0, gravity=(2.0, 0.0, 0.0))
    constants_of = lambda simulation: simulation.scene._tissues["constants"][1].copy()

    def half_ablated():
        simulation = made()
        simulation.advance(0.1)
        before = simulation.save()
        simulation.advance(0.1)
        simulation.ablate(everything, stiff, 0.2)
        simulation.advance(0.05)
        within = simulation.save()
        for _ in range(5):
            simulation.advance(0.01)
        return simulation, before, within

    for back in ("reset", "before", "within"):
        simulation, before, within = half_ablated()
        constants = constants_of(simulation)
        assert soft.constants["c"] < constants[0] < stiff.constants["c"]
        if back == "reset":
            simulation.reset()
            assert simulation.time == 0.0 and not simulation.displacements.any()
        else:
            simulation.restore({"before": before, "within": within}[back])
        simulation.advance(0.01)
        assert (constants_of(simulation) == constants).all(), back
        for _ in range(60):
            simulation.advance(0.01)
        assert (constants_of(simulation) == constants).all() == (back != "within"), back
        if back == "within":
            assert constants_of(simulation)[0] == pytest.approx(stiff.constants["c"])
    # What is removed stays so.
    simulation = made()
    simulation.remove(centres(mesh)[:, 2] > 0.04)
    left = simulation.scene.facts["elements"]
    simulation.reset()
    assert simulation.scene.facts["elements"] == left < made().scene.facts["elements"]


@pytest.mark.parametrize("method", ["exact", "long"])
def test_a_scene_that_was_kept_has_the_tissue_of_its_time(soft, method):
    mesh, stiff = bar(cells=(2, 2, 6)), supple.Material.from_moduli(15000.0, 0.45, density=1000.0)
    made = lambda: supple.Simulation(scene_of(mesh, soft), method, step=2e-4 if method == "exact" else 2e-3, damping=20.0, gravity=(2.0, 0.0, 0.0))
    simulation, undisturbed = made(), made()
    for each in (simulation, undisturbed):
        each.advance(0.1)
    saved, as_it_was = simulation.save(), simulation.scene
    simulation.ablate(np.ones(len(mesh.tets), bool), stiff, 0.0)
    simulation.advance(0.1)
    simulation.remove(centres(mesh)[:, 2] > 0.05)
    simulation.advance(0.1)
    simulation.exchange(as_it_was)
    simulation.restore(saved)
    for each in (simulation, undisturbed):
        each.advance(0.1)
    off = abs(simulation.displacements - undisturbed.displacements).max()
    print(f"{method}: {1e6 * off:.3f} um")
    assert off == 0.0 if method == "exact" else off < 1e-5


def test_a_scene_in_the_middle_of_an_ablation_can_be_used_again(soft):
    """Its constants are those that are reached."""
    mesh, stiff = bar(cells=(2, 2, 6)), supple.Material.from_moduli(15000.0, 0.45, density=1000.0)
    made = lambda scene: supple.Simulation(scene, damping=20.0, gravity=(2.0, 0.0, 0.0))
    simulation = made(scene_of(mesh, soft))
    simulation.ablate(np.ones(len(mesh.tets), bool), stiff, 0.2)
    for _ in range(10):
        simulation.advance(0.011)
    again = made(simulation.scene)
    simulation.exchange(simulation.scene)
    # The latest stage began at 0.099 s: the ninth of twenty.
    between = {name: 0.55 * soft.constants[name] + 0.45 * stiff.constants[name] for name in "cd"}
    expected = made(scene_of(mesh, supple.Material("neo-hookean", **between, density=1000.0)))
    for each in (simulation, again, expected):
        assert each.settle(1e-6).at_rest
    way = abs(expected.displacements).max()
    offs = [abs(each.displacements - expected.displacements).max() for each in (simulation, again)]
    print(f"{1e6 * max(offs):.2f} um of {1e3 * way:.3f} mm")
    assert max(offs) < 3e-6 < 0.05 * way
