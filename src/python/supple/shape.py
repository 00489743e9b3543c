"""The unloaded shape: the mesh whose shape at rest under loads is that of an image."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _library as library
from .errors import Diverged, InputError
from .mesh import Mesh

# As in the command (src/bin/supple/unloaded).
_REMEMBERED = 6
_SINGULAR = 1e-3
_LEAST_SHARE = 1.0 / 16.0

Floats = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Unloaded:
    """The `mesh` without loads; `mean_gap` and `largest_gap` (m) between its shape at rest under them and the image; `simulations` that it took."""

    mesh: Mesh
    mean_gap: float
    largest_gap: float
    simulations: int


def unloaded(image: Mesh, at_rest: Callable[[Mesh], ArrayLike], *, gap: float = 1e-4, most_simulations: int = 40) -> Unloaded:
    """The mesh whose shape at rest is `image`, an organ as it was imaged under gravity, to `gap` (m) at the worst node.

    `at_rest` gets a mesh of the same tetrahedra and gives the displacements (n, 3) of its nodes at rest, m, to a tenth of `gap`. Where it raises
    `Diverged`, or elements would be inside out, a step is taken in part; an `InputError` says so where none is left, or where the gap is still
    larger after `most_simulations`.

    The places X of the nodes are those with x(X) = image: X - (x(X) - image) is repeated, which alone diverges where bodies sag far, with
    Anderson's mixture of the latest six (Journal of the ACM 12, 1965; Walker and Ni, SIAM Journal on Numerical Analysis 49, 2011).
    """
    if not 0.0 < library.number(gap, "gap") < np.inf:
        raise InputError(f"gap {gap}: it must be a positive number of metres")
    target, volumes = image.points.astype(np.float64), image.volumes
    points, tried, best, share = target, None, np.inf, 1.0
    places, gaps, count = list[Floats](), list[Floats](), 0
    while count < most_simulations:
        mesh = Mesh(points, image.tets, regions=image.regions)
        found = None
        if (mesh.volumes * volumes > 0.0).all():
            count += 1
            found = _gap_of(mesh, at_rest, target)
        if found is None:
            share *= 0.5
            if tried is None or share < _LEAST_SHARE:
                raise InputError(
                    "every mesh without loads that was tried has elements inside out, or does not come to rest under the loads"
                    + (f" (nearest so far: {1e3 * best:.2f} mm)" if np.isfinite(best) else "")
                    + "; the tissue is too soft for these loads, or the image is not one of this body under them"
                )
            points = 0.5 * (tried + points)
            continue
        share, lengths = 1.0, np.linalg.norm(found, axis=1)
        best = min(best, float(lengths.max()))
        if lengths.max() <= gap:
            return Unloaded(mesh, float(lengths.mean()), float(lengths.max()), count)
        places, gaps = [*places[-_REMEMBERED:], points.ravel()], [*gaps[-_REMEMBERED:], found.ravel()]
        tried, points = points, _mixture(places, gaps).reshape(-1, 3)
    raise InputError(f"after {most_simulations} simulations a node is still {1e3 * best:.2f} mm from the image; stiffen the tissue, or accept a larger gap")


def _gap_of(mesh: Mesh, at_rest: Callable[[Mesh], ArrayLike], target: Floats) -> Floats | None:
    try:
        moved = np.array(at_rest(mesh), np.float64)
    except Diverged:
        return None
    if moved.shape != target.shape:
        raise InputError(f"at_rest: its displacements are of shape {moved.shape}, the mesh has {len(target)} nodes")
    gap: Floats = mesh.points + moved - target
    return gap


def _mixture(places: list[Floats], gaps: list[Floats]) -> Floats:
    """The next places: a step by the whole gap from where the linear model of the latest has the gaps least."""
    following: Floats = places[-1] - gaps[-1]
    if len(places) > 1:
        of_places, of_gaps = np.diff(places, axis=0).T, np.diff(gaps, axis=0).T
        weights = np.linalg.lstsq(of_gaps, gaps[-1], rcond=_SINGULAR)[0]
        following -= (of_places - of_gaps) @ weights
    return following
