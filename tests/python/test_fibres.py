"""Tissue with fibres."""

import numpy as np
import pytest
import supple
from conftest import ROOT, bar

FIBRES, SHEETS, COUPLING = [18472.0, 16.026], [2481.0, 11.12], [216.0, 11.436]


def with_fibres(soft, **terms):
    return supple.Material("neo-hookean", **soft.constants, density=soft.density, **terms)


def along(mesh, fibre, sheet=None):
    vectors = fibre if sheet is None else [fibre, sheet]
    return np.broadcast_to(vectors, (len(mesh.tets), *np.shape(vectors))).copy()


def slope(term, x):
    """a x exp(b x^2), Pa."""
    return term[0] * x * np.exp(term[1] * x**2)


@pytest.mark.parametrize("element", ["linear", "nodal-pressure", "nodal-strain"])
def test_the_force_on_a_sheared_bar_is_that_of_the_closed_form(soft, element):
    """Holzapfel & Ogden 2009, section 5d: fibres across the planes that slide, sheets along them, and the other way round."""
    mesh, k = bar(cells=(2, 2, 4)), 0.3
    top, inner = mesh.points[:, 2] > 0.0599, np.linalg.norm(mesh.points - [0.01, 0.01, 0.03], axis=1) < 1e-6
    shape = np.zeros_like(mesh.points)
    shape[:, 0] = k * mesh.points[:, 2]
    law, coupling = 2.0 * soft.constants["c"] * k, slope(COUPLING, k)
    all_terms = with_fibres(soft, fibres=FIBRES, sheets=SHEETS, coupling=COUPLING)
    cases = [
        (with_fibres(soft, fibres=FIBRES), along(mesh, [0, 0, 2]), law + 2.0 * k * slope(FIBRES, k**2)),
        (with_fibres(soft, fibres=FIBRES), along(mesh, [0, -1, 0]), law),
        (all_terms, along(mesh, [0, 0, 2], [1, 0, 5]), law + 2.0 * k * slope(FIBRES, k**2) + coupling),
        (all_terms, along(mesh, [-1, 0, 0], [0, 0, 0.1]), law + 2.0 * k * slope(SHEETS, k**2) + coupling),
    ]
    for material, directions, expected in cases:
        scene = supple.Scene(mesh, material, moved=~inner, element=element, directions=directions)
        simulation = supple.Simulation(scene, step=1e-5)
        simulation.set_displacements(shape)
        simulation.take(1)
        found = -simulation.forces[top, 0].sum() / 0.02**2
        print(f"{element}: {found:.2f} Pa, closed form {expected:.2f}")
        assert found == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("method", ["exact", "long", "auto"])
def test_fibres_along_a_bar_hold_it(soft, method):
    mesh = bar(cells=(2, 2, 6))
    ways = []
    for terms in ({}, {"fibres": FIBRES}):
        directions = along(mesh, [0, 0, 1]) if terms else None
        scene = supple.Scene(mesh, with_fibres(soft, **terms), fixed=mesh.points[:, 2] < 1e-6, directions=directions)
        settled, simulation = supple.Simulation(scene, gravity=(1.0, 0.0, 0.0)), supple.Simulation(scene, method, damping=20.0, gravity=(1.0, 0.0, 0.0))
        assert settled.settle(1e-6).at_rest
        for _ in range(100):
            simulation.advance(0.02)
        ways.append(settled.displacements[:, 0].max())
        assert simulation.displacements[:, 0].max() == pytest.approx(ways[-1], rel=0.03)
    print(f"{method}: {1e3 * ways[0]:.3f} mm without, {1e3 * ways[1]:.3f} mm with fibres")
    assert ways[1] < 0.8 * ways[0]


def halves():
    mesh = bar(cells=(2, 2, 6))
    return supple.Mesh(mesh.points, mesh.tets, regions=np.where(mesh.points[mesh.tets][:, :, 2].mean(axis=1) < 0.03, 1, 2))


def test_fibres_of_one_region(soft):
    """The elements of the other one need no direction, and those of a tissue without sheets none of these."""
    mesh, ways = halves(), []
    fibrous = with_fibres(soft, fibres=FIBRES)
    directions = along(mesh, [0.0, 0.0, 1.0], [0.0, 0.0, 0.0])
    lower = directions.copy()
    lower[mesh.regions == 2] = np.nan
    for materials, given in [((soft, soft), None), ((fibrous, soft), lower), ((fibrous, fibrous), directions)]:
        scene = supple.Scene(mesh, dict(zip((1, 2), materials)), fixed=mesh.points[:, 2] < 1e-6, directions=given)
        simulation = supple.Simulation(scene, gravity=(1.0, 0.0, 0.0))
        assert simulation.settle(1e-6).at_rest
        ways.append(simulation.displacements[:, 0].max())
    print([f"{1e3 * way:.3f} mm" for way in ways])
    assert ways[1] < 0.9 * ways[0] and ways[2] < ways[1]
    # With sheets in the upper half that half alone needs their direction.
    directions[mesh.regions == 2, 1] = [1.0, 0.0, 0.0]
    both = {1: fibrous, 2: with_fibres(soft, fibres=FIBRES, sheets=SHEETS)}
    simulation = supple.Simulation(supple.Scene(mesh, both, fixed=mesh.points[:, 2] < 1e-6, directions=directions), gravity=(1.0, 0.0, 0.0))
    assert simulation.settle(1e-6).at_rest
    assert simulation.displacements[:, 0].max() == pytest.approx(ways[2], rel=0.1)


def test_fibres_stay_where_elements_go_or_are_ablated(soft):
    mesh = bar(cells=(2, 2, 6))
    fibrous = with_fibres(soft, fibres=FIBRES)
    scene = supple.Scene(mesh, fibrous, fixed=mesh.points[:, 2] < 1e-6, directions=along(mesh, [0, 0, 1]))
    corner = [int(mesh.points[mesh.tets].mean(axis=1)[:, 2].argmax())]
    for change in ("remove", "ablate"):
        simulation = supple.Simulation(scene, gravity=(1.0, 0.0, 0.0))
        simulation.settle(1e-6)
        way = simulation.displacements[:, 0].max()
        saved = simulation.save()
        if change == "remove":
            simulation.remove(corner)
        else:
            simulation.ablate(corner, soft, 0.02)
            simulation.advance(0.04)
        assert simulation.settle(1e-6).at_rest
        print(f"{change}: {1e3 * way:.3f} mm, then {1e3 * simulation.displacements[:, 0].max():.3f} mm")
        assert simulation.displacements[:, 0].max() == pytest.approx(way, rel=0.03)
        simulation.restore(saved)
    # In a scene without fibres it falls farther, in the one with them it comes back.
    simulation.exchange(supple.Scene(mesh, soft, fixed=mesh.points[:, 2] < 1e-6))
    assert simulation.settle(1e-6).at_rest and simulation.displacements[:, 0].max() > 1.2 * way
    simulation.exchange(scene)
    assert simulation.settle(1e-6).at_rest and simulation.displacements[:, 0].max() == pytest.approx(way, rel=0.01)


def test_a_material_tells_its_fibres():
    material = supple.Material.from_moduli(3000.0, 0.45, density=1000.0, fibres=FIBRES, coupling=np.array(COUPLING))
    assert material.fibres == tuple(FIBRES) and material.sheets is None and "fibres a=18472, b=16.026, coupling a=216" in repr(material)


@pytest.mark.parametrize(
    ("terms", "words"),
    [
        ({"fibres": 5.0}, r"fibres: its shape is \(\), it must be two numbers, a \(Pa\) and b"),
        ({"sheets": [1.0, 2.0, 3.0]}, r"sheets: its shape is \(3,\)"),
        ({"coupling": "stiff"}, r"coupling: not two numbers, a \(Pa\) and b"),
        ({"fibres": [0.0, 16.0]}, "fibres: a is 0, it must be a finite positive number; without such a term leave it out"),
        ({"sheets": [1e3, -2.0]}, "sheets: b is -2"),
        ({"coupling": [np.nan, 2.0]}, "coupling: a is nan"),
    ],
)
def test_terms_that_cannot_be_are_refused_in_words(soft, terms, words):
    with pytest.raises(supple.InputError, match=words):
        with_fibres(soft, **terms)


def test_numbers_beyond_float32_are_refused_in_words(soft):
    mesh = bar()
    with np.errstate(over="ignore"), pytest.raises(supple.InputError, match="a constant of fibres is not a finite positive number: entry 0, term 1"):
        supple.Scene(mesh, with_fibres(soft, fibres=FIBRES, sheets=[1e39, 2.0]), directions=along(mesh, [0, 0, 1], [0, 1, 0]))


def test_directions_that_cannot_be_are_refused_in_words(soft):
    mesh = bar(cells=(1, 1, 2))
    fibrous, all_terms = with_fibres(soft, fibres=FIBRES), with_fibres(soft, fibres=FIBRES, sheets=SHEETS)
    good = along(mesh, [0.0, 0.0, 1.0], [0.0, 1.0, 0.0])
    zero, parallel, infinite = good.copy(), good.copy(), good.copy()
    zero[7, 0], parallel[3, 1], infinite[2, 0, 1] = 0.0, [0.0, 0.0, -5.0], np.inf
    for material, directions, words in [
        (fibrous, None, r"directions: there are none, and a material has fibres: give an array of shape \(12, 3\) or \(12, 2, 3\)"),
        (all_terms, None, r"give an array of shape \(12, 2, 3\), along fibres and sheets"),
        (soft, good, r"directions: no material has fibres: give it some \(fibres=\[a, b\]\), or leave the directions out"),
        (fibrous, good[:11], r"directions: their shape is \(11, 2, 3\), it must be \(12, 3\) or \(12, 2, 3\)"),
        (all_terms, good[:, 0], r"directions: their shape is \(12, 3\), it must be \(12, 2, 3\), along fibres and sheets"),
        (fibrous, "along", "directions: not an array of numbers"),
        (fibrous, zero, r"directions: of element 7 \[\[0.0, 0.0, 0.0\], \[0.0, 1.0, 0.0\]\]: they must be finite and not zero"),
        (fibrous, infinite[:, 0], r"directions: of element 2 \[0.0, inf, 1.0\]: they must be finite"),
        (all_terms, parallel, r"directions: of element 3 .*: they must be finite and not zero, and those of fibres and sheets not parallel"),
    ]:
        with pytest.raises(supple.InputError, match=words):
            supple.Scene(mesh, material, directions=directions)
    # Sheets that are not read may be anything.
    supple.Scene(mesh, fibrous, directions=parallel)


def test_learned_steps_do_not_know_them():
    mesh = bar(cells=(8, 8, 17), size=(0.05, 0.05, 0.1))
    material = supple.Material("exponential", a=59.0, b=8.023, d=60000.0, density=1000.0, fibres=[100.0, 5.0])
    scene = supple.Scene(mesh, material, fixed=mesh.points[:, 2] < 1e-6, element="linear", directions=along(mesh, [0, 0, 1]))
    weights = ROOT / "weights" / "compact-10.weights"
    simulation = supple.Simulation(scene, "learned", weights=weights, fallback=False, lead_in=0.03)
    with pytest.raises(supple.Diverged, match="learned steps do not know tissue that relaxes or has fibres"):
        simulation.advance(0.1)
