"""Sequential linear programming on the errors of a free run: few unknowns, and as many rows as there are samples.

Each step minimises a linear cost over a box of steps, with every linearised error within a bound. The bound may be
exceeded at a price, so that there is a step from any start. A linear program holds only the rows that matter: those
that its solution breaks are added until it breaks none. The box grows or shrinks with the ratio of actual to predicted
reduction, and derivatives are kept as long as they predict well.

Reference: Fletcher and Sainz de la Maza, Nonlinear programming and nonsmooth optimization by successive linear
programming, Mathematical Programming 43 (1989) 235-256.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from relaxations.algebra.arrays import Array, Index
from smid.fitting.constraints import Constraints
from smid.fitting.problem import Fitting

_STEPS = 30
_SHORTEST = 1e-12
_ADDED = 20  # rows that a linear program is given at a time
_BROKEN = 1e-12  # a row is broken by more than this share of the largest error
_KEPT = 0.9  # derivatives are kept from this ratio of actual to predicted reduction
_TINY = 1e-12  # a step of this size changes nothing
_CARRIES = 1e-9  # multipliers from this share of the largest one


@dataclass(frozen=True, eq=False)
class Descent:
    """Where a descent ended.

    Parameters
    ----------
    vector
        Shape (n_free,).
    largest
        The largest error there, in the scale of its channel.
    rows
        The errors that hold the solution: indices into `Fitting.residual`.
    """

    vector: Array
    largest: float
    rows: Index


@dataclass(frozen=True, eq=False)
class _Region:
    """Steps between ``least`` and ``most``, with ``distance + slopes @ step >= 0``."""

    least: Array
    most: Array
    distance: Array
    slopes: Array


class Descents:
    """Descents on one fitting problem: each begins with the rows and the derivatives of the one before.

    They keep the model's constraints from a start that keeps them.
    """

    def __init__(self, problem: Fitting) -> None:
        self.problem = problem
        self._constraints = Constraints.of(problem)
        self._rows: Index = np.empty(0, dtype=np.int64)
        self._slopes: Array | None = None

    def descend(self, vector: Array, cost: Array, bound: float, price: float, worth: float) -> Descent:
        """Minimise ``cost @ vector`` with errors within a bound, and find the least excess where there is none.

        Parameters
        ----------
        vector
            Shape (n_free,). The start.
        cost
            Shape (n_free,).
        bound
            In the scale of each channel.
        price
            Of an error beyond the bound, beside the cost of a step that changes the RMS error by the largest error.
        worth
            Least predicted reduction, as a share of what was gained.
        """
        problem = self.problem
        lower, upper = problem.box
        vector = np.clip(vector, lower, upper)
        error = problem.residual(vector)
        worst, rows = float(np.abs(error).max()), self._rows[:0]
        if not np.isfinite(worst) or not len(vector):
            return Descent(vector, worst, rows)
        fresh = self._slopes is None
        slopes = _finite(problem.jacobian(vector)) if self._slopes is None else self._slopes
        dear = price * (float(np.abs(cost * _unit(slopes, worst)).max()) or 1.0)
        radius, gained = 1.0, 0.0
        for _ in range(_STEPS):
            unit = _unit(slopes, worst)
            region = self._region(vector, unit, radius)
            step, excess, rows, weight = self._program(cost * unit, error, slopes * unit, region, bound, dear)
            # Twice the multipliers is the least price at which a step that breaks the bound is surely no reduction.
            before, fair = max(worst - bound, 0.0), min(dear, 2 * weight) or dear
            promised = fair * (before - excess) - float(cost @ (unit * step))
            if promised > worth * (gained if cost.any() else worst):
                tried = np.clip(vector + unit * step, lower, upper)
                found = problem.residual(tried)
                now = float(np.abs(found).max())
                # Accept the step and adapt the radius by actual over predicted reduction.
                got = fair * (before - max(now - bound, 0.0)) - float(cost @ (tried - vector))
                share = 0.0 if self._constraints.violated(tried) else got / promised
                if share > 0.7:
                    radius *= 2.0
                elif share <= 0.1 and fresh:
                    radius = 0.3 * float(np.abs(step).max())
                if share > 0.1:
                    vector, error, worst, gained, fresh = tried, found, now, gained + got, False
            elif fresh:
                break
            else:
                share = 0.0
            if radius < _SHORTEST:
                break
            if share < _KEPT and not fresh:
                slopes, fresh = _finite(problem.jacobian(vector)), True
        self._slopes = slopes
        return Descent(vector, worst, rows)

    def _region(self, vector: Array, unit: Array, radius: float) -> _Region:
        """Return the steps that keep the boxes, the linearised constraints and the trust region, in units."""
        lower, upper = self.problem.box
        below, above = (
            np.divide(end - vector, unit, out=np.zeros_like(unit), where=unit > 0) for end in (lower, upper)
        )
        distance = np.maximum(self._constraints.value(vector), 0.0)
        tilt = self._constraints.slopes(vector) * unit
        return _Region(np.maximum(below, -radius), np.minimum(above, radius), distance, tilt)

    def _program(
        self, cost: Array, error: Array, slopes: Array, region: _Region, bound: float, price: float
    ) -> tuple[Array, float, Index, float]:
        """Return the best step in a region, the predicted excess, the rows that hold it, and their multipliers' sum."""
        count, allowed = slopes.shape[1], _BROKEN * float(np.abs(error).max())
        rows = np.union1d(self._rows, largest(np.abs(error), -np.inf, _ADDED))
        # A solver's tolerance is absolute: let it count in steps of the size that it takes.
        scale = max(float(np.abs([region.least, region.most]).max()), _TINY)
        while True:
            some, ones, none = slopes[rows], np.ones((len(rows), 1)), np.zeros((len(region.distance), 1))
            solved = linprog(
                np.append(cost, price),
                A_ub=np.block([[some, -ones], [-some, -ones], [-region.slopes, none]]),
                b_ub=np.concatenate([bound - error[rows], bound + error[rows], region.distance]) / scale,
                bounds=[*zip(region.least / scale, region.most / scale, strict=True), (0.0, None)],
                method="highs-ds",
            )
            if solved.x is None:
                return np.zeros(count), max(float(np.abs(error).max()) - bound, 0.0), rows[:0], price
            step, excess = scale * solved.x[:count], scale * float(solved.x[count])
            beyond = np.abs(error + slopes @ step) - bound - excess
            broken = np.setdiff1d(largest(beyond, allowed, _ADDED), rows)
            size = 10 * float(np.abs(step).max())
            if len(broken):
                rows = np.union1d(rows, broken)
            elif _TINY < size < 0.1 * scale:
                scale = size
            else:
                break
        self._rows = rows
        weights = np.abs(solved.ineqlin.marginals[: 2 * len(rows)]).reshape(2, -1).max(axis=0)
        return step, excess, rows[weights > _CARRIES * weights.max()], float(weights.sum())


def largest(values: Array, least: float, count: int) -> Index:
    """Return the places of the largest values above a limit, at most so many."""
    places = np.flatnonzero(values > least)
    return places if len(places) <= count else places[np.argpartition(values[places], -count)[-count:]]


def _unit(slopes: Array, largest: float) -> Array:
    """Return the step of each unknown that changes the RMS error by the largest error."""
    size = np.sqrt(np.mean(slopes**2, axis=0))
    unit: Array = np.divide(largest, size, out=np.zeros_like(size), where=size > 0)
    return unit


def _finite(slopes: Array) -> Array:
    """Replace an infinite or undefined slope, as of a root at zero, by zero."""
    return np.nan_to_num(slopes, posinf=0.0, neginf=0.0)
