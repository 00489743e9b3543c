"""To rest, from displacements of one's own, and under pressures that follow the surface."""

import numpy as np
import pytest
import supple
from conftest import bar

GRAVITY = (0.4, 0.0, -1.0)
TOLERANCE = 1e-5


def held(**settings):
    """A bar that hangs from one end."""
    mesh = bar(cells=(3, 3, 8))
    material = supple.Material.from_moduli(3_000.0, 0.45, density=1000.0)
    scene = supple.Scene(mesh, material, fixed=mesh.points[:, 2] < 1e-6, element=settings.pop("element", "nodal-strain"))
    return supple.Simulation(scene, gravity=GRAVITY, **settings)


@pytest.mark.parametrize("element", ["linear", "nodal-pressure", "nodal-strain"])
def test_it_rests_where_a_damped_motion_ends(element):
    damped = held(element=element, damping=20.0)
    damped.advance(4.0)
    resting = held(element=element)
    told = resting.settle(TOLERANCE)
    apart = np.linalg.norm(resting.displacements - damped.displacements, axis=1).max()
    print(f"{element}: {told}, {apart:.2e} m from the damped motion")
    assert told.at_rest and told.status == "ok" and told.remaining < TOLERANCE and apart < TOLERANCE
    assert resting.time == 0.0 and np.all(resting.velocities == 0.0)


@pytest.mark.parametrize("method", ["exact", "long", "auto"])
def test_steps_go_on_from_rest(method):
    simulation = held(method=method, damping=20.0)
    simulation.advance(0.05)
    assert simulation.settle(TOLERANCE).at_rest
    before = simulation.displacements.copy()
    reports = [simulation.advance(0.05) for _ in range(6)]
    assert reports[-1].ok and np.abs(simulation.displacements - before).max() < 2 * TOLERANCE


def test_what_does_not_come_to_rest_says_so():
    told = held().settle(TOLERANCE, most_steps=20)
    assert not told.at_rest and told.status == "behind" and told.steps == 20
    mesh = bar(cells=(2, 2, 4))
    scene = supple.Scene(mesh, supple.Material.from_moduli(3_000.0, 0.45, density=1000.0))
    free = supple.Simulation(scene, gravity=GRAVITY)
    with pytest.warns(RuntimeWarning, match="free"):
        assert not free.settle(TOLERANCE, most_steps=300).at_rest
    for metre in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(supple.InputError, match="settle to within"):
            held().settle(metre)
    with pytest.raises(supple.InputError, match="most_steps"):
        held().settle(TOLERANCE, most_steps=0)


def test_displacements_can_be_set():
    resting = held()
    resting.settle(TOLERANCE)
    other = held(damping=20.0)
    other.set_displacements(resting.displacements)
    assert np.array_equal(other.displacements, resting.displacements)
    other.advance(0.1)
    assert np.abs(other.displacements - resting.displacements).max() < 2 * TOLERANCE
    wrong = resting.displacements.copy()
    wrong[7, 1] = np.nan
    for bad in (wrong, wrong[1:], wrong[:, :2]):
        with pytest.raises(supple.InputError, match="displacements"):
            other.set_displacements(bad)


def test_a_free_body_shrinks_under_a_pressure_by_its_bulk_modulus():
    mesh = bar(cells=(3, 3, 6))
    material = supple.Material.from_moduli(3_000.0, 0.3, density=1000.0)
    simulation = supple.Simulation(supple.Scene(mesh, material, element="nodal-pressure"))
    pressure = simulation.add_pressure(mesh.boundary(), 25.0)
    volume = pressure.volume
    simulation._is_warned = True
    assert simulation.settle(1e-7).at_rest
    bulk = 3_000.0 / (3.0 * (1.0 - 2.0 * 0.3))
    found = 1.0 - pressure.volume / volume
    print(f"{found:.6f} of {25.0 / bulk:.6f}")
    assert abs(found / (25.0 / bulk) - 1.0) < 0.01
    pressure.fill(0.99 * volume, 10 * bulk)
    pressure.pascal = 0.0
    assert pressure.pascal == 0.0
    assert simulation.settle(1e-7).at_rest
    missing = 1.0 - pressure.volume / (0.99 * volume)
    print(f"filled to {pressure.volume / volume:.5f}, {pressure.now:.2f} Pa")
    # The tissue pushes back with its own bulk modulus.
    assert abs(pressure.now / (0.01 * bulk * 10 / 11) - 1.0) < 0.02
    assert abs(-10 * bulk * missing / pressure.now - 1.0) < 1e-3
    for wrong in ((0.0, 1.0), (1e-5, -1.0), (np.nan, 1.0)):
        with pytest.raises(supple.InputError, match="fill"):
            pressure.fill(*wrong)
    pressure.fill(0.0, 0.0)
    simulation.settle(1e-7)
    assert abs(pressure.volume / volume - 1.0) < 1e-5


def test_an_open_surface_cannot_be_filled():
    simulation = held()
    faces = simulation.scene.mesh.boundary()
    for open_at in (faces[1:], faces[:7]):
        pressure = simulation.add_pressure(open_at, 0.0)
        with pytest.raises(supple.InputError, match="fill to 0.0001 m\\^3 with 100.0 Pa: the surface is open") as caught:
            pressure.fill(1e-4, 100.0)
        print(caught.value)
    simulation.add_pressure(faces, 0.0).fill(1e-4, 100.0)


def test_pressures_let_go_of_what_is_removed():
    """They act on what is left of their surfaces, as on a body that never had more; a surface that is open then does not fill."""
    cut, never = held(damping=20.0), held(damping=20.0)
    mesh = cut.scene.mesh
    gone = mesh.points[mesh.tets].mean(axis=1)[:, 0] > 0.6 * mesh.points[:, 0].max()
    sides = mesh.boundary()
    pressure = cut.add_pressure(sides, 15.0)
    pressure.fill(1e-4, 1.0)
    assert cut.advance(0.1).ok
    cut.remove(gone)
    assert pressure._filling == (0.0, 0.0) and pressure.pascal == 15.0
    left = {tuple(sorted(nodes)) for nodes in supple.mesh.boundary_of(np.ascontiguousarray(mesh.tets[~gone])).tolist()}
    never.add_pressure(np.array([nodes for nodes in sides.tolist() if tuple(sorted(nodes)) in left]), 15.0)
    never.remove(gone)
    for simulation in (cut, never):
        assert simulation.settle(1e-6).at_rest
    used = np.unique(mesh.tets[~gone])
    off = np.linalg.norm(cut.displacements[used] - never.displacements[used], axis=1).max()
    most = np.linalg.norm(never.displacements[used], axis=1).max()
    print(f"{1e3 * off:.4f} mm off of {1e3 * most:.2f} mm")
    assert off < 0.01 * most + 2e-6 and most > 1e-5
    cut.add_pressure(sides[:1], 1.0)


def test_a_surface_that_is_open_has_no_volume():
    simulation = held()
    mesh = simulation.scene.mesh
    faces = mesh.boundary()
    part, whole = simulation.add_pressure(faces[1:], 0.0), simulation.add_pressure(faces, 7.0)
    assert np.isnan(part.volume) and whole.volume == pytest.approx(mesh.volumes.sum(), rel=1e-5)
    simulation.remove(mesh.points[mesh.tets].mean(axis=1)[:, 0] > 0.6 * mesh.points[:, 0].max())
    assert np.isnan(whole.volume) and whole.now == 7.0


@pytest.mark.parametrize("way", ["remove", "exchange"])
def test_tractions_let_go_of_what_is_removed(way):
    """The end of a bar is pulled, and half of it goes: the supports bear traction times the area that is left."""
    mesh = bar(cells=(4, 4, 8))
    sides, middle = mesh.boundary(), mesh.points[mesh.tets].mean(axis=1)
    end = sides[(mesh.points[sides][:, :, 2] > 0.0599).all(axis=1)]
    gone, held = (middle[:, 2] > 0.045) & (middle[:, 0] > 0.01), mesh.points[:, 2] < 1e-6
    material = supple.Material.from_moduli(3_000.0, 0.45, density=1000.0)
    made = lambda **removed: supple.Simulation(supple.Scene(mesh, material, fixed=held, **removed), damping=20.0)
    cut, never = made(), made(removed=gone)
    cut.set_tractions(end, [0.0, 0.0, 20.0])
    cut.set_forces([0], [0.0, 0.0, 1e-3])
    assert cut.advance(0.1).ok
    if way == "remove":
        cut.remove(gone)
    else:
        cut.exchange(never.scene)
    never.set_tractions(end[(mesh.points[end][:, :, 0] < 0.0101).all(axis=1)], [0.0, 0.0, 20.0])
    for simulation in (cut, never):
        assert simulation.settle(1e-6).at_rest
    used = np.unique(mesh.tets[~gone])
    off = np.linalg.norm(cut.displacements[used] - never.displacements[used], axis=1).max()
    most = np.linalg.norm(never.displacements[used], axis=1).max()
    print(f"{1e6 * off:.2f} um off of {1e3 * most:.3f} mm")
    assert off < 2e-6 and most > 1e-4
    # Nothing is left of the end.
    cut.remove(np.flatnonzero(middle[:, 2] > 0.055))
    assert cut.settle(1e-6).at_rest and np.linalg.norm(cut.displacements[used][mesh.points[used, 2] < 0.05], axis=1).max() < 2e-6
    cut.set_tractions([], [0.0, 0.0, 0.0])
    cut.remove([0])


def test_pressures_and_tractions_are_on_triangles_of_the_boundary_each_once():
    simulation = held()
    mesh, pressed = simulation.scene.mesh, lambda triangles: simulation.add_pressure(triangles, 10.0)
    pulled = lambda triangles: simulation.set_tractions(triangles, [0.0, 0.0, 10.0])
    sides = mesh.boundary()
    of_boundary = {tuple(sorted(nodes)) for nodes in sides.tolist()}
    faces = [nodes for tet in mesh.tets.tolist() for nodes in (tet[:3], tet[1:])]
    inside = next(nodes for nodes in faces if tuple(sorted(nodes)) not in of_boundary)
    for load in (pressed, pulled):
        load(np.roll(sides, 1, axis=1))
        for triangles, words in [
            ([*sides[:5].tolist(), inside], r"triangles: row 5, \[.*\], is none of the boundary of the tissue"),
            ([*sides[:5], sides[2]], r"triangles: row 5, \[.*\], is the same as row 2: each is given once"),
            ([*sides[:5], np.roll(sides[2], 2)], "row 5, .* is the same as row 2"),
            ([[0, 0, 0]], "row 0, .* is none of the boundary"),
            (sides.ravel(), r"triangles: their shape is \(\d+,\), it must be \(k, 3\)"),
        ]:
            with pytest.raises(supple.InputError, match=words):
                load(triangles)
    # A traction has a direction of its own.
    pulled(sides[:, ::-1])
    for triangles, words in [(sides[:, ::-1], r"row 0, .* is seen from inside: .* triangles\[:, ::-1\] turns all"), ([], "there are none")]:
        with pytest.raises(supple.InputError, match=words):
            pressed(triangles)
    # What is removed has no boundary; the cut has.
    middle = mesh.points[mesh.tets].mean(axis=1)
    end = sides[(mesh.points[sides][:, :, 2] > 0.0599).all(axis=1)]
    simulation.clear_pressures()
    simulation.remove(middle[:, 2] > 0.045)
    for load in (pressed, pulled):
        with pytest.raises(supple.InputError, match="row 0, .* is none of the boundary of the tissue that is left"):
            load(end)
        cut = supple.Mesh(mesh.points, mesh.tets[middle[:, 2] < 0.045]).boundary()
        load(cut[np.isclose(mesh.points[cut][:, :, 2], 0.045).all(axis=1)])
    # With all tissue back it is inside.
    simulation.exchange(held().scene)
    assert not len(simulation._tractions) and not len(simulation._pressures[0]._numbers) and simulation.settle(TOLERANCE).at_rest


def test_pressures_are_added_changed_and_cleared():
    simulation = held(damping=20.0)
    mesh = simulation.scene.mesh
    triangles = mesh.boundary()
    low = triangles[(mesh.points[triangles][:, :, 0] < 1e-6).all(axis=1)]
    high = triangles[(mesh.points[triangles][:, :, 0] > mesh.points[:, 0].max() - 1e-6).all(axis=1)]
    first, second = simulation.add_pressure(low, 20.0, ramp=0.1), simulation.add_pressure(high, 20.0)
    second.set(5.0, ramp=0.1)
    assert (first.pascal, second.pascal) == (20.0, 5.0)
    assert simulation.advance(0.5).ok
    for triangles, pascal in ((low, np.nan), (low.ravel(), 1.0), (np.array([[0, 1, 10_000]]), 1.0)):
        with pytest.raises(supple.InputError):
            simulation.add_pressure(triangles, pascal)
    with pytest.raises(supple.InputError, match="pressure"):
        first.pascal = np.inf
    second.pascal = 1e20
    with pytest.raises(supple.Diverged, match="pressure"):
        simulation.advance(0.1)
    simulation.clear_pressures()
    simulation.stop()
    assert simulation.advance(0.1).ok
    with pytest.raises(supple.InputError, match="no more"):
        first.pascal = 1.0
