"""Displacement fields on the grid of an image, and images that follow the tissue, in the conventions of ITK: millimetres, LPS axes (x to the
patient's left, y to the back, z to the head), direction cosines. Meshes stay in metres; their axes are LPS unless you say "RAS".

Files and resampling are SimpleITK's (`pip install SimpleITK`, or the extra `image`); fields need numpy alone.
"""

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
from .mesh import Mesh
from .points import _located

_KINDS = {"forward": lib.SUPPLE_FORWARD_FIELD, "inverse": lib.SUPPLE_INVERSE_FIELD}
# From the axes of the mesh to LPS, and back.
_SIGNS = {"LPS": np.array([1.0, 1.0, 1.0]), "RAS": np.array([-1.0, -1.0, 1.0])}
_TRANSFORMS = (".h5", ".hdf5", ".tfm", ".txt")
_IMAGES = (".nrrd", ".mha", ".nii.gz", ".nii", ".mhd", ".nhdr")
# A field of more points is made on a coarser grid: 24 bytes each while an image is warped.
_MOST_POINTS = 1 << 24
# A field that falls off begins to at a cell of at most an eighth of the reach, or a voxel, from the tissue. Its slope is at most 1.54
# times the displacement over the rest of the reach; from 1 on it folds.
_STEEPEST = 1.54
_CELL = 1 / 8
# How far directions may be from being orthonormal, as the kernel has it.
_ORTHONORMAL = 1e-3
# In diagonals of the body: farther nodes do not move.
_FAR = 10.0
# What an image shows of a motion that ends at a border, mm.
_VISIBLE = 0.01


@dataclasses.dataclass(frozen=True)
class Grid:
    """Where the points of an image are, as ITK has it: origin and spacing (mm, LPS), points along x, y, z, and direction cosines, of which
    column `a` is the direction of axis `a`."""

    origin: tuple[float, ...]
    spacing: tuple[float, ...]
    size: tuple[int, ...]
    direction: tuple[tuple[float, ...], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))

    @classmethod
    def of(cls, image: Any) -> Grid:
        """Of a SimpleITK image, or of a grid."""
        if isinstance(image, Grid):
            return image
        try:
            origin, spacing, size, direction = (
                np.asarray(getattr(image, f"Get{name}")(), np.float64) for name in ("Origin", "Spacing", "Size", "Direction")
            )
        except (AttributeError, TypeError, ValueError):
            raise InputError(f"an image of SimpleITK or a supple.Grid is needed, not {type(image).__name__}") from None
        if len(size) != 3:
            raise InputError(f"the image has {len(size)} dimensions, 3 are needed")
        rows = direction.reshape(3, 3).tolist()
        return cls(tuple(origin), tuple(spacing), tuple(int(count) for count in size), tuple(tuple(row) for row in rows))

    def coarser(self, factor: int) -> Grid:
        """The same box, with every `factor`-th point, and one more where these do not reach its end."""
        factor = library.whole(factor, "factor", 1 << 31)
        size = tuple(-(-(count - 1) // factor) + 1 for count in self.size)
        return dataclasses.replace(self, spacing=tuple(factor * each for each in self.spacing), size=size)

    def points(self) -> NDArray[np.float64]:
        """Where they are, mm, LPS, of shape (nz, ny, nx, 3)."""
        index = np.stack(np.meshgrid(*(np.arange(count) for count in reversed(self.size)), indexing="ij")[::-1], axis=-1)
        places: NDArray[np.float64] = (index * self.spacing) @ np.asarray(self.direction, np.float64).T + self.origin
        return places

    def _index_of(self, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where places (mm, LPS, (.., 3)) are along its axes, from its first point on, in spacings."""
        index: NDArray[np.float64] = (places - self.origin) @ np.asarray(self.direction) / self.spacing
        return index

    def _raw(self, signs: NDArray[np.float64]) -> Any:
        """As the kernel has it: metres, in the axes of the mesh."""
        made = ffi.new("supple_image_grid *")
        origin, spacing, direction = (_numbers(each) for each in (self.origin, self.spacing, self.direction))
        if origin.shape != (3,) or not np.isfinite(origin).all():
            raise InputError(f"the grid: origin {self.origin}: they must be three finite numbers, mm")
        if spacing.shape != (3,) or not ((spacing > 0.0) & (spacing < np.inf)).all():
            raise InputError(f"the grid: spacing {self.spacing}: they must be three positive numbers, mm")
        if direction.shape != (3, 3) or not (np.abs(direction.T @ direction - np.eye(3)) <= _ORTHONORMAL).all():
            raise InputError(
                f"the grid: direction {self.direction}: columns must be of length 1 and at right angles, to a thousandth: resample the image"
            )
        size = np.asarray(self.size)
        if size.shape != (3,) or not np.issubdtype(size.dtype, np.integer) or size.min() < 1 or size.max() >= 1 << 32:
            raise InputError(f"the grid: size {self.size}: whole numbers of points are needed, at least 1")
        made.origin, made.spacing = (1e-3 * signs * origin).tolist(), (1e-3 * spacing).tolist()
        made.size, made.direction = size.tolist(), (signs[:, None] * direction).tolist()
        return made


@dataclasses.dataclass(frozen=True)
class Field:
    """Displacements at the points of a grid: `values` (mm, LPS) of shape (nz, ny, nx, 3), float32; `inside`: how many points are within the
    tissue. Of kind "inverse" they tell where in the image at rest the material comes from that is at a point now: what ITK and 3D Slicer
    warp an image with. Of kind "forward", where the material that was at a point has gone."""

    kind: str
    grid: Grid
    values: NDArray[np.float32]
    inside: int
    # The tissue at rest and its axes, for what an image of it lacks.
    _tissue: tuple[Mesh, str] | None = dataclasses.field(default=None, repr=False, compare=False)

    def image(self) -> Any:
        """As a SimpleITK image of three float64 a point."""
        sitk = _simple_itk()
        made = sitk.GetImageFromArray(self.values.astype(np.float64), isVector=True)
        made.SetOrigin([float(each) for each in self.grid.origin])
        made.SetSpacing([float(each) for each in self.grid.spacing])
        made.SetDirection(np.ravel(self.grid.direction).astype(float).tolist())
        return made

    def transform(self) -> Any:
        """As a SimpleITK transform, which is the identity outside the grid."""
        return _simple_itk().DisplacementFieldTransform(self.image())

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes it for SimpleITK and 3D Slicer: as a transform (.h5, .tfm, .txt), or as an image of vectors (.nrrd, .mha, .nii.gz)."""
        sitk, name = _simple_itk(), str(path)
        if name.lower().endswith(_TRANSFORMS):
            _by_simple_itk(path, "write", lambda: sitk.WriteTransform(self.transform(), name))
        elif name.lower().endswith(_IMAGES):
            _by_simple_itk(path, "write", lambda: sitk.WriteImage(sitk.Cast(self.image(), sitk.sitkVectorFloat32), name, True))
        else:
            raise InputError(f"{path}: a transform ends in {', '.join(_TRANSFORMS)}, an image in {', '.join(_IMAGES)}")

    def warp(self, image: Any, *, labels: bool = False) -> Any:
        """The image at rest as it looks now, on its own grid, from an inverse field: interpolated linearly, of a map of labels by the nearest
        voxel. What comes from outside the image has its least value (NaN apart), of labels 0."""
        if self.kind != "inverse":
            raise InputError("an image is warped with an inverse field, this is a forward one")
        sitk = _simple_itk()
        if "complex" in image.GetPixelIDTypeAsString():
            raise InputError("the image has complex values, which have no order: warp its real and its imaginary part by themselves")
        beyond, lost = self._lost(Grid.of(image))
        if lost > _VISIBLE:
            warnings.warn(
                f"the image goes on {beyond:.3g} mm beyond the grid of the field, at whose border it moves by {lost:.3g} mm: "
                "beyond it nothing moves; make the field on the grid of the image, or with a reach that ends within its own",
                RuntimeWarning, stacklevel=2,
            )  # fmt: skip
        missing = _points_from_outside(self, image)
        if missing:
            value = "the label 0" if labels else "its least value"
            warnings.warn(
                f"{missing} of the {self.inside} points within the tissue show what was outside the image, and have {value}: the tissue moves across "
                "its border; take an image, or slices, of all that moves there",
                RuntimeWarning, stacklevel=2,
            )  # fmt: skip
        outside = 0.0 if labels else float(np.fmin.reduce(sitk.GetArrayViewFromImage(image), axis=None))
        return sitk.Resample(image, image, self.transform(), sitk.sitkNearestNeighbor if labels else sitk.sitkLinear, outside)

    def _lost(self, image: Grid) -> tuple[float, float]:
        """How far an image goes on beyond the grid, and how far the field moves there the border that is within the image, at most; mm."""
        grid, beyond, lost = self.grid, 0.0, 0.0
        lengths = tuple((count - 1) * each for count, each in zip(image.size, image.spacing))
        ends = dataclasses.replace(image, spacing=lengths, size=(2, 2, 2))
        of_ends = grid._index_of(ends.points()).reshape(-1, 3)
        for axis in range(3):
            last = grid.size[axis] - 1
            for side, over in ((0, -of_ends[:, axis].min()), (last, of_ends[:, axis].max() - last)):
                # ITK goes on for half a voxel.
                if over <= 0.5 + _ORTHONORMAL:
                    continue
                origin = np.asarray(grid.origin) + side * grid.spacing[axis] * np.asarray(grid.direction)[:, axis]
                size = tuple(1 if each == axis else grid.size[each] for each in range(3))
                index = image._index_of(dataclasses.replace(grid, origin=tuple(origin), size=size).points())
                is_seen = ((index >= -0.5) & (index <= np.asarray(image.size) - 0.5)).all(axis=-1)
                moved = np.linalg.norm(np.take(self.values, [side], axis=2 - axis)[is_seen], axis=-1).max(initial=0.0)
                if moved > lost:
                    beyond, lost = float(over * grid.spacing[axis]), float(moved)
        return beyond, lost


def displacement_field(
    mesh: Mesh, displacements: ArrayLike, image: Any, kind: str = "inverse", *, reach: float = 0.0, axes: str = "LPS"
) -> Field:
    """The field of these displacements of the nodes (m, (n, 3)) at the points of an image: see `Simulation.field`."""
    moved = library.vectors(displacements, "displacements", len(mesh.points))
    vectors = ffi.new("supple_vectors *", {"first": library.pointer("float", moved), "stride": 12, "count": len(moved)})
    return field_of(mesh, vectors, float(np.linalg.norm(moved, axis=1).max()), (image, kind, reach, axes))


def field_of(mesh: Mesh, vectors: Any, largest: float, asked: tuple[Any, str, float, str]) -> Field:
    """The same of vectors as the kernel has them, of which the largest is so long (m)."""
    image, kind, reach, axes = asked
    for value, known, what in ((kind, _KINDS, "kind"), (axes, _SIGNS, "axes")):
        if not isinstance(value, str) or value not in known:
            raise InputError(f"{what} {value!r}: there are {', '.join(known)}")
    reach, grid, signs = library.not_negative(reach, "reach", "mm"), Grid.of(image), _SIGNS[axes]
    raw = grid._raw(signs)
    rest = _STEEPEST * 1e3 * largest
    least = max(rest / (1.0 - _CELL), rest + max(grid.spacing))
    if 0.0 < reach < least:
        warnings.warn(
            f"reach {reach:g} mm: the field may fold where it falls off, since nodes move by up to {1e3 * largest:.3g} mm; "
            f"from {least:.3g} mm on it does not",
            RuntimeWarning, stacklevel=3,
        )  # fmt: skip
    error, bytes_needed = library.new_error(), ffi.new("size_t *")
    library.checked(lib.supple_displacement_field_size(raw, 1e-3 * reach, bytes_needed, error), error, "the grid")
    scratch, covered = library.Memory(bytes_needed[0]), ffi.new("size_t *")
    values = np.empty((*reversed(grid.size), 3), np.float32)
    status = lib.supple_displacement_field(
        library.pointer("float", mesh.points), len(mesh.points), library.pointer("uint32_t", mesh.tets), len(mesh.tets),
        vectors, _KINDS[kind], raw, 1e-3 * reach, scratch.pointer, scratch.size,
        library.pointer("float", values), values.size, covered, error,
    )  # fmt: skip
    library.checked(status, error, "the field")
    across = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
    is_far = largest > _FAR * across
    far = f"displacements are up to {largest:.4g} m, the tissue is {across:.3g} m across: are they in metres? (1 mm is 0.001 m)"
    if is_far and covered[0] > 0:
        warnings.warn(far, RuntimeWarning, stacklevel=3)
    if covered[0] == 0:
        if is_far:
            raise InputError(f"no point of the grid is within the tissue as it has moved: {far}")
        low, high = 1e3 * signs * mesh.points.min(axis=0), 1e3 * signs * mesh.points.max(axis=0)
        raise InputError(
            f"no point of the grid is within the tissue, which lies from {np.minimum(low, high).round(1).tolist()} to "
            f"{np.maximum(low, high).round(1).tolist()} mm (LPS): is the mesh in metres, and in {axes} axes? Or the grid too coarse?"
        )
    values *= (1e3 * signs).astype(np.float32)
    return Field(kind, grid, values, int(covered[0]), (mesh, axes))


def _points_from_outside(field: Field, image: Any) -> int:
    """How many points of an inverse field are within the tissue, and their material comes from outside the image: more than half a voxel."""
    if field._tissue is None:
        return 0
    (mesh, axes), grid, of_image, found = field._tissue, field.grid, Grid.of(image), 0
    corners = 1e3 * _SIGNS[axes] * np.stack([mesh.points.min(axis=0), mesh.points.max(axis=0)])
    low, high = corners.min(axis=0), corners.max(axis=0)
    for layer, values in enumerate(field.values):
        origin = np.asarray(grid.origin) + layer * grid.spacing[2] * np.asarray(grid.direction)[:, 2]
        places = dataclasses.replace(grid, origin=tuple(origin), size=(*grid.size[:2], 1)).points()[0] + values
        voxels = of_image._index_of(places)
        is_outside = ((voxels < -0.5) | (voxels > np.asarray(of_image.size) - 0.5)).any(axis=-1)
        is_near = ((places >= low) & (places <= high)).all(axis=-1)
        there = places[is_outside & is_near]
        if len(there):
            found += int((_located(mesh, 1e-3 * _SIGNS[axes] * there)["distance"] == 0.0).sum())
    return found


def grid_for_warping(image: Any) -> Grid:
    """The grid of an image, or one with every second, third, ... point where it has more than 2^24."""
    grid, factor = Grid.of(image), 1
    while np.prod([float(count) for count in grid.coarser(factor).size]) > _MOST_POINTS:
        factor += 1
    return grid.coarser(factor)


def read_image(path: str | os.PathLike[str]) -> Any:
    """An image from a file, by SimpleITK: .nrrd, .mha, .nii.gz and others."""
    sitk = _simple_itk()
    if not pathlib.Path(path).is_file():
        raise InputError(f"{path}: there is no such file")
    return _by_simple_itk(path, "read", lambda: sitk.ReadImage(str(path)))


def write_image(image: Any, path: str | os.PathLike[str]) -> None:
    """Writes an image to a file, compressed, by SimpleITK."""
    sitk = _simple_itk()
    _by_simple_itk(path, "write", lambda: sitk.WriteImage(image, str(path), True))


def _numbers(given: Any) -> NDArray[np.float64]:
    """As an array; of no shape where it is none of numbers."""
    try:
        return np.asarray(given, np.float64)
    except (TypeError, ValueError):
        return np.zeros(0)


def _by_simple_itk(path: str | os.PathLike[str], what: str, do: Any) -> Any:
    try:
        return do()
    except RuntimeError as problem:
        said = str(problem).strip().splitlines()
        raise InputError(f"{path}: SimpleITK cannot {what} it: {said[-1] if said else 'it does not say why'}") from None


def _simple_itk() -> Any:
    try:
        import SimpleITK
    except ModuleNotFoundError:
        raise ImportError("for images SimpleITK is needed: pip install SimpleITK") from None
    return SimpleITK
