"""Fits: known values come back from another mesh with noise, what data cannot tell is told, and the unloaded shape makes a round trip."""

import numpy as np
import pytest
import supple

YOUNG = 30_000.0
GRAVITY = (9.81, 0.0, 0.0)


def at_rest(mesh, young, gravity=GRAVITY, gap=1e-6):
    """Displacements of a bar that is fixed at z = 0, at rest: with nearly critical damping until it hardly moves."""
    material = supple.Material.from_moduli(young, 0.45, density=1000.0)
    scene = supple.Scene(mesh, material, fixed=mesh.points[:, 2] < 1e-6, element="nodal-strain")
    simulation = supple.Simulation(scene, damping=80.0, gravity=gravity)
    moved = np.inf
    while moved > 0.5 * gap:
        latest = simulation.displacements.copy()
        simulation.advance(0.02)
        moved = np.abs(simulation.displacements - latest).max()
    return simulation.displacements.copy()


def bar(cells):
    return supple.Mesh.box((0.02, 0.02, 0.05), cells)


def test_young_comes_back_from_another_mesh_with_noise():
    fine, coarse = bar((6, 6, 12)), bar((3, 3, 6))
    truth = at_rest(fine, YOUNG)
    # The coarse nodes are among the fine ones.
    same = np.array([np.linalg.norm(fine.points - point, axis=1).argmin() for point in coarse.points])
    chosen = np.flatnonzero(coarse.points[:, 2] > 0.02)[::5]
    noise = np.random.default_rng(5).normal(0.0, 0.2e-3, (len(chosen), 3))
    measured = truth[same[chosen]] + noise
    measured[0] = np.nan
    found = supple.fit(
        lambda values: at_rest(coarse, values["young"])[chosen], {"young": 8e3}, measured, bounds={"young": (1000, 1000000)}, left_out=[2, 5]
    )
    print(found)
    assert found.converged and found.cannot_tell == []
    assert found.values["young"] == pytest.approx(YOUNG, rel=0.12)
    assert 1e-4 * YOUNG < found.standard_errors["young"] < 0.03 * YOUNG
    assert found.simulations <= 7
    # Three axes of 0.2 mm.
    assert found.rms == pytest.approx(0.35e-3, rel=0.4) and found.left_out_worst < 1e-3
    assert np.isnan(found.each_left_out[[0, 2, 5]]).all() and np.isfinite(found.each_left_out).sum() == len(chosen) - 3
    assert "mm rms" in str(found)


PLACES = np.random.default_rng(1).uniform(0.2, 1.0, (12, 3))


def model(values):
    """Twelve points: what one value over another moves, and a slight bend by a third."""
    return 0.01 * values.get("load", 1.0) / values["young"] * PLACES + 1e-3 * values.get("bend", 0.0) * PLACES**2


BOUNDS = {"young": (0.1, 10.0), "load": (0.1, 10.0), "bend": (-5.0, 5.0)}


def fit(simulate, start, measured, **more):
    return supple.fit(simulate, start, measured, bounds={name: BOUNDS[name] for name in start}, **more)


def test_errors_are_those_of_linear_regression():
    """Against closed forms of a linear model: standard errors, correlations, and each point left out by fitting anew without it."""
    measured = model({"young": 2.0, "bend": 1.0}) + np.random.default_rng(2).normal(0.0, 1e-4, (12, 3))
    columns = np.stack([(0.01 * PLACES).ravel(), (1e-3 * PLACES**2).ravel()], axis=1)
    (inverse_young, bend), squares = np.linalg.lstsq(columns, measured.ravel(), rcond=None)[:2]
    covariance = squares[0] / 34 * np.linalg.inv(columns.T @ columns)
    found = fit(model, {"young": 1.0, "bend": 0.0}, measured)
    assert found.values["young"] == pytest.approx(1.0 / inverse_young, rel=1e-3)
    assert found.values["bend"] == pytest.approx(bend, rel=1e-2)
    assert found.standard_errors["young"] == pytest.approx(np.sqrt(covariance[0, 0]) / inverse_young**2, rel=0.02)
    assert found.standard_errors["bend"] == pytest.approx(np.sqrt(covariance[1, 1]), rel=0.02)
    # Of the value, not of its inverse.
    assert found.correlations[0, 1] == pytest.approx(-covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1]), abs=0.02)
    for point in (0, 7):
        without = fit(model, {"young": 1.0, "bend": 0.0}, measured, left_out=[point])
        assert without.left_out_rms == pytest.approx(found.each_left_out[point], rel=0.05)


def test_what_the_data_cannot_tell_is_told():
    measured = model({"young": 2.0}) + np.random.default_rng(3).normal(0.0, 1e-4, (12, 3))
    both = fit(model, {"young": 1.0, "load": 1.0}, measured)
    assert any("cannot tell young from load: their correlation is 1.0" in sentence for sentence in both.cannot_tell), both.cannot_tell
    idle = fit(lambda values: model({"young": values["young"]}), {"young": 1.0, "bend": 1.0}, measured)
    assert idle.cannot_tell == ["bend moves no measured point; measure elsewhere, or leave it out"]
    noisy = measured + np.random.default_rng(4).normal(0.0, 5e-3, (12, 3))
    loose = fit(model, {"young": 1.0, "bend": 1.0}, noisy)
    assert any("the data cannot tell bend: its standard error" in sentence for sentence in loose.cannot_tell), loose.cannot_tell
    zero = fit(model, {"young": 1.0, "bend": 1.0}, measured)
    assert zero.standard_errors["bend"] > 0.5 * abs(zero.values["bend"]) and zero.cannot_tell == [], zero.cannot_tell
    places = fit(model, {"young": 1.0}, measured - 0.05)
    assert any("displacements and not places" in sentence for sentence in places.cannot_tell), places.cannot_tell
    limit = supple.fit(model, {"young": 1.0}, measured, bounds={"young": (0.1, 1.5)})
    assert limit.values["young"] == pytest.approx(1.5) and "young stays at its limit, 1.5" in limit.cannot_tell[0]


def test_values_that_diverge_are_refused_and_displacements_over_time_fitted():
    measured = np.stack([model({"young": 2.0}), 0.5 * model({"young": 2.0})])

    def simulate(values):
        if values["young"] > 2.5:
            raise supple.Diverged("too stiff a joke")
        return np.stack([model(values), 0.5 * model(values)])

    found = fit(simulate, {"young": 0.3}, measured)
    assert found.values["young"] == pytest.approx(2.0, rel=1e-3) and found.worst < 1e-5
    with pytest.raises(supple.Diverged):
        fit(simulate, {"young": 3.0}, measured)


def test_what_cannot_be_fitted_is_refused():
    measured = model({"young": 2.0})

    def refused(words, start={"young": 1.0}, measured=measured, bounds={"young": BOUNDS["young"]}, simulate=model, left_out=None):
        with pytest.raises(supple.InputError, match=words):
            supple.fit(simulate, start, measured, bounds=bounds, left_out=left_out)

    refused("start of young: 20.0, it must be from 0.1 to 10.0", start={"young": 20.0})
    refused("bounds of young: 2.0 and 1.0, the first must be below", bounds={"young": (2.0, 1.0)})
    refused("bounds: young has none", bounds={})
    refused("start: it is empty", start={}, bounds={})
    refused(r"measured: its shape is \(12,\)", measured=measured[:, 0])
    refused(r"simulate: the displacement of point 2 is .*nan.* with young = ", simulate=lambda values: np.where(np.arange(12)[:, None] == 2, np.nan, model(values)))
    refused(r"simulate: its displacements are of shape \(11, 3\)", simulate=lambda values: model(values)[1:])
    refused("start of young '1.0': it must be a number", start={"young": "1.0"})
    refused(r"start \['young'\]: it must give a first value to each name", start=["young"])
    refused("bounds of young: -1.0 and 10.0, the first must be zero or more", bounds={"young": (-1.0, 10.0)})
    refused("bounds of young: 5, they must be two numbers, the least and the most", bounds={"young": 5})
    refused("bounds: yuong is none of the names of start, young", bounds={"young": (0.1, 10.0), "yuong": (0.1, 10.0)})
    refused("measured 'a': it must be displacements", measured="a")
    endless = np.where(np.arange(12)[:, None] == 3, np.inf, measured)
    refused(r"measured: the displacement of point 3 is \[inf, .*\]: where nothing was measured give NaN", measured=endless)
    refused("left_out: .*, there are points 0 to 11", left_out=[12])
    refused("1 values, but only 0 measured numbers", left_out=np.ones(12, bool))


def test_the_unloaded_shape_makes_a_round_trip():
    image = bar((2, 2, 5))
    found = supple.unloaded(image, lambda mesh: at_rest(mesh, 17e3, gap=1e-5))
    sag = np.linalg.norm(found.mesh.points - image.points, axis=1)
    print(found, sag.max())
    assert sag.max() > 7e-3 and found.largest_gap < 1e-4 and found.simulations <= 9
    again = found.mesh.points + at_rest(found.mesh, 17e3, gap=1e-6)
    assert np.linalg.norm(again - image.points, axis=1).max() < 1.2e-4


def test_shapes_that_cannot_be_unloaded_are_refused():
    image = bar((1, 1, 3))
    calls = []

    def gives_way(mesh):
        calls.append(mesh)
        if len(calls) > 1:
            raise supple.Diverged("it gives way")
        return np.full(mesh.points.shape, 0.01)

    with pytest.raises(supple.InputError, match=r"elements inside out, .*nearest so far: 17.32 mm"):
        supple.unloaded(image, gives_way)
    assert 2 < len(calls) < 8
    with pytest.raises(supple.InputError, match="after 3 simulations a node is still"):
        supple.unloaded(image, lambda mesh: np.full(mesh.points.shape, 0.01) * np.random.default_rng().normal(), most_simulations=3)
    with pytest.raises(supple.InputError, match=r"at_rest: its displacements are of shape \(2, 3\)"):
        supple.unloaded(image, lambda mesh: np.zeros((2, 3)))
    with pytest.raises(supple.InputError, match="gap 0: it must be"):
        supple.unloaded(image, lambda mesh: np.zeros(mesh.points.shape), gap=0)
