"""Tetrahedral meshes, from arrays or from files, and their boundaries."""

from __future__ import annotations

import functools
import os
import pathlib
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _library as library
from ._library import ffi, lib
from .errors import InputError

# What the kernel reads itself, as the command does; meshio reads other formats.
_OWN = (".vtk", ".vtu", ".msh", ".node", ".ele")
_Result = TypeVar("_Result")


class Mesh(library.Sealed):
    """Points (m) of shape (n, 3), the four nodes of each tetrahedron, of shape (m, 4), from zero, and of what region each tetrahedron
    is, integers of shape (m,), or None. They are copied, and read-only: what is made of a mesh keeps it.

    `scale` makes metres of the points: 0.001 for a mesh in millimetres.
    """

    def __init__(self, points: ArrayLike, tets: ArrayLike, scale: float = 1.0, regions: ArrayLike | None = None) -> None:
        if not 0.0 < library.number(scale, "scale") < np.inf:
            raise InputError(f"scale {scale}: it must be a positive number")
        self.points: NDArray[np.float32] = library.vectors(np.asarray(points, np.float64) * scale, "points")
        array = np.asarray(tets)
        if array.ndim != 2 or array.shape[1] != 4 or not np.issubdtype(array.dtype, np.integer):
            raise InputError(f"tets: {array.dtype} of shape {array.shape}, they must be integers of shape (m, 4)")
        bad = np.flatnonzero(((array < 0) | (array >= len(self.points))).any(axis=1))
        if len(bad):
            raise InputError(f"tets: element {bad[0]} has nodes {array[bad[0]].tolist()}, there are {len(self.points)} nodes")
        self.tets: NDArray[np.uint32] = np.array(array, np.uint32, order="C")
        self.regions = None if regions is None else _regions(regions, len(self.tets))
        for kept in (self.points, self.tets, self.regions):
            if kept is not None:
                kept.flags.writeable = False
        self._is_made = True

    @classmethod
    def box(cls, size: ArrayLike, cells: ArrayLike) -> Mesh:
        """A box from the origin to `size` (m), of so many cells along x, y, z, each cut into six tetrahedra around a diagonal."""
        nx, ny, nz = library.cells_of(cells)
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
        return cls._of_used(np.asarray(mesh.points), np.concatenate(parts), None, scale)

    @classmethod
    def read(cls, path: str | os.PathLike[str], scale: float = 1.0) -> Mesh:
        """A mesh from a file, without the points that belong to no tetrahedron: .vtk, .vtu, .msh (Gmsh 1, 2.x, 4.1), .node or .ele
        (TetGen), with their regions; others by meshio, if it is installed."""
        if pathlib.Path(path).suffix.lower() in _OWN:
            return cls._of_used(*_read(path), scale=scale)
        return cls.from_meshio(_by_meshio(path, "read", lambda meshio: meshio.read(path)), scale)

    @classmethod
    def _of_used(cls, points: NDArray[Any], tets: NDArray[Any], regions: NDArray[Any] | None, scale: float) -> Mesh:
        used, tets = np.unique(tets, return_inverse=True)
        return cls(points[used], tets.reshape(-1, 4), scale, regions)

    def write(self, path: str | os.PathLike[str], displacements: ArrayLike | None = None) -> None:
        """Writes the mesh, moved if there are displacements (m), with these as point data `displacement`, and its regions
        as cell data, in any format of meshio; `.msh` is Gmsh's, 2.2. `read` finds regions again in the formats that it reads itself."""
        points, data = self.points.astype(np.float64), {}
        if displacements is not None:
            moved = np.array(displacements, np.float64)
            points, data = points + moved, {"displacement": moved}
        cells = [("tetra", self.tets.astype(np.int64))]
        kind, values = None, {} if self.regions is None else {"region": [self.regions]}
        if pathlib.Path(path).suffix.lower() == ".msh":
            # To meshio these are Ansys's unless it is told. Region 0 is none.
            tags = np.zeros(len(self.tets), np.int32) if self.regions is None else self.regions
            kind, values = "gmsh22", {"gmsh:physical": [tags], "gmsh:geometrical": [tags]}
        _by_meshio(
            path, "write", lambda meshio: meshio.write(path, meshio.Mesh(points, cells, point_data=data, cell_data=values), kind)
        )  # fmt: skip

    def boundary(self) -> NDArray[np.uint32]:
        """The triangles that belong to one tetrahedron only, of shape (k, 3), seen from outside."""
        return boundary_of(self.tets)

    @property
    def volumes(self) -> NDArray[np.float64]:
        """Of the tetrahedra, m^3; negative where their nodes turn the other way."""
        a, b, c, d = self.points.astype(np.float64)[self.tets].transpose(1, 0, 2)
        six: NDArray[np.float64] = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a)
        return six / 6.0

    @functools.cached_property
    def _overlap(self) -> str | None:
        """Elements that take the same room, as the kernel's readers tell it: with twice the mass and stiffness they would look sound."""
        nodes, elements = np.sort(self.tets, axis=1), np.arange(len(self.tets))
        is_whole = (nodes[:, :-1] < nodes[:, 1:]).all(axis=1)
        nodes, elements = nodes[is_whole], elements[is_whole]
        faces = np.concatenate([np.delete(nodes, corner, axis=1) for corner in range(4)])
        for parts, most, what in ((nodes, 1, "have the same four nodes"), (faces, 2, "share a face, which has two sides")):
            order = np.lexsort(parts.T)
            again = np.flatnonzero((parts[order[most:]] == parts[order[:-most]]).all(axis=1))
            if len(again):
                place = again[(order[again] % len(elements)).argmin()]
                first = np.sort(elements[order[place : place + most + 1] % len(elements)]).tolist()
                more = f", one of {len(again)} such places" if len(again) > 1 else ""
                return f"tets: elements {', '.join(map(str, first))} {what}{more}: list each once"
        return None

    def __repr__(self) -> str:
        return f"<supple.Mesh: {len(self.points)} nodes, {len(self.tets)} tetrahedra>"


def boundary_of(tets: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """See `Mesh.boundary`."""
    faces, count = np.empty((4 * len(tets), 3), np.uint32), ffi.new("uint32_t *")
    given, triangles = (library.pointer("uint32_t", array) for array in (tets, faces))
    library.checked(lib.supple_boundary(given, len(tets), triangles, len(faces), count), what="the boundary")
    return faces[: count[0]].copy()


def _regions(regions: ArrayLike, elements: int) -> NDArray[np.int32]:
    array = np.asarray(regions)
    if array.shape != (elements,) or not np.issubdtype(array.dtype, np.integer):
        raise InputError(f"regions: {array.dtype} of shape {array.shape}, they must be integers of shape ({elements},)")
    made = array.astype(np.int32)
    bad = np.flatnonzero(made != array)
    if len(bad):
        raise InputError(f"regions: element {bad[0]} is of {array[bad[0]]}, numbers of regions must fit in 32 bits: give smaller ones")
    return made


def _read(path: str | os.PathLike[str]) -> tuple[NDArray[np.float64], NDArray[np.uint32], NDArray[np.int32] | None]:
    """Points, tetrahedra and regions by the kernel's readers, with their words."""
    name, size, words = os.fsencode(path), ffi.new("supple_mesh_size *"), ffi.new("char[]", 4096)
    call = (words, len(words))

    def checked(status: int) -> None:
        if status < 0:
            said = str(ffi.string(words), "utf-8") or library.words(status)
            raise InputError(said, status)

    checked(lib.supple_measure_mesh(name, size, *call))
    points, tets = np.empty((size.nodes, 3)), np.empty((size.elements, 4), np.uint32)
    regions = np.empty(size.elements, np.int32) if size.has_regions else None
    arrays = library.pointer("double", points), library.pointer("uint32_t", tets)
    room = ffi.NULL if regions is None else library.pointer("int32_t", regions)
    checked(lib.supple_read_mesh(name, size, *arrays, room, *call))
    return points, tets, regions


def _by_meshio(path: str | os.PathLike[str], what: str, do: Callable[[Any], _Result]) -> _Result:
    """What meshio makes of a file. Where it fails it raises whatever comes, and may end the process."""
    try:
        import meshio
    except ModuleNotFoundError:
        raise ImportError(f"{path}: for files of its format meshio is needed: pip install meshio") from None
    try:
        return do(meshio)
    except (SystemExit, Exception) as problem:
        raise InputError(f"{path}: meshio cannot {what} it: {problem}") from None
