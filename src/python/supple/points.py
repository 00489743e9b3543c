"""Points that follow the tissue: a tumour, vessels, a finer surface, targets. And the rigid motion that is nearest to theirs."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _library as library
from ._library import ffi, lib
from .errors import InputError

if TYPE_CHECKING:
    from .mesh import Mesh
    from .simulation import Simulation

# As supple_followed_point.
_POINT = np.dtype(
    [("rest", np.float32, 3), ("element", np.uint32), ("nodes", np.uint32, 4), ("weights", np.float32, 4), ("distance", np.float32)]
)


def _located(mesh: Mesh, places: ArrayLike) -> NDArray[np.void]:
    array = library.vectors(places, "points")
    found, error = np.zeros(len(array), _POINT), library.new_error()
    memory = library.Memory(lib.supple_locate_size(len(mesh.tets)))
    status = lib.supple_locate(
        library.pointer("float", mesh.points), len(mesh.points), library.pointer("uint32_t", mesh.tets), len(mesh.tets),
        library.pointer("float", array), len(array), memory.pointer, memory.size, library.pointer("supple_followed_point", found), error,
    )  # fmt: skip
    library.checked(status, error, "points")
    return found


class FollowedPoints(library.Sealed):
    """Points of the tissue; made by `Simulation.locate`. Those outside follow the nearest point of it.

    Attributes
    ----------
    rest : where they are at rest, m, (n, 3)
    distances : how far outside the tissue they are at rest, m, (n,); 0 inside
    elements : the tetrahedron that each follows, (n,); `weights` (n, 4) of its nodes
    """

    def __init__(self, simulation: Simulation, places: ArrayLike) -> None:
        # The simulation, too: its memory must stay.
        self._simulation, self._points = simulation, _located(simulation.scene._mesh_of_tissue(), places)
        # Numbers of elements are those of the whole mesh.
        self._points["element"] = np.flatnonzero(simulation.scene._removed == 0)[self._points["element"]]
        self._points.flags.writeable = False
        self.rest: NDArray[np.float32] = self._points["rest"]
        self.distances: NDArray[np.float32] = self._points["distance"]
        self.elements: NDArray[np.uint32] = self._points["element"]
        self.weights: NDArray[np.float32] = self._points["weights"]
        self._is_made = True

    def __len__(self) -> int:
        return len(self._points)

    @property
    def positions(self) -> NDArray[np.float32]:
        """Where they are now, m, (n, 3): a copy."""
        positions, _ = self._follow()
        return positions

    @property
    def velocities(self) -> NDArray[np.float32]:
        """Over the latest step, m/s, (n, 3): a copy."""
        _, velocities = self._follow()
        return velocities

    @property
    def displacements(self) -> NDArray[np.float32]:
        """From where they are at rest, m, (n, 3): a copy."""
        moved: NDArray[np.float32] = self.positions - self.rest
        return moved

    def _follow(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        positions, velocities = np.zeros((len(self), 3), np.float32), np.zeros((len(self), 3), np.float32)
        points, error, simulation = library.pointer("supple_followed_point", self._points), library.new_error(), self._simulation
        to = library.pointer("float", positions), library.pointer("float", velocities)
        with simulation._lock:
            status = lib.supple_follow(simulation._state, points, len(self), *to, error)
        library.checked(status, error, "points")
        return positions, velocities

    def __repr__(self) -> str:
        outside = int(np.count_nonzero(self.distances))
        return f"<supple.FollowedPoints: {len(self)}, {outside} of them outside>"


@dataclasses.dataclass(frozen=True)
class Rigid:
    """A rigid motion: `rotation` (3, 3), then `translation` (m). Called with points (m, (n, 3)) it gives where they go."""

    rotation: NDArray[np.float64]
    translation: NDArray[np.float64]

    def __call__(self, points: ArrayLike) -> NDArray[np.float64]:
        moved: NDArray[np.float64] = np.asarray(points, np.float64) @ self.rotation.T + self.translation
        return moved

    def matrix(self) -> NDArray[np.float64]:
        """Of shape (4, 4), in m."""
        made = np.eye(4)
        made[:3, :3], made[:3, 3] = self.rotation, self.translation
        return made


def rigid_fit(points: ArrayLike, seen: ArrayLike) -> Rigid:
    """The rigid motion that brings points (m, (n, 3)) nearest to where they are seen, by least squares. Rows with a NaN are left out: a point that
    is not seen. Three points that do not lie on a line are needed."""
    a, b = np.asarray(points, np.float64), np.asarray(seen, np.float64)
    if a.shape != b.shape or a.ndim != 2 or a.shape[1] != 3:
        raise InputError(f"rigid fit: points of shape {a.shape}, seen of shape {b.shape}; both must be (n, 3)")
    there, all_points = np.flatnonzero(np.isfinite(a + b).all(axis=1)), len(a)
    a, b = a[there], b[there]
    if len(a) < 3:
        raise InputError(f"rigid fit: {len(a)} of {all_points} points are seen, at least 3 are needed")
    from_a, from_b = a - a.mean(axis=0), b - b.mean(axis=0)
    for rows in (from_a, from_b):
        _, width, length = np.linalg.eigvalsh(rows.T @ rows)
        if width <= 1e-4 * length:
            raise InputError(f"rigid fit: the {len(a)} points that are seen lie on a line, one more off that line is needed")
    u, _, v = np.linalg.svd(from_a.T @ from_b)
    rotation = (u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v).T
    return Rigid(rotation, b.mean(axis=0) - rotation @ a.mean(axis=0))
