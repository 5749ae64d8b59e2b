"""Local minima of polynomial problems by sequential quadratic programming, without a proof.

References
----------
D. Kraft, "A software package for sequential quadratic programming", DFVLR-FB 88-28 (1988): SciPy's SLSQP.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import Bounds, minimize

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.polynomial import Polynomials
from relaxations.deadline import check_time
from relaxations.moments.facial import independent_rows
from relaxations.problem.problem import PolynomialProblem
from relaxations.reductions.scaling import Scaling

FEASIBLE = 1e-9  # tolerance of the scaled constraints
LARGEST = 200  # variables; the method's matrices are dense


def local_minimum(
    problem: PolynomialProblem, objective: Polynomials, start: Array, margin: float = 0.0
) -> Array | None:
    """Return a point with a small objective whose scaled constraints hold within 1e-9, or None.

    ``margin`` is the scaled distance from every inequality and every bound. Bounds must be finite (ProblemError). None
    also for more than 200 variables, because the matrices of the method are dense.
    """
    return LocalSearch.of(problem, objective).minimum(start, margin)


@dataclass(frozen=True)
class LocalSearch:
    """A problem prepared for searches from any number of points: scaled to [-1, 1], with its derivatives."""

    problem: PolynomialProblem
    scaling: Scaling
    cost: _Smooth
    equalities: _Smooth
    inequalities: _Smooth

    @staticmethod
    def of(problem: PolynomialProblem, objective: Polynomials) -> LocalSearch:
        """Prepare a problem with finite bounds (ProblemError)."""
        # Scale the variables to [-1, 1], and the objective to coefficients near one.
        scaling = Scaling.of_box(problem)
        scaled = scaling.apply(problem)
        cost = scaling.polynomials(objective)
        size = max(float(np.abs(cost.coefficients.mid).max(initial=0.0)), 1e-300)
        n = problem.n_variables
        return LocalSearch(
            problem,
            scaling,
            _Smooth(cost, n, 1 / size),
            _Smooth(scaled.equalities, n),
            _Smooth(scaled.inequalities, n),
        )

    def minimum(self, start: Array, margin: float = 0.0) -> Array | None:
        """Return what :func:`local_minimum` returns."""
        problem, cost, unequal = self.problem, self.cost, self.inequalities
        if problem.n_variables > LARGEST:
            return None
        centre, scale = self.scaling.centre, self.scaling.scale
        free = scale > 0
        reach = np.where(free, 1.0 - margin, 0.0)
        begin = np.where(free, (start - centre) / np.where(free, scale, 1.0), 0.0)
        # SLSQP fails on linearly dependent equalities.
        equal = self.equalities
        if equal.n_rows > 1:
            equal = equal.take(independent_rows(equal.jacobian(np.clip(begin, -reach, reach))))
        # Constraints in the form of SLSQP.
        constraints = [
            {
                "type": kind,
                "fun": lambda t, family=family, shift=shift: family.values(t) - shift,
                "jac": family.jacobian,
            }
            for kind, family, shift in (("eq", equal, 0.0), ("ineq", unequal, margin))
            if family.n_rows
        ]

        def value(t: Array) -> float:
            check_time()
            return float(cost.values(t)[0])

        # Older versions of scipy warn each time that they clip a step to the bounds.
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", "Values in x were outside bounds", RuntimeWarning)
            found = minimize(  # type: ignore[call-overload]
                value,
                np.clip(begin, -reach, reach),
                jac=lambda t: cost.jacobian(t)[0],
                method="SLSQP",
                bounds=Bounds(-reach, reach),
                constraints=constraints,
                options={"maxiter": 200, "ftol": 1e-14},
            )
        # Accept the point only if its constraints hold.
        t = np.clip(found.x, -reach, reach)
        if not np.isfinite(t).all():
            return None
        violated = np.abs(self.equalities.values(t)).max(initial=0.0) > FEASIBLE
        violated = violated or unequal.values(t).min(initial=0.0) < -FEASIBLE
        # A variable at a bound gets the exact bound, so that products which are zero there are exactly zero.
        point = np.where(t == 1.0, problem.upper, np.where(t == -1.0, problem.lower, self.scaling.recover(t)))
        return None if violated else np.clip(point, problem.lower, problem.upper)


class _Smooth:
    """Polynomials times a factor, with their derivatives."""

    def __init__(self, family: Polynomials, n_variables: int, factor: float = 1.0) -> None:
        self.family, self.n_variables, self.factor = family, n_variables, factor
        self.n_rows = family.n_rows

    @cached_property
    def _derivatives(self) -> Polynomials:
        return self.family.derivatives(self.n_variables)

    def values(self, point: Array) -> Array:
        return self.factor * self.family.evaluate(point)

    def jacobian(self, point: Array) -> Array:
        """Return the dense Jacobian."""
        return self.factor * self._derivatives.evaluate(point).reshape(self.n_rows, self.n_variables)

    def take(self, rows: Index) -> _Smooth:
        return self if len(rows) == self.n_rows else _Smooth(self.family.take(rows), self.n_variables, self.factor)
