"""A scene in motion: loads, instruments, steps of every kind, and what they lead to."""

from __future__ import annotations

import dataclasses
import functools
import os
import pathlib
import threading
import warnings
from collections.abc import Callable
from typing import Any, Concatenate, ParamSpec, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _library as library
from ._laws import LAWS
from ._library import ffi, lib
from .errors import InputError
from .exchange import Ablation, ablated, exchanged, made_of, next_stage
from .images import Field, field_of
from .instruments import POINT, Contact, Instrument, Rows, Touch, need_triangles
from .points import FollowedPoints
from .pulls import PullMemory, Pulls, Wanted, wanted_of
from .reactions import Reaction
from .scene import ELEMENTS, Material, Scene, axes_of

_STEPS = {
    "exact": lib.SUPPLE_STEPS_EXACT,
    "long": lib.SUPPLE_STEPS_LONG,
    "auto": lib.SUPPLE_STEPS_AUTO,
    "learned": lib.SUPPLE_STEPS_LEARNED,
}
METHODS = tuple(_STEPS)
_WORDS = {
    lib.SUPPLE_OK: "ok",
    lib.SUPPLE_LIMITED: "limited",
    lib.SUPPLE_OUTSIDE: "outside",
    lib.SUPPLE_FELL_BACK: "fell back",
    lib.SUPPLE_INEXACT: "inexact",
    lib.SUPPLE_BEHIND: "behind",
}
# What the index of a remark stands for.
_PLACES = {
    lib.SUPPLE_REMARK_DENSITY: "tissue",
    lib.SUPPLE_REMARK_STIFFNESS: "tissue",
    lib.SUPPLE_REMARK_POISSON_RATIO: "tissue",
    lib.SUPPLE_REMARK_WAY: "motion",
    lib.SUPPLE_REMARK_SPEED: "motion",
    lib.SUPPLE_REMARK_THIN: "instrument",
    lib.SUPPLE_REMARK_INSIDE: "instrument",
    lib.SUPPLE_REMARK_HELD_PULL: "pull",
    lib.SUPPLE_REMARK_FAR: "instrument",
    lib.SUPPLE_REMARK_FAR_TARGET: "pull",
}
# As supple_force and supple_motion.
_FORCE = np.dtype([("node", np.uint32), ("newton", np.float32, 3), ("ramp", np.float32)])
_MOTION = np.dtype([("node", np.uint32), ("axes", np.uint32), ("metre", np.float32, 3), ("ramp", np.float32)])


# In diagonals of the body: a length within which errors keep, and how far it moves in metres, as the kernel has it of targets.
_MOST_TOLERANCE, _FAR = 0.1, 10.0
# Radius of a patch of some 20 to 50 nodes, in mean edges.
_PATCH = 2.2

_Given = ParamSpec("_Given")
_Result = TypeVar("_Result")


def _one_at_a_time(
    method: Callable[Concatenate[Simulation, _Given], _Result],
) -> Callable[Concatenate[Simulation, _Given], _Result]:
    """Other threads wait while one is in the kernel, which takes one at a time and lets the interpreter go on."""

    @functools.wraps(method)
    def in_turn(self: Simulation, /, *given: _Given.args, **named: _Given.kwargs) -> _Result:
        with self._lock:
            return method(self, *given, **named)

    return in_turn


@dataclasses.dataclass(frozen=True)
class Report:
    """What a call of `advance` came to.

    `status` is "ok"; "limited" (steps were taken, but are not exact), "outside" (the network saw what its training had not),
    "fell back" (exact steps took the place of learned ones), "inexact" (the estimate of the error exceeds what is allowed),
    "behind" (the work that a call may take is spent, and `missing` seconds of it are).
    It is the worst of all steps of the call. `estimate`: mean error of the nodes (m) after the last of them, by the guard or the
    automatic steps, None where there is none (yet); `largest_estimate`: that of the worst node, `worst_node`; `allowed`: what the guard
    accepts for the mean, a fifth of the motion so far or the tolerance. `exact`, `long`, `learned` count the steps taken, `undone` those
    computed and not taken, or taken back; `shortest` and `longest` are their lengths (s). What "limited" is about:
    `least_volume_ratio` below 0.1, `saturation` of the exponential law above 1, `energy_excess` above 0 (kinetic energy beyond the balance,
    a share), `held_back` nodes, of exact steps pulls, `lattice_share` below 0.5. `available_energy`: the most that loads and supports ever gave (J).
    `added_mass`: of long steps, mean inertia added, in masses of the node. `clipped`, `outside`: of learned steps, shares of the vertices.
    """

    status: str
    time: float
    exact: int
    long: int
    learned: int
    undone: int
    missing: float
    least_volume_ratio: float
    kinetic_energy: float
    estimate: float | None
    allowed: float | None
    largest_estimate: float | None
    worst_node: int | None
    shortest: float
    longest: float
    available_energy: float
    saturation: float
    energy_excess: float
    held_back: int
    lattice_share: float
    added_mass: float
    clipped: float
    outside: float

    @property
    def steps(self) -> int:
        return self.exact + self.long + self.learned

    @property
    def ok(self) -> bool:
        return self.status == "ok"


@dataclasses.dataclass(frozen=True)
class Settled:
    """What a call of `settle` came to.

    `at_rest`: whether every node is within the tolerance of where it rests; `remaining`: the estimate of the largest distance from there (m),
    infinite before the body has swung once; `steps` that were computed; `status`: "ok", "limited" as of `advance`, or "behind" where the body
    is not at rest after the steps, or never can be.
    """

    at_rest: bool
    remaining: float
    steps: int
    status: str


class Simulation(library.Sealed):
    """A scene that starts at rest.

    Parameters
    ----------
    scene
    method : "exact"; "long" beyond the critical step; "auto", exact and long steps whose length keeps a tolerance; "learned"
    step : s; of exact steps, those around a network's included, 0.9 of the critical one unless given, and shorter where that falls; of
        long ones 20 times the critical one; of automatic ones the longest
    damping : 1/s; learned steps have that of their training, and refuse another
    tolerance : mean error (m) that automatic steps keep, half a millimetre or less in bodies below 10 cm unless given, and that the
        guard allows, a fifth of the motion unless given
    weights : file of the network, for learned steps
    lead_in : seconds of exact steps before a network takes over
    guard : whether a second run estimates the error of long and learned steps
    fallback : whether exact steps take the place of learned ones that are not to be believed; else `advance` raises there
    cells : of the lattice of long steps along x, y, z; chosen for the scene unless given
    most_steps : the most work that a call of `advance` takes, in exact steps; a long or a learned one counts four. When it is spent the
        call ends, its status is "behind", and the next goes on from there
    threads : 1 to 8 that compute a step, with the same bits. They are the kernel's own, one set for all
        simulations: a process that forks does so before
    """

    def __init__(
        self,
        scene: Scene,
        method: str = "exact",
        *,
        step: float | None = None,
        damping: float = 0.0,
        tolerance: float | None = None,
        weights: str | os.PathLike[str] | None = None,
        lead_in: float = 0.3,
        guard: bool = True,
        fallback: bool = True,
        cells: tuple[int, int, int] | None = None,
        most_steps: int | None = None,
        threads: int = 1,
        gravity: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        if method not in METHODS:
            raise InputError(f"method {method!r}: there are {', '.join(METHODS)}")
        if method == "learned" and weights is None:
            raise InputError("learned steps need weights, the file of a network")
        if not isinstance(scene, Scene):
            raise InputError(f"scene {scene!r}: it must be a Scene")
        self._scene, self.method, self._step = scene, method, step
        nodes = len(scene.mesh.points)
        settings = self._settings = ffi.new("supple_settings *")
        library.checked(lib.supple_default_settings(settings))
        settings.steps, settings.guard, settings.lead_in = _STEPS[method], int(guard), library.not_negative(lead_in, "lead_in", "s")
        # Forces on nodes, and those of a traction.
        settings.damping, settings.forces, settings.motions = library.not_negative(damping, "damping", "1/s"), 2 * nodes, nodes
        settings.fallback = int(fallback)
        # What words of the kernel are about.
        self._what = method if weights is None else f"{method}: {weights}"
        if cells is not None:
            settings.cells = library.cells_of(cells)
            self._what += f", cells {tuple(settings.cells)}"
        if most_steps is not None:
            settings.most_steps = library.whole(most_steps, "most_steps", (1 << 32) - 1)
        self._threads = _threads(threads)
        for name, value in (("seconds", step), ("tolerance", tolerance)):
            if value is not None:
                what = "step" if name == "seconds" else name
                if not 0.0 < library.number(value, what) < np.inf:
                    raise InputError(f"{what} {value}: it must be a positive number")
                setattr(settings, name, value)
        if weights is not None:
            if method != "learned":
                raise InputError(f"weights are those of learned steps; {method} steps have none")
            self._weights = _weights(weights)
            settings.weights, settings.weights_bytes = self._weights.pointer, self._weights.size
        self._adopt(*made_of(scene, settings, self._what))
        self._ablations = list[Ablation]()
        self._contact: Contact | None = None
        self._pull_memory: PullMemory | None = None
        self._pull_groups = list[Wanted]()
        self._forces = self._tractions = np.zeros(0, _FORCE)
        self._traction: tuple[NDArray[np.uint32], NDArray[np.float32], float] | None = None
        self._pressures: list[Pressure] = []
        self._lock = threading.RLock()
        trained = None if self.network is None else self.network["damping"]
        if trained is not None and damping and abs(damping - trained) > 1e-6 * trained:
            raise InputError(f"damping {damping:g} 1/s: the network learned with {trained:g} 1/s, and knows no other: leave it out")
        self.gravity = gravity
        self._is_made = True

    @property
    def scene(self) -> Scene:
        """What moves; another one after `exchange`, `remove` and `ablate`."""
        return self._scene

    def _adopt(self, memory: library.Memory, sim: Any) -> None:
        """Moves this one from now on."""
        objects = ffi.new("supple_sim_objects *")
        library.checked(lib.supple_sim_describe(sim, objects))
        self._memory, self._sim = memory, sim
        self._raw_scene, self._state, self._loads, self._network = objects.scene, objects.state, objects.loads, objects.learned
        self._vectors = self._view_of_displacements()

    # Loads.

    @property
    def gravity(self) -> NDArray[np.float32]:
        """m/s^2, read-only: to change it assign three numbers."""
        return self._gravity

    @gravity.setter
    @_one_at_a_time
    def gravity(self, value: ArrayLike) -> None:
        if np.shape(value) != (3,):
            raise InputError(f"gravity: {value!r}, it must be three numbers, m/s^2")
        self._gravity: NDArray[np.float32] = library.vectors([value], "gravity")[0]
        self._gravity.flags.writeable = False
        library.checked(lib.supple_set_gravity(self._loads, library.pointer("float", self._gravity)), what="gravity")

    @_one_at_a_time
    def set_forces(self, nodes: ArrayLike, newton: ArrayLike, ramp: float = 0.0) -> None:
        """Replaces all forces: on each of these nodes a force (N), one for all or a row for each, which rises evenly over the first `ramp` s
        of the simulation: set later, it acts in full. The forces on a node that is named twice add up."""
        numbers = library.node_numbers(nodes, len(self.scene.mesh.points), "forces")
        rows = np.zeros(len(numbers), _FORCE)
        rows["node"], rows["newton"], rows["ramp"] = numbers, library.vectors(newton, "newton", len(numbers)), library.not_negative(ramp, "ramp", "s")
        self._set_forces(rows, self._tractions)

    @_one_at_a_time
    def set_tractions(self, triangles: ArrayLike, pascal: ArrayLike, ramp: float = 0.0) -> None:
        """Replaces all tractions: on these triangles of the boundary, (k, 3) node numbers as of `Mesh.boundary`, each once, a force per area at rest
        (Pa, one vector), which rises evenly over the first `ramp` s of the simulation. Its direction stays while the body moves; what is
        removed it lets go of."""
        points, corners = self.scene.mesh.points, self.scene._triangles_of(triangles, outward=False)
        numbers, ramp = corners.ravel(), library.not_negative(ramp, "ramp", "s")
        if np.shape(pascal) != (3,):
            raise InputError(f"pascal: {pascal!r}, it must be three numbers, Pa")
        found, error = np.zeros(len(numbers), _FORCE), library.new_error()
        status = lib.supple_traction(
            library.pointer("float", points), len(points), library.pointer("uint32_t", numbers), len(numbers) // 3,
            library.pointer("float", library.vectors([pascal], "pascal")), ramp, library.pointer("supple_force", found), len(found), error,
        )  # fmt: skip
        library.checked(status, error, "tractions")
        # One for each node.
        nodes, place = np.unique(found["node"], return_inverse=True)
        rows, newton = np.zeros(len(nodes), _FORCE), np.zeros((len(nodes), 3))
        np.add.at(newton, place, found["newton"])
        rows["node"], rows["newton"], rows["ramp"] = nodes, newton, ramp
        self._set_forces(self._forces, rows)
        self._traction = corners, np.array(pascal, np.float32), ramp

    def _set_forces(self, forces: NDArray[np.void], tractions: NDArray[np.void]) -> None:
        error, rows = library.new_error(), np.concatenate([forces, tractions]) if len(tractions) else forces
        library.checked(lib.supple_set_forces(self._loads, library.pointer("supple_force", rows), len(rows), error), error, "forces")
        self._forces, self._tractions = forces, tractions

    @_one_at_a_time
    def add_pressure(self, triangles: ArrayLike, pascal: float, ramp: float = 0.0) -> Pressure:
        """Adds a pressure that follows a part of the surface as it moves: triangles of the boundary, (k, 3) node numbers as
        `Mesh.boundary` tells them, seen from outside, each once. `pascal` is positive where it presses the tissue, from outside or from within a cavity, and rises evenly over
        the first `ramp` s of the simulation. It is changed through what this gives."""
        numbers = self.scene._triangles_of(triangles, outward=True).ravel()
        if not len(numbers):
            raise InputError("triangles: there are none")
        added = Pressure(self, len(self._pressures), numbers)
        added._pascal, added._ramp = library.number(pascal, "pascal"), library.not_negative(ramp, "ramp", "s")
        self._set_pressures([*self._pressures, added])
        return added

    def _set_pressures(self, made: list[Pressure]) -> None:
        points = self.scene.mesh.points
        rows = np.concatenate([one._numbers for one in made])
        surface_of = np.concatenate([np.full(len(one._numbers) // 3, one._surface, np.uint32) for one in made])
        memory = library.Memory(lib.supple_pressure_size(len(surface_of), len(made)))
        error, raw = library.new_error(), ffi.new("supple_pressure **")
        status = lib.supple_pressure_init(
            memory.pointer, memory.size, self._raw_scene, library.pointer("float", points), library.pointer("uint32_t", rows),
            library.pointer("uint32_t", surface_of), len(surface_of), len(made), raw, error,
        )  # fmt: skip
        library.checked(status, error, "pressure")
        for one in made:
            status = lib.supple_pressure_set(raw[0], one._surface, one._pascal, one._ramp)
            library.checked(status, what=f"pressure {one._pascal} Pa, ramp {one._ramp} s")
            library.checked(lib.supple_pressure_fill(raw[0], one._surface, *one._filling), what="pressure")
        library.checked(lib.supple_set_pressure(self._loads, raw[0]))
        self._pressures, self._pressure_memory, self._pressure = made, memory, raw[0]

    @_one_at_a_time
    def clear_pressures(self) -> None:
        """Takes all pressures away."""
        library.checked(lib.supple_set_pressure(self._loads, ffi.NULL))
        self._pressures = []

    @_one_at_a_time
    def set_motions(self, nodes: ArrayLike, metre: ArrayLike, axes: str = "xyz", ramp: float = 0.0) -> None:
        """Replaces all motions: moved nodes of the scene go to these displacements (m) along `axes`, evenly over the first `ramp` s of the
        simulation, or over the next call of `advance` without one. A node that is named twice must go to one place."""
        numbers = library.node_numbers(nodes, len(self.scene.mesh.points), "motions")
        rows = np.zeros(len(numbers), _MOTION)
        rows["node"], rows["metre"], rows["ramp"] = numbers, library.vectors(metre, "metre", len(numbers)), library.not_negative(ramp, "ramp", "s")
        rows["axes"] = axes_of(axes, "motions")
        _, first, place = np.unique(numbers, return_index=True, return_inverse=True)
        bad = np.flatnonzero((rows["metre"] != rows["metre"][first[place]]).any(axis=1))
        if len(bad):
            one, other = first[place[bad[0]]], bad[0]
            raise InputError(
                f"motions: entries {one} and {other} are both node {numbers[other]}, "
                f"with {rows['metre'][one].tolist()} and {rows['metre'][other].tolist()} m: only one of them can hold"
            )
        error, motions = library.new_error(), library.pointer("supple_motion", rows)
        library.checked(lib.supple_set_motions(self._loads, self._raw_scene, motions, len(rows), error), error, "motions")

    # Instruments.

    @_one_at_a_time
    def set_instruments(self, instruments: list[Instrument], *, triangles: bool | None = None, grips: int = 0) -> None:
        """Replaces all instruments, at most eight, which stand still where they are. Unless you say it with `triangles`, they touch the
        triangles of the surface, and not only its nodes, where one of them is thinner than edges are long; `grips` is how many nodes they
        can hold at once."""
        contact, points, boundary, rows = self._contact, self.scene.mesh.points, self.scene._boundary, Rows(instruments)
        needed = need_triangles(rows, points, boundary) if triangles is None else triangles
        if contact is None or grips or needed != contact.triangles:
            contact = Contact(points, boundary, self._raw_scene, needed, grips or (contact.grips if contact else 0))
        # Refused ones leave the loads with the instruments that they have.
        contact.put(rows)
        library.checked(lib.supple_set_contact(self._loads, contact.raw if instruments else ffi.NULL))
        self._contact = contact

    @_one_at_a_time
    def move(self, instrument: int, position: ArrayLike, rotation: ArrayLike | None = None, *, within: float) -> None:
        """Lets an instrument go on a line, and turn evenly, to a pose in the next `within` seconds."""
        self._touching(instrument).move(instrument, position, rotation, self.time, self.time + library.not_negative(within, "within", "s"))

    @_one_at_a_time
    def touch(self, instrument: int) -> Touch:
        """What an instrument felt in the latest call of `advance`."""
        return self._touching(instrument).touch(instrument)

    @_one_at_a_time
    def grasp(self, instrument: int, within: float) -> int:
        """Lets an instrument hold the nodes of the surface that are nearer than `within` (m), until `let_go`. Gives how many it holds."""
        held = ffi.new("uint32_t *")
        status = lib.supple_grasp(self._touching(instrument).raw, self._state, instrument, library.not_negative(within, "within", "m"), held)
        library.checked(status, what=f"instrument {instrument}")
        return int(held[0])

    @_one_at_a_time
    def let_go(self, instrument: int) -> None:
        library.checked(lib.supple_let_go(self._touching(instrument).raw, instrument), what=f"instrument {instrument}")

    @_one_at_a_time
    def contact_points(self) -> NDArray[np.void]:
        """Where instruments push in the latest step, 64 points at most, with the fields position (m), normal (outward of the instrument, zero
        where it holds the node), force (on the tissue, N), depth (m), node and instrument."""
        return np.zeros(0, POINT) if self._contact is None else self._contact.points()

    # Pulls.

    @_one_at_a_time
    def pull(
        self,
        points: ArrayLike,
        targets: ArrayLike | None = None,
        *,
        radius: float | None = None,
        stiffness: ArrayLike = 300.0,
        most: float | None = None,
        along: ArrayLike | None = None,
    ) -> Pulls:
        """Draws points of the tissue (m, at rest) to targets (m) from now on, each by the nodes within `radius` (m; 2.2 mean edges unless
        given, some 20 to 50 nodes), with `stiffness` (N/m, one
        for all or one for each, up to 1e6; no stiffness makes a step unstable) and at most `most` N
        (a quarter of the shear modulus on the area in which its nodes hang together with others, half of that for fewer than eight, unless given; more tears the tissue). With `along`, a direction for all or for
        each, such as the normal of a surface, only along it: the point slides free across. Without targets they are absent. A point turns with
        the body whenever targets move, and while it settles."""
        radius = _PATCH * self.scene._edge if radius is None else radius
        wanted = wanted_of(points, radius, stiffness, most, along)
        groups = [*self._pull_groups, wanted]
        if targets is not None:
            array = np.array(targets, np.float32)
            if array.shape != wanted.points.shape:
                raise InputError(f"targets: their shape is {array.shape}, it must be {wanted.points.shape}")
            wanted.targets = array
        self._set_pulls(groups)
        self._warn_of("pulls: radius", radius, 1.0)
        outside = self.locate(wanted.points).distances
        if outside.max(initial=0.0) > 0.5 * radius:
            warnings.warn(
                f"pulls: point {outside.argmax()} is {1e3 * outside.max():.3g} mm outside the tissue: is it in metres, and in the axes of the mesh?",
                RuntimeWarning, stacklevel=3,
            )  # fmt: skip
        return Pulls(self, wanted)

    def _set_pulls(self, groups: list[Wanted]) -> None:
        memory = PullMemory(self, groups) if groups else None
        if memory:
            memory.turn(self)
        library.checked(lib.supple_set_pulls(self._loads, memory.raw if memory else ffi.NULL), what="pulls")
        self._pull_memory, self._pull_groups = memory, groups

    @_one_at_a_time
    def _release(self, pulls: Pulls) -> None:
        self._place_of(pulls._wanted)
        self._set_pulls([group for group in self._pull_groups if group is not pulls._wanted])

    @_one_at_a_time
    def _aim(self, wanted: Wanted, targets: NDArray[np.float32], within: float) -> None:
        place = self._place_of(wanted)
        if not 0.0 <= library.number(within, "within") < np.inf:
            raise InputError(f"within {within} s: it must be zero or more")
        assert self._pull_memory is not None
        self._pull_memory.aim(place.start, targets, (self.time, self.time + within))
        self._pull_memory.turn(self)
        wanted.aim(targets, self.time, within)

    @_one_at_a_time
    def _pulled(self, wanted: Wanted) -> NDArray[np.void]:
        place = self._place_of(wanted)
        assert self._pull_memory is not None
        return self._pull_memory.read(self._state)[place]

    def _place_of(self, wanted: Wanted) -> slice:
        first = 0
        for group in self._pull_groups:
            if group is wanted:
                return slice(first, first + len(group.points))
            first += len(group.points)
        raise InputError("these pulls were released")

    # Tissue that changes.

    @_one_at_a_time
    def exchange(self, scene: Scene) -> None:
        """Goes on in another scene of the same points: displacements, velocities, time, loads, pulls and instruments stay, so what stays of the
        tissue keeps its momentum. Where it is refused nothing has changed. Views of `displacements` are to be taken anew, and reactions."""
        exchanged(self, scene)
        self._ablations = []

    @_one_at_a_time
    def remove(self, elements: ArrayLike) -> None:
        """Removes elements, as numbers or as a mask over all, as a resection does: see `exchange`. Nodes without an element stay in all
        arrays, held where they are; instruments touch the new surface, pulls and instruments let go of what is removed, and pressures and
        tractions act on what is left of their surfaces, not on the cut; an open one fills no more. Forces stay on
        their nodes."""
        scene = self.scene
        removed = scene._removed.copy()
        removed[library.node_numbers(elements, len(removed), "remove", "element")] = 1
        exchanged(self, scene._without(removed))

    @_one_at_a_time
    def ablate(self, elements: ArrayLike, material: Material, seconds: float) -> None:
        """Lets the constants of some elements, as numbers or as a mask, change evenly to those of a material of the same law over so many
        seconds from now on, in 20 stages, each at the begin of a call of `advance`. Densities, relaxation and fibres stay. A `reset` or an
        `exchange` ends it where it is. See `exchange`."""
        ablated(self, elements, material, seconds)

    # Supports.

    @_one_at_a_time
    def reaction(self, nodes: ArrayLike) -> Reaction:
        """What tells the force by which some of the fixed or moved nodes act on the tissue. It takes as long as some hundred steps."""
        numbers = library.node_numbers(nodes, len(self.scene.mesh.points), "reaction")
        if not len(numbers):
            raise InputError("reaction: there are no nodes: name some that the scene fixes or moves")
        bad = np.flatnonzero(~np.isin(numbers, self.scene._supports[:, 0]))
        if len(bad):
            raise InputError(
                f"reaction: entry {bad[0]} is node {numbers[bad[0]]}, which the scene neither fixes nor moves", index=int(bad[0]), node=int(numbers[bad[0]])
            )
        damping = self._settings.damping if self.network is None else self.network["damping"]
        return Reaction(self, numbers, damping)

    def _touching(self, instrument: int) -> Contact:
        if self._contact is None:
            raise InputError("there are no instruments: set_instruments comes first")
        if not isinstance(instrument, (int, np.integer)) or not 0 <= instrument < len(self._contact.list):
            raise InputError(f"instrument {instrument}: there are {len(self._contact.list)}, counted from 0")
        return self._contact

    @_one_at_a_time
    def remarks(self) -> list[str]:
        """What looks as if a unit or a number was mistaken, in the kernel's words, the first of each kind; the first step warns of it."""
        points, count, room = library.pointer("float", self.scene.mesh.points), ffi.new("uint32_t *", 32), 0
        while count[0] > room:
            room = count[0]
            found = ffi.new("supple_remark[]", room)
            status = lib.supple_remarks(self._raw_scene, points, self._loads, self._network, found, room, count)
            library.checked(status, what="remarks")
        said = []
        kinds = [remark.kind for remark in found[0 : count[0]]]
        for remark in (found[kinds.index(kind)] for kind in dict.fromkeys(kinds)):
            figures = " against ".join(f"{value:.4g}" for value in (remark.value, remark.limit) if value != 0.0)
            place = f"{_PLACES[remark.kind]} {remark.index}: " if remark.kind in _PLACES else ""
            words = str(ffi.string(lib.supple_remark_text(remark.kind)), "ascii")
            more = f", the first of {kinds.count(remark.kind)}" if kinds.count(remark.kind) > 1 else ""
            said.append(f"{place}{words} ({figures}){more}" if figures else f"{place}{words}{more}")
        if not len(self.scene._supports) and not self._pull_groups:
            said.append("no node is fixed, moved or pulled: the body is free")
        said += self._loose_parts()
        if self._settings.tolerance > _MOST_TOLERANCE * self.scene._across:
            said.append(f"tolerance {self._settings.tolerance:.4g} m {self._large()}")
        return said

    def _loose_parts(self) -> list[str]:
        """Parts of the tissue that nothing holds, next to some that are held: meshes that were put together, and their nodes not."""
        part, held = self.scene._parts, self.scene._supports[:, 0]
        if self._pull_memory:
            held = np.concatenate([held, *(self._pulled_nodes(group) for group in self._pull_groups)])
        tissue = np.unique(self.scene.mesh.tets[self.scene._removed == 0])
        parts, nodes = np.unique(part[tissue], return_counts=True)
        is_loose = ~np.isin(parts, part[held])
        if not is_loose.any() or is_loose.all():
            return []
        return [
            f"the mesh has {len(parts)} parts that share no node, and nothing holds {is_loose.sum()} of them, of up to {nodes[is_loose].max()} nodes: "
            "merge nodes that lie on each other, if they belong together"
        ]

    def _pulled_nodes(self, group: Wanted) -> NDArray[np.intp]:
        """Those within the radius of a point."""
        points = self.scene.mesh.points
        near = [np.flatnonzero(np.linalg.norm(points - each, axis=1) < group.radius) for each in group.points]
        return np.concatenate(near) if near else np.zeros(0, np.intp)

    def _large(self) -> str:
        """Of a length that is."""
        return f"is large for a body that is {self.scene._across:.3g} m across: is it in metres? (1 mm is 0.001 m)"

    def _warn_of(self, what: str, metre: float, most: float) -> None:
        """Where what is given now is longer than so many diagonals of the body."""
        if metre > most * self.scene._across:
            warnings.warn(f"{what} {metre:.4g} m {self._large()}", RuntimeWarning, stacklevel=4)

    def _warn_once(self) -> None:
        if self._is_warned:
            return
        self._is_warned = True
        for words in self.remarks():
            warnings.warn(words, RuntimeWarning, stacklevel=4)

    _is_warned = False

    # Steps.

    @property
    @_one_at_a_time
    def network(self) -> dict[str, Any] | None:
        """What the network of learned steps was trained for: seconds (of a step), damping (1/s), law, constants (Pa), density (kg/m^3),
        element, exact_seconds (of the steps it learned from), multiply_adds (of a node's prediction); and fell_back, how often exact steps have
        taken the place of its own. Of other steps None."""
        if self._network == ffi.NULL:
            return None
        facts = ffi.new("supple_learned_facts *")
        library.checked(lib.supple_learned_describe(self._network, facts), what="network")
        law, names = next((name, names) for name, (number, names) in LAWS.items() if number == facts.law)
        told = {name: getattr(facts, name) for name in ("seconds", "damping", "exact_seconds", "multiply_adds", "fell_back")}
        element = next(name for name, number in ELEMENTS.items() if number == facts.element)
        constants = dict(zip(names, facts.tissue.constants))
        return {**told, "law": law, "constants": constants, "density": facts.tissue.density, "element": element}

    @property
    @_one_at_a_time
    def critical_step(self) -> float:
        """The longest exact step (s) at the present displacements: a bound, safe."""
        seconds = ffi.new("float *")
        library.checked(lib.supple_critical_step(self._raw_scene, self._state, seconds, ffi.NULL))
        return float(seconds[0])

    @_one_at_a_time
    def advance(self, seconds: float) -> Report:
        """Moves on by so many seconds; learned steps end at the nearest of the network's, and a span shorter than a sixteenth
        of the last step is left to the next call. Raises `Diverged` where a step is refused: the state is then the last good one."""
        if not 0.0 < library.number(seconds, "seconds") < np.inf:
            raise InputError(f"advance by {seconds} s: it must be a positive number")
        self._warn_once()
        next_stage(self)
        report = ffi.new("supple_sim_report *")
        status = lib.supple_sim_advance(self._sim, seconds, self._threads, report)
        call, estimate = report.call, report.estimate
        library.checked(status, call.error, f"at {call.time:.6g} s")
        return Report(
            _WORDS.get(status, str(status)),
            float(call.time),
            int(report.exact),
            int(report.long_steps),
            int(report.learned),
            int(report.undone),
            float(report.missing),
            float(call.least_volume_ratio),
            float(call.kinetic),
            float(estimate.mean) if estimate.known else None,
            float(estimate.allowed) if estimate.known else None,
            float(estimate.largest) if estimate.known else None,
            int(estimate.node) if estimate.known else None,
            float(report.shortest),
            float(report.longest),
            float(call.available),
            float(call.saturation),
            float(call.energy_excess),
            int(call.held_back),
            float(call.lattice_share),
            float(call.added_mass),
            float(call.clipped),
            float(call.outside),
        )

    @_one_at_a_time
    def take(self, count: int) -> Report:
        """Takes so many exact or long steps of the length that was given."""
        if self._step is None or self.method not in ("exact", "long"):
            raise InputError(f"take: {self.method} steps without a length that is given; call advance")
        if not 1.0 <= library.number(count, "count") < np.inf or int(count) != count:
            raise InputError(f"take {count} steps: it must be a whole number, at least 1")
        return self.advance(count * float(self._step))

    @_one_at_a_time
    def settle(self, metre: float, *, most_steps: int = 10_000) -> Settled:
        """Brings the body to rest under its loads and instruments, as they act at the present time, which stands still: every node to within
        about `metre` of where it rests, ablations as far as they are due. Velocities are zero afterwards. Each of the steps takes about as
        long as an exact one. Raises `Diverged` where a step is refused."""
        most_steps = library.whole(most_steps, "most_steps", (1 << 32) - 1)
        if not 0.0 < library.number(metre, "metre") < np.inf:
            raise InputError(f"settle to within {metre} m: it must be a positive number")
        self._warn_once()
        self._warn_of("settle: to within", metre, _MOST_TOLERANCE)
        next_stage(self)
        room = library.Memory(lib.supple_settle_size(len(self.scene.mesh.points)))
        pulls, told, steps = self._pull_memory, ffi.new("supple_settled *"), 0
        if pulls:
            pulls.turn(self)
        # They turn with the body when it is nearly at rest, before it is brought on.
        most = min(64, most_steps) if pulls else most_steps
        while True:
            status = lib.supple_sim_settle(self._sim, metre, most, self._threads, room.pointer, room.size, told)
            library.checked(status, told.error, "settle")
            steps += int(told.steps)
            # Where it rests its pulls have turned it, and turn with it.
            has_turned = pulls is not None and pulls.turn(self) > metre
            is_over = status != lib.SUPPLE_BEHIND and not has_turned
            if is_over or steps >= most_steps or told.steps == 0:
                break
            most = most_steps - steps
        word = _WORDS.get(status, str(status)) if is_over else "behind"
        return Settled(word != "behind", float(told.remaining), steps, word)

    @_one_at_a_time
    def set_displacements(self, metre: ArrayLike) -> None:
        """Puts the nodes at these displacements, shape (n, 3), m from rest, at a stop: velocities are zero, time stays, and the energy balance
        begins anew. Fixed nodes keep what is given."""
        rows = library.vectors(metre, "displacements")
        if len(rows) != len(self.scene.mesh.points):
            raise InputError(f"displacements: {len(rows)} rows, there are {len(self.scene.mesh.points)} nodes")
        self._warn_of("displacements: up to", float(np.linalg.norm(rows, axis=1).max(initial=0.0)), _FAR)
        error = library.new_error()
        given = library.pointer("float", rows)
        library.checked(lib.supple_set_displacements(self._raw_scene, self._state, given, len(rows), error), error, "displacements")
        # Made anew, they turn in full.
        self._set_pulls(self._pull_groups)
        self._prepare_again()

    # What it comes to.

    def _view_of_displacements(self) -> NDArray[np.float32]:
        vectors = ffi.new("supple_vectors *")
        library.checked(lib.supple_displacements(self._state, vectors))
        offset = int(ffi.cast("uintptr_t", vectors.first)) - self._memory.view.ctypes.data
        floats = self._memory.view[offset : offset + vectors.count * vectors.stride].view(np.float32)
        view = floats.reshape(vectors.count, vectors.stride // 4)[:, :3]
        view.flags.writeable = False
        return view

    @property
    def time(self) -> float:
        """s."""
        seconds = ffi.new("double *")
        library.checked(lib.supple_state_time(self._state, seconds, ffi.NULL))
        return float(seconds[0])

    @property
    def displacements(self) -> NDArray[np.float32]:
        """Of the nodes, m, shape (n, 3): a view without a copy, read-only, which always shows the newest state. `.copy()` keeps one."""
        return self._vectors

    @property
    def positions(self) -> NDArray[np.float32]:
        """Where the nodes are, m: a copy."""
        return self.scene.mesh.points + self._vectors

    @property
    def velocities(self) -> NDArray[np.float32]:
        """Of the nodes over the latest step, m/s: a copy."""
        return self._copied(lib.supple_copy_velocities)

    @property
    def forces(self) -> NDArray[np.float32]:
        """On the nodes in the latest step, loads less what the elements resist, N: a copy."""
        return self._copied(lib.supple_copy_forces)

    @_one_at_a_time
    def _copied(self, copy: Any) -> NDArray[np.float32]:
        out = np.empty((len(self.scene.mesh.points), 3), np.float32)
        library.checked(copy(self._state, library.pointer("float", out), out.size))
        return out

    @_one_at_a_time
    def locate(self, points: ArrayLike) -> FollowedPoints:
        """Points (m, (n, 3), of the shape at rest) that follow the tissue: a tumour, vessels, a finer surface, targets. Located once; where they
        are is asked for after each frame. Those outside follow the nearest point of the tissue, `distances` tells how far that is."""
        return FollowedPoints(self, points)

    @_one_at_a_time
    def field(self, image: Any, kind: str = "inverse", *, reach: float = 0.0, axes: str = "LPS") -> Field:
        """The displacement field on the grid of an image (of SimpleITK, or a `Grid`): "inverse" warps that image as the tissue has moved, "forward"
        moves points. In mm and LPS, as ITK has it. Within the tissue it is that of the elements; elsewhere it goes on smoothly, within the
        bounds of what is within, or falls off to zero at a `reach` (mm). `axes` are those of the mesh, "LPS" or "RAS"; its unit is m."""
        vectors = ffi.new("supple_vectors *")
        library.checked(lib.supple_displacements(self._state, vectors))
        largest = float(np.linalg.norm(self._vectors, axis=1).max())
        return field_of(self.scene._mesh_of_tissue(), vectors, largest, (image, kind, reach, axes))

    @_one_at_a_time
    def save(self) -> bytes:
        """The state as bytes, for `restore`."""
        size = ffi.new("size_t *")
        library.checked(lib.supple_state_saved_size(self._state, size))
        to = np.empty(size[0], np.uint8)
        library.checked(lib.supple_save(self._state, library.pointer("uint8_t", to), size[0]))
        return to.tobytes()

    @_one_at_a_time
    def restore(self, saved: bytes) -> None:
        """Puts the state back; steps go on from there, a network's after a lead-in. Exact steps of a given length without pulls go on to the
        bit; pulls are turned as the tissue is now. The motion alone goes back: loads and tissue stay as they are now, without what was
        removed and with what was ablated. An ablation that began later than the state's time ends where it is; another goes on from there
        when its next stage is due. To have the tissue of that time as well, keep its `scene` and `exchange` it before."""
        try:
            data = np.frombuffer(saved, np.uint8)
        except (TypeError, ValueError):
            raise InputError(f"restore {saved!r:.40}: it must be the bytes that save gave") from None
        size = ffi.new("size_t *")
        library.checked(lib.supple_state_saved_size(self._state, size))
        status = lib.supple_restore(self._state, library.pointer("uint8_t", data), len(data))
        library.checked(status, what=f"restore of {len(data)} bytes, where save gives {size[0]}")
        self._ablations = [ablation for ablation in self._ablations if ablation.start <= self.time]
        self._prepare_again()

    @_one_at_a_time
    def reset(self) -> None:
        """Back to rest, at time zero; targets of pulls are where they were to go. The motion alone goes back: loads and tissue stay as they
        are now, without what was removed and with what was ablated, and an ablation under way ends where it is. To have the tissue of the
        start as well, keep its `scene` and `exchange` it before."""
        library.checked(lib.supple_state_reset(self._state))
        self._ablations = []
        for group in self._pull_groups:
            group.times = (0.0, 0.0)
        self._set_pulls(self._pull_groups)
        self._prepare_again()

    @_one_at_a_time
    def stop(self) -> None:
        """Stops all motion: nodes and time stay, velocities are zero, and the energy balance begins anew. To go on after `Diverged` for too
        much energy, without a saved state."""
        library.checked(lib.supple_state_stop(self._raw_scene, self._state))
        self._prepare_again()

    def _prepare_again(self) -> None:
        """From the state as it is. Exact steps look at it by themselves."""
        if self._pull_memory:
            self._pull_memory.turn(self)
        if self.method != "exact":
            error = library.new_error()
            library.checked(lib.supple_sim_set(self._sim, self._settings, error), error, self._what)

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the moved mesh with its displacements, in any format of meshio (.vtu, ...): what is left of the tissue, and all nodes."""
        self.scene._mesh_of_tissue().write(path, self._vectors)


class Pressure(library.Sealed):
    """A pressure on a part of the surface, of `Simulation.add_pressure`."""

    def __init__(self, simulation: Simulation, surface: int, numbers: NDArray[np.uint32]) -> None:
        self._simulation, self._surface, self._numbers = simulation, surface, numbers
        self._pascal = self._ramp = 0.0
        self._filling = (0.0, 0.0)
        self._is_made = True

    @property
    def pascal(self) -> float:
        """Pa, in full."""
        return self._pascal

    @pascal.setter
    def pascal(self, value: float) -> None:
        self.set(value)

    def set(self, pascal: float, ramp: float = 0.0) -> None:
        """Sets it, Pa; it rises evenly over `ramp` s from the start of the simulation."""
        with self._simulation._lock:
            self._check()
            pascal, ramp = library.number(pascal, "pascal"), library.not_negative(ramp, "ramp", "s")
            status = lib.supple_pressure_set(self._simulation._pressure, self._surface, pascal, ramp)
            library.checked(status, what=f"pressure {pascal} Pa, ramp {ramp} s")
            self._pascal, self._ramp = pascal, ramp

    def fill(self, volume: float, bulk: float) -> None:
        """Asks for the volume (m^3) within the surface, which is closed, of a body or of a cavity: in addition to `pascal` there is a pressure from
        within, `bulk` (Pa) times the share of the volume that is missing. With a bulk of 0 the volume is not asked for."""
        with self._simulation._lock:
            self._check()
            volume, bulk = library.number(volume, "volume"), library.number(bulk, "bulk")
            status = lib.supple_pressure_fill(self._simulation._pressure, self._surface, volume, bulk)
            library.checked(status, what=f"fill to {volume} m^3 with {bulk} Pa")
            self._filling = (volume, bulk)

    @property
    def volume(self) -> float:
        """Within the surface, m^3; NaN where it is open, as after a cut."""
        return self._now()[0]

    @property
    def now(self) -> float:
        """The pressure at present, with what fills the surface, Pa."""
        return self._now()[1]

    def _now(self) -> tuple[float, float]:
        with self._simulation._lock:
            self._check()
            volume, pascal = ffi.new("double *"), ffi.new("float *")
            state = self._simulation._state
            library.checked(lib.supple_pressure_now(self._simulation._pressure, state, self._surface, volume, pascal))
            return float(volume[0]), float(pascal[0])

    def _check(self) -> None:
        if self not in self._simulation._pressures:
            raise InputError("this pressure is no more: clear_pressures has taken it away")


def _threads(count: int) -> Any:
    """Threads of the kernel's own; the calling one alone is NULL."""
    if not 1 <= library.number(count, "threads") <= lib.SUPPLE_MOST_PARTS or int(count) != count:
        raise InputError(f"threads {count}: there are 1 to {lib.SUPPLE_MOST_PARTS}")
    if count == 1:
        return ffi.NULL
    threads = ffi.new("supple_threads *")
    library.checked(lib.supple_own_threads(int(count), threads), what="threads")
    return threads


def _weights(path: str | os.PathLike[str]) -> library.Memory:
    try:
        data = pathlib.Path(path).read_bytes()
    except OSError as problem:
        raise InputError(f"{path}: cannot be read: {problem.strerror}") from None
    memory = library.Memory(len(data))
    memory.view[:] = np.frombuffer(data, np.uint8)
    return memory
