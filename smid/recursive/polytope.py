"""A polytope with a limited number of rows, and certified bounds along given directions (dual simplex, warm start).

The set is ``{theta : a_j' theta <= b_j}``. Its upper bound ("end") along a direction c is a linear program; directions
are the axes, their negatives, and others on request. Stored is a dual solution: a basis B of n rows with multipliers
``lambda_B >= 0`` and ``c = A_B' lambda_B``, which proves ``c' theta <= lambda_B' b_B``. A new row that cuts off the
vertex of an end enters its basis; the row that keeps the multipliers nonnegative leaves. Every basis is dual feasible,
so an early stop gives wider bounds, but valid ones.

Safeguards:

- Rounding: with the multipliers as floats, ``r = c - A_B' lambda_B`` and ``|theta| <= m`` from the box before,

      c' theta <= lambda_B' b_B + |r|' m,

  evaluated with a bound on its own rounding. Multipliers with ``A_B' mu = 0`` and ``mu' b_B < 0`` prove an empty set.
- Rows are never combined into new rows, so errors do not add up.
- Parameters that drift move every row outwards, by what the change can be along its normal.
- If no place is free, the rows are dropped that are in no basis and farthest from the set.

References: Milanese and Vicino, "Optimal estimation theory for dynamic systems with set membership uncertainty: an
overview", Automatica 27 (1991); Mo and Norton, "Fast and robust algorithm to compute exact polytope parameter bounds",
Mathematics and Computers in Simulation 32 (1990); Neumaier and Shcherbina, "Safe bounds in linear and mixed-integer
linear programming", Mathematical Programming 99 (2004).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from relaxations.algebra.arrays import Array, Index, Mask
from relaxations.algebra.ball_arithmetic import EPSILON, TINY
from smid.models import ModelError

__all__ = ["Polytope"]

OUTSIDE = 1e-9
"""Smallest violation of a row by a vertex, relative to the row's range over the box."""
PIVOTS = 6
"""Limit of pivots for each end and cut, to save time; the next cut continues."""
SMALLEST_PIVOT = 1e-9
"""Relative to the largest pivot. A smaller pivot would make the basis singular."""
FEIGNED = 1e-4
"""Times OUTSIDE, relative to the parameters: a smaller violation may be rounding of the vertex."""
NOTHING = 1e-200
"""Replaces a range of zero."""
SPOILT = 1e-3
"""Largest error of an inverse. Beyond it, the end starts again at a corner of the box."""


@dataclass(frozen=True, eq=False)
class Polytope:
    """An outer set of n parameters, with certified upper bounds along each axis and other directions.

    Parameters
    ----------
    normals
        Shape (m, n). The first 2n rows are the box; unused rows are zero.
    offsets
        Shape (m,). Right-hand sides; infinite for unused rows.
    directions
        Shape (q, n). The axes, their negatives, other directions, their negatives.
    ends
        Shape (q,). Certified upper bound of the set along each direction.
    bases
        Shape (q, n). The rows of the basis of each end.
    inverses
        Shape (q, n, n). Of the bases.
    units
        Shape (n,). Largest magnitude of each parameter in the first box.
    empty
        Whether the set is certified to be empty; then the ends have no meaning.

    Examples
    --------
    >>> square = Polytope.box(np.array([-1.0, -1.0]), np.array([1.0, 1.0]))
    >>> cut = square.cut(np.array([[1.0, 1.0], [-1.0, 1.0]]), np.array([0.5, 0.5]))
    >>> cut.upper.round(12)
    array([1. , 0.5])
    >>> cut.cut(np.array([[0.0, -1.0]]), np.array([-0.75])).empty
    True
    """

    normals: Array
    offsets: Array
    directions: Array
    ends: Array
    bases: Index
    inverses: Array
    units: Array
    empty: bool = False

    @staticmethod
    def box(lower: Array, upper: Array, capacity: int = 100) -> Polytope:
        """Return a box with room for `capacity` more rows; raise `ModelError` if the box or the capacity is invalid."""
        n = len(lower)
        if not (np.isfinite(lower).all() and np.isfinite(upper).all() and (lower <= upper).all()):
            raise ModelError(f"the box from {lower} to {upper} is empty or not finite: give finite ends, in order")
        if capacity <= 2 * n * n:
            raise ModelError(f"capacity = {capacity} is too small: {n} parameters need more than {2 * n * n} rows")
        axes = np.concatenate([np.eye(n), -np.eye(n)])
        ends = np.concatenate([upper, -lower])
        normals = np.concatenate([axes, np.zeros((capacity, n))])
        bases = _box_bases(axes)
        units = np.maximum(np.abs(lower), np.abs(upper)) + NOTHING
        return Polytope(normals, np.append(ends, np.full(capacity, np.inf)), axes, ends, bases, normals[bases], units)

    @property
    def n(self) -> int:
        """Return the number of parameters."""
        return len(self.normals[0])

    @property
    def lower(self) -> Array:
        """Return the certified lower bounds of the parameters."""
        return -self.ends[self.n : 2 * self.n]

    @property
    def upper(self) -> Array:
        """Return the certified upper bounds of the parameters."""
        return self.ends[: self.n]

    @property
    def widths(self) -> Array:
        """Return the certified widths along the axes and the other directions."""
        n, others = self.n, self.ends[2 * self.n :]
        half = len(others) // 2
        return np.concatenate([self.ends[:n] + self.ends[n : 2 * n], others[:half] + others[half:]])

    @property
    def vertices(self) -> Array:
        """Return the point at which each end is attained, shape (q, n); not certified."""
        return np.asarray((self.inverses @ self.offsets[self.bases][:, :, None])[:, :, 0])

    def along(self, others: Array) -> Polytope:
        """Return the set with certified bounds along others, shape (p, n), and their negatives.

        Raises
        ------
        ModelError
            If the capacity is too small for their bases.
        """
        n, fresh = self.n, np.concatenate([others, -others])
        if (2 * n + len(fresh)) * n + 2 * n >= len(self.normals):
            raise ModelError(f"{len(others)} directions do not fit into {len(self.normals)} rows: raise the capacity")
        # Keep the bounds along the axes; start the new directions from known bases.
        bases, inverses = self._begun(fresh)
        kept = slice(0, 2 * n)
        turned = replace(
            self,
            directions=np.concatenate([self.directions[kept], fresh]),
            ends=np.append(self.ends[kept], np.full(len(fresh), np.inf)),
            bases=np.concatenate([self.bases[kept], bases]),
            inverses=np.concatenate([self.inverses[kept], inverses]),
        )
        return _optimised(turned, self.normals, self.offsets, np.arange(len(turned.ends)) >= 2 * n)

    def drifted(self, step: Array, first: Polytope) -> Polytope:
        """Return the set of the points that are within `step`, shape (n,), of a point of the set, and in a first set.

        The first set has the same axes; its ends limit those of the result.
        """

        def farther(values: Array, along: Array) -> Array:
            reach = np.abs(along) @ step * (1 + (self.n + 2) * EPSILON)
            return np.asarray(np.nextafter(values + reach, np.inf))

        n, ends = self.n, farther(self.ends, self.directions)
        ends[: 2 * n] = np.minimum(ends[: 2 * n], first.ends[: 2 * n])
        offsets = farther(self.offsets, self.normals)
        offsets[: 2 * n] = ends[: 2 * n]
        return replace(self, offsets=offsets, ends=ends)

    def _begun(self, directions: Array) -> tuple[Index, Array]:
        """Return for each direction the best present basis that is dual feasible, or a corner of the box."""
        weights = directions @ self.inverses  # (q, k, n)
        reach = np.where(weights.min(axis=2) >= 0, (weights * self.offsets[self.bases][:, None, :]).sum(axis=2), np.inf)
        best = reach.argmin(axis=0)
        corners = _box_bases(directions)
        found = np.isfinite(reach.min(axis=0))
        bases = np.where(found[:, None], self.bases[best], corners)
        return bases, np.where(found[:, None, None], self.inverses[best], self.normals[corners])

    def cut(self, normals: Array, offsets: Array) -> Polytope:
        """Return an outer set of the points that also satisfy ``normals @ theta <= offsets``.

        The result is the set itself if its box satisfies all rows, or if it is empty.
        """
        # Only rows that cut the box can change an end.
        reach = np.maximum(normals, 0.0) @ self.upper + np.minimum(normals, 0.0) @ self.lower
        cutting = (reach > offsets).nonzero()[0]
        if self.empty or not len(cutting):
            return self
        # Add as many rows as the capacity allows, then the others.
        room = len(self.normals) - 2 * self.n - self.bases.size
        rows, right = self._stored(normals[cutting[:room]], offsets[cutting[:room]])
        cut = _optimised(self, rows, right, np.zeros(len(self.ends), dtype=bool))
        rest = cutting[room:]
        return cut.cut(normals[rest], offsets[rest]) if len(rest) and not cut.empty else cut

    def ranges(self, rows: Array) -> Array:
        """Return the range of each row over the box, or the rounding of a vertex if that is larger."""
        size = np.maximum(np.abs(self.lower), np.abs(self.upper))
        return np.abs(rows) @ (self.upper - self.lower + FEIGNED * size) + NOTHING

    def _stored(self, normals: Array, offsets: Array) -> tuple[Array, Array]:
        """Return all rows after new rows have replaced free rows, or the rows farthest from the set."""
        n, rows, right = self.n, self.normals.copy(), self.offsets.copy()
        away = (right - (self.vertices @ rows.T).max(axis=0)) / self.ranges(rows)
        away[: 2 * n] = -np.inf
        away[self.bases.ravel()] = -np.inf
        places = np.argpartition(away, -len(offsets))[-len(offsets) :]
        rows[places], right[places] = normals, offsets
        right[: 2 * n] = self.ends[: 2 * n]
        return rows, right


def _box_bases(directions: Array) -> Index:
    """Return for each direction the corner of the box that is farthest along it."""
    n = directions.shape[1]
    return np.where(directions >= 0, np.arange(n), np.arange(n) + n)


def _optimised(polytope: Polytope, rows: Array, right: Array, moved: Mask) -> Polytope:
    """Return the set after the dual simplex for all ends, with new certified bounds for the changed ones."""
    n, bases, inverses = polytope.n, polytope.bases.copy(), polytope.inverses.copy()
    width = polytope.ranges(rows)
    amount = np.abs(rows) @ polytope.units
    # An end whose basis contains a row of the box changes with the box.
    moved, ends = moved | (right != polytope.offsets)[bases].any(axis=1), np.arange(len(bases))
    for _ in range(PIVOTS):
        # Entering row: the one that the vertex violates most.
        vertices = (inverses[ends] @ right[bases[ends]][:, :, None])[:, :, 0]
        depth = (right - vertices @ rows.T) / width
        entering = depth.argmin(axis=1)
        outside = (depth[np.arange(len(ends)), entering] < -OUTSIDE).nonzero()[0]
        if not len(outside):
            break
        ends, entering = ends[outside], entering[outside]
        inverse = inverses[ends]
        alpha = (rows[entering][:, None, :] @ inverse)[:, 0, :]
        weights = np.maximum((polytope.directions[ends][:, None, :] @ inverse)[:, 0, :], 0.0)
        # Row scales may differ by many powers of ten, so compare the pivots over the first box.
        share = alpha * amount[bases[ends]]
        able = share > SMALLEST_PIVOT * np.abs(share).max(axis=1, keepdims=True)
        go = able.any(axis=1)
        for k in (~go).nonzero()[0]:
            # No row can leave: the entering row contradicts the basis.
            chosen = np.append(bases[ends[k]], entering[k])
            if _contradict(polytope, rows[chosen], right[chosen], np.append(np.maximum(-alpha[k], 0.0), 1.0)):
                return replace(polytope, empty=True)
        ends, entering, inverse, alpha = ends[go], entering[go], inverse[go], alpha[go]
        weights, share, able, each = weights[go], share[go], able[go], np.arange(len(ends))
        # Leaving row: smallest ratio, and among equal ratios the largest pivot.
        ratio = np.where(able, weights / np.where(able, alpha, 1.0), np.inf)
        tied = ratio <= ratio.min(axis=1, keepdims=True) * (1 + 1e-9)
        leaving = np.where(tied, share, 0.0).argmax(axis=1)
        # Exchange the two rows in the inverse.
        column = inverse[each, :, leaving] / alpha[each, leaving][:, None]
        inverse = inverse - column[:, :, None] * alpha[:, None, :]
        inverse[each, :, leaving] = column
        bases[ends, leaving] = entering
        # One Newton step prevents the accumulation of rounding.
        defect = np.eye(n) - rows[bases[ends]] @ inverse
        inverses[ends] = inverse + inverse @ defect
        # An inaccurate inverse (or NaN) is replaced by that of a corner of the box.
        size = amount[bases[ends]]
        lost = ends[~((np.abs(defect) @ size[:, :, None])[:, :, 0] < SPOILT * size).all(axis=1)]
        bases[lost] = _box_bases(polytope.directions[lost])
        inverses[lost] = rows[bases[lost]]
        moved[ends] = True
    # Certify the changed ends; an end never grows.
    ends = moved.nonzero()[0]
    directions = polytope.directions[ends]
    weights = np.maximum(directions[:, None, :] @ inverses[ends], 0.0)
    proven = polytope.ends.copy()
    proven[ends] = np.fmin(proven[ends], _bound(polytope, weights, rows[bases[ends]], right[bases[ends]], directions))
    empty = bool((proven[:n] < -proven[n : 2 * n]).any())
    return Polytope(rows, right, polytope.directions, proven, bases, inverses, polytope.units, empty)


def _bound(polytope: Polytope, weights: Array, rows: Array, right: Array, target: Array) -> Array:
    """Return an upper bound of ``target' theta`` from nonnegative weights of rows.

    A sum of k products has an error of at most k u times the sum of the absolute values. EPSILON = 2 u and the extra
    terms cover the rounding of the bound itself; TINY covers underflow.
    """
    slip = (rows.shape[1] + 4) * EPSILON
    size = np.maximum(np.abs(polytope.lower), np.abs(polytope.upper))
    rest = np.abs(target - (weights @ rows)[:, 0]) + slip * (np.abs(target) + (weights @ np.abs(rows))[:, 0])
    value = (weights[:, 0] * right).sum(axis=1)
    error = rest @ size + slip * (weights[:, 0] * np.abs(right)).sum(axis=1) + rows.shape[1] * TINY * (1 + size.sum())
    return np.asarray(np.nextafter(value + (error * (1 + slip) + EPSILON * np.abs(value)), np.inf))


def _contradict(polytope: Polytope, rows: Array, right: Array, weights: Array) -> bool:
    """Return whether nonnegative weights of rows prove that no point of the box satisfies all rows."""
    bound = _bound(polytope, weights[None, None, :], rows[None], right[None], np.zeros((1, polytope.n)))
    return bool(bound[0] < 0)
