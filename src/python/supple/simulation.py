"""A scene in motion: loads, instruments, steps of every kind, and what they lead to."""

from __future__ import annotations

import dataclasses
import os
import pathlib
import warnings
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _library as library
from ._library import ffi, lib
from .errors import InputError
from .instruments import Contact, Instrument, Touch
from .scene import Scene, axes_of

METHODS = ("exact", "mass-scaled", "multilevel", "damped", "adaptive", "learned")
_LARGE = {"mass-scaled": 0, "multilevel": 1, "damped": 2, "adaptive": 2}
_WORDS = {0: "ok", 1: "limited", 2: "outside", 3: "fell back", 4: "inexact"}
# Share of the critical step that exact steps take unless they are told.
_SHARE = 0.9


@dataclasses.dataclass(frozen=True)
class Report:
    """What a call of `advance` came to.

    `status` is "ok"; "limited" (steps were taken, but are not exact), "outside" (the network saw what its training had not),
    "fell back" (exact steps took the place of learned ones), "inexact" (the estimate of the error exceeds what is allowed).
    It is the worst of all steps of the call. `estimate`: mean error of the nodes (m) after the last of them, by the guard or the
    adaptive steps, None where there is none (yet); `allowed`: what the guard accepts there, a fifth of the motion so far or the tolerance.
    """

    status: str
    time: float
    steps: int
    least_volume_ratio: float
    kinetic_energy: float
    estimate: float | None
    allowed: float | None

    @property
    def ok(self) -> bool:
        return self.status == "ok"


class Simulation:
    """A scene that starts at rest.

    Parameters
    ----------
    scene
    method : "exact"; "damped" beyond the critical step ("mass-scaled" and "multilevel" are for comparisons); "adaptive" chooses the
        length of its steps for a tolerance; "learned"
    step : s; of exact steps 0.9 of the critical one at the moment unless given; needed by those beyond it, unless adaptive
    damping : 1/s; learned steps take that of their training
    tolerance : mean error (m) that adaptive steps keep and the guard allows
    weights : file of the network, for learned steps; of another damper than the library's own, for damped and adaptive ones
    lead : seconds of exact steps before a network takes over
    guard : whether a second run estimates the error of long and learned steps
    instruments : how many nodes they can hold at once, and whether they touch triangles too, is said by `grips` and `triangles`
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
        lead: float = 0.3,
        guard: bool = True,
        gravity: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        if method not in METHODS:
            raise InputError(f"method {method!r}: there are {', '.join(METHODS)}")
        self.scene, self.method, self.tolerance = scene, method, tolerance
        self.damping, self._lead, self._fixed_step = float(damping), float(lead), step
        nodes = len(scene.mesh.points)
        size = lib.supple_state_size(nodes, _element(scene))
        self._state_memory = library.Memory(size)
        state = ffi.new("supple_state **")
        library.checked(lib.supple_state_init(self._state_memory.pointer, size, scene._raw, state))
        self._state = state[0]
        self._room_for_loads(0, 0)
        self._forces: Any = None
        self._motions: Any = None
        self._contact: Contact | None = None
        self._kernel: Any = None
        self._guard: Any = None
        self._error = library.new_error()
        self._vectors = self._view_of_displacements()
        self.gravity = gravity
        if method == "learned":
            if weights is None:
                raise InputError("learned steps need weights, the file of a network")
            self._prepare_learned(weights, lead)
        elif method != "exact":
            self._prepare_large(weights)
        if guard and method not in ("exact", "adaptive"):
            self._prepare_guard()

    # Loads.

    @property
    def gravity(self) -> NDArray[np.float32]:
        """m/s^2."""
        return self._gravity.copy()

    @gravity.setter
    def gravity(self, value: ArrayLike) -> None:
        if np.shape(value) != (3,):
            raise InputError(f"gravity: {value!r}, it must be three numbers, m/s^2")
        self._gravity: NDArray[np.float32] = library.vectors([value], "gravity")[0]
        library.checked(lib.supple_set_gravity(self._loads, library.pointer("float", self._gravity)), what="gravity")

    def set_forces(self, nodes: ArrayLike, newton: ArrayLike, ramp: float = 0.0) -> None:
        """Replaces all forces: on each of these nodes a force (N), one for all or a row for each, which rises evenly over `ramp` s."""
        numbers = library.node_numbers(nodes, len(self.scene.mesh.points), "forces")
        newton_of = library.vectors(newton, "newton", len(numbers))
        rows = ffi.new("supple_force[]", max(len(numbers), 1))
        for row, node, force in zip(rows, numbers, newton_of):
            row.node, row.newton, row.ramp = int(node), force.tolist(), ramp
        self._forces = (rows, len(numbers))
        self._fill_loads()

    def set_motions(self, nodes: ArrayLike, metre: ArrayLike, axes: str = "xyz", ramp: float = 0.0) -> None:
        """Replaces all motions: moved nodes of the scene go to these displacements (m) along `axes`, evenly over `ramp` s, or over the next
        call of `advance` without one."""
        numbers = library.node_numbers(nodes, len(self.scene.mesh.points), "motions")
        metre_of = library.vectors(metre, "metre", len(numbers))
        rows = ffi.new("supple_motion[]", max(len(numbers), 1))
        for row, node, way in zip(rows, numbers, metre_of):
            row.node, row.axes, row.metre, row.ramp = int(node), axes_of(axes, "motions"), way.tolist(), ramp
        self._motions = (rows, len(numbers))
        self._fill_loads()

    def _room_for_loads(self, forces: int, motions: int) -> None:
        size = lib.supple_loads_size(forces, motions)
        self._loads_memory, self._loads_room = library.Memory(size), (forces, motions)
        loads = ffi.new("supple_loads **")
        library.checked(lib.supple_loads_init(self._loads_memory.pointer, size, self.scene._raw, forces, motions, loads))
        self._loads = loads[0]

    def _fill_loads(self) -> None:
        counts = tuple(0 if rows is None else rows[1] for rows in (self._forces, self._motions))
        if any(count > room for count, room in zip(counts, self._loads_room)):
            self._room_for_loads(*counts)
            self.gravity = self._gravity
            if self._contact is not None:
                library.checked(lib.supple_set_contact(self._loads, self._contact.raw))
        error = library.new_error()
        if self._forces is not None:
            library.checked(lib.supple_set_forces(self._loads, *self._forces, error), error, "forces")
        if self._motions is not None:
            library.checked(lib.supple_set_motions(self._loads, self.scene._raw, *self._motions, error), error, "motions")

    # Instruments.

    def set_instruments(self, instruments: list[Instrument], *, triangles: bool = False, grips: int = 0) -> None:
        """Replaces all instruments, at most eight, which stand still where they are. `triangles` of the surface are needed by those that are
        thinner than its edges are long; `grips` is how many nodes they can hold at once."""
        if self._contact is None or triangles or grips:
            self._contact = Contact(self.scene, triangles, grips)
        self._contact.put(instruments)
        library.checked(lib.supple_set_contact(self._loads, self._contact.raw if instruments else ffi.NULL))

    def move(self, instrument: int, position: ArrayLike, rotation: ArrayLike | None = None, *, within: float) -> None:
        """Lets an instrument go on a line, and turn evenly, to a pose in the next `within` seconds."""
        self._touching().move(instrument, position, rotation, self.time, self.time + within)

    def touch(self, instrument: int) -> Touch:
        """What an instrument felt in the latest call of `advance`."""
        return self._touching().touch(instrument)

    def grasp(self, instrument: int, within: float) -> int:
        """Lets an instrument hold the nodes of the surface that are nearer than `within` (m), until `let_go`. Gives how many it holds."""
        held = ffi.new("uint32_t *")
        status = lib.supple_grasp(self._touching().raw, self._state, instrument, within, held)
        library.checked(status, what=f"instrument {instrument}")
        return int(held[0])

    def let_go(self, instrument: int) -> None:
        library.checked(lib.supple_let_go(self._touching().raw, instrument), what=f"instrument {instrument}")

    def _touching(self) -> Contact:
        if self._contact is None:
            raise InputError("there are no instruments: set_instruments comes first")
        return self._contact

    def remarks(self) -> list[str]:
        """What looks as if a unit or a number was mistaken, in the kernel's words; the first step warns of it."""
        found, count, room = ffi.new("supple_remark[]", 32), ffi.new("uint32_t *"), 32
        learned = self._kernel if self.method == "learned" else ffi.NULL
        library.checked(lib.supple_remarks(self.scene._raw, self._points(), self._loads, learned, found, room, count), what="remarks")
        said = []
        for remark in found[0 : min(count[0], room)]:
            figures = [f"{value:.4g}" for value in (remark.value, remark.limit) if value != 0.0]
            said.append(f"{str(ffi.string(lib.supple_remark_text(remark.kind)), 'ascii')} ({' against '.join(figures) or 'no figure'})")
        if not len(self.scene._supports):
            said.append("no node is fixed or moved: the body is free")
        return said

    def _warn_once(self) -> None:
        if self._is_warned:
            return
        self._is_warned = True
        for words in self.remarks():
            warnings.warn(words, RuntimeWarning, stacklevel=4)

    _is_warned = False

    # Steps.

    @property
    def critical_step(self) -> float:
        """The longest exact step (s) at the present displacements: a bound, safe."""
        seconds = ffi.new("float *")
        library.checked(lib.supple_critical_step(self.scene._raw, self._state, seconds, ffi.NULL))
        return float(seconds[0])

    def advance(self, seconds: float) -> Report:
        """Moves on by so many seconds; of fixed steps by the nearest whole number of them, at least one. Raises `Diverged` where a step is
        refused: the state is then the last good one."""
        if not (np.isfinite(seconds) and seconds > 0.0):
            raise InputError(f"advance by {seconds} s: it must be a positive number")
        self._warn_once()
        if self.method == "adaptive":
            return self._advance_adaptive(seconds)
        if self.method == "exact" and self._fixed_step is None:
            count = max(1, int(np.ceil(seconds / (_SHARE * self.critical_step))))
            self._set_exact(seconds / count)
        elif self.method == "exact":
            self._set_exact(self._fixed_step or 0.0)
            count = self._whole(seconds)
        else:
            count = self._whole(seconds)
        return self.take(count)

    def take(self, count: int) -> Report:
        """Takes so many steps of the length that is set (exact ones: by `advance` or `step`)."""
        scene, loads, state, report = self.scene._raw, self._loads, self._state, ffi.new("supple_report *")
        if self.method == "adaptive":
            raise InputError("adaptive steps choose their length: call advance")
        status, left = 0, int(count)
        while left > 0:
            # A guard follows each call.
            now = min(left, self._every) if self._guard is not None else left
            if self.method == "exact":
                if self._step is None:
                    self._set_exact(self._fixed_step or _SHARE * self.critical_step)
                code = lib.supple_step(scene, loads, state, now, ffi.NULL, report)
            elif self.method == "learned":
                code = lib.supple_learned_step(scene, loads, state, self._kernel, now, ffi.NULL, report)
            else:
                code = lib.supple_large_step(scene, loads, state, self._kernel, now, ffi.NULL, report)
            library.checked(code, report.error, f"at {report.time:.6g} s")
            status = max(status, code)
            if self._guard is not None:
                followed = lib.supple_guard_follow(scene, loads, state, self._guard, ffi.NULL, self._estimate)
                status = max(status, library.checked(followed))
                if followed == lib.SUPPLE_INEXACT and self.method == "learned":
                    library.checked(lib.supple_learned_fall_back(self._kernel, state))
            left -= now
        return self._report(status, report, count)

    def _advance_adaptive(self, seconds: float) -> Report:
        report, taken = ffi.new("supple_report *"), ffi.new("supple_adaptive_report *")
        status = lib.supple_adaptive_advance(
            self.scene._raw, self._loads, self._state, self._kernel, seconds, ffi.NULL, report, taken
        )
        library.checked(status, report.error, f"at {report.time:.6g} s")
        self._estimate = taken.estimate
        return self._report(status, report, int(taken.exact + taken.large))

    def _report(self, status: int, report: Any, steps: int) -> Report:
        known = self._estimate is not None and self._estimate.known
        return Report(
            _WORDS.get(status, str(status)),
            float(report.time),
            steps,
            float(report.least_volume_ratio),
            float(report.kinetic),
            float(self._estimate.mean) if known else None,
            float(self._estimate.allowed) if known else None,
        )

    def _whole(self, seconds: float) -> int:
        return max(1, round(seconds / (self._fixed_step or seconds)))

    def _set_exact(self, seconds: float) -> None:
        if seconds == self._step:
            return
        made = library.config("supple_step_config")
        made.seconds, made.damping = seconds, self.damping
        error = library.new_error()
        library.checked(lib.supple_set_step(self.scene._raw, self._state, made, error), error, "step")
        self._step = seconds

    _step: float | None = None
    _estimate: Any = None
    _every = 3

    # What steps need.

    def _points(self) -> Any:
        return library.pointer("float", self.scene.mesh.points)

    def _prepare_large(self, weights: str | os.PathLike[str] | None) -> None:
        made = library.config("supple_large_config")
        made.method, made.damping = _LARGE[self.method], self.damping
        if self.method == "adaptive":
            if self.tolerance is None:
                raise InputError("adaptive steps need a tolerance, m")
            made.seconds = self._fixed_step or 1.0 / 60.0
        elif self._fixed_step is None:
            raise InputError(f"{self.method} steps need a step, s: the critical one is {self.critical_step:.4g} s")
        else:
            made.seconds = self._fixed_step
        if weights is not None and self.method in ("damped", "adaptive"):
            self._weights = _weights(weights)
            made.weights, made.weights_bytes = self._weights.pointer, self._weights.size
        kind = "adaptive" if self.method == "adaptive" else "large"
        more = (self.tolerance,) if kind == "adaptive" else ()
        size, error, kernel = ffi.new("size_t *"), library.new_error(), ffi.new(f"supple_{kind} **")
        scene = self.scene._raw
        library.checked(getattr(lib, f"supple_{kind}_size")(scene, self._points(), made, size, error), error, self.method)
        self._kernel_memory = library.Memory(size[0])
        init = getattr(lib, f"supple_{kind}_init")
        memory = self._kernel_memory
        status = init(memory.pointer, memory.size, scene, self._state, self._points(), made, *more, kernel, error)
        library.checked(status, error, self.method)
        self._kernel = kernel[0]

    def _prepare_learned(self, weights: str | os.PathLike[str], lead: float) -> None:
        self._weights = _weights(weights)
        made = library.config("supple_learned_config")
        made.fallback, made.weights, made.weights_bytes = 1, self._weights.pointer, self._weights.size
        size = lib.supple_learned_size(len(self.scene.mesh.points), 1)
        self._kernel_memory = library.Memory(size)
        kernel, error = ffi.new("supple_learned **"), library.new_error()
        status = lib.supple_learned_init(self._kernel_memory.pointer, size, self.scene._raw, made, kernel, error)
        library.checked(status, error, f"{weights}")
        self._kernel = kernel[0]
        facts = ffi.new("supple_learned_facts *")
        library.checked(lib.supple_learned_describe(self._kernel, facts))
        self._fixed_step, self.damping, self._every = float(facts.seconds), float(facts.damping), 1
        # The exact steps of the lead-in.
        count = max(1, int(np.ceil(facts.seconds / (_SHARE * self.critical_step))))
        self._set_exact(facts.seconds / count)

    def lead(self) -> Report:
        """The exact steps that lead before the network takes over; learned steps take none before it."""
        report = ffi.new("supple_report *")
        status = lib.supple_learned_lead(
            self.scene._raw, self._loads, self._state, self._kernel, self._lead, ffi.NULL, report
        )
        library.checked(status, report.error, f"at {report.time:.6g} s")
        return self._report(status, report, int(report.steps))

    def _prepare_guard(self) -> None:
        size, error, guard = ffi.new("size_t *"), library.new_error(), ffi.new("supple_guard **")
        library.checked(lib.supple_guard_size(self.scene._raw, self._points(), size, error), error, "the guard")
        made = library.config("supple_guard_config")
        made.seconds, made.damping, made.every = self._fixed_step or 0.0, self.damping, self._every
        made.tolerance = self.tolerance or 0.0
        self._guard_memory = library.Memory(size[0])
        status = lib.supple_guard_init(
            self._guard_memory.pointer, size[0], self.scene._raw, self._state, self._points(), made, guard, error
        )
        library.checked(status, error, "the guard")
        self._guard, self._estimate = guard[0], ffi.new("supple_estimate *")

    # What it comes to.

    def _view_of_displacements(self) -> NDArray[np.float32]:
        vectors = ffi.new("supple_vectors *")
        library.checked(lib.supple_displacements(self._state, vectors))
        offset = int(ffi.cast("uintptr_t", vectors.first)) - self._state_memory.view.ctypes.data
        floats = self._state_memory.view[offset : offset + vectors.count * vectors.stride].view(np.float32)
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

    def _copied(self, copy: Any) -> NDArray[np.float32]:
        out = np.empty((len(self.scene.mesh.points), 3), np.float32)
        library.checked(copy(self._state, library.pointer("float", out), out.size))
        return out

    def save(self) -> bytes:
        """The state as bytes, for `restore`."""
        size = lib.supple_saved_size(len(self.scene.mesh.points))
        to = np.empty(size, np.uint8)
        library.checked(lib.supple_save(self._state, library.pointer("uint8_t", to), size))
        return to.tobytes()

    def restore(self, saved: bytes) -> None:
        """Puts the state back; long steps go on from there, a network needs `lead` again."""
        data = np.frombuffer(saved, np.uint8)
        library.checked(lib.supple_restore(self._state, library.pointer("uint8_t", data), len(data)), what="restore")

    def reset(self) -> None:
        """Back to rest, at time zero."""
        library.checked(lib.supple_state_reset(self._state))

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the moved mesh with its displacements, in any format of meshio (.vtu, ...)."""
        self.scene.mesh.write(path, self._vectors)


def _element(scene: Scene) -> int:
    from .scene import ELEMENTS

    return ELEMENTS[scene.element]


def _weights(path: str | os.PathLike[str]) -> library.Memory:
    try:
        data = pathlib.Path(path).read_bytes()
    except OSError as problem:
        raise InputError(f"{path}: cannot be read: {problem.strerror}") from None
    memory = library.Memory(len(data))
    memory.view[:] = np.frombuffer(data, np.uint8)
    return memory
