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

from collections.abc import Iterator, Mapping, Sequence
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

WORTH = 0.9  # a range that shrinks to less than this share
PINCHED = 1e-3  # a slope below this share of the sum of its terms
HALVINGS = 80  # of the segment on which private variables are recovered


@dataclass(frozen=True)
class Row:
    """The inequality ``sign h + slack >= 0`` for an equality h in which some variables have given values."""

    equality: int
    sign: int
    slack: float
    values: tuple[tuple[int, float], ...]


@dataclass(frozen=True)
class Projected:
    """A projection on one box.

    Parameters
    ----------
    problem
        In the variables that are kept; its last inequalities are the rows.
    whole
        The problem with all variables and equalities, and the rows as its last inequalities.
    stated
        The problem without the rows.
    """

    problem: PolynomialProblem
    whole: PolynomialProblem
    stated: PolynomialProblem
    rows: tuple[Row, ...]

    @property
    def exact(self) -> bool:
        """Return whether every point of the projection belongs to a point of the problem: no row has a slack."""
        return not any(row.slack for row in self.rows)


Key = tuple[int, int, int, tuple[tuple[int, float], ...], int]
Caps = Mapping[Key, float]


@dataclass(frozen=True)
class Difference:
    """A polynomial D that is to be bounded from above on a box.

    ``key`` names it, ``objective`` is -D in the variables that are kept but for an ``error``, and ``high`` is its bound
    by interval arithmetic.
    """

    key: Key
    objective: Polynomials
    high: float
    error: float


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

    def on(self, lower: Array, upper: Array, caps: Caps | None = None) -> Projected:
        """Return the projection with outer rows that hold on a box, shape (n_variables,).

        ``caps`` are proven upper bounds of some :meth:`differences`.
        """
        rows, made = list[Polynomials](), list[Row]()

        def add(sign: int, ends: Array, some: Index) -> Index:
            """Add the rows of some equalities; return those with a slack."""
            slacks = self._slacks(sign, ends, lower, upper, caps or {})
            rows.append(_plus(self._fixed(sign, ends).take(some), slacks[some]))
            for k in some.tolist():
                values = tuple((v, float(ends[v])) for v in self.private[k].tolist() if v >= 0)
                made.append(Row(int(self.equalities[k]), sign, float(slacks[k]), values))
            return np.flatnonzero(slacks)

        centre = self._middle(lower, upper)
        for sign in (1, -1):
            loose = add(sign, self._ends(sign, centre), np.arange(len(self.equalities)))
            add(sign, np.zeros(len(lower)), loose)
        stated = self.problem.with_box(lower, upper)
        whole = stated.with_inequalities(Polynomials.join(rows))
        return Projected(whole.without(self.removed)[0], whole, stated, tuple(made))

    def differences(self, lower: Array, upper: Array, caps: Caps) -> list[Difference]:
        """Return the differences ``sign (b_j - h(e))`` that leave a slack on a box, the largest first."""
        numbers = np.full(self.problem.n_variables, -1, dtype=np.int64)
        numbers[self.kept] = np.arange(len(self.kept))
        found = []
        for sign in (1, -1):
            for member in self._bounded(sign, self._ends(sign, self._middle(lower, upper)), lower, upper, caps):
                family = member.family
                errors = value_ranges(
                    replace(family, coefficients=Balls(0 * family.coefficients.mid, family.coefficients.rad)),
                    lower,
                    upper,
                )[1]
                for k in np.flatnonzero(member.high > 0).tolist():
                    own = family.take(np.array([k]))
                    if not np.isin(own.factors[own.factors >= 0], self.removed).any():
                        objective = replace(own, coefficients=Balls.exact(-own.coefficients.mid)).renumbered(numbers)
                        found.append(Difference(member.keys[k], objective, float(member.high[k]), float(errors[k])))
        return sorted(found, key=lambda one: -one.high)

    def inner(
        self, lower: Array, upper: Array, near: Array | None = None, turned: Index | None = None
    ) -> PolynomialProblem:
        """Return the projection with inner rows, on a box: each of its points belongs to a feasible point.

        The rows suit points ``near`` one of the variables that are kept, by default the centre of the box. Those
        ``turned``, by their numbers, suit the other side, where h falls with v and not rises.
        """
        ends = [self._ends(sign, self._middle(lower, upper, near)) for sign in (1, -1)]
        if turned is not None:
            variables = self.private[turned].ravel()
            variables = variables[variables >= 0]
            for own in ends:
                own[variables] = -own[variables]
        rows = [self._fixed(sign, own) for sign, own in zip((1, -1), ends, strict=True)]
        return self.problem.with_box(lower, upper).with_inequalities(Polynomials.join(rows)).without(self.removed)[0]

    def pinched(self, near: Array) -> list[int]:
        """Return the numbers of the projected equalities in which h hardly moves with v at a point.

        Inner rows keep a point on one side of where the slope changes its sign. At the change both sides are feasible.
        """
        _, columns, values = self._family.jacobian(self._middle(self.problem.lower, self.problem.upper, near))
        slope, size = (np.bincount(columns, v, self.problem.n_variables) for v in (values, np.abs(values)))
        flat = (self.private >= 0) & (np.abs(slope) < PINCHED * size)[self.private]
        return np.flatnonzero(flat.any(axis=1)).tolist()

    def recover(self, point: Array) -> Array:
        """Return a point of all variables, shape (n_variables,), from one that is verified with inner rows.

        The private variables are computed by bisection between the ends of the rows that suit the point.
        """
        whole = self._middle(self.problem.lower, self.problem.upper, point)
        ends = [self._ends(sign, whole) for sign in (-1, 1)]
        row_of = np.zeros(len(whole), dtype=np.int64)
        for column in self.private.T:
            row_of[column[column >= 0]] = np.flatnonzero(column >= 0)
        low, high = np.zeros(len(self.equalities)), np.ones(len(self.equalities))
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            share = middle[row_of[self.removed]]
            first, other = (end[self.removed] for end in ends)
            whole[self.removed] = np.where(first == other, first, (1 - share) * first + share * other)
            above = self._family.evaluate(whole) > 0
            low, high = np.where(above, low, middle), np.where(above, middle, high)
        return whole

    def narrowed(self, lower: Array, upper: Array) -> tuple[Array, Array, list[tuple[int, int]]]:
        """Return a smaller box, and (equality, variable) for each variable that an equality narrows.

        A projected equality may give a variable that is kept, such as the output of a curve, explicitly.
        """
        lower, upper, found = lower.copy(), upper.copy(), []
        terms = self._family.terms()
        given = [(k, *own) for k, row in enumerate(terms) if (own := _given(row, self.removed)) is not None]
        if given:
            rows, variables, factors = (np.array(side) for side in zip(*given, strict=True))
            family = self._family.take(rows)
            others = ~(family.factors == variables[family.rows][:, None]).any(axis=1)
            rest = Polynomials(len(rows), family.rows[others], family.factors[others], family.coefficients[others])
            low, high = value_ranges(rest, lower, upper)
            ends = np.sort(np.stack([-low / factors, -high / factors]), axis=0)
            low, high = np.nextafter(ends[0], -np.inf), np.nextafter(ends[1], np.inf)
            for k, v in enumerate(variables.tolist()):
                width, end, start = upper[v] - lower[v], min(high[k], upper[v]), max(low[k], lower[v])
                # A smaller gain is not worth a step of the proof; an empty range is left to the relaxation.
                if start <= end and end - start < WORTH * width:
                    lower[v], upper[v] = start, end
                    found.append((int(self.equalities[rows[k]]), v))
        return lower, upper, found

    def _middle(self, lower: Array, upper: Array, near: Array | None = None) -> Array:
        """Return the centre of a box, or a point of the variables that are kept, with private variables zero."""
        known = np.isfinite(upper - lower)
        centre = 0.5 * np.where(known, lower, 0.0) + 0.5 * np.where(known, upper, 0.0)
        if near is not None:
            centre[self.kept] = near
        centre[self.removed] = 0.0
        return centre

    def _ends(self, sign: int, point: Array) -> Array:
        """Return values of the private variables at which ``sign h`` is largest, as its slopes at a point tell."""
        _, columns, values = self._family.jacobian(point)
        slope, limit = np.bincount(columns, sign * values, len(point)), self.problem.upper
        ends = np.where(slope >= 0, limit, -limit)
        return np.where(np.isin(np.arange(len(point)), self.removed), ends, 0.0)

    def _fixed(self, sign: int, ends: Array) -> Polynomials:
        """Return ``sign h`` with the private variables at given values."""
        family = self._family
        for column in self.private.T:
            family = _with_fixed(family, column[column >= 0], ends)
        return _signed(family, sign)

    def _bounded(self, sign: int, ends: Array, lower: Array, upper: Array, caps: Caps) -> Iterator[_Bounded]:
        """Yield the differences ``sign (b_j - h(e))``, each with an upper bound on a box."""
        family = self._family
        for column in self.private.T:
            for rows, j, differences in _differences(family, column, sign, ends, self.problem.upper):
                keys = [
                    (
                        int(k),
                        sign,
                        j,
                        tuple((v, float(ends[v])) for v in self.private[k].tolist() if v >= 0),
                        int(column[k]),
                    )
                    for k in rows
                ]
                high = value_ranges(differences, lower, upper)[1]
                high = np.minimum(high, [caps.get(key, np.inf) for key in keys])
                yield _Bounded(rows, column, keys, differences, high)
            family = _with_fixed(family, column[column >= 0], ends)

    def _slacks(self, sign: int, ends: Array, lower: Array, upper: Array, caps: Caps) -> Array:
        """Return the slack that each row needs on a box, with the private variables at given values."""
        needed = np.zeros((len(self.equalities), self.private.shape[1]))
        for member in self._bounded(sign, ends, lower, upper, caps):
            place = (self.private[member.rows] == member.column[member.rows][:, None]).argmax(axis=1)
            needed[member.rows, place] = np.maximum(needed[member.rows, place], member.high)
        slack = np.zeros(len(self.equalities))
        for more in needed.T:
            slack = np.where(more > 0, np.nextafter(slack + more, np.inf), slack)
        return slack


@dataclass(frozen=True)
class _Bounded:
    """Differences of some of the projected equalities, by their numbers, with upper bounds on a box."""

    rows: Index
    column: Index
    keys: list[Key]
    family: Polynomials
    high: Array


def _given(terms: list[tuple[float, float, list[int]]], removed: Index) -> tuple[int, float] | None:
    """Return a variable that an equality gives explicitly, and its factor."""
    for mid, rad, own in terms:
        if len(own) == 1 and not rad and own[0] not in removed and sum(own[0] in other for _, _, other in terms) == 1:
            return own[0], mid
    return None


def _in_one_row(family: Polynomials, n_variables: int) -> Mask:
    """Tell which variables occur in exactly one polynomial."""
    real = family.factors >= 0
    pairs = np.stack([np.broadcast_to(family.rows[:, None], real.shape)[real], family.factors[real]], axis=1)
    counts = np.bincount(np.unique(pairs, axis=0)[:, 1], minlength=n_variables)
    return np.asarray(counts == 1)


def _cover(products: list[list[int]], able: Mask) -> list[int]:
    """Return the private variables of some products; empty where a product would not be affine in the others."""
    cover = {v for own in products for v in own if able[v]}
    return sorted(cover) if all(sum(v not in cover for v in own) < 2 for own in products) else []


def _with_fixed(family: Polynomials, variables: Index, ends: Array) -> Polynomials:
    """Return the polynomials with some variables at given values."""
    centre, scale = np.zeros(len(ends)), np.ones(len(ends))
    centre[variables], scale[variables] = ends[variables], 0.0
    moved = family.substitute_affine(centre, scale)
    kept = ~np.isin(moved.factors, variables).any(axis=1)  # the others have the factor zero
    return Polynomials(moved.n_rows, moved.rows[kept], moved.factors[kept], moved.coefficients[kept])


def _differences(
    family: Polynomials, variables: Index, sign: int, ends: Array, limits: Array
) -> Iterator[tuple[Index, int, Polynomials]]:
    """Yield rows, j, and their polynomials ``sign (b_j - h(end))``; one variable v for each row, -1 for none.

    With ``v = -d + 2 d t`` and ``h = sum_m a_m t^m`` of degree n the Bernstein coefficients are
    ``b_j = sum_m a_m C(j, m) / C(n, m)``.
    """
    own = variables[family.rows]
    powers = ((family.factors == own[:, None]) & (own >= 0)[:, None]).sum(axis=1)
    degree = np.zeros(family.n_rows, dtype=np.int64)
    np.maximum.at(degree, family.rows, powers)
    for n in np.unique(degree[degree > 0]).tolist():
        rows = np.flatnonzero(degree == n)
        at = variables[rows]
        centre, scale = np.zeros(len(ends)), np.ones(len(ends))
        centre[at], scale[at] = -limits[at], 2 * limits[at]
        part = family.take(rows).substitute_affine(centre, scale)
        is_own = part.factors == at[part.rows][:, None]
        power, rest = is_own.sum(axis=1), np.sort(np.where(is_own, -1, part.factors), axis=1)
        place = np.rint(np.sign(ends[at])).astype(np.int64)[part.rows]  # -1, 0, 1: t is 0, 1/2, 1
        for j in range(n + 1):
            weights = _weights(n, j)[place + 1, power]
            yield rows, j, _signed(Polynomials(len(rows), part.rows, rest, part.coefficients * weights), sign).collect()


def _weights(n: int, j: int) -> Balls:
    """Return the factor of a_m in ``b_j - h(end)``, shape (3, n + 1): for the ends t = 0, 1/2 and 1, and each m."""
    values = [
        [Fraction(comb(j, m), comb(n, m)) - (t**m if m else 1) for m in range(n + 1)]
        for t in (Fraction(0), Fraction(1, 2), Fraction(1))
    ]
    balls = [[Balls.enclose(value) for value in row] for row in values]
    return Balls(
        np.array([[float(b.mid) for b in row] for row in balls]),
        np.array([[float(b.rad) for b in row] for row in balls]),
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
