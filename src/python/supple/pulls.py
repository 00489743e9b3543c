"""Pulls: forces that draw points of the tissue to targets, as tracked points do."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _library as library
from ._library import ffi, lib
from .errors import InputError

if TYPE_CHECKING:
    from .simulation import Simulation

# N/m.
_STIFFEST = 1e6
# As supple_pulled.
_PULLED = np.dtype([("point", np.float32, 3), ("gap", np.float32, 3), ("force", np.float32, 3)])


@dataclasses.dataclass
class Wanted:
    """What is asked of some pulls: points at rest and targets (m, NaN: absent), of the same length."""

    points: NDArray[np.float32]
    targets: NDArray[np.float32]
    radius: float
    stiffness: NDArray[np.float32]
    most: float
    along: NDArray[np.float32]
    # Where targets are at the first of these times; they are at `targets` from the second on.
    start: NDArray[np.float32] = dataclasses.field(default_factory=lambda: np.empty((0, 3), np.float32))
    times: tuple[float, float] = (0.0, 0.0)

    def at(self, time: float) -> NDArray[np.float32]:
        """Where the targets are, m. One that was absent is there at once."""
        begin, end = self.times
        if time >= end or len(self.start) != len(self.targets):
            return self.targets
        share = np.float32(max(0.0, (time - begin) / (end - begin)))
        between = self.start + share * (self.targets - self.start)
        return np.where(np.isnan(between), self.targets, between)

    def aim(self, targets: NDArray[np.float32], now: float, within: float) -> None:
        self.start, self.targets, self.times = self.at(now), targets, (now, now + within)

    def row(self, index: int) -> Any:
        pull = ffi.new("supple_pull *")
        pull.at, pull.radius, pull.stiffness = self.points[index].tolist(), self.radius, self.stiffness[index]
        pull.most, pull.along = self.most, self.along[index].tolist()
        return pull


class PullMemory:
    """All pulls of a simulation in the memory of the library."""

    def __init__(self, simulation: Simulation, groups: list[Wanted]) -> None:
        nodes = simulation.scene.mesh.points
        count = sum(len(group.points) for group in groups)
        # Room for the nodes of all patches, found by trying.
        room = 64 * count
        while True:
            try:
                self._make(simulation, groups, count, room)
                break
            except InputError as refused:
                if refused.status != lib.SUPPLE_E_CAPACITY or room >= count * len(nodes):
                    raise
                room = min(4 * room, count * len(nodes))
        self.count = count

    def _make(self, simulation: Simulation, groups: list[Wanted], count: int, room: int) -> None:
        nodes, size = simulation.scene.mesh.points, lib.supple_pulls_size(count, room)
        self._memory, made, error = library.Memory(size), ffi.new("supple_pulls **"), library.new_error()
        library.checked(lib.supple_pulls_init(self._memory.pointer, size, simulation._raw_scene, count, room, made))
        self.raw, points = made[0], library.pointer("float", nodes)
        for group in groups:
            for index in range(len(group.points)):
                status = lib.supple_add_pull(self.raw, simulation._raw_scene, points, group.row(index), error)
                # Of those that were asked for together.
                error.index = index
                library.checked(status, error, "pulls")
        first, now = 0, simulation.time
        for group in groups:
            # On its way.
            self.aim(first, group.at(now), (0.0, 0.0))
            if group.times[1] > now:
                self.aim(first, group.targets, (now, group.times[1]))
            first += len(group.points)

    def aim(self, first: int, targets: NDArray[np.float32], times: tuple[float, float]) -> None:
        error, rows = library.new_error(), np.ascontiguousarray(targets)
        status = lib.supple_set_targets_from(self.raw, first, library.pointer("float", rows), len(rows), *times, error)
        library.checked(status, error, "targets")

    def turn(self, simulation: Simulation) -> float:
        """With the body. By how much at most, m."""
        points, most = library.pointer("float", simulation.scene.mesh.points), ffi.new("float *")
        library.checked(lib.supple_turn_pulls(self.raw, simulation._raw_scene, points, simulation._state, most), what="pulls")
        return float(most[0])

    def read(self, state: Any) -> NDArray[np.void]:
        found = np.zeros(self.count, _PULLED)
        library.checked(lib.supple_read_pulls(self.raw, state, library.pointer("supple_pulled", found), self.count), what="pulls")
        return found


class Pulls(library.Sealed):
    """Pulls that were made together, by `Simulation.pull`."""

    def __init__(self, simulation: Simulation, wanted: Wanted) -> None:
        self._simulation, self._wanted = simulation, wanted
        self._is_made = True

    def move(self, targets: ArrayLike, *, within: float = 0.0) -> None:
        """Sets all targets, m, of shape (n, 3); a row with a NaN is absent until it has one again. Targets that were there move evenly to
        the new ones in the next `within` seconds, usually a frame; others are there at once."""
        array = np.array(targets, np.float32)
        if array.shape != self._wanted.points.shape:
            raise InputError(f"targets: their shape is {array.shape}, it must be {self._wanted.points.shape}")
        array[np.isnan(array).any(axis=1)] = np.nan
        self._simulation._aim(self._wanted, array, within)

    def release(self) -> None:
        """Ends these pulls for good."""
        self._simulation._release(self)

    @property
    def targets(self) -> NDArray[np.float32]:
        """m, NaN where absent: a copy."""
        return self._wanted.targets.copy()

    @property
    def points(self) -> NDArray[np.float32]:
        """Where the points are, m."""
        return self._read("point")

    @property
    def gaps(self) -> NDArray[np.float32]:
        """From the points to their targets, m; along the direction of a pull that has one; zero where absent."""
        return self._read("gap")

    @property
    def forces(self) -> NDArray[np.float32]:
        """On the tissue in the latest step, N."""
        return self._read("force")

    def _read(self, field: str) -> NDArray[np.float32]:
        return np.array(self._simulation._pulled(self._wanted)[field], np.float32)


def wanted_of(points: ArrayLike, radius: float, stiffness: ArrayLike, most: float | None, along: ArrayLike | None) -> Wanted:
    """Checks what `Simulation.pull` is given."""
    rows = library.vectors(points, "points")
    if not 0.0 < library.number(radius, "radius") < np.inf:
        raise InputError(f"radius {radius}: it must be a positive number, m")
    if most is not None and not library.number(most, "most") > 0.0:
        raise InputError(f"most {most}: it must be a positive number, N, or infinite for no limit")
    directions = np.zeros_like(rows) if along is None else library.vectors(along, "along", len(rows))
    bad = np.flatnonzero(~directions.any(axis=1))
    if along is not None and len(bad):
        raise InputError(f"along: row {bad[0]} is {directions[bad[0]].tolist()}, no direction; for pulls along all directions leave it out")
    try:
        stiff = np.broadcast_to(np.asarray(stiffness, np.float32), (len(rows),)).copy()
    except (TypeError, ValueError):
        raise InputError(f"stiffness {stiffness!r}: it must be one number, N/m, or one for each of {len(rows)} points") from None
    wrong = np.flatnonzero(~((stiff >= 0.0) & (stiff <= _STIFFEST)))
    if len(wrong):
        raise InputError(f"stiffness of row {wrong[0]}: {stiff[wrong[0]]:g} N/m, it must be from 0 to {_STIFFEST:g}")
    return Wanted(rows, np.full_like(rows, np.nan), radius, stiff, most or 0.0, directions)
