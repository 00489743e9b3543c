"""Python can do what C can: each function of the header is used by the package, or stands here with the reason why it is not."""

import pathlib
import re
import threading

import numpy as np
import pytest
import supple
from conftest import ROOT, bar

GRAVITY = np.array([0.0, 0.0, -9.81])
BY_THE_SIMULATION = "a supple_sim prepares and calls it by itself"
OWN_STEPS = "for hosts that take each step themselves; Simulation.advance takes those of every kind"
# Functions of include/supple.h that the package does not use, on purpose.
ADVANCED = {
    "supple_set_level": "for comparisons of instruction sets; the best is chosen by itself",
    "supple_copy_displacements": "Simulation.displacements is a view; numpy copies it",
    "supple_copy_positions": "numpy adds points and displacements",
    "supple_state_carry_on": "Simulation.exchange lets the state go on",
    "supple_set_tissues": "Simulation.ablate changes those of the simulation",
    "supple_set_targets": "each group of pulls has targets of its own, by supple_set_targets_from",
    "supple_set_pull": "Pulls.release ends pulls, Simulation.pull makes others",
    "supple_add_pull_of_nodes": "for springs and points of hosts with weights of their own; Simulation.pull takes patches",
    **dict.fromkeys(["supple_loads_size", "supple_loads_init", "supple_state_size", "supple_state_init"], BY_THE_SIMULATION),
    **dict.fromkeys(["supple_guard_size", "supple_guard_init", "supple_guard_follow", "supple_learned_fall_back"], BY_THE_SIMULATION),
    **dict.fromkeys(["supple_learned_size", "supple_learned_init", "supple_learned_reset", "supple_learned_lead"], BY_THE_SIMULATION),
    **dict.fromkeys(["supple_large_size", "supple_large_init", "supple_adaptive_size", "supple_adaptive_init"], BY_THE_SIMULATION),
    **dict.fromkeys(["supple_set_step", "supple_step", "supple_learned_step", "supple_large_step", "supple_adaptive_advance"], OWN_STEPS),
    "supple_settle": "supple_sim_settle calls it",
    "supple_saved_size": "supple_state_saved_size tells it of tissue that relaxes as well",
    "supple_relaxation_size": BY_THE_SIMULATION,
}


def test_no_function_of_the_header_is_forgotten():
    declared = set(re.findall(r"^[\w ]+?\*? ?\*?(supple_\w+)\(", (ROOT / "include" / "supple.h").read_text(), flags=re.M))
    used = set()
    for file in pathlib.Path(supple.__file__).parent.glob("*.py"):
        if file.name != "_interface.py":
            used |= set(re.findall(r"lib\.(supple_\w+)", file.read_text()))
    print(f"{len(declared)} functions, {len(used)} used, {len(ADVANCED)} left out")
    assert len(declared) > 70
    assert sorted(declared - used - set(ADVANCED)) == [], "neither used nor left out on purpose"
    assert sorted(set(ADVANCED) - declared) == [] and sorted(used - declared) == [], "not in the header"
    assert sorted(used & set(ADVANCED)) == [], "used after all"


def halves():
    """A bar along z: region 1 below its middle, 2 above."""
    mesh = bar(cells=(2, 2, 8))
    middle = mesh.points[mesh.tets][:, :, 2].mean(axis=1)
    return supple.Mesh(mesh.points, mesh.tets, regions=np.where(middle < 0.03, 1, 2))


def test_tissues_of_regions_stretch_in_series():
    """Pulled by a small force, each half gets longer by force times length over its own modulus and the area."""
    mesh, area, force = halves(), 0.02**2, 0.004
    soft, stiff = (supple.Material.from_moduli(young, 0.3, density=1000.0) for young in (2000.0, 8000.0))
    end = mesh.points[:, 2] > 0.0599
    scene = supple.Scene(mesh, {1: soft, 2: stiff, 9: soft}, fixed=mesh.points[:, 2] < 1e-6, element="nodal-strain")
    simulation = supple.Simulation(scene, damping=40.0)
    triangles = mesh.boundary()
    simulation.set_tractions(triangles[end[triangles].all(axis=1)], [0.0, 0.0, force / area], ramp=0.2)
    simulation.advance(1.0)
    middle = np.isclose(mesh.points[:, 2], 0.03)
    lower = simulation.displacements[middle, 2].mean()
    upper = simulation.displacements[end, 2].mean() - lower
    print(f"{1e3 * lower:.3f} and {1e3 * upper:.3f} mm")
    assert lower == pytest.approx(force * 0.03 / (2000.0 * area), rel=0.1)
    assert upper == pytest.approx(force * 0.03 / (8000.0 * area), rel=0.1)
    assert scene.facts["mass"] == pytest.approx(1000.0 * area * 0.06, rel=1e-5)
    # One of density 3 kg/m^3 is remarked upon by its number.
    light = supple.Material.from_moduli(8000.0, 0.3, density=3.0)
    assert "tissue 1: an unusual density" in supple.Simulation(supple.Scene(mesh, {1: soft, 2: light})).remarks()[0]


def test_tissues_that_cannot_be_are_refused_in_words(soft):
    exponential = supple.Material("exponential", a=1500.0, b=8.0, d=40000.0, density=1060.0)
    for materials, words in [
        ({1: soft}, r"element \d+ is of region 2, there are \[1\]"),
        ({1: soft, 2: exponential}, "all must be of one law, not neo-hookean, exponential"),
        ({}, "there are none"),
    ]:
        with pytest.raises(supple.InputError, match=words):
            supple.Scene(halves(), materials)
    with pytest.raises(supple.InputError, match="the mesh has no regions"):
        supple.Scene(bar(), {1: soft})
    with pytest.raises(supple.InputError, match=r"regions: int64 of shape \(2,\), they must be integers of shape"):
        supple.Mesh(bar().points, bar().tets, regions=[1, 2])


def test_a_traction_gives_its_impulse(soft):
    """The momentum of a free body is pressure times area times time, also next to a force; another traction takes its place."""
    mesh = bar()
    simulation = supple.Simulation(supple.Scene(mesh, soft), step=2e-4)
    triangles = mesh.boundary()
    top = triangles[(mesh.points[triangles, 2] > 0.0599).all(axis=1)]
    simulation.set_tractions(triangles, [9.0, 9.0, 9.0])
    simulation.set_tractions(top, [3.0, 0.0, 5.0])
    simulation.set_forces([0], [0.0, 0.002, 0.0])
    simulation.advance(0.05)
    share = np.zeros(len(mesh.points))
    np.add.at(share, mesh.tets, mesh.volumes[:, None] / 4.0)
    momentum = 1000.0 * (share[:, None] * simulation.velocities).sum(axis=0)
    assert momentum == pytest.approx(0.05 * np.array([3.0 * 0.02**2, 0.002, 5.0 * 0.02**2]), rel=1e-3, abs=1e-8)
    for wrong, words in [(([[0, 1]], [0, 0, 1]), r"\(k, 3\)"), (([[0, 1, 999]], [0, 0, 1]), "node 999"), ((top, 5.0), "three numbers, Pa")]:
        with pytest.raises(supple.InputError, match=words):
            simulation.set_tractions(*wrong)
    with pytest.raises(supple.InputError, match="ramp -1.0: it must be zero or a positive number, s"):
        simulation.set_tractions(top, [0.0, 0.0, 1.0], ramp=-1.0)
    simulation.set_tractions([], [0.0, 0.0, 0.0])


def test_stop_takes_the_velocity_and_leaves_the_place(soft):
    simulation = supple.Simulation(supple.Scene(bar(), soft), gravity=GRAVITY)
    simulation.advance(0.02)
    before, time = simulation.displacements.copy(), simulation.time
    assert np.linalg.norm(simulation.velocities, axis=1).min() > 0.1
    simulation.stop()
    assert simulation.time == time and (simulation.displacements == before).all() and not simulation.velocities.any()
    simulation.gravity = (0.0, 0.0, 0.0)
    simulation.advance(0.02)
    assert abs(simulation.displacements - before).max() < 1e-6


@pytest.mark.parametrize("method", ["exact", "long"])
def test_threads_give_the_same_bits(lobe, liver, method):
    scene = supple.Scene(lobe, liver, fixed=lobe.points[:, 1] > 0.03)
    ends = []
    for threads in (1, 2, 8):
        simulation = supple.Simulation(scene, method, damping=20.0, gravity=GRAVITY, threads=threads)
        both = [threading.Thread(target=simulation.advance, args=(0.02,)) for _ in range(2)]
        for each in both:
            each.start()
        for each in both:
            each.join()
        ends.append(simulation.displacements.copy())
    assert abs(ends[0]).max() > 5e-4 and all((end == ends[0]).all() for end in ends)
    for threads in (0, 9, 1.5):
        with pytest.raises(supple.InputError, match="there are 1 to 8"):
            supple.Simulation(scene, threads=threads)


def test_supports_react_with_the_weight(soft):
    """A bar that has come to rest hangs by its weight, in exact and in long steps."""
    mesh = bar(cells=(2, 2, 4))
    held = mesh.points[:, 2] > 0.0599
    for method in ("exact", "long"):
        simulation = supple.Simulation(supple.Scene(mesh, soft, fixed=held), method, damping=30.0, gravity=GRAVITY)
        reaction = simulation.reaction(held)
        for _ in range(120):
            simulation.advance(1.0 / 60.0)
            force = reaction.force()
        weight = 9.81 * simulation.scene.facts["mass"]
        print(f"{method}: {1e3 * force.newton} mN of {1e3 * weight:.2f}, spread {1e3 * force.spread:.3f}")
        assert -simulation.forces[held, 2].sum() == pytest.approx(weight, rel=0.02)
        assert force.resolved and force.newton[2] == pytest.approx(weight, rel=0.02) and abs(force.newton[:2]).max() < 0.02 * weight
        simulation.reset()
        assert reaction.force() is None
    with pytest.raises(supple.InputError, match="reaction: entry 0 is node 0, which the scene neither fixes nor moves"):
        simulation.reaction([0])


def test_a_local_force_follows_a_spring():
    """Of a spring of 50 N/m along z it learns the stiffness, and tells the force between the frames."""
    model = supple.LocalForce()
    for frame in range(20):
        model.follow([0.0, 0.0, -1e-4 * frame], [0.0, 0.0, 50.0 * 1e-4 * frame])
    assert model.stiffness[2, 2] == pytest.approx(-50.0, rel=0.05)
    assert model.at([0.0, 0.0, -1.95e-3])[2] == pytest.approx(0.0975, rel=0.01)
    predicted, held = model.errors
    assert predicted < 0.1 * held
    with pytest.raises(supple.InputError, match="force .*nan.*three finite numbers are needed, N"):
        model.follow([0, 0, 0], [0, 0, np.nan])


def test_a_network_says_what_it_was_trained_for():
    material = supple.Material("exponential", a=59.0, b=8.023, d=60000.0, density=1000.0)
    mesh = bar(cells=(8, 8, 17), size=(0.05, 0.05, 0.1))
    scene = supple.Scene(mesh, material, fixed=mesh.points[:, 2] < 1e-6, element="linear")
    weights = ROOT / "weights" / "compact-10.weights"
    simulation = supple.Simulation(scene, "learned", weights=weights, fallback=False, lead_in=0.03)
    network = simulation.network
    assert network["law"] == "exponential" and network["element"] == "linear" and network["fell_back"] == 0
    assert network["seconds"] == pytest.approx(10 * network["exact_seconds"], rel=1e-3) and network["multiply_adds"] > 100
    assert network["constants"] == pytest.approx(material.constants) and network["density"] == 1000.0
    assert supple.Simulation(scene).network is None


def test_a_report_tells_what_c_tells(lobe, liver):
    scene = supple.Scene(lobe, liver, fixed=lobe.points[:, 1] > 0.03)
    simulation = supple.Simulation(scene, "long", damping=20.0, gravity=GRAVITY, cells=(2, 2, 2))
    for _ in range(10):
        report = simulation.advance(1.0 / 60.0)
    assert report.largest_estimate > report.estimate > 0.0 and 0 <= report.worst_node < len(lobe.points)
    assert 0.0 < report.shortest <= report.longest < 1.0 / 60.0 + 1e-6 and report.available_energy > report.kinetic_energy > 0.0
    assert report.added_mass > 0.0 and 0.0 < report.lattice_share <= 1.0 and report.energy_excess == 0.0 and report.outside == 0.0
    with pytest.raises(supple.InputError, match=r"long, cells \(99, 99, 99\): "):
        supple.Simulation(scene, "long", cells=(99, 99, 99))
    whole = supple.Simulation(scene, "long", damping=20.0, gravity=GRAVITY, cells=(2.0, 2.0, 2.0))
    for _ in range(10):
        whole.advance(1.0 / 60.0)
    assert (whole.displacements == simulation.displacements).all()


def test_contact_points_add_up_to_the_force(lobe, liver):
    scene = supple.Scene(lobe, liver, fixed=lobe.points[:, 1] > 0.03)
    simulation = supple.Simulation(scene, damping=30.0)
    assert len(simulation.contact_points()) == 0
    top = lobe.points[lobe.points[:, 2].argmax()].astype(float)
    simulation.set_instruments([supple.Instrument.sphere(0.01, top + [0.0, 0.0, 0.011])])
    simulation.move(0, top + [0.0, 0.0, 0.006], within=0.1)
    simulation.advance(0.1)
    points, touch = simulation.contact_points(), simulation.touch(0)
    assert len(points) == touch.contacts > 0 and points["depth"].max() == pytest.approx(touch.depth)
    assert -points["force"].sum(axis=0) == pytest.approx(touch.force, rel=1e-4, abs=1e-6)
    assert np.linalg.norm(points["normal"], axis=1) == pytest.approx(1.0, abs=1e-4) and (points["instrument"] == 0).all()


def press(soft, triangles, radius):
    """The mean force of the last frames on a ball that goes 2 mm into the middle of the top of a cube of cells of 10 mm."""
    mesh = supple.Mesh.box((0.06, 0.06, 0.06), (6, 6, 6))
    scene = supple.Scene(mesh, soft, fixed=mesh.points[:, 2] < 1e-6)
    simulation = supple.Simulation(scene, damping=20.0)
    at = lambda depth: [0.0367, 0.0333, 0.06 + radius - depth]
    simulation.set_instruments([supple.Instrument.sphere(radius, at(-1e-4))], triangles=triangles)
    simulation.move(0, at(0.002), within=0.2)
    simulation.advance(0.3)
    return simulation.touch(0).mean_force[2], simulation.remarks()


def test_a_ball_as_large_as_an_edge_touches_triangles_by_itself(soft):
    (chosen, said), (nodes, warned), (given, _) = (press(soft, triangles, 0.01) for triangles in (None, False, True))
    print(f"{1e3 * chosen:.1f} mN by itself, {1e3 * nodes:.1f} with nodes alone, {1e3 * given:.1f} with triangles; {warned}")
    assert chosen == given and nodes < 0.7 * chosen
    assert not any("thinner" in words for words in said)
    assert "instrument 0: an instrument thinner than edges of the surface are long" in warned[-1] and "(0.01)" in warned[-1]
    # A ball thicker than the diagonal of a cell meets nodes, which costs less.
    (chosen, said), (nodes, warned) = (press(soft, triangles, 0.0142) for triangles in (None, False))
    assert chosen == nodes > 0.0 and said == warned


def test_an_instrument_that_starts_within_the_body_is_remarked_upon():
    mesh = supple.Mesh.box((0.06, 0.04, 0.04), (6, 4, 4))
    simulation = supple.Simulation(supple.Scene(mesh, supple.Material.from_moduli(4e3, 0.45, density=1000.0), fixed=mesh.points[:, 0] < 1e-6))
    for place, within in ([0.03, 0.02, 0.02], True), ([0.03, 0.02, 0.055], False):
        for instrument in supple.Instrument.sphere(0.006, place), supple.Instrument.capsule(0.003, 0.01, place):
            simulation.set_instruments([instrument], triangles=True)
            said = simulation.remarks()
            print(said)
            assert said == (["instrument 0: an instrument that starts within the body: let its path begin outside"] if within else [])
