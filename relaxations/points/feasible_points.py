"""Feasible points of a minimisation: candidates of a local search, and proofs that they are feasible.

A local search accepts a point whose constraints hold within 1e-9. Such a point is a candidate. Only the objective value
at a proven feasible point is an upper bound of the minimum.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.polynomial import Polynomials
from relaxations.deadline import TimeIsUp
from relaxations.moments.parametric_lift import nonlinear_variables
from relaxations.points.exact_point import exact_point
from relaxations.points.local_search import LocalSearch, local_minimum
from relaxations.points.newton_point import newton_point
from relaxations.points.witness import MARGINS, Witness, definition_order, find_witness, verify
from relaxations.problem.problem import PolynomialProblem
from relaxations.reductions.vanishing import Piece, Product, piece

_NEAR = 1e-4  # points at a smaller distance, relative to the box, count as one


@dataclass
class FeasiblePoints:
    """The candidates and the proven feasible points of a problem.

    Parameters
    ----------
    vanishing
        The result of :func:`relaxations.reductions.vanishing.products`.
    tolerance
        Gap that counts as zero, relative to ``max(1, |minimum|)``.
    suggested, proven
        Objective value and point of each candidate, and of each proven point.
    tried
        Candidates for which a proof was tried.
    prepared
        The local search on each piece of the problem, by the variables that the piece keeps.
    """

    problem: PolynomialProblem
    objective: Polynomials
    vanishing: tuple[Product, ...]
    tolerance: float
    suggested: list[tuple[float, Array]] = field(default_factory=list)
    proven: list[tuple[float, Array]] = field(default_factory=list)
    tried: list[tuple[float, Array]] = field(default_factory=list)
    prepared: dict[tuple[int, ...], LocalSearch] = field(default_factory=dict)

    @property
    def best(self) -> float:
        """Return the least value at a proven point; infinite without one."""
        return min((value for value, _ in self.proven), default=np.inf)

    @property
    def hope(self) -> float:
        """Return the least value at any candidate, proven or not."""
        return min((value for value, _ in self.suggested), default=np.inf)

    def less(self, value: float) -> float:
        """Return a value minus the tolerance; infinity is unchanged."""
        return value - self.tolerance * max(1.0, abs(value)) if np.isfinite(value) else value

    def search(self, start: Array | None) -> None:
        """Run a local search from a point, and add the result to the candidates."""
        if start is None or not np.isfinite(start).all():
            return
        part = piece(self.problem, self.objective, self.vanishing, start)
        kept = tuple(part.kept.tolist())
        if kept not in self.prepared:
            self.prepared[kept] = LocalSearch.of(part.problem, part.objective)
        point = self.prepared[kept].minimum(start[part.kept])
        if point is not None:
            self.suggested.append((float(part.objective.evaluate(point)[0]), part.whole(point)))

    def prove(self) -> None:
        """Try to prove candidates in the order of their values, until no better proven value is possible."""
        for value, point in sorted(self.suggested, key=lambda p: p[0]):
            if value >= self.less(self.best):
                return
            self._prove(value, point)

    def distinct(self) -> list[tuple[float, Array]]:
        """Return the proven points with nearly the best value, the best first; nearby points count once."""
        self.prove()
        # Prove further candidates with nearly the best value, then drop duplicates.
        near = self.best + max(self.tolerance, 1e-6) * max(1.0, abs(self.best))
        for value, point in sorted(self.suggested, key=lambda p: p[0]):
            if value <= near and not any(self._apart(point, other) < _NEAR for _, other in self.proven):
                self._prove(value, point)
        kept: list[tuple[float, Array]] = []
        for value, point in sorted(self.proven, key=lambda p: p[0]):
            if value <= near and not any(self._apart(point, other) < _NEAR for _, other in kept):
                kept.append((value, point))
        return kept

    def _apart(self, point: Array, other: Array) -> float:
        """Return the distance of two points, relative to the box."""
        width = self.problem.upper - self.problem.lower
        return float((np.abs(point - other) / np.where(width > 0, width, 1.0)).max(initial=0.0))

    def _prove(self, value: float, point: Array) -> None:
        """Prove a candidate or a point near it, unless a nearby candidate with a similar value was tried before."""
        if any(self.less(other) <= value and self._apart(point, place) < _NEAR for other, place in self.tried):
            return
        self.tried.append((value, point))
        part = piece(self.problem, self.objective, self.vanishing, point)
        found = _best_proof_near(part, point[part.kept], value, self.tolerance)
        if found is not None:
            self.proven.append((found.value, part.whole(found.point)))


def _best_proof_near(part: Piece, point: Array, value: float, tolerance: float) -> Witness | None:
    """Return the best proven point among several near a candidate."""
    best: Witness | None = None
    with suppress(TimeIsUp):  # points verified before the limit count
        for found in _proofs_near(part.problem, part.objective, point):
            if found is not None and (best is None or found.value < best.value):
                best = found
            if best is not None and best.value <= value + 0.1 * tolerance * max(1.0, abs(value)):
                break
    return best


def _proofs_near(problem: PolynomialProblem, objective: Polynomials, point: Array) -> Iterator[Witness | None]:
    """Yield a proven point near a candidate, or None, for one method after the other."""
    yield exact_point(problem, objective, point)
    defined = definition_order(problem.equalities) is not None
    if defined:  # a simulation takes a hundredth of the time of Newton's method in fractions
        yield verify(problem, objective, point)
        for margin in MARGINS:
            moved = local_minimum(problem, objective, point, margin)
            yield None if moved is None else verify(problem, objective, moved)
        yield find_witness(problem, problem, objective, nonlinear_variables(problem), point)
    yield newton_point(problem, objective, point)
    if not defined:
        return
    # Last: keep all variables of nonlinear monomials within a trust region.
    high = [f.factors[f.term_degrees > 1].ravel() for f in (problem.equalities, problem.inequalities, objective)]
    yield find_witness(problem, problem, objective, np.setdiff1d(np.concatenate(high), [-1]), point)
