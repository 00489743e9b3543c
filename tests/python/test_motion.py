"""Motions held against what is not ours: free fall, momentum, uniaxial compression, and the other methods."""

import concurrent.futures

import numpy as np
import pytest
import supple
from conftest import ROOT, bar

GRAVITY = np.array([0.0, 0.0, -9.81])


def mean_error(simulation, reference):
    return np.linalg.norm(simulation.displacements - reference, axis=1).mean()


def test_a_free_body_falls(soft):
    """By g t (t + dt) / 2, with the velocity g t: what central differences from u(0) = u(-dt) = 0 make of it."""
    simulation = supple.Simulation(supple.Scene(bar(), soft), step=2e-4, gravity=GRAVITY)
    report = simulation.advance(0.1)
    assert report.ok and report.time == pytest.approx(0.1, abs=1e-6)
    fallen = 0.5 * GRAVITY * report.time * (report.time + 2e-4)
    assert simulation.displacements.mean(axis=0) == pytest.approx(fallen, abs=1e-6)
    assert np.ptp(simulation.displacements, axis=0).max() < 1e-5
    assert simulation.velocities.mean(axis=0) == pytest.approx(GRAVITY * report.time, abs=1e-4)


def test_a_force_gives_its_impulse(soft):
    """The momentum of a free body is force times time."""
    mesh = bar()
    scene = supple.Scene(mesh, soft)
    simulation = supple.Simulation(scene, step=2e-4)
    newton = np.array([0.003, 0.0, 0.004])
    simulation.set_forces([0, 7], newton)
    simulation.advance(0.05)
    share = np.zeros(len(mesh.points))
    np.add.at(share, mesh.tets, mesh.volumes[:, None] / 4.0)
    momentum = 1000.0 * (share[:, None] * simulation.velocities).sum(axis=0)
    assert momentum == pytest.approx(2.0 * newton * 0.05, rel=1e-3, abs=1e-8)
    assert scene.facts["mass"] == pytest.approx(1000.0 * 0.02 * 0.02 * 0.06, rel=1e-5)


def test_a_bar_is_pulled_by_hooke(soft):
    """A slow small pull at the end of a bar: F = E A dl / l, to what the clamped end adds."""
    mesh = bar(cells=(4, 4, 12))
    end = mesh.points[:, 2] > 0.0599
    scene = supple.Scene(mesh, soft, fixed=mesh.points[:, 2] < 1e-6, element="nodal-strain")
    simulation = supple.Simulation(scene, damping=40.0)
    force = 0.01
    simulation.set_forces(end, [0.0, 0.0, force / end.sum()], ramp=0.2)
    simulation.advance(1.0)
    stretch = simulation.displacements[end, 2].mean()
    expected = force * 0.06 / (3000.0 * 0.02**2)
    assert stretch == pytest.approx(expected, rel=0.06)


def test_moved_nodes_follow(soft):
    mesh = bar()
    end = mesh.points[:, 2] > 0.0599
    scene = supple.Scene(mesh, soft, fixed=mesh.points[:, 2] < 1e-6, moved=end)
    simulation = supple.Simulation(scene, damping=20.0)
    simulation.set_motions(end, [0.004, 0.0, 0.0], ramp=0.1)
    simulation.advance(0.3)
    assert simulation.displacements[end] == pytest.approx(np.tile([0.004, 0.0, 0.0], (end.sum(), 1)), abs=1e-7)
    middle = np.isclose(mesh.points[:, 2], 0.03)
    assert 0.001 < simulation.displacements[middle, 0].mean() < 0.003


@pytest.mark.parametrize(
    ("method", "options", "most"),
    [
        ("long", {"step": 2e-3}, 0.01),
        ("long", {}, 0.03),
        ("auto", {"tolerance": 5e-4}, 0.03),
        ("auto", {}, 0.03),
    ],
)
def test_long_steps_follow_exact_ones(lobe, liver, method, options, most):
    """The lobe sags: the error is below this share of the motion, which is that of not moving."""
    scene = supple.Scene(lobe, liver, fixed=lobe.points[:, 1] > 0.03)
    exact = supple.Simulation(scene, damping=20.0, gravity=GRAVITY)
    exact.advance(0.4)
    still = np.linalg.norm(exact.displacements, axis=1).mean()
    assert still > 0.005
    simulation = supple.Simulation(scene, method, damping=20.0, gravity=GRAVITY, **options)
    for _ in range(24):
        report = simulation.advance(1.0 / 60.0)
    error = mean_error(simulation, exact.displacements)
    print(f"{method}: {1e3 * error:.3f} of {1e3 * still:.3f} mm, estimate {1e3 * (report.estimate or 0.0):.3f} mm, {report.status}")
    assert error < most * still
    assert report.steps == report.exact + report.long > 0 and (report.long > 0 or method == "auto")
    assert report.estimate is not None and report.estimate > 0.3 * error - 1e-6


def test_weights_are_those_of_learned_steps(lobe, liver):
    """Other steps, and a network of another shape, are refused in words."""
    scene = supple.Scene(lobe, liver, fixed=lobe.points[:, 1] > 0.03)
    with pytest.raises(supple.InputError, match="weights are those of learned steps; long steps have none"):
        supple.Simulation(scene, "long", step=2e-3, weights=ROOT / "weights" / "compact-10.weights")
    with pytest.raises(supple.InputError, match="damping 3 1/s: the network learned with"):
        supple.Simulation(scene, "learned", weights=ROOT / "weights" / "compact-10.weights", damping=3.0)
    with pytest.raises(supple.InputError, match="learned: .*other-shape"):
        supple.Simulation(scene, "learned", weights=ROOT / "tests" / "data" / "other-shape.weights")


def test_a_ball_presses_and_leaves(lobe, liver):
    """No node is inside the ball, its force points outwards, and what it has left comes back."""
    scene = supple.Scene(lobe, liver, fixed=lobe.points[:, 1] > 0.03)
    simulation = supple.Simulation(scene, damping=30.0)
    top = lobe.points[lobe.points[:, 2].argmax()].astype(float)
    at = lambda depth: top + [0.0, 0.0, 0.01 - depth]
    simulation.set_instruments([supple.Instrument.sphere(0.01, at(-0.001), friction=0.3)])
    for frame in range(30):
        simulation.move(0, at(-0.001 + 0.005 * (frame + 1) / 30), within=1.0 / 60.0)
        assert simulation.advance(1.0 / 60.0).ok
    touch = simulation.touch(0)
    distance = np.linalg.norm(simulation.positions - at(0.004), axis=1)
    assert distance.min() > 0.01 - 1e-5
    assert touch.mean_force[2] > 0.02 and touch.contacts > 0
    pressed = np.linalg.norm(simulation.displacements, axis=1).max()
    assert pressed > 0.003
    simulation.move(0, at(-0.01), within=0.1)
    simulation.advance(1.0)
    assert simulation.touch(0).contacts == 0 and not simulation.touch(0).force.any()
    assert np.linalg.norm(simulation.displacements, axis=1).max() < 0.02 * pressed


def test_forceps_hold_and_let_go(soft):
    mesh = bar()
    scene = supple.Scene(mesh, soft, fixed=mesh.points[:, 2] < 1e-6)
    simulation = supple.Simulation(scene, damping=20.0)
    simulation.set_instruments([supple.Instrument.sphere(0.004, [0.01, 0.01, 0.0645])], grips=16)
    assert simulation.grasp(0, 0.003) > 0
    simulation.move(0, [0.014, 0.01, 0.0645], within=0.2)
    simulation.advance(0.4)
    held = np.linalg.norm(simulation.displacements, axis=1).max()
    assert held == pytest.approx(0.004, rel=0.3)
    simulation.let_go(0)
    simulation.move(0, [0.014, 0.01, 0.2], within=0.2)
    simulation.advance(1.0)
    assert np.linalg.norm(simulation.displacements, axis=1).max() < 0.1 * held


def test_refused_instruments_leave_those_that_there_are(lobe, liver):
    """Also in memory that the refused ones would have taken."""
    scene = supple.Scene(lobe, liver, fixed=lobe.points[:, 1] > 0.03)
    top = lobe.points[lobe.points[:, 2].argmax()].astype(float)
    forces = []
    for refused in (False, True):
        simulation = supple.Simulation(scene, damping=30.0)
        simulation.set_instruments([supple.Instrument.sphere(0.01, top + [0.0, 0.0, 0.011])])
        if refused:
            with pytest.raises(supple.InputError, match="instruments: more than there is room for: value 9"):
                simulation.set_instruments([supple.Instrument.sphere(0.01, top)] * 9, grips=10)
        simulation.move(0, top + [0.0, 0.0, 0.007], within=0.1)
        simulation.advance(0.1)
        forces.append(simulation.touch(0).mean_force)
    assert forces[0][2] > 0.02 and (forces[0] == forces[1]).all()


@pytest.mark.parametrize("element", ["nodal-pressure", "nodal-strain"])
def test_a_call_of_any_length_follows_the_critical_step(element):
    """A cube of 10 kPa sags under gravity: one call of a second comes to where frames of a sixtieth come."""
    mesh = supple.Mesh.box((0.06, 0.06, 0.06), (6, 6, 6))
    scene = supple.Scene(mesh, supple.Material.from_moduli(10e3, 0.45, density=1060), fixed=mesh.points[:, 0] < 1e-6, element=element)
    ends = []
    for frames in (1, 60):
        simulation = supple.Simulation(scene, damping=20.0, gravity=GRAVITY)
        for _ in range(frames):
            simulation.advance(1.0 / frames)
        ends.append(simulation.displacements.copy())
    sag = np.linalg.norm(ends[1], axis=1).mean()
    assert sag > 1e-3 and np.linalg.norm(ends[0] - ends[1], axis=1).mean() < 0.01 * sag


def test_two_threads_take_turns(lobe, liver):
    scene = supple.Scene(lobe, liver, fixed=lobe.points[:, 1] > 0.03)
    once = supple.Simulation(scene, step=1e-4, damping=20.0, gravity=GRAVITY)
    for _ in range(40):
        once.take(10)
    both = supple.Simulation(scene, step=1e-4, damping=20.0, gravity=GRAVITY)
    with concurrent.futures.ThreadPoolExecutor(2) as threads:
        for done in [threads.submit(both.take, 10) for _ in range(40)]:
            assert done.result().steps == 10
    assert both.time == pytest.approx(0.04) and np.array_equal(both.displacements, once.displacements)


def test_a_saved_state_goes_on_to_the_bit(lobe, liver):
    scene = supple.Scene(lobe, liver, fixed=lobe.points[:, 1] > 0.03)
    simulation = supple.Simulation(scene, step=1e-4, damping=20.0, gravity=GRAVITY)
    simulation.advance(0.02)
    saved, time = simulation.save(), simulation.time
    simulation.advance(0.02)
    once = simulation.displacements.copy()
    simulation.restore(saved)
    assert simulation.time == time
    simulation.advance(0.02)
    assert (simulation.displacements == once).all() and abs(once).max() > 1e-4


def test_a_network_moves_the_bar_of_its_training():
    """The paper's bar under a load like that of the training; the error is below that of standing still."""
    from conftest import ROOT

    mesh = bar(cells=(8, 8, 17), size=(0.05, 0.05, 0.1))
    material = supple.Material("exponential", a=59.0, b=8.023, d=60000.0, density=1000.0)
    scene = supple.Scene(mesh, material, fixed=mesh.points[:, 2] < 1e-6, element="linear")
    corner = np.flatnonzero((mesh.points == mesh.points.max(axis=0)).all(axis=1))
    runs = []
    for method, options in [("exact", {"damping": 20.0}), ("learned", {"weights": ROOT / "weights" / "compact-10-i8.weights"})]:
        simulation = supple.Simulation(scene, method, **options)
        simulation.set_forces(corner, [0.1, 0.0, 0.0], ramp=1.0)
        report = simulation.advance(0.8)
        assert report.learned > 0 or method == "exact"
        runs.append(simulation.displacements.copy())
    exact, learned = runs
    still = np.linalg.norm(exact, axis=1).mean()
    error = np.linalg.norm(learned - exact, axis=1).mean()
    print(f"learned: {1e3 * error:.3f} of {1e3 * still:.3f} mm")
    assert still > 0.001 and error < 0.5 * still


@pytest.mark.parametrize("method", ["exact", "long", "auto"])
def test_a_call_ends_when_its_work_is_spent(lobe, liver, method):
    simulation = supple.Simulation(supple.Scene(lobe, liver, fixed=lobe.points[:, 0] < 0.01), method, damping=20.0, most_steps=40)
    simulation.gravity = (0.0, 0.0, -9.81)
    for call in range(3):
        before, report = simulation.time, simulation.advance(1.0)
        assert report.status == "behind" and report.missing == pytest.approx(before + 1.0 - report.time)
        assert 40 <= report.exact + report.undone + 4 * report.long < 44
    assert np.abs(simulation.displacements).max() > 1e-6
    with pytest.raises(supple.InputError, match="most_steps 0: it must be a whole number, at least 1"):
        supple.Simulation(simulation.scene, most_steps=0)
