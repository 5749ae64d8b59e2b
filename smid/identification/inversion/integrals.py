r"""Rates integrated over windows: rows that are linear in the coefficients, for boxes of the parameters of any size.

Over an interval of length h a state x with the rate f = \sum_j q_j g_j(z), for coefficients q and states z, obeys

    x(k+1) - x(k) = \sum_j q_j \int g_j(z(s)) ds,                                                      (balance)
    \int x ds = h (x(k) + x(k+1)) / 2 - h l,      l = \int (s/h - 1/2) f ds.                           (moment)

These are exact, and linear in q, in the states at the samples, and in the moments l. Where the rate y' of a state is x
itself, the second one is y(k+1) - y(k). Both together hold for any modulating function that is a spline: its row is a
sum of theirs. (For y'' the hat functions give the second differences of the measurements.) What the linear program
shares between rows, the noise of a measurement above all, cancels.

With the mean m of z over the interval, some number m' near it, and r = z - m, of which \int r = 0,

    \int g = h g(m') + h g'(m') (m - m') + 1/2 \int g''(.) (z - m')^2,

and \int r^2 lies between the least and the largest f^2 h^3 / 12. So \int g is linear in m, which the samples of the
states decide, and what is left over is small. Where g jumps or bends sharply it is h times its range.

The product of q and of the part that is linear in m is linear about the middle of q. The rest is bounded over the whole
window, in which it telescopes where g' does not change: so over a window in which a mass sticks, noise counts only at
both ends.

References
----------
V. Maletinsky, "On-line parameter estimation of continuous processes", IFAC Proceedings 8 (1975) (spline-type modulating
functions).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from relaxations.algebra.arrays import Array, Index, Mask
from relaxations.algebra.ball_arithmetic import EPSILON, TINY
from relaxations.algebra.intervals import Intervals
from smid.identification.inversion.comparison import States
from smid.identification.inversion.frame import middle_and_half
from smid.identification.inversion.rows import Rows
from smid.identification.inversion.terms import Term, Terms

__all__ = ["CHANGE", "Integrals"]

CHANGE = -1
"""In place of the end of a window: the row is the moment of a state in the interval."""

_MOST_CUTS = 16
"""Samples of a stretch in which a slope does not change, between which the rates are integrated."""

_DOUBT = 0.02  # a coefficient known less well is not taken about its middle alone


_ROUNDED = Intervals.of(1 - 8 * EPSILON, 1 + 8 * EPSILON)
"""A factor that covers the rounding of a few others."""


@dataclass(frozen=True, eq=False)
class _Term:
    """The integral of a function over each interval: ``constant + slopes @ (variables - middle)``.

    Parameters
    ----------
    constant
        Shape (n - 1,).
    slopes
        Shape (n - 1, variables).
    shift, reach
        Shape (n - 1,). The least and the largest value of the second part is the first, less and plus the other.
    """

    coefficient: int
    constant: Intervals
    slopes: sparse.csr_array
    shift: Array
    reach: Array
    stretches: list[tuple[int, int]]


class Integrals:
    """The rows of an experiment.

    In place of a source each has a 0 for the experiment, its state, and the window of intervals, or one and `CHANGE`.
    The unknowns are the parameters, the coefficients, the states at the samples, and the moments of the states.
    """

    def __init__(self, terms: Terms, parameters: int, data: Array, h: float) -> None:
        self._terms, self._data, self._h = terms, data, h
        self._n, self._states = int(data.shape[1]), len(terms.states)
        self._begin: int = parameters + len(terms.coefficients)

    def rows(self, box: Array, coefficients: Intervals, states: States) -> tuple[Rows, Array, Array] | None:
        """Return the rows, and the ends of all unknowns; None where no run has such states."""
        h, n, terms = self._h, self._n, self._terms
        count = terms.functions.places.size
        tubes = np.stack([states.during.lower.T, states.during.upper.T], axis=2)
        now = np.arange(1, n)
        functions, jumps = terms.functions.over(box, tubes, now, self._data, count)
        rates = self._rates(coefficients, functions, states.during)
        moments = self._moments(coefficients, functions, jumps, rates)
        means = self._means(states, moments)
        if means.empty or moments.empty:
            return None
        lower = np.concatenate([box[:, 0], coefficients.lower, states.at.lower.ravel(), moments.lower.ravel()])
        upper = np.concatenate([box[:, 1], coefficients.upper, states.at.upper.ravel(), moments.upper.ravel()])
        middle = np.where(np.isfinite(means.width), 0.5 * means.lower + 0.5 * means.upper, 0.0)
        points = np.stack([middle.T, middle.T], axis=2)
        around, _ = terms.functions.over(box, points, now, self._data, count)
        rows = _Rows(lower, upper)
        unsure = coefficients.upper - coefficients.lower > 2 * _DOUBT * coefficients.magnitude
        for i, own in enumerate(terms.rates):
            if terms.rate[i] >= 0:
                places = _places(terms.rate[i], [(k, CHANGE) for k in range(n - 1)])
                rows.equal(self._change(i) - self._mean(terms.rate[i], by_rate=False) * h, places)
            if own:
                integrals = [
                    self._integrated(term, functions, jumps, around, means, middle, rates, states) for term in own
                ]
                doubtful = [term for term in integrals if len(term.slopes.data) and unsure[term.coefficient]]
                single = [(k, k + 1) for k in range(n - 1)]
                self._balances(i, integrals, single, unsure & False, coefficients, rows)
                if doubtful:
                    longer = [pair for term in doubtful for pair in term.stretches]
                    self._balances(i, integrals, sorted({*single, *longer}), unsure, coefficients, rows)
                if doubtful and longer:
                    self._balances(i, integrals, longer, unsure & False, coefficients, rows)
        return rows.done(), lower, upper

    def _at(self, i: int, k: int) -> int:
        return self._begin + i * self._n + k

    def _change(self, i: int) -> sparse.csr_array:
        """Return the differences of a state, shape (n - 1, unknowns)."""
        n = self._n
        return _bands([(self._at(i, 1), 1.0), (self._at(i, 0), -1.0)], n - 1, self._count)

    def _mean(self, i: int, by_rate: bool = True) -> sparse.csr_array:
        """Return the means of a state over the intervals."""
        k, n = self._terms.integral[i], self._n
        if k >= 0 and by_rate:
            return sparse.csr_array(self._change(k) / self._h)
        moment = self._begin + self._states * n + i * (n - 1)
        return _bands([(self._at(i, 0), 0.5), (self._at(i, 1), 0.5), (moment, -1.0)], n - 1, self._count)

    @property
    def _count(self) -> int:
        return self._begin + self._states * (2 * self._n - 1)

    def _rates(self, coefficients: Intervals, functions: Intervals, during: Intervals) -> Intervals:
        """Return the ranges of the rates in the intervals, shape (states, n - 1)."""
        found = []
        for i, own in enumerate(self._terms.rates):
            total = Intervals.of(np.zeros(self._n - 1))
            for term in own:
                total = total + functions[:, term.function] * coefficients[term.coefficient]
            found.append(total if own else during[self._terms.rate[i]])
        return _stacked(found)

    def _moments(self, coefficients: Intervals, functions: Intervals, jumps: Mask, rates: Intervals) -> Intervals:
        """Return the ranges of the moments: by the range of the rate, and by that of its derivative."""
        h, found = self._h, []
        for i, own in enumerate(self._terms.rates):
            with np.errstate(invalid="ignore"):
                range_ = Intervals.within(np.nan_to_num(rates[i].width, nan=np.inf) * h / 8.0 * (1 + 8 * EPSILON))
            if own:
                bend, smooth = Intervals.of(np.zeros(self._n - 1)), np.ones(self._n - 1, dtype=bool)
                for term in own:
                    smooth &= ~jumps[:, term.function]
                    for j, place in term.slopes:
                        bend = bend + functions[:, place] * rates[j] * coefficients[term.coefficient]
            else:
                bend, smooth = rates[self._terms.rate[i]], np.ones(self._n - 1, dtype=bool)
            both = range_.meet(bend * (h * h) / 12.0 * _ROUNDED)
            found.append(both.where(smooth, range_))
        return _stacked(found)

    def _means(self, states: States, moments: Intervals) -> Intervals:
        """Return the ranges of the means, shape (states, n - 1)."""
        at, found = states.at, []
        for i, k in enumerate(self._terms.integral):
            mean = states.during[i].meet((at[i, :-1] + at[i, 1:]) * 0.5 - moments[i])
            if k >= 0:
                mean = mean.meet((at[k, 1:] - at[k, :-1]) / self._h)
            found.append(mean)
        return _stacked(found)

    def _integrated(
        self,
        term: Term,
        functions: Intervals,
        jumps: Mask,
        around: Intervals,
        means: Intervals,
        middle: Array,
        rates: Intervals,
        states: States,
    ) -> _Term:
        h, n = self._h, self._n
        whole = functions[:, term.function] * h
        smooth = ~jumps[:, term.function]
        squares = dict[int, Intervals]()
        constant = around[:, term.function] * h
        slopes = sparse.csr_array((n - 1, self._count))
        shift, reach, numbers = np.zeros(n - 1), np.zeros(n - 1), np.zeros((n - 1, len(means.lower)))
        for i, place in term.slopes:
            smooth &= ~jumps[:, place] & np.isfinite(means[i].width)
            deviation = means[i] - middle[i]
            squares[i] = deviation.square() * h
            squares[i] = (
                Intervals(np.zeros(n - 1), squares[i].upper) + rates[i].square() * (h * h * h) / 12.0 * _ROUNDED
            )
            # The slope at the middle, as a number; what it is in doubt multiplies all of the deviation.
            slope = around[:, place]
            numbers[:, i] = number = np.nan_to_num(0.5 * slope.lower + 0.5 * slope.upper)
            doubt = (slope - number).magnitude * (states.during[i] - middle[i]).magnitude * h
            constant = constant + Intervals.within(doubt * (1 + 8 * EPSILON))
            own = sparse.csr_array(sparse.diags_array(number * h) @ self._mean(i))
            slopes = slopes + own
            shift = shift - number * h * middle[i]
            reach = reach + np.abs(number) * h * deviation.magnitude
        for i, j, place in term.bends:
            if i == j:
                constant = constant + functions[:, place] * squares[i] * 0.5
            else:
                product = np.sqrt(squares[i].upper * squares[j].upper) * (1 + 8 * EPSILON)
                constant = constant + Intervals.within(functions[:, place].magnitude * product * (1 + 4 * EPSILON))
        smooth &= np.isfinite(constant.width) & np.isfinite(reach)
        if not term.slopes:
            constant, smooth = whole, np.ones(n - 1, dtype=bool)
        # Where second order says less than the range, as over long intervals, the range is taken.
        with np.errstate(invalid="ignore"):
            smooth &= ~(constant.width > whole.width)
        kept = sparse.diags_array(smooth.astype(np.float64))
        return _Term(
            term.coefficient,
            constant.where(smooth, whole),
            sparse.csr_array(kept @ slopes),
            np.where(smooth, shift, 0.0),
            np.where(smooth, reach, 0.0),
            _stretches(numbers * smooth[:, None], self._data[:, :-1]),
        )

    def _balances(
        self,
        i: int,
        integrals: list[_Term],
        pairs: list[tuple[int, int]],
        blurred: Mask,
        coefficients: Intervals,
        rows: _Rows,
    ) -> None:
        """Add the rows of windows, with linear parts about the middles of the coefficients or, blurred, in these."""
        first, windows = self._begin - len(coefficients.lower), _windows(self._n - 1, pairs)
        middle, half = middle_and_half(coefficients.lower, coefficients.upper)
        exact, free, rest = windows @ self._change(i), np.zeros(windows.shape[0]), np.zeros(windows.shape[0])
        bounds = list[tuple[int, Intervals]]()
        for term in integrals:
            constant, j = _summed(windows, term.constant), term.coefficient
            if len(term.slopes.data):
                slopes, shift = sparse.csr_array(windows @ term.slopes), windows @ term.shift
                # Of the sum, either the sum of the ranges or the range of what is left when it telescopes.
                centre, around = rows.range(slopes, shift)
                plain = Intervals.within((windows @ term.reach) * (1 + self._n * EPSILON))
                part = (Intervals.of(centre) + Intervals.within(around)).meet(plain)
                if blurred[j]:
                    constant = constant + part
                else:
                    exact = exact - slopes * middle[j]
                    free = free + middle[j] * shift
                    rest = rest + part.magnitude * half[j] * (1 + 8 * EPSILON)
            bounds.append((first + j, constant))
        rows.within(exact, bounds, free - rest, free + rest, _places(i, pairs))


class _Rows:
    """Rows being written, in the unknowns themselves."""

    def __init__(self, lower: Array, upper: Array) -> None:
        self._middle, self._half = middle_and_half(lower, upper)
        self._known = np.isfinite(upper - lower)
        self._lower, self._upper = lower, upper
        self._size = np.maximum(np.abs(lower), np.abs(upper))
        self._parts: list[Rows] = []

    def range(self, slopes: sparse.csr_array, shift: Array) -> tuple[Array, Array]:
        """Return the centre and the reach of ``slopes @ unknowns + shift``, rounding included; infinite if unknown."""
        sizes = np.where(self._known, self._size, np.inf)
        size = _times(abs(slopes), sizes) + np.abs(shift)
        around = abs(slopes) @ self._half + self._rounding(slopes) * size
        return slopes @ self._middle + shift, np.where(np.isfinite(around), around, np.inf)

    def equal(self, slopes: sparse.csr_array, places: Index) -> None:
        """Add rows ``slopes @ unknowns = 0``."""
        zero = np.zeros(slopes.shape[0])
        self._add(slopes, zero, zero, places)

    def within(
        self, slopes: sparse.csr_array, bounds: list[tuple[int, Intervals]], least: Array, most: Array, places: Index
    ) -> None:
        """Add ``least <= slopes @ unknowns - (sum of unknowns times numbers within bounds) <= most``."""
        count = slopes.shape[0]
        # Of an unknown with one sign an end of the bounds is taken, of others the middle.
        for side, end in ((1.0, most), (-1.0, least)):
            own, free = [slopes], end.copy()
            for k, bound in bounds:
                up = bound.upper if side > 0 else bound.lower
                down = bound.lower if side > 0 else bound.upper
                if self._lower[k] >= 0:
                    factor = up
                elif self._upper[k] <= 0:
                    factor = down
                else:
                    factor = 0.5 * up + 0.5 * down
                    free = free + 0.5 * (up - down) * self._size[k] * (1 + 8 * EPSILON)
                free = np.where(np.isfinite(factor), free, side * np.inf)
                factor = np.where(np.isfinite(factor), factor, 0.0)
                own.append(_column(k, -factor, slopes.shape[1]))
            total = sparse.csr_array(sum(own[1:], start=own[0]))
            free = np.nan_to_num(free, nan=side * np.inf)
            infinite = np.full(count, np.inf)
            least_now, most_now = (-infinite, free) if side > 0 else (free, infinite)
            self._add(total, least_now, most_now, places)

    def _rounding(self, slopes: sparse.csr_array) -> Array:
        return (np.diff(slopes.indptr) + 16) * 4 * EPSILON

    def _add(self, slopes: sparse.csr_array, least: Array, most: Array, places: Index) -> None:
        """Add ``least <= slopes @ unknowns <= most``, each end rounded outwards."""
        slopes.eliminate_zeros()
        size = _times(abs(slopes), np.where(self._known, self._size, np.inf))
        kept = np.flatnonzero(np.isfinite(size) & (np.isfinite(least) | np.isfinite(most)))
        slopes, least, most, size, places = slopes[kept], least[kept], most[kept], size[kept], places[kept]
        scaled = sparse.csr_array(slopes @ sparse.diags_array(self._half))
        centre, reach = slopes @ self._middle, np.asarray(abs(scaled).sum(axis=1))
        slack = self._rounding(slopes) * (size + np.abs(centre)) + TINY
        # An end that is not known is one beyond reach.
        low = np.where(np.isfinite(least), least - 4 * EPSILON * np.abs(least) - slack, centre - reach - slack)
        high = np.where(np.isfinite(most), most + 4 * EPSILON * np.abs(most) + slack, centre + reach + slack)
        middle = 0.5 * low + 0.5 * high
        radius = (np.maximum(high - middle, middle - low)) * (1 + 8 * EPSILON) + 4 * EPSILON * np.abs(middle)
        useful = np.abs(centre - middle) + reach > radius
        self._parts.append(Rows.of(scaled[useful], (centre - middle)[useful], radius[useful], places[useful]))

    def done(self) -> Rows:
        """Return all rows."""
        return Rows.joined(self._parts)


def _places(state: int, pairs: list[tuple[int, int]]) -> Index:
    """Return the places of rows in the first experiment."""
    return np.array([(0, state, begin, end) for begin, end in pairs], dtype=np.int64).reshape(-1, 4)


def _column(k: int, values: Array, width: int) -> sparse.csr_array:
    """Return a matrix with values in one column."""
    own = np.arange(len(values))
    return sparse.csr_array((values, (own, np.full_like(own, k))), (len(values), width))


def _bands(entries: list[tuple[int, float]], count: int, width: int) -> sparse.csr_array:
    """Return a matrix whose row k has some values in columns that move with k."""
    own = np.arange(count)
    parts = [sparse.csr_array((np.full(count, value), (own, own + first)), (count, width)) for first, value in entries]
    return sparse.csr_array(sum(parts[1:], start=parts[0]))


def _times(matrix: sparse.csr_array, values: Array) -> Array:
    """Return a product in which zero times infinity is zero."""
    known = np.isfinite(values)
    unknown = matrix @ (~known).astype(np.float64) > 0
    return np.where(unknown, np.inf, matrix @ np.where(known, values, 0.0))


def _summed(windows: sparse.csr_array, values: Intervals) -> Intervals:
    """Return sums over windows."""
    finite = np.isfinite(values.lower) & np.isfinite(values.upper)
    low, high = np.where(finite, values.lower, 0.0), np.where(finite, values.upper, 0.0)
    slack = 2 * (np.diff(windows.indptr) + 4) * EPSILON * (windows @ np.maximum(np.abs(low), np.abs(high)))
    unknown = windows @ (~finite).astype(np.float64) > 0
    nothing = Intervals.within(np.full(windows.shape[0], np.inf))
    return nothing.where(unknown, Intervals(windows @ low - slack, windows @ high + slack))


def _windows(n: int, pairs: list[tuple[int, int]]) -> sparse.csr_array:
    """Return sums over some intervals, from one sample to another, shape (pairs, n)."""
    columns = np.concatenate([np.arange(begin, end) for begin, end in pairs])
    indptr = np.cumsum([0, *(end - begin for begin, end in pairs)])
    return sparse.csr_array((np.ones(len(columns)), columns, indptr), (len(pairs), n))


def _stretches(slopes: Array, held: Array) -> list[tuple[int, int]]:
    """Return windows of stretches in which the slopes (n - 1, states) do not change, nor are all zero.

    They begin and end where the inputs (channels, n - 1) change, or are evenly spaced.
    """
    same = (slopes[1:] == slopes[:-1]).all(axis=1) & slopes[1:].any(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], same.astype(np.int64), [0]])))
    found = []
    for begin, end in edges.reshape(-1, 2).tolist():
        inner = begin + 1 + np.flatnonzero((held[:, begin + 1 : end + 1] != held[:, begin:end]).any(axis=0))
        cuts = [begin, *inner.tolist(), end + 1]
        if len(cuts) > _MOST_CUTS:
            cuts = sorted(set(np.linspace(begin, end + 1, _MOST_CUTS).round().astype(int).tolist()))
        found += [(a, b) for a in cuts for b in cuts if b > a + 1]
    return found


def _stacked(rows: list[Intervals]) -> Intervals:
    return Intervals(np.array([own.lower for own in rows]), np.array([own.upper for own in rows]))
