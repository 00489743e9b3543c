"""Tetrahedral meshes, from arrays or from files that meshio reads, and their boundaries."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _library as library
from .errors import InputError

# The corners of the face opposite to each corner, seen from outside.
_FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


class Mesh:
    """Points (m) of shape (n, 3) and the four nodes of each tetrahedron, of shape (m, 4), from zero.

    `scale` makes metres of the points: 0.001 for a mesh in millimetres.
    """

    def __init__(self, points: ArrayLike, tets: ArrayLike, scale: float = 1.0) -> None:
        if not (np.isfinite(scale) and scale > 0.0):
            raise InputError(f"scale {scale}: it must be a positive number")
        self.points: NDArray[np.float32] = library.vectors(np.asarray(points, np.float64) * scale, "points")
        array = np.asarray(tets)
        if array.ndim != 2 or array.shape[1] != 4 or not np.issubdtype(array.dtype, np.integer):
            raise InputError(f"tets: {array.dtype} of shape {array.shape}, they must be integers of shape (m, 4)")
        bad = np.flatnonzero(((array < 0) | (array >= len(self.points))).any(axis=1))
        if len(bad):
            raise InputError(f"tets: element {bad[0]} has nodes {array[bad[0]].tolist()}, there are {len(self.points)} nodes")
        self.tets: NDArray[np.uint32] = np.ascontiguousarray(array, np.uint32)

    @classmethod
    def box(cls, size: ArrayLike, cells: ArrayLike) -> Mesh:
        """A box from the origin to `size` (m), of so many cells along x, y, z, each cut into six tetrahedra around a diagonal."""
        nx, ny, nz = (int(count) for count in np.asarray(cells).reshape(3))
        if min(nx, ny, nz) < 1:
            raise InputError(f"cells {cells!r}: one along each axis at least")
        lengths = np.asarray(size, np.float64).reshape(3)
        axes = [np.linspace(0.0, length, count + 1) for length, count in zip(lengths, (nx, ny, nz))]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        low = np.stack(np.meshgrid(*(np.arange(count) for count in (nx, ny, nz)), indexing="ij"), axis=-1).reshape(-1, 3)
        strides = np.array([(ny + 1) * (nz + 1), nz + 1, 1])
        ring = np.array([[1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1], [1, 0, 1]]) @ strides
        corner = low @ strides
        pairs = [(ring[n], ring[(n + 1) % 6]) for n in range(6)]
        tets = np.stack([np.stack([corner, corner + a, corner + b, corner + strides.sum()], axis=1) for a, b in pairs], axis=1)
        return cls(points, tets.reshape(-1, 4))

    @classmethod
    def from_meshio(cls, mesh: Any, scale: float = 1.0) -> Mesh:
        """The tetrahedra of a `meshio.Mesh`, without the points that belong to none."""
        parts = [part.data for part in mesh.cells if part.type == "tetra"]
        if not parts:
            kinds = sorted({part.type for part in mesh.cells})
            raise InputError(f"the mesh has no tetrahedra of four nodes, only {', '.join(kinds) or 'points'}")
        tets = np.concatenate(parts)
        used, tets = np.unique(tets, return_inverse=True)
        return cls(np.asarray(mesh.points)[used], tets.reshape(-1, 4), scale)

    @classmethod
    def read(cls, path: str | os.PathLike[str], scale: float = 1.0) -> Mesh:
        """A mesh from a file that meshio reads (.msh, .vtk, .vtu, ...)."""
        meshio = _meshio()
        try:
            return cls.from_meshio(meshio.read(path), scale)
        # For some files meshio ends the process.
        except (SystemExit, meshio.ReadError) as problem:
            raise InputError(f"{path}: meshio cannot read it: {problem}") from None

    def write(self, path: str | os.PathLike[str], displacements: ArrayLike | None = None) -> None:
        """Writes the mesh, moved if there are displacements (m), with these as point data `displacement`."""
        meshio = _meshio()
        points, data = self.points.astype(np.float64), {}
        if displacements is not None:
            moved = np.array(displacements, np.float64)
            points, data = points + moved, {"displacement": moved}
        meshio.write(path, meshio.Mesh(points, [("tetra", self.tets.astype(np.int64))], point_data=data))

    def boundary(self) -> NDArray[np.uint32]:
        """The triangles that belong to one tetrahedron only, of shape (k, 3), seen from outside."""
        faces = self.tets[:, _FACES].reshape(-1, 3)
        _, first, counts = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
        outer: NDArray[np.uint32] = faces[np.sort(first[counts == 1])]
        return outer

    @property
    def volumes(self) -> NDArray[np.float64]:
        """Of the tetrahedra, m^3; negative where their nodes turn the other way."""
        a, b, c, d = self.points.astype(np.float64)[self.tets].transpose(1, 0, 2)
        six: NDArray[np.float64] = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a)
        return six / 6.0

    def __repr__(self) -> str:
        return f"<supple.Mesh: {len(self.points)} nodes, {len(self.tets)} tetrahedra>"


def _meshio() -> Any:
    try:
        import meshio
    except ModuleNotFoundError:
        raise ImportError("files of meshes need meshio: pip install meshio") from None
    return meshio
