"""Bounds of functions over a certified polytope: Taylor models, linear programs, and branch and bound.

On a box of coordinates along the axes of the polytope, a Taylor model gives value, slopes and curvature of a function.
Its least value over the box and the half-spaces follows from a linear program in the slopes, whose multipliers prove it
(:func:`relaxations.search.benders.master.lower_bound`), and from the largest effect of the curvature on the box. This
effect falls with the square of the box: where it leaves a gap, the box is cut in two.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property

import numpy as np
import sympy

from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import EPSILON, TINY, Balls
from relaxations.search.benders.master import contradiction, lower_bound, shrink
from relaxations.search.benders.split import frame
from relaxations.search.best_first import best_first
from smid.responses.functions import Functions
from smid.responses.outer_set import OuterSet
from smid.responses.taylor import Taylor

Box = tuple[Array, Array]
CLOSE, MOST_PIVOTS = 1e-10, 100  # of the dual simplex method


@dataclass
class Bounder:
    """Bounds functions of an outer set's parameters over this set.

    Its coordinates are ``s = axes @ (p - middle)``.
    """

    outer: OuterSet
    functions: Functions
    _known: dict[bytes, Taylor] = field(init=False, default_factory=dict)
    _half_spaces: dict[bytes, tuple[Array, Array]] = field(init=False, default_factory=dict)
    _parts: dict[bytes, tuple[Box | None, Box | None]] = field(init=False, default_factory=dict)

    @cached_property
    def middle(self) -> Array:
        """Return the origin of the coordinates, shape (n,)."""
        return 0.5 * self.outer.lower + 0.5 * self.outer.upper

    @cached_property
    def root(self) -> Box:
        """Return a box that holds the set."""
        o = self.outer
        radius = np.maximum(o.upper - self.middle, self.middle - o.lower)
        reach = np.abs(o.axes) @ radius * (1 + 4 * (len(radius) + 2) * EPSILON)
        return self.tightened((-reach, reach)) or (-reach, reach)

    def values(self, point: Array) -> Array:
        """Return the functions at a point."""
        return self._at(Balls.exact(point), Balls.exact(np.zeros((len(point), 0)))).value

    def bound(self, box: Box, which: int, sign: int, enough: float = np.inf) -> float:
        """Return a certified lower bound of ``sign`` times one function over a box; infinite where the box is empty.

        Without the half-spaces, if that gives as much as is enough.
        """
        model = self.model(box)[which]
        if not np.isfinite(model.size):
            return -np.inf
        cost, curvature = sign * model.slopes, sign * model.curvature
        own = np.diagonal(curvature)
        bent = np.abs(curvature).sum() - np.maximum(own, 0.0).sum()  # a square is at least zero
        size = float(np.abs(cost).sum())
        rounding = 8 * (len(cost) ** 2 + 8) * EPSILON * (model.size + size)
        rest = float(sign * model.value - bent - model.error - rounding)
        if size == 0 or rest - size >= enough:
            return rest - size
        b, a = self._rows(box)
        weights = multipliers(cost / size, b, a)
        if weights is None and contradiction(b, a) is not None:
            return np.inf
        return rest + lower_bound(cost, b, a, np.zeros(len(b)) if weights is None else size * weights)

    def search(self, which: int, sign: int, start: float, goal: float, boxes: int) -> float:
        """Return a better bound by branch and bound, with at most so many boxes; stop at the goal."""
        looked = 0

        def expand(bound: float, box: Box) -> Iterator[tuple[float, Box]]:
            nonlocal looked
            for part in self._halves(box):
                looked += 1
                if part is not None:
                    yield max(bound, self.bound(part, which, sign, goal)), part

        return best_first(
            self.root,
            start,
            expand,
            enough=lambda: goal,
            more=lambda: looked < boxes and len(self.middle) > 0,
            report=lambda _: None,
        )

    def direction(self, which: int, sign: int) -> Array:
        """Return the direction of the parameters in which ``sign`` times one function falls, at first order."""
        _, radius = frame(*self.root)
        slopes = self.model(self.root).slopes[:, which] / np.where(radius > 0, radius, 1.0)
        return np.asarray(-sign * slopes @ self.outer.axes, dtype=np.float64)

    def model(self, box: Box) -> Taylor:
        """Return all functions over a box, as models of ``t`` from -1 to 1."""
        key = _key(box)
        if key not in self._known:
            self._known[key] = self._at(*self._affine(box))
        return self._known[key]

    def tightened(self, box: Box) -> Box | None:
        """Return the part of a box that the half-spaces allow one by one; None where they allow none."""
        left = shrink(*self._rows(box))
        if left.empty:
            return None
        centre, radius = frame(*box)
        slack = 4 * EPSILON * (np.abs(centre) + radius)
        return (
            np.maximum(box[0], centre + radius * left.lower - slack),
            np.minimum(box[1], centre + radius * left.upper + slack),
        )

    def _at(self, values: Balls, slopes: Balls) -> Taylor:
        errors = (values.rad + slopes.rad.sum(axis=1)) * (1 + 4 * len(values) * EPSILON)
        point = [Taylor.linear(*parts) for parts in zip(values.mid, slopes.mid, errors, strict=True)]
        with np.errstate(invalid="ignore", over="ignore"):  # what overflows bounds nothing
            return self.functions(point, slopes.mid.shape[1])

    def _affine(self, box: Box) -> tuple[Balls, Balls]:
        """Return the parameters as ``middle + slopes @ t`` for t in [-1, 1]."""
        centre, radius = frame(*box)
        return Balls.exact(self.middle) + _product(self._back, Balls.exact(centre)), self._back * Balls.exact(radius)

    def _rows(self, box: Box) -> tuple[Array, Array]:
        """Return ``b + a @ t >= 0``, which all points of the set in a box satisfy."""
        key = _key(box)
        if key not in self._half_spaces or len(self._half_spaces[key][0]) < len(self.outer.ends):
            self._half_spaces[key] = self._new_rows(box)
        return self._half_spaces[key]

    def _new_rows(self, box: Box) -> tuple[Array, Array]:
        middle, slopes = self._affine(box)
        directions = Balls.exact(self.outer.directions)
        room, a = Balls.exact(self.outer.ends) - _product(directions, middle), -_product(directions, slopes)
        b = room.upper + a.rad.sum(axis=1)
        b = b + 8 * EPSILON * (len(box[0]) + 1) * (np.abs(b) + a.rad.sum(axis=1))
        size = np.max(np.abs(a.mid), axis=1, initial=0.0)
        unit = 2.0 ** -np.floor(np.log2(np.where(size > 0, size, 1.0)))  # an exact factor
        return b * unit, a.mid * unit[:, None]

    def _halves(self, box: Box) -> tuple[Box | None, Box | None]:
        """Cut a box where all functions together are bent most, so that their searches share the parts."""
        key = _key(box)
        if key not in self._parts:
            lower, upper = box
            model = self.model(box)
            bent = np.abs(model.curvature).sum(axis=0) / np.maximum(np.abs(model.slopes).sum(axis=0), TINY)
            loss = np.where(np.isfinite(model.error), bent, 0.0).sum(axis=1)
            k = int(np.argmax(loss if loss.any() else (upper - lower) / (self.root[1] - self.root[0])))
            below, above = upper.copy(), lower.copy()
            below[k] = above[k] = 0.5 * lower[k] + 0.5 * upper[k]
            self._parts[key] = self.tightened((lower, below)), self.tightened((above, upper))
        return self._parts[key]

    @cached_property
    def _back(self) -> Balls:
        """Return the inverse of the axes, rounded once."""
        rows = [[sympy.Rational(x) for x in row] for row in self.outer.axes.tolist()]
        n = len(rows)
        inverse = sympy.Matrix(n, n, [x for row in rows for x in row]).inv()
        cells = [Balls.enclose(Fraction(int(x.p), int(x.q))) for x in inverse]
        mid, rad = (np.array([float(getattr(cell, part)) for cell in cells]).reshape(n, n) for part in ("mid", "rad"))
        return Balls(mid, rad)


def multipliers(cost: Array, b: Array, a: Array) -> Array | None:
    """Return multipliers of rows ``b + a @ t >= 0`` at the least ``cost @ t`` for t in [-1, 1]; None where not found.

    By the dual simplex method, from the corner of the box where the cost is least. For a few unknowns it takes a tenth
    of the time of a general solver. Rounding does no harm: any nonnegative multipliers prove a bound.

    >>> multipliers(np.array([1.0, 1.0]), np.array([0.5]), np.array([[1.0, 0.0]]))  # t_0 >= -0.5
    array([1.])
    """
    count, n = a.shape
    one = np.eye(n)
    rows, room = np.concatenate([a, one, -one]), np.concatenate([b, np.ones(2 * n)])
    active = count + np.arange(n) + np.where(cost < 0, n, 0)
    values = np.abs(cost)
    for _ in range(MOST_PIVOTS):
        try:
            point = np.linalg.solve(rows[active], -room[active])
            left = room + rows @ point
            enters = int(np.argmin(left))
            if left[enters] >= -CLOSE:
                found = np.zeros(len(rows))
                found[active] = np.maximum(values, 0.0)
                return found[:count]
            shares = np.linalg.solve(rows[active].T, rows[enters])
        except np.linalg.LinAlgError:
            return None
        ratios = np.where(shares > CLOSE, values / np.where(shares > CLOSE, shares, 1.0), np.inf)
        leaves = int(np.argmin(ratios))
        if np.isinf(ratios[leaves]):
            return None
        values = values - ratios[leaves] * shares
        values[leaves], active[leaves] = ratios[leaves], enters
    return None


def _key(box: Box) -> bytes:
    return box[0].tobytes() + box[1].tobytes()


def _product(matrix: Balls, other: Balls) -> Balls:
    """Return a matrix times a matrix, or times a vector."""
    terms = matrix[:, :, None] * other[None] if other.mid.ndim == 2 else matrix * other[None]
    rounding = terms.mid.shape[1] * EPSILON * np.abs(terms.mid).sum(axis=1)
    return Balls(terms.mid.sum(axis=1), (terms.rad.sum(axis=1) + rounding) * (1 + (terms.mid.shape[1] + 8) * EPSILON))
