"""Local minima of polynomial problems by sequential quadratic programming, without a proof.

References
----------
D. Kraft, "A software package for sequential quadratic programming", DFVLR-FB 88-28 (1988): SciPy's SLSQP.
"""

from __future__ import annotations

import warnings

import numpy as np
from scipy import sparse
from scipy.optimize import Bounds, minimize

from relaxations.algebra.arrays import Array
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
    if problem.n_variables > LARGEST:
        return None
    # Scale the variables to [-1, 1], and the objective to coefficients near one.
    scaling = Scaling.of_box(problem)
    scaled = scaling.apply(problem)
    cost = scaling.polynomials(objective)
    size = max(float(np.abs(cost.coefficients.mid).max(initial=0.0)), 1e-300)
    free = scaling.scale > 0
    reach = np.where(free, 1.0 - margin, 0.0)
    begin = np.where(free, (start - scaling.centre) / np.where(free, scaling.scale, 1.0), 0.0)
    # SLSQP fails on linearly dependent equalities.
    equal = scaled.equalities
    if equal.n_rows > 1:
        equal = equal.take(independent_rows(_jacobian(equal, np.clip(begin, -reach, reach))))
    # Constraints in the form of SLSQP.
    constraints = [
        {
            "type": kind,
            "fun": lambda t, family=family, shift=shift: family.evaluate(t) - shift,
            "jac": lambda t, family=family: _jacobian(family, t),
        }
        for kind, family, shift in (("eq", equal, 0.0), ("ineq", scaled.inequalities, margin))
        if family.n_rows
    ]

    def value(t: Array) -> float:
        check_time()
        return float(cost.evaluate(t)[0]) / size

    # Older versions of scipy warn each time that they clip a step to the bounds.
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Values in x were outside bounds", RuntimeWarning)
        found = minimize(  # type: ignore[call-overload]
            value,
            np.clip(begin, -reach, reach),
            jac=lambda t: _jacobian(cost, t)[0] / size,
            method="SLSQP",
            bounds=Bounds(-reach, reach),
            constraints=constraints,
            options={"maxiter": 200, "ftol": 1e-14},
        )
    # Accept the point only if its constraints hold.
    t = np.clip(found.x, -reach, reach)
    if not np.isfinite(t).all():
        return None
    violated = np.abs(scaled.equalities.evaluate(t)).max(initial=0.0) > FEASIBLE
    violated = violated or scaled.inequalities.evaluate(t).min(initial=0.0) < -FEASIBLE
    # A variable at a bound gets the exact bound, so that products which are zero there are exactly zero.
    point = np.where(t == 1.0, problem.upper, np.where(t == -1.0, problem.lower, scaling.recover(t)))
    return None if violated else np.clip(point, problem.lower, problem.upper)


def _jacobian(family: Polynomials, point: Array) -> Array:
    """Return the dense Jacobian of polynomials at a point."""
    rows, columns, values = family.jacobian(point)
    shape = (family.n_rows, len(point))
    return np.asarray(sparse.coo_matrix((values, (rows, columns)), shape=shape).toarray(), dtype=np.float64)
