"""Rigid instruments that touch the tissue, what they feel, and the force on them between two frames."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _library as library
from ._library import ffi, lib
from .errors import InputError


# What a shape cannot be without.
_SIZES = {lib.SUPPLE_SPHERE: ("radius",), lib.SUPPLE_CAPSULE: ("radius", "length")}


@dataclasses.dataclass(frozen=True)
class Instrument:
    """A rigid body at a position (m), turned by a quaternion x, y, z, w. Made by `sphere`, `capsule`, `plane` and `field`.

    A capsule lies along z of its axes, a plane is solid below z = 0, a field is in the axes of its mesh.
    """

    shape: int
    position: tuple[float, float, float]
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    friction: float = 0.0
    radius: float = 0.0
    length: float = 0.0
    distances: bytes | None = None

    @classmethod
    def sphere(cls, radius: float, position: ArrayLike, *, friction: float = 0.0) -> Instrument:
        return cls(lib.SUPPLE_SPHERE, _three(position), friction=friction, radius=radius)

    @classmethod
    def capsule(
        cls, radius: float, length: float, position: ArrayLike, *, rotation: ArrayLike = (0, 0, 0, 1), friction: float = 0.0
    ) -> Instrument:
        return cls(lib.SUPPLE_CAPSULE, _three(position), _four(rotation), friction, radius, length)

    @classmethod
    def plane(cls, position: ArrayLike, *, rotation: ArrayLike = (0, 0, 0, 1), friction: float = 0.0) -> Instrument:
        return cls(lib.SUPPLE_PLANE, _three(position), _four(rotation), friction)

    @classmethod
    def field(
        cls, distances: bytes, position: ArrayLike = (0, 0, 0), *, rotation: ArrayLike = (0, 0, 0, 1), friction: float = 0.0
    ) -> Instrument:
        """Any form, as the bytes of a file that `supple field` makes of a mesh."""
        return cls(lib.SUPPLE_FIELD, _three(position), _four(rotation), friction, distances=bytes(distances))


@dataclasses.dataclass(frozen=True)
class Touch:
    """What an instrument felt: force of the tissue in the latest step and on average over the latest call (N; with
    method "auto" that of its last step), moment about its position (N m), nodes and triangles that it pushes, how deep these would have been inside it (m)."""

    force: NDArray[np.float64]
    mean_force: NDArray[np.float64]
    moment: NDArray[np.float64]
    contacts: int
    depth: float


def _three(vector: ArrayLike, unit: str = "m") -> tuple[float, float, float]:
    array = np.asarray(vector, np.float64)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise InputError(f"{'position' if unit == 'm' else 'force'} {vector!r}: three finite numbers are needed, {unit}")
    return float(array[0]), float(array[1]), float(array[2])


def _four(rotation: ArrayLike) -> tuple[float, float, float, float]:
    array = np.asarray(rotation, np.float64)
    if array.shape != (4,) or not np.isfinite(array).all() or not array.any():
        raise InputError(f"rotation {rotation!r}: a quaternion x, y, z, w is needed, not all of it zero")
    return float(array[0]), float(array[1]), float(array[2]), float(array[3])


def _pose(position: ArrayLike, rotation: ArrayLike) -> Any:
    return ffi.new("supple_pose *", {"position": _three(position), "rotation": _four(rotation)})


# As supple_contact_point.
POINT = np.dtype(
    [("position", np.float32, 3), ("normal", np.float32, 3), ("force", np.float32, 3), ("depth", np.float32)]
    + [("node", np.uint32), ("instrument", np.uint32)]
)


class LocalForce(library.Sealed):
    """The force on an instrument between two frames, for a haptic loop: a stiffness that `follow` learns from each frame. `at` may be
    called from any thread, as often as you like."""

    def __init__(self) -> None:
        self._model = ffi.new("supple_local_force *")
        self._is_made = True

    def follow(self, position: ArrayLike, force: ArrayLike) -> None:
        """After a frame: where the instrument is (m), and the force on it (N), such as `Touch.force`."""
        # Those that ask meanwhile have the former one.
        model = ffi.new("supple_local_force *", self._model[0])
        at, newton = (ffi.new("float[3]", _three(each, "m" if each is position else "N")) for each in (position, force))
        library.checked(lib.supple_local_force_follow(model, at, newton), what="the local force")
        self._model = model

    def at(self, position: ArrayLike) -> NDArray[np.float32]:
        """The force (N) at a position (m) before the next frame."""
        force = np.empty(3, np.float32)
        status = lib.supple_local_force_at(self._model, ffi.new("float[3]", _three(position)), library.pointer("float", force))
        library.checked(status, what="the local force")
        return force

    @property
    def stiffness(self) -> NDArray[np.float32]:
        """Change of the force with the position, N/m, symmetric, of shape (3, 3)."""
        return np.array([list(row) for row in self._model.stiffness], np.float32)

    @property
    def errors(self) -> tuple[float, float]:
        """By how much the force that was predicted for the latest frame was off, and holding that of the frame before, N."""
        return float(self._model.error), float(self._model.hold_error)


class Rows:
    """Instruments as the library takes them, with the memory of their fields."""

    def __init__(self, instruments: list[Instrument]) -> None:
        # Not by their values: a field is long.
        if not isinstance(instruments, (list, tuple)):
            raise InputError(f"instruments: {type(instruments).__name__} is given, a list of Instrument is needed")
        for index, each in enumerate(instruments):
            if not isinstance(each, Instrument):
                raise InputError(f"instruments: entry {index} is {each!r}, an Instrument is needed", index=index)
        self.list, self.fields = list(instruments), list[NDArray[np.uint8]]()
        self.raw = ffi.new("supple_instrument[]", max(len(instruments), 1))
        for index, (row, each) in enumerate(zip(self.raw, instruments)):
            row.shape = each.shape
            for name in ("radius", "length", "friction"):
                value = library.number(getattr(each, name), name)
                is_size = name in _SIZES.get(each.shape, ())
                if not (value > 0.0 if is_size else value >= 0.0) or value == np.inf:
                    wanted = "a positive number, m" if is_size else "zero or a positive number"
                    raise InputError(f"instruments: entry {index}: {name} {value:g}: it must be {wanted}", index=index)
                setattr(row, name, value)
            row.pose = _pose(each.position, each.rotation)[0]
            if each.distances is not None:
                memory = library.Memory(len(each.distances))
                memory.view[:] = np.frombuffer(each.distances, np.uint8)
                self.fields.append(memory.view)
                row.field, row.field_bytes = memory.pointer, len(each.distances)


class Contact:
    """The instruments of one simulation; used through `Simulation`."""

    def __init__(self, points: NDArray[np.float32], boundary: NDArray[np.uint32], scene: Any, triangles: bool, grips: int) -> None:
        self.triangles, self.grips = triangles, grips
        nodes, corners = np.unique(boundary).astype(np.uint32), boundary if triangles else boundary[:0]
        surface = ffi.new("supple_surface *")
        surface.nodes, surface.node_count = library.pointer("uint32_t", nodes), len(nodes)
        surface.triangles, surface.triangle_count = library.pointer("uint32_t", corners), len(corners)
        size = lib.supple_contact_size(len(nodes), len(corners), grips)
        self.memory = library.Memory(size)
        made, error = ffi.new("supple_contact **"), library.new_error()
        status = lib.supple_contact_init(
            self.memory.pointer, size, scene, library.pointer("float", points), surface, grips, made, error
        )
        library.checked(status, error, "instruments")
        self.raw = made[0]
        self._rows = Rows([])

    @property
    def list(self) -> list[Instrument]:
        return self._rows.list

    def put(self, rows: Rows) -> None:
        error = library.new_error()
        library.checked(lib.supple_set_instruments(self.raw, rows.raw, len(rows.list), error), error, "instruments")
        self._rows = rows

    def points(self) -> NDArray[np.void]:
        found, count = np.zeros(lib.SUPPLE_MOST_CONTACT_POINTS, POINT), ffi.new("uint32_t *")
        status = lib.supple_contact_points(self.raw, library.pointer("supple_contact_point", found), len(found), count)
        library.checked(status, what="contact points")
        return found[: count[0]]

    def move(self, index: int, position: ArrayLike, rotation: ArrayLike | None, start: float, end: float) -> None:
        error = library.new_error()
        turned = rotation if rotation is not None else self.list[index].rotation
        pose = _pose(position, turned)
        library.checked(lib.supple_move_instrument(self.raw, index, pose, start, end, error), error, f"instrument {index}")
        self.list[index] = dataclasses.replace(self.list[index], position=_three(position), rotation=_four(turned))

    def touch(self, index: int) -> Touch:
        felt = ffi.new("supple_touch *")
        library.checked(lib.supple_read_touch(self.raw, index, felt), what=f"instrument {index}")
        force, mean, moment = (np.array(list(each)) for each in (felt.force, felt.mean_force, felt.moment))
        return Touch(force, mean, moment, int(felt.contacts), float(felt.depth))


def need_triangles(instruments: Rows, points: NDArray[np.float32], boundary: NDArray[np.uint32]) -> bool:
    """Whether one of them is thinner than edges of the boundary are long."""
    needed, error = ffi.new("uint32_t *"), library.new_error()
    surface = library.pointer("float", points), len(points), library.pointer("uint32_t", boundary), len(boundary)
    status = lib.supple_needs_triangles(*surface, instruments.raw, len(instruments.list), needed, error)
    library.checked(status, error, "instruments")
    return bool(needed[0])
