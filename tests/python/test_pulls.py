"""Pulls: a weight on a spring, registration from points with errors, lost and wrong points, rigid fits, and what is refused."""

import numpy as np
import pytest
import supple
from conftest import bar


def test_a_pull_carries_the_weight(soft):
    mesh = bar(cells=(3, 3, 8))
    simulation = supple.Simulation(supple.Scene(mesh, soft, element="nodal-strain"), damping=20.0, gravity=(0.0, 0.0, -9.81))
    pulls = simulation.pull([[0.01, 0.01, 0.06]], [[0.01, 0.01, 0.06]], radius=0.012, stiffness=100.0, most=np.inf)
    simulation.advance(2.0)
    weight = 1000.0 * 0.02 * 0.02 * 0.06 * 9.81
    assert pulls.forces[0] == pytest.approx([0.0, 0.0, weight], abs=0.01 * weight)
    assert pulls.gaps[0] == pytest.approx([0.0, 0.0, weight / 100.0], abs=0.01 * weight / 100.0)
    assert pulls.points[0, 2] == pytest.approx(0.06 - weight / 100.0, abs=1e-5)


def test_a_rigid_fit_finds_the_motion_and_says_what_it_lacks():
    random = np.random.default_rng(2)
    points = random.normal(size=(6, 3))
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    seen = points @ turn.T + [1.0, 2.0, 3.0]
    seen[4] = np.nan
    for count in (6, 3):
        fit = supple.rigid_fit(points[:count], seen[:count])
        assert np.allclose(fit.rotation, turn) and np.allclose(fit(points), points @ turn.T + [1.0, 2.0, 3.0])
    assert np.allclose(fit.matrix() @ [*points[4], 1.0], [*fit(points[4]), 1.0])
    for given, words in [
        ((points[3:], seen[3:]), "2 of 3 points are seen, at least 3"),
        ((np.outer(range(5), [1.0, 1.0, 0.0]), points[:5]), "the 5 points that are seen lie on a line"),
        ((points, seen[:5]), r"points of shape \(6, 3\), seen of shape \(5, 3\)"),
    ]:
        with pytest.raises(supple.InputError, match=words):
            supple.rigid_fit(*given)


def bent(points):
    """A smooth deformation, up to 10 mm."""
    x, y, z = points.T
    return np.column_stack([x + 3.0 * z * z, y - 0.1 * z, z])


def error_of(simulation, mesh):
    return np.linalg.norm(simulation.positions - bent(mesh.points), axis=1).mean()


@pytest.mark.parametrize("method", ["exact", "long", "auto"])
def test_points_with_errors_register_a_body(soft, method):
    mesh, random = bar(cells=(4, 4, 12)), np.random.default_rng(4)
    step = {"long": 4e-3, "exact": None, "auto": None}[method]
    simulation = supple.Simulation(supple.Scene(mesh, soft, element="nodal-strain"), method, step=step, damping=20.0)
    chosen = random.choice(len(mesh.points), 24, replace=False)
    targets = bent(mesh.points[chosen]) + random.normal(0.0, 0.0003, (24, 3))
    targets[3] += [0.0, 0.015, 0.0]  # one is wrong
    targets[7] = np.nan  # one is not seen
    pulls = simulation.pull(mesh.points[chosen], targets)
    before = error_of(simulation, mesh)
    for _ in range(20):
        report = simulation.advance(0.1)
    gaps = np.linalg.norm(pulls.gaps, axis=1)
    print(f"{method}: {1e3 * error_of(simulation, mesh):.2f} mm of {1e3 * before:.2f} mm, gaps {np.round(1e3 * gaps, 1)} mm")
    assert report.ok and error_of(simulation, mesh) < 0.25 * before
    assert gaps.argmax() == 3 and gaps[3] > 3.0 * np.delete(gaps, 3).max()
    assert not pulls.forces[7].any() and np.isnan(pulls.targets[7]).all()


def test_points_turn_with_a_body_that_settles_and_feed_no_motion(soft):
    mesh, (sine, cosine) = bar(cells=(3, 3, 8)), (np.sin(0.7), np.cos(0.7))
    turn = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
    at = np.array([[0.01, 0.02, 0.06], [0.01, 0.0, 0.05], [0.0, 0.0, 0.06], [0.0, 0.02, 0.0]])
    simulation = supple.Simulation(supple.Scene(mesh, soft, element="nodal-strain"), damping=20.0)
    pulls = simulation.pull(at, at @ turn.T)
    assert simulation.settle(1e-5).at_rest
    off = np.linalg.norm(simulation.positions - mesh.points @ turn.T, axis=1).max()
    # A knock, and targets that move to where they are in each frame.
    simulation.set_forces([0], [[0.0, 0.05, 0.0]])
    fastest = []
    for _ in range(60):
        pulls.move(at @ turn.T, within=1 / 60)
        fastest.append(simulation.advance(1 / 60).kinetic_energy)
        simulation.set_forces([], np.zeros((0, 3)))
    print(f"settled {1e3 * off:.3f} mm off, {max(fastest):.1e} J after the knock, {fastest[-1]:.1e} at last")
    assert off < 1e-4 and 1e-9 < max(fastest[:3]) == max(fastest) and fastest[-1] < 1e-3 * max(fastest)


def test_targets_move_and_pulls_end(soft):
    mesh = bar()
    simulation = supple.Simulation(supple.Scene(mesh, soft), damping=20.0)
    first = simulation.pull([[0.01, 0.01, 0.0], [0.01, 0.01, 0.06]], [[0.01, 0.01, 0.0], [0.01, 0.01, 0.06]])
    side = simulation.pull([[0.01, 0.0, 0.03]], [[0.015, 0.003, 0.03]], along=[0.0, 1.0, 0.0])
    for frame in range(30):
        first.move([[0.01, 0.01 + 1e-4 * frame, 0.0], [0.01, 0.01 + 1e-4 * frame, 0.06]], within=1 / 60)
        simulation.advance(1 / 60)
    assert first.points[:, 1] == pytest.approx([0.0129] * 2, abs=5e-4)
    # Only along its direction; the push against its side turns the bar a little.
    assert side.gaps[0, 0] == 0.0 and side.points[0, 0] == pytest.approx(0.01, abs=1e-3)
    side.release()
    with pytest.raises(supple.InputError, match="were released"):
        side.points
    assert first.points[:, 1] == pytest.approx([0.0129] * 2, abs=5e-4)


def test_each_group_of_pulls_goes_its_own_way(soft):
    mesh, ends = bar(), np.array([[0.01, 0.01, 0.06], [0.01, 0.01, 0.0]], np.float32)
    simulation = supple.Simulation(supple.Scene(mesh, soft), damping=20.0)
    slow, quick = (simulation.pull([end], [end]) for end in ends)
    aside = np.array([[0.012, 0.01, 0.06]], np.float32)
    slow.move(aside, within=0.2)
    for frame in range(10):
        quick.move([[0.01, 0.01 + 1e-4 * frame, 0.0]], within=0.01)
        if frame == 3:
            # Made anew in the middle of the way of the first.
            simulation.pull([[0.0, 0.0, 0.03]]).release()
        simulation.advance(0.01)
        target = slow.points[0] + slow.gaps[0]
        assert target[0] == pytest.approx(0.01 + 1e-4 * (frame + 1), abs=2e-6), frame
    simulation.reset()
    simulation.advance(1e-3)
    assert slow.points[0] + slow.gaps[0] == pytest.approx(aside[0], abs=1e-6)


def test_what_cannot_be_is_refused(soft):
    simulation = supple.Simulation(supple.Scene(bar(), soft))
    at = [[0.01, 0.01, 0.03]]
    for arguments, words in [
        ({"radius": -1.0}, "radius -1.0"),
        ({"stiffness": 2e6}, "stiffness"),
        ({"most": np.nan}, "most nan"),
        ({"along": [[0.0, np.nan, 0.0]]}, "along"),
        ({"along": [0.0, 0.0, 0.0]}, r"along: row 0 is \[0.0, 0.0, 0.0\], no direction"),
        ({"targets": [[0.0, 0.0]]}, r"their shape is \(1, 2\)"),
    ]:
        with pytest.raises(supple.InputError, match=words):
            simulation.pull(at, **arguments)
    with pytest.raises(supple.InputError, match="no node is nearer"):
        simulation.pull([[1.0, 0.0, 0.0]], radius=0.001)
    with pytest.warns(RuntimeWarning, match="point 1 is 5 mm outside the tissue: is it in metres"):
        simulation.pull([*at, [0.01, 0.01, 0.065]], radius=0.009).release()
    pulls = simulation.pull(at)
    with pytest.raises(supple.InputError, match="targets"):
        pulls.move([[np.inf, 0.0, 0.0]])
    assert simulation.advance(0.01).ok


def test_learned_steps_do_not_know_pulls():
    from test_motion import ROOT

    mesh = bar()
    material = supple.Material("exponential", a=59.0, b=8.023, d=60000.0, density=1000.0)
    scene = supple.Scene(mesh, material, fixed=mesh.points[:, 2] < 1e-6, element="linear")
    simulation = supple.Simulation(scene, "learned", weights=ROOT / "weights" / "compact-10.weights", lead_in=0.0, fallback=False)
    simulation.pull([[0.01, 0.01, 0.06]], [[0.011, 0.01, 0.06]])
    with pytest.raises(supple.Diverged, match="does not know pulls"):
        simulation.advance(0.5)
