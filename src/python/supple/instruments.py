"""Rigid instruments that touch the tissue, and what they feel."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _library as library
from ._library import ffi, lib
from .errors import InputError
from .mesh import Mesh


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
    """What an instrument felt: force of the tissue in the latest step and on average over the latest call (N), moment about its
    position (N m), nodes and triangles that it pushes, how deep these would have been inside it (m)."""

    force: NDArray[np.float64]
    mean_force: NDArray[np.float64]
    moment: NDArray[np.float64]
    contacts: int
    depth: float


def _three(position: ArrayLike) -> tuple[float, float, float]:
    array = np.asarray(position, np.float64)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise InputError(f"position {position!r}: three finite numbers are needed, m")
    return float(array[0]), float(array[1]), float(array[2])


def _four(rotation: ArrayLike) -> tuple[float, float, float, float]:
    array = np.asarray(rotation, np.float64)
    if array.shape != (4,) or not np.isfinite(array).all() or not array.any():
        raise InputError(f"rotation {rotation!r}: a quaternion x, y, z, w is needed, not all of it zero")
    return float(array[0]), float(array[1]), float(array[2]), float(array[3])


def _pose(position: ArrayLike, rotation: ArrayLike) -> Any:
    return ffi.new("supple_pose *", {"position": _three(position), "rotation": _four(rotation)})


class Contact:
    """The instruments of one simulation; used through `Simulation`."""

    def __init__(self, mesh: Mesh, scene: Any, triangles: bool, grips: int) -> None:
        points, boundary = mesh.points, mesh.boundary()
        nodes = np.unique(boundary).astype(np.uint32)
        corners = np.ascontiguousarray(boundary if triangles else boundary[:0])
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
        self.raw, self.list = made[0], list[Instrument]()

    def put(self, instruments: list[Instrument]) -> None:
        rows = ffi.new("supple_instrument[]", max(len(instruments), 1))
        fields: list[NDArray[np.uint8]] = []
        for row, each in zip(rows, instruments):
            row.shape, row.radius, row.length, row.friction = each.shape, each.radius, each.length, each.friction
            row.pose = _pose(each.position, each.rotation)[0]
            if each.distances is not None:
                memory = library.Memory(len(each.distances))
                memory.view[:] = np.frombuffer(each.distances, np.uint8)
                fields.append(memory.view)
                row.field, row.field_bytes = memory.pointer, len(each.distances)
        error = library.new_error()
        library.checked(lib.supple_set_instruments(self.raw, rows, len(instruments), error), error, "instruments")
        self.list, self._fields = list(instruments), fields

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
