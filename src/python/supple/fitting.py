"""Values of a simulation from measured displacements: least squares on SciPy with few simulations, and what the data can tell."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _library as library
from .errors import Error, InputError

Floats = NDArray[np.float64]
Simulate = Callable[[dict[str, float]], ArrayLike]

# As in the command (src/bin/supple/fit): the step of finite differences and what they must exceed, the end of the search, what cannot be told.
_DIFFERENCE = 0.05
_LARGE_DIFFERENCE = 0.5
_NOISE = 2e-4
_NEAR = 0.2
_NEAR_SHARE = 1e-3
_MOST_SEARCHES = 4
_REFUSED = 10.0
_SINGULAR = 1e-6
_MOST_OF_VALUE = 0.5
_MOST_OF_RANGE = 0.1
_SMALL_OF_RANGE = 0.01
_MOST_CORRELATION = 0.98
_LOOSE = 0.1
_SAME = 0.9999
_MOST_MISSED = 1.0 / 3.0
# Names that end so are of what displacements are inverse to.
_INVERSE = ("young", "stiffness")


@dataclasses.dataclass(frozen=True)
class Fit:
    """What a fit came to; printed it is a table, in mm.

    `values` and `standard_errors` by name, in the units of `start`; an error is as if there were no bounds, infinite where there are no more
    numbers than values. `correlations`: of shape (p, p), in the order of the names. `cannot_tell`: sentences about what the data do not show, empty
    if there is nothing. `residuals`: simulated less measured, m, of the shape of `measured`, NaN where it is. `rms`, `worst` (m) of the distances of the
    points that were fitted, and the index `worst_point`; `left_out_rms`, `left_out_worst` of those that were not, None without any.
    `each_left_out`: for each point what a fit without it would miss it by (m; rms over its times), by the linear model; NaN where the fit
    needs the point. `simulations` counts them; `converged`: whether the search came to its end.
    """

    values: dict[str, float]
    standard_errors: dict[str, float]
    correlations: Floats
    cannot_tell: list[str]
    residuals: Floats
    rms: float
    worst: float
    worst_point: int
    left_out_rms: float | None
    left_out_worst: float | None
    each_left_out: Floats
    simulations: int
    converged: bool

    def __str__(self) -> str:
        lines = [f"{name:<21} {_short(value)}, standard error {_short(self.standard_errors[name])}" for name, value in self.values.items()]
        lines.append(f"{'residuals':<21} {1e3 * self.rms:.2f} mm rms, worst {1e3 * self.worst:.2f} mm at point {self.worst_point}")
        known = self.each_left_out[np.isfinite(self.each_left_out)]
        if len(known) > 1:
            lines.append(f"{'each point left out':<21} {1e3 * np.sqrt(np.mean(known**2)):.2f} mm rms, worst {1e3 * known.max():.2f} mm")
        if self.left_out_rms is not None and self.left_out_worst is not None:
            lines.append(f"{'left out':<21} {1e3 * self.left_out_rms:.2f} mm rms, worst {1e3 * self.left_out_worst:.2f} mm")
        lines.append(f"{'simulations':<21} {self.simulations}")
        return "\n".join([*lines, *self.cannot_tell])


def _short(value: float) -> str:
    """Four digits, without an exponent."""
    return str(np.format_float_positional(value, precision=4, fractional=False, trim="-"))


def fit(
    simulate: Simulate,
    start: Mapping[str, float],
    measured: ArrayLike,
    *,
    bounds: Mapping[str, tuple[float, float]],
    left_out: ArrayLike | None = None,
) -> Fit:
    """Values with which simulated displacements are nearest to measured ones.

    Parameters
    ----------
    simulate : gets the values by name and gives displacements (m) of the points, of the shape of `measured`. Where it raises a `supple.Error`, as
        `Diverged`, the values are refused, but for the first ones. Bodies at rest: to a ten-thousandth of the way
    start : the first values, by name. Names that end in "young" or "stiffness" are searched as their inverse, in which displacements are
        nearly linear
    measured : displacements (m), of shape (points, 3), or (times, points, 3) over time; NaN where nothing was measured
    bounds : for each name the least and the most
    left_out : points that are not fitted but predicted, as numbers or as a mask

    Needs SciPy (`pip install supple[fit]`). The trust region is that of `scipy.optimize.least_squares`; derivatives are finite differences at the
    start and at the end, and follow the steps in between (Broyden 1965), as simulations are what takes time.
    """
    problem = _Problem(simulate, start, measured, bounds, left_out)
    here = problem.at(problem.start)
    problem.refused = _REFUSED * (np.abs(here.residuals) + np.linalg.norm(problem.numbers) / np.sqrt(len(problem.numbers)))
    jacobian, converged = problem.differences(here), False
    for _ in range(_MOST_SEARCHES):
        moved = _search(problem, here, jacobian)
        if not np.array_equal(moved.x, here.x):
            here, jacobian = moved, problem.differences(moved)
        converged = problem.is_near(here, jacobian)
        if converged:
            break
    return _told(problem, here, jacobian, converged)


@dataclasses.dataclass
class _Point:
    x: Floats
    residuals: Floats


class _Problem:
    """The values as coordinates, which are 1 at the start, and the residuals of the numbers that are fitted."""

    def __init__(
        self,
        simulate: Simulate,
        start: Mapping[str, float],
        measured: ArrayLike,
        bounds: Mapping[str, tuple[float, float]],
        left_out: ArrayLike | None,
    ) -> None:
        if not isinstance(start, Mapping):
            raise InputError(f"start {start!r}: it must give a first value to each name: {{'young': 8e3}}")
        if not isinstance(bounds, Mapping):
            raise InputError(f"bounds {bounds!r}: they must give the least and the most to each name: {{'young': (1e3, 1e5)}}")
        self.simulate, self.names, self.done = simulate, list(start), dict[bytes, Floats]()
        try:
            self.measured = np.array(measured, np.float64)
        except (TypeError, ValueError):
            raise InputError(f"measured {measured!r:.40}: it must be displacements, m, (points, 3) or (times, points, 3)") from None
        if self.measured.ndim not in (2, 3) or self.measured.shape[-1] != 3:
            raise InputError(f"measured: its shape is {self.measured.shape}, it must be (points, 3) or (times, points, 3)")
        if not self.names:
            raise InputError("start: it is empty; name at least one value")
        bad = np.argwhere(np.isinf(self.measured).any(axis=-1))
        if len(bad):
            wrong = self.measured[tuple(bad[0])].tolist()
            raise InputError(f"measured: the displacement of point {bad[0][-1]} is {wrong}: where nothing was measured give NaN")
        others = [name for name in bounds if name not in start]
        if others:
            raise InputError(f"bounds: {others[0]} is none of the names of start, {', '.join(self.names)}: leave it out, or mend its name")
        first = np.array([library.number(start[name], f"start of {name}") for name in self.names])
        self.limits = np.array([self._limits(name, value, bounds) for name, value in zip(self.names, first.tolist())])
        self.is_inverse = np.array([name.endswith(_INVERSE) for name in self.names]) & (self.limits[:, 0] > 0.0)
        # Each coordinate is 1 at the start.
        self.unit = np.where(first == 0.0, np.ptp(self.limits, axis=1), np.abs(first))
        self.first, self.start = first, np.ones(len(first))
        self.ends = np.sort(np.stack([self.coordinates(end) for end in self.limits.T]), axis=0)
        points = self.measured.shape[-2]
        self.is_out = np.zeros(points, bool)
        if left_out is not None:
            chosen = np.asarray(left_out)
            if chosen.dtype == bool and chosen.shape != (points,):
                raise InputError(f"left_out: a mask of shape {chosen.shape}, there are {points} points")
            if chosen.dtype != bool and chosen.size and not (0 <= chosen.min() and chosen.max() < points):
                raise InputError(f"left_out: {chosen.tolist()}, there are points 0 to {points - 1}")
            self.is_out[chosen if chosen.dtype == bool else chosen.astype(np.int64)] = True
        self.is_fitted = np.isfinite(self.measured) & ~self.is_out[:, None]
        self.numbers = self.measured[self.is_fitted]
        if len(self.numbers) < len(self.names):
            raise InputError(f"{len(self.names)} values, but only {len(self.numbers)} measured numbers; measure more, or fix some")
        self.refused = np.zeros(0)

    @staticmethod
    def _limits(name: str, first: float, bounds: Mapping[str, tuple[float, float]]) -> tuple[float, float]:
        if name not in bounds:
            raise InputError(f"bounds: {name} has none; give the least and the most")
        try:
            least, most = (library.number(each, "bound") for each in bounds[name])
        except (TypeError, ValueError):
            raise InputError(f"bounds of {name}: {bounds[name]!r}, they must be two numbers, the least and the most") from None
        if name.endswith(_INVERSE) and least < 0.0:
            raise InputError(f"bounds of {name}: {least} and {most}, the first must be zero or more")
        if not (np.isfinite(least) and np.isfinite(most) and least < most):
            raise InputError(f"bounds of {name}: {least} and {most}, the first must be below the second")
        if not least <= first <= most:
            raise InputError(f"start of {name}: {first}, it must be from {least} to {most}")
        return least, most

    def coordinates(self, values: Floats) -> Floats:
        # No inverse is taken of what may be zero.
        inverse = np.divide(self.first, values, out=np.ones_like(values), where=self.is_inverse)
        coordinates: Floats = np.where(self.is_inverse, inverse, 1.0 + (values - self.first) / self.unit)
        return coordinates

    def values(self, x: Floats) -> Floats:
        inside = np.clip(x, *self.ends)
        inverse = np.divide(self.first, inside, out=np.ones_like(inside), where=self.is_inverse)
        values: Floats = np.where(self.is_inverse, inverse, self.first + (inside - 1.0) * self.unit)
        # To the bit at a bound.
        limited: Floats = np.clip(values, *self.limits.T)
        return limited

    def slopes(self, values: Floats) -> Floats:
        """Of the coordinates over the values."""
        slopes: Floats = np.where(self.is_inverse, -self.first / values**2, 1.0 / self.unit)
        return slopes

    def displacements(self, x: Floats) -> Floats:
        values = self.values(x)
        key = values.tobytes()
        if key not in self.done:
            found = np.array(self.simulate(dict(zip(self.names, values.tolist()))), np.float64)
            if found.shape != self.measured.shape:
                raise InputError(f"simulate: its displacements are of shape {found.shape}, those measured of {self.measured.shape}")
            bad = np.flatnonzero((self.is_fitted & ~np.isfinite(found)).any(axis=1))
            if len(bad):
                tried = ", ".join(f"{name} = {value:g}" for name, value in zip(self.names, values))
                raise InputError(f"simulate: the displacement of point {bad[0]} is {found[bad[0]].tolist()} with {tried}; where it cannot tell, raise supple.Error")
            self.done[key] = found
        return self.done[key]

    def at(self, x: Floats) -> _Point:
        return _Point(np.clip(x, *self.ends), (self.displacements(x) - self.measured)[self.is_fitted])

    def tried(self, x: Floats) -> Floats:
        try:
            return self.at(x).residuals
        except InputError:
            raise
        except Error:
            return self.refused

    def differences(self, here: _Point) -> Floats:
        """Derivatives by finite differences, away from the nearer bound; differences that simulations have by themselves say nothing."""
        columns = []
        for index, x in enumerate(here.x):
            least, most = self.ends[:, index]
            up = most - x >= x - least
            room = most - x if up else x - least
            column = self._difference(here, index, min(_DIFFERENCE * float(np.clip(abs(x), _DIFFERENCE, 1.0)), room), up)
            if not column.any():
                # As of a tissue that hardly changes its volume.
                try:
                    column = self._difference(here, index, min(_LARGE_DIFFERENCE, room), up)
                except InputError:
                    raise
                except Error:
                    pass
            columns.append(column)
        return np.stack(columns, axis=1)

    def _difference(self, here: _Point, index: int, step: float, up: bool) -> Floats:
        step = step if up else -step
        there = here.x.copy()
        there[index] += step
        difference = self.at(there).residuals - here.residuals
        is_noise = np.linalg.norm(difference) <= _NOISE * np.linalg.norm(self.numbers)
        return 0.0 * difference if is_noise else difference / step

    def held(self, here: _Point, jacobian: Floats) -> NDArray[np.bool_]:
        """Which coordinates are at a bound towards which the residuals fall."""
        downhill, (low, high) = -jacobian.T @ here.residuals, self.at_ends(here)
        held: NDArray[np.bool_] = (low & (downhill < 0.0)) | (high & (downhill > 0.0))
        return held

    def at_ends(self, here: _Point) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        near = 1e-6 * np.ptp(self.ends, axis=0)
        return here.x <= self.ends[0] + near, here.x >= self.ends[1] - near

    def is_near(self, here: _Point, jacobian: Floats) -> bool:
        """Whether the best values of the linear model are as near as asked."""
        free = ~self.held(here, jacobian)
        inverse = _inverse_of_normal(jacobian[:, free])
        step = -inverse @ jacobian[:, free].T @ here.residuals
        variance = here.residuals @ here.residuals / max(len(here.residuals) - int(free.sum()), 1)
        near = np.maximum(1.5 * _NEAR * np.sqrt(variance * np.diag(inverse)), _NEAR_SHARE * np.abs(here.x[free]))
        step = np.clip(here.x[free] + step, *self.ends[:, free]) - here.x[free]
        return bool((np.abs(step) <= near).all())


class _Near(Exception):
    """The search is near enough."""


def _search(problem: _Problem, here: _Point, jacobian: Floats) -> _Point:
    """Steps from a point with its derivatives until they end."""
    try:
        from scipy.optimize import least_squares
    except ModuleNotFoundError:
        raise ImportError("supple.fit needs SciPy: pip install supple[fit]") from None
    free = ~problem.held(here, jacobian)
    if not free.any():
        return here
    taken = _Point(here.x.copy(), here.residuals)
    derivatives = jacobian[:, free].copy()

    def whole(x: Floats) -> Floats:
        coordinates = here.x.copy()
        coordinates[free] = x
        return coordinates

    def follow(x: Floats) -> Floats:
        """Derivatives at a step that was taken."""
        nonlocal taken, derivatives
        now = problem.at(whole(x))
        step = (now.x - taken.x)[free]
        if step.any():
            derivatives = derivatives + np.outer(now.residuals - taken.residuals - derivatives @ step, step) / (step @ step)
            taken = now
        lengths = np.linalg.norm(derivatives, axis=0)
        cosines = np.abs(derivatives.T @ now.residuals) / np.maximum(lengths * np.linalg.norm(now.residuals), np.finfo(float).tiny)
        if step.any() and cosines.max() <= _NEAR / np.sqrt(len(now.residuals)):
            raise _Near
        return derivatives

    def tried(x: Floats) -> Floats:
        return problem.tried(whole(x))

    try:
        least_squares(
            tried, here.x[free], jac=follow, bounds=tuple(problem.ends[:, free]), x_scale="jac",
            xtol=_NEAR_SHARE, ftol=1e-6, gtol=None, max_nfev=12 * int(free.sum()),
        )  # fmt: skip
    except _Near:
        pass
    return taken


def _inverse_of_normal(columns: Floats) -> Floats:
    """(J'J)^-1, large and finite in directions that the data do not show."""
    lengths = np.linalg.norm(columns, axis=0)
    largest = lengths.max(initial=0.0)
    lengths = np.maximum(lengths, _SINGULAR * largest) if largest > 0.0 else np.ones_like(lengths)
    values, vectors = np.linalg.eigh((columns / lengths).T @ (columns / lengths))
    inverse: Floats = (vectors / np.maximum(values, _SINGULAR**2)) @ vectors.T / np.outer(lengths, lengths)
    return inverse


def _told(problem: _Problem, here: _Point, jacobian: Floats, converged: bool) -> Fit:
    values, held = problem.values(here.x), problem.held(here, jacobian)
    # One that has gone there stays there where nothing tells whether it wants to go further.
    held |= np.logical_or(*problem.at_ends(here)) & ~jacobian.any(axis=0) & (here.x != 1.0)
    jacobian = jacobian * problem.slopes(values)
    inverse, count = _inverse_of_normal(jacobian), len(values)
    freedom = len(here.residuals) - count
    variance = here.residuals @ here.residuals / freedom if freedom > 0 else np.inf
    with np.errstate(invalid="ignore"):
        errors = np.where(jacobian.any(axis=0), np.sqrt(variance * np.diag(inverse)), np.inf)
    correlations = inverse / np.sqrt(np.outer(np.diag(inverse), np.diag(inverse)))
    residuals = problem.displacements(here.x) - problem.measured
    distances = np.sqrt(np.nansum(residuals**2, axis=-1))
    is_seen = np.isfinite(problem.measured).any(axis=-1)
    fitted, out = is_seen & ~problem.is_out, is_seen & problem.is_out
    of_points = np.where(fitted, distances, -1.0).reshape(-1, len(problem.is_out)).max(axis=0)
    untold = _cannot_tell(problem, values, errors, correlations, jacobian, held)
    missed, moved = _rms(distances[fitted]), _rms(np.sqrt(np.nansum(problem.measured**2, axis=-1))[fitted])
    if missed > _MOST_MISSED * moved:
        untold.append(
            f"the points are {1e3 * missed:.2f} mm rms from where they were measured, and have moved by {1e3 * moved:.2f} mm; is what was measured in "
            "metres, displacements and not places, and are the loads in the simulation those that acted?"
        )
    if not converged:
        untold.append("the search ended before the best values; start it from these")
    return Fit(
        values=dict(zip(problem.names, values.tolist())),
        standard_errors=dict(zip(problem.names, errors.tolist())),
        correlations=correlations,
        cannot_tell=untold,
        residuals=residuals,
        rms=missed,
        worst=float(distances[fitted].max()),
        worst_point=int(of_points.argmax()),
        left_out_rms=_rms(distances[out]) if out.any() else None,
        left_out_worst=float(distances[out].max()) if out.any() else None,
        each_left_out=_each_left_out(problem, here.residuals, jacobian, inverse),
        simulations=len(problem.done),
        converged=converged,
    )


def _rms(distances: Floats) -> float:
    return float(np.sqrt(np.mean(distances**2)))


def _cannot_tell(
    problem: _Problem, values: Floats, errors: Floats, correlations: Floats, jacobian: Floats, held: NDArray[np.bool_]
) -> list[str]:
    said, loose = [], []
    for index, name in enumerate(problem.names):
        (least, most), value, error = problem.limits[index], values[index], errors[index]
        # Of a value near zero there is no share.
        is_near_zero = least * most < 0.0 or (least * most == 0.0 and error <= _SMALL_OF_RANGE * (most - least))
        share = 0.0 if is_near_zero else error / (_MOST_OF_VALUE * abs(value)) if value != 0.0 else np.inf
        loose.append(max(error / (_MOST_OF_RANGE * (most - least)), share))
        is_told, is_still = loose[-1] <= 1.0, not jacobian[:, index].any()
        if held[index] and (is_still or is_told):
            what = "there it moves no measured point" if is_still else "the data want it further"
            others = ", and the other values and their errors hold only if it is the truth" if len(values) > 1 else ""
            said.append(f"{name} stays at its limit, {value:g}: {what}{others}; give a wider limit, or look for another cause of what they show")
        elif is_still:
            said.append(f"{name} moves no measured point; measure elsewhere, or leave it out")
        elif not is_told:
            limit = ", at its limit," if held[index] else ""
            said.append(
                f"the data cannot tell {name}: its standard error is {error:.4g}, its value {value:.4g}{limit} of a range from {least:g} to "
                f"{most:g}; give it a fixed value from another source"
            )
    for a in range(len(values)):
        for b in range(a):
            size = abs(correlations[a, b])
            if size > _SAME or (size > _MOST_CORRELATION and max(loose[a], loose[b]) > _LOOSE):
                names = f"{problem.names[b]} from {problem.names[a]}"
                said.append(f"the data cannot tell {names}: their correlation is {correlations[a, b]:.4f}; fix one of them")
    return said


def _each_left_out(problem: _Problem, residuals: Floats, jacobian: Floats, inverse: Floats) -> Floats:
    """What the fit would miss each point by without it: (1 - H)^-1 r in its rows, with H = J (J'J)^-1 J'."""
    points = np.broadcast_to(np.arange(len(problem.is_out))[:, None], problem.measured.shape)[problem.is_fitted]
    missed = np.full(len(problem.is_out), np.nan)
    times = problem.measured.size // (3 * len(problem.is_out))
    for point in np.unique(points):
        rows = points == point
        known = np.eye(int(rows.sum())) - jacobian[rows] @ inverse @ jacobian[rows].T
        if np.linalg.eigvalsh(known).min() > 1e-6:
            missed[point] = np.linalg.norm(np.linalg.solve(known, residuals[rows])) / np.sqrt(times)
    return missed
