"""Contraction of a box by linear programs: multipliers prove each bound, whatever the solver returns.

For rows ``|c + G e| <= r`` with e in [-1, 1] and any multipliers m,

    s e_k  =  m (G e)  +  (s 1_k - m G) e  >=  sum of min(m (-c - r), m (-c + r))  -  sum |s 1_k - m G|,

so any multipliers give a true bound, and those of the solved program give the best one. It is rounded outwards. Without
``s e_k`` a positive bound proves that no point of the box keeps all rows.

References
----------
A. Neumaier and O. Shcherbina, "Safe bounds in linear and mixed-integer linear programming", Mathematical Programming
99 (2004) 283-296.
A. M. Gleixner, T. Berthold, B. Mueller and S. Weltge, "Three enhancements for optimization-based bound tightening",
Journal of Global Optimization 67 (2017) 731-757.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import highspy
import numpy as np
from scipy import sparse

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.ball_arithmetic import EPSILON
from relaxations.algebra.compiled import compiled
from relaxations.points.linear_program import prepared
from smid.identification.inversion.frame import middle_and_half
from smid.identification.inversion.record import Group
from smid.identification.inversion.rows import Rows

NOTHING = -1
"""In place of an unknown: the multipliers prove that the box is empty."""

_ITERATIONS = 10  # of the simplex method, for each row and column: it may cycle, where coefficients are of all sizes
_AT_END = 1e-6  # of half a box: a point is at its end
_SMALLEST = 1e-12  # multipliers below this share of the largest are left out


@dataclass(frozen=True, eq=False)
class Multipliers:
    """What proves an end.

    Parameters
    ----------
    unknown
        Place of the unknown, or `NOTHING`.
    sign
        1 for a lower end, -1 for an upper one.
    sources
        Shape (n, 4). The rows, see :class:`.record.Rows`.
    values
        Shape (n,).
    """

    unknown: int
    sign: int
    sources: Index
    values: Array


@dataclass(frozen=True, eq=False)
class Contraction:
    """A smaller box, or none where the box is proven empty.

    Parameters
    ----------
    lower, upper
        Shape (unknowns,).
    inside
        A point near the middle of what the rows leave.
    proof
        In order, each on the box before the contraction; the last one of an empty box proves that.
    """

    lower: Array
    upper: Array
    inside: Array | None
    proof: tuple[Multipliers, ...]
    empty: bool = False


class Program:
    """The linear program of some rows, solved for one end after the other."""

    def __init__(self, rows: Rows) -> None:
        self._rows = rows
        starts, unknowns = rows.slopes.indptr.astype(np.int64), rows.slopes.indices.astype(np.int64)
        self._entries = starts, unknowns, rows.slopes.data
        # A row's own scale: its largest slope.
        scale = np.zeros(len(rows.centre))
        np.maximum.at(scale, np.repeat(np.arange(len(scale)), np.diff(starts)), np.abs(rows.slopes.data))
        self._scale = np.where(scale > 0, scale, 1.0)
        ends = (-rows.centre - rows.radius) / self._scale, (-rows.centre + rows.radius) / self._scale
        self._slopes, self._ends = sparse.diags_array(1 / self._scale) @ rows.slopes, ends

    @cached_property
    def _program(self) -> highspy.Highs:
        rows, count = self._slopes.shape
        program = prepared(np.zeros(count), self._slopes, self._ends, (-np.ones(count), np.ones(count)))
        program.setOptionValue("simplex_iteration_limit", _ITERATIONS * (rows + count))
        return program

    def end(self, k: int, sign: int) -> tuple[float, Multipliers, Array] | None:
        """Return a proven lower bound of ``sign e_k``, its proof, and the point where the program ends.

        None where the program has no solution.
        """
        program = self._program
        program.changeColCost(k, float(sign))
        program.run()
        solved = program.getModelStatus() == highspy.HighsModelStatus.kOptimal
        solution = program.getSolution()
        program.changeColCost(k, 0.0)
        if not solved:  # then the solver may give no multipliers
            return None
        values, point = np.array(solution.row_dual) / self._scale, np.array(solution.col_value)
        return (*self._proven(values, k, sign), point)

    def emptiness(self) -> Multipliers | None:
        """Return a proof that no point keeps all rows, by the ray of the solver that found so; None where it fails."""
        _, known, ray = self._program.getDualRay()  # type: ignore[attr-defined]  # the stubs lack it
        bound, proof = self._proven(np.array(ray) / self._scale, NOTHING, 1) if known else (0.0, None)
        return proof if bound > 0 else None

    def _proven(self, values: Array, k: int, sign: int) -> tuple[float, Multipliers]:
        rows, used = self._rows, np.flatnonzero(np.abs(values) > _SMALLEST * np.abs(values).max(initial=0.0))
        left = np.zeros(rows.slopes.shape[1])
        if k != NOTHING:
            left[k] = sign
        m = values[used]
        bound, size = _bound(used, m, rows.centre, rows.radius, *self._entries, left)
        rounding = (2 * len(m) + len(left) + 16) * EPSILON * (1 + size)
        return float(bound - np.abs(left).sum() - rounding), Multipliers(k, sign, rows.sources[used], m)


@compiled
def _bound(
    used: Index, m: Array, centre: Array, radius: Array, starts: Index, unknowns: Index, slopes: Array, left: Array
) -> tuple[float, float]:
    """Subtract the rows times their multipliers; return the least of these sums' ends, and the size of all terms."""
    total, size = 0.0, 0.0
    for n in range(len(used)):
        row = used[n]
        total += m[n] * ((-centre[row] - radius[row]) if m[n] > 0 else (-centre[row] + radius[row]))
        size += abs(m[n]) * (abs(centre[row]) + radius[row])
        for place in range(starts[row], starts[row + 1]):
            left[unknowns[place]] -= m[n] * slopes[place]
            size += abs(m[n] * slopes[place])
    return total, size


def contracted(rows: Rows, lower: Array, upper: Array, groups: Sequence[Group]) -> Contraction:
    """Return the box after each of some unknowns is bounded by the rows.

    Parameters
    ----------
    lower, upper
        The box of the rows, shape (unknowns,).
    groups
        Unknowns, each group bounded by the rows of some pieces.
    """
    if rows.impossible >= 0:
        proof = Multipliers(NOTHING, 1, rows.sources, np.ones(1))
        return Contraction(lower, upper, None, (proof,), empty=True)
    # The unknowns are middle + half * e: the numbers of the forms.
    middle, half = middle_and_half(lower, upper)
    low, high = lower.copy(), upper.copy()
    inside = None
    proofs = list[Multipliers]()
    for group in groups:
        own = rows if group.pieces is None else rows.where(np.isin(rows.sources[:, 1], group.pieces))
        if not (len(own.centre) and group.unknowns):
            continue
        program, points = Program(own), list[Array]()
        for k in group.unknowns:
            for sign in (1, -1):
                # A point at the end that keeps the rows leaves it where it is (Gleixner et al.).
                if any(sign * point[k] <= _AT_END - 1 for point in points):
                    continue
                found = program.end(k, sign)
                if found is None:
                    empty = program.emptiness()
                    return Contraction(low, high, None, (*proofs, empty) if empty else tuple(proofs), empty is not None)
                bound, proof, point = found
                reach = half[k] * bound - 8 * EPSILON * (abs(middle[k]) + half[k])
                better = middle[k] + reach > low[k] if sign > 0 else middle[k] - reach < high[k]
                if better:
                    proofs.append(proof)
                    low[k], high[k] = (middle[k] + reach, high[k]) if sign > 0 else (low[k], middle[k] - reach)
                points.append(point)
                if low[k] > high[k]:
                    return Contraction(low, high, None, tuple(proofs), empty=True)
        inside = middle + half * np.mean(points, axis=0)[: len(middle)] if group.pieces is None else inside
    return Contraction(low, high, inside, tuple(proofs))
