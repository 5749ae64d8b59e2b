"""Projection: the noise of a curve is eliminated, and two inequalities take the place of its equality.

A *private* variable v, in a box [-d, d], occurs in one equality ``h(x, v) = 0`` only, such as the noise of the input of
a curve, ``x = sum_k c_k (u - v)^k``. As v ranges over its box, h is continuous. So

    h(x, v) = 0 for some v    if and only if    max_v h(x, v) >= 0 >= min_v h(x, v)

(intermediate value theorem). Let e be an end of the box at which h is largest. Then ``h(x, e) >= 0`` states the left
inequality without v, and it is affine where h is affine in the coefficients of the curve: neither powers of the noise
nor the coefficients complicate any more. The right inequality is the same with -h.

*Outer rows.* On a box of x, the Bernstein coefficients b_j(x) of h in v give a number

    c >= max_j (b_j(x) - h(x, e)) >= h(x, v) - h(x, e)     so that     h(x, e) + c >= h(x, v) = 0

holds at every feasible point. The slack c is zero where h is monotone in v, the usual case of a small noise on a
curve. Elsewhere it is of the order of d times the change of slope over the box: it shrinks with the box, and a second
row with v = 0 limits it. Several private variables of one equality are fixed one after the other, and their slacks are
added up.

*Inner rows.* ``h(x, e) >= 0`` and ``h(x, f) <= 0`` without slack prove, for any e and f in the box, that a v exists. So
a point that is verified with these rows belongs to a feasible point of the problem.

References
----------
J. Garloff, "Convergent bounds for the range of multivariate polynomials", Interval Mathematics 1985, LNCS 212, 37-56:
Bernstein coefficients enclose a polynomial's range.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from math import comb

import numpy as np

from relaxations.algebra.arrays import Array, Index, Mask
from relaxations.algebra.ball_arithmetic import Balls, concatenate
from relaxations.algebra.polynomial import Polynomials, pad
from relaxations.algebra.value_ranges import value_ranges
from relaxations.problem.problem import PolynomialProblem

HALVINGS = 80  # of the segment on which private variables are recovered


@dataclass(frozen=True)
class Projected:
    """A projection on one box.

    Parameters
    ----------
    problem
        In the variables that are kept; its last inequalities are the rows.
    whole
        The problem with all variables and equalities, and the rows as its last inequalities.
    equalities, signs, slacks
        Shape (n_rows,). Each row is ``sign h + slack >= 0`` with fixed private variables, h an equality.
    ends
        Shape (n_rows, n_variables). Values of the private variables.
    """

    problem: PolynomialProblem
    whole: PolynomialProblem
    equalities: Index
    signs: Index
    slacks: Array
    ends: Array

    @property
    def exact(self) -> bool:
        """Return whether every point of the projection belongs to a point of the problem: no row has a slack."""
        return not self.slacks.any()


@dataclass(frozen=True)
class Projection:
    """The private variables of a problem, and the equalities that hold them.

    Parameters
    ----------
    equalities
        Shape (n_projected,).
    private
        Shape (n_projected, most). The private variables of each of these equalities; -1 for padding.

    Examples
    --------
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> c, x, v = variables("c x v")
    >>> box = [c >= 1, c <= 2, x >= 0, x <= 4, v >= -0.1, v <= 0.1]
    >>> problem, _ = problem_of(x, [x == c * (1 - v) ** 2, *box])
    >>> found = Projection.of(problem, kept=[0])
    >>> [problem.names[k] for k in found.private.ravel()]
    ['v']
    >>> projected = found.on(problem.lower, problem.upper)  # 0.81 c <= x <= 1.21 c
    >>> projected.exact, projected.problem.names
    (True, ('c', 'x'))
    >>> projected.problem.inequalities.evaluate(np.array([1.0, 1.0])).round(2)
    array([0.19, 0.21])
    """

    problem: PolynomialProblem
    equalities: Index
    private: Index

    @staticmethod
    def of(problem: PolynomialProblem, kept: Sequence[int]) -> Projection | None:
        """Find private variables that occur in powers, or in products with variables other than those to be kept.

        None if there are none.
        """
        h = problem.equalities
        able = _in_one_row(h, problem.n_variables)
        able[problem.inequalities.occurring()] = False
        able[list(kept)] = False
        able &= np.isfinite(problem.upper) & (problem.lower == -problem.upper) & (problem.upper > 0)
        # Products of variables that are not kept: those of a row are to be covered by its private variables.
        free = np.ones(problem.n_variables + 1, dtype=bool)  # the last entry is for padding, -1
        free[[*kept, -1]] = False
        several = free[h.factors].sum(axis=1) > 1
        products: dict[int, list[list[int]]] = {}
        for row, factor in zip(h.rows[several].tolist(), h.factors[several].tolist(), strict=True):
            products.setdefault(row, []).append([v for v in factor if free[v]])
        covers = {row: _cover(own, able) for row, own in products.items()}
        found = {row: cover for row, cover in covers.items() if cover}
        if not found:
            return None
        most = max(map(len, found.values()))
        private = [[*cover, *[-1] * (most - len(cover))] for cover in found.values()]
        return Projection(problem, np.array(list(found), dtype=np.int64), np.array(private, dtype=np.int64))

    @cached_property
    def removed(self) -> Index:
        """Return the private variables, sorted."""
        return np.unique(self.private[self.private >= 0])

    @cached_property
    def kept(self) -> Index:
        """Return the other variables, sorted."""
        return np.setdiff1d(np.arange(self.problem.n_variables), self.removed)

    @cached_property
    def left(self) -> Index:
        """Return the equalities that are kept."""
        return np.setdiff1d(np.arange(self.problem.equalities.n_rows), self.equalities)

    @cached_property
    def _family(self) -> Polynomials:
        return self.problem.equalities.take(self.equalities)

    def on(self, lower: Array, upper: Array) -> Projected:
        """Return the projection with outer rows that hold on a box, shape (n_variables,)."""
        sides = [self._side(sign, self._ends(sign, lower, upper), lower, upper) for sign in (1, -1)]
        # Where an end leaves a slack, a row in the middle of the box is of use as well.
        for sign, first in zip((1, -1), tuple(sides), strict=True):
            loose = np.flatnonzero(first.slacks)
            if len(loose):
                sides.append(self._side(sign, np.zeros(len(lower)), lower, upper, loose))
        rows = Polynomials.join([side.rows for side in sides])
        whole = self.problem.with_box(lower, upper).with_inequalities(rows)
        return Projected(
            whole.without(self.removed)[0],
            whole,
            np.concatenate([side.equalities for side in sides]),
            np.concatenate([np.full(len(side.slacks), side.sign) for side in sides]),
            np.concatenate([side.slacks for side in sides]),
            np.concatenate([np.tile(side.ends, (len(side.slacks), 1)) for side in sides]),
        )

    def inner(self, lower: Array, upper: Array) -> PolynomialProblem:
        """Return the projection with inner rows, on a box: each of its points belongs to a feasible point."""
        rows = [self._fixed(sign, self._ends(sign, lower, upper)) for sign in (1, -1)]
        return self.problem.with_box(lower, upper).with_inequalities(Polynomials.join(rows)).without(self.removed)[0]

    def recover(self, point: Array, lower: Array, upper: Array) -> Array:
        """Return a point of all variables, shape (n_variables,), from one that is verified with inner rows on a box.

        The private variables are computed by bisection between the ends of these rows.
        """
        whole = np.zeros(self.problem.n_variables)
        whole[self.kept] = point
        ends = [self._ends(sign, lower, upper) for sign in (-1, 1)]
        row_of = np.zeros(len(whole), dtype=np.int64)
        for column in self.private.T:
            row_of[column[column >= 0]] = np.flatnonzero(column >= 0)
        low, high = np.zeros(len(self.equalities)), np.ones(len(self.equalities))
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            share = middle[row_of[self.removed]]
            whole[self.removed] = (1 - share) * ends[0][self.removed] + share * ends[1][self.removed]
            above = self._family.evaluate(whole) > 0
            low, high = np.where(above, low, middle), np.where(above, middle, high)
        return whole

    def explicit(self) -> list[tuple[int, int, float]]:
        """Return (equality, variable, factor) where a projected equality gives a variable that is kept explicitly."""
        found = []
        for row, terms in zip(self.equalities.tolist(), self._family.terms(), strict=True):
            for mid, rad, own in terms:
                alone = len(own) == 1 and not rad and own[0] not in self.removed
                if alone and all(own[0] not in other or other is own for _, _, other in terms):
                    found.append((row, own[0], mid))
        return found

    def _ends(self, sign: int, lower: Array, upper: Array) -> Array:
        """Return values of the private variables at which ``sign h`` is largest, as its slopes at the centre tell."""
        centre = np.where(np.isfinite(upper - lower), 0.5 * lower + 0.5 * upper, 0.0)
        centre[self.removed] = 0.0
        _, columns, values = self._family.jacobian(centre)
        slope = np.bincount(columns, sign * values, len(lower))
        ends = np.where(slope >= 0, upper, lower)
        return np.where(np.isin(np.arange(len(lower)), self.removed), ends, 0.0)

    def _fixed(self, sign: int, ends: Array) -> Polynomials:
        """Return ``sign h`` with all private variables fixed."""
        family = self._family
        for column in self.private.T:
            family = _with_fixed(family, column[column >= 0], ends)
        return _signed(family, sign)

    def _side(self, sign: int, ends: Array, lower: Array, upper: Array, some: Index | None = None) -> _Side:
        """Return the outer rows of one sign, with private variables at given values."""
        family, slack = self._family, np.zeros(len(self.equalities))
        for column in self.private.T:
            more = _excess(family, column, sign, ends, lower, upper)
            slack = np.where(more > 0, np.nextafter(slack + more, np.inf), slack)
            family = _with_fixed(family, column[column >= 0], ends)
        chosen = np.arange(len(self.equalities)) if some is None else some
        return _Side(
            sign, ends, self.equalities[chosen], slack[chosen], _plus(_signed(family, sign).take(chosen), slack[chosen])
        )


@dataclass(frozen=True)
class _Side:
    """The rows of one sign with private variables at the same values."""

    sign: int
    ends: Array
    equalities: Index
    slacks: Array
    rows: Polynomials


def _in_one_row(family: Polynomials, n_variables: int) -> Mask:
    """Tell which variables occur in exactly one polynomial."""
    real = family.factors >= 0
    pairs = np.stack([np.broadcast_to(family.rows[:, None], real.shape)[real], family.factors[real]], axis=1)
    counts = np.bincount(np.unique(pairs, axis=0)[:, 1], minlength=n_variables)
    return np.asarray(counts == 1)


def _cover(products: list[list[int]], able: Mask) -> list[int]:
    """Return private variables such that each product is affine in the others; empty where that is impossible."""
    cover: set[int] = set()
    for own in products:
        while len(left := [v for v in own if v not in cover]) > 1:
            choice = [v for v in left if able[v]]
            if not choice:
                return []
            cover.add(max(choice, key=lambda v: (sum(v in other for other in products), -v)))
    return sorted(cover)


def _with_fixed(family: Polynomials, variables: Index, ends: Array) -> Polynomials:
    """Return the polynomials with some variables at given values."""
    centre, scale = np.zeros(len(ends)), np.ones(len(ends))
    centre[variables], scale[variables] = ends[variables], 0.0
    moved = family.substitute_affine(centre, scale)
    kept = ~np.isin(moved.factors, variables).any(axis=1)  # the others have the factor zero
    return Polynomials(moved.n_rows, moved.rows[kept], moved.factors[kept], moved.coefficients[kept])


def _excess(family: Polynomials, variables: Index, sign: int, ends: Array, lower: Array, upper: Array) -> Array:
    """Return for each row a number that is at least ``sign (h(v) - h(end))`` on the box; -1 is no variable.

    With ``v = -d + 2 d t`` and ``h = sum_m a_m t^m`` of degree n the Bernstein coefficients are
    ``b_j = sum_m a_m C(j, m) / C(n, m)``.
    """
    found = np.zeros(family.n_rows)
    own = variables[family.rows]
    powers = ((family.factors == own[:, None]) & (own >= 0)[:, None]).sum(axis=1)
    degree = np.zeros(family.n_rows, dtype=np.int64)
    np.maximum.at(degree, family.rows, powers)
    for n in np.unique(degree[degree > 0]).tolist():
        rows = np.flatnonzero(degree == n)
        at = variables[rows]
        centre, scale = np.zeros(len(ends)), np.ones(len(ends))
        centre[at], scale[at] = -upper[at], 2 * upper[at]
        part = family.take(rows).substitute_affine(centre, scale)
        of_row = at[part.rows]
        power = (part.factors == of_row[:, None]).sum(axis=1)
        rest = np.sort(np.where(part.factors == of_row[:, None], -1, part.factors), axis=1)
        place = np.rint(np.sign(ends[at])).astype(np.int64)[part.rows]  # -1, 0, 1: t is 0, 1/2, 1
        for j in range(n + 1):
            weights = _weights(n, j)[place + 1, power]
            differences = Polynomials(len(rows), part.rows, rest, part.coefficients * weights)
            high = value_ranges(_signed(differences, sign).collect(), lower, upper)[1]
            found[rows] = np.maximum(found[rows], high)
    return found


def _weights(n: int, j: int) -> Balls:
    """Return the factor of a_m in ``b_j - h(end)``, shape (3, n + 1): for the ends t = 0, 1/2 and 1, and each m."""
    values = [
        [Fraction(comb(j, m), comb(n, m)) - (t**m if m else 1) for m in range(n + 1)]
        for t in (Fraction(0), Fraction(1, 2), Fraction(1))
    ]
    balls = [[Balls.enclose(value) for value in row] for row in values]
    return Balls(
        np.array([[float(b.mid) for b in row] for row in balls]), np.array([[float(b.rad) for b in row] for row in balls])
    )


def _signed(family: Polynomials, sign: int) -> Polynomials:
    return family if sign > 0 else replace(family, coefficients=-family.coefficients)


def _plus(family: Polynomials, constants: Array) -> Polynomials:
    """Return each polynomial plus a number."""
    count = family.n_rows
    width = max(family.factors.shape[1], 1)
    return Polynomials(
        count,
        np.concatenate([family.rows, np.arange(count)]),
        np.concatenate([pad(family.factors, width), np.full((count, width), -1)]),
        concatenate([family.coefficients, Balls.exact(constants)]),
    ).collect()
