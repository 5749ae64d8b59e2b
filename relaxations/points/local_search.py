"""A local minimum of a polynomial problem near a point, by sequential quadratic programming: no proof, a good guess.

References
----------
D. Kraft, "A software package for sequential quadratic programming", DFVLR-FB 88-28 (1988): SciPy's SLSQP.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.optimize import Bounds, minimize

from relaxations.algebra.ball_arithmetic import Array
from relaxations.algebra.polynomial import Polynomials
from relaxations.deadline import check_time
from relaxations.moments.facial import independent
from relaxations.problem.problem import PolynomialProblem
from relaxations.reductions.scaling import Scaling

FEASIBLE = 1e-9  # of the scaled constraints
LARGEST = 200  # variables; the method's matrices are dense


def local_minimum(
    problem: PolynomialProblem, objective: Polynomials, start: Array, margin: float = 0.0
) -> Array | None:
    """Return a point whose constraints hold to 1e-9 and whose objective is small, or None.

    Parameters
    ----------
    problem
        With a finite box.
    objective
        One row.
    start
        Shape (n_variables,).
    margin
        Distance, scaled, that is kept from every inequality and every box end.

    Returns
    -------
    ndarray, shape (n_variables,), or None
        None also beyond 200 variables, for the method's matrices are dense.

    Raises
    ------
    ProblemError
        Where the box is infinite.

    Examples
    --------
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> x, y = variables("x y")
    >>> problem, objective = problem_of(x * y, [x**2 + y**2 <= 1])
    >>> local_minimum(problem, objective, np.array([0.5, -0.1])).round(4)
    array([ 0.7071, -0.7071])
    """
    if problem.n_variables > LARGEST:
        return None
    scaling = Scaling.of_box(problem)
    scaled = scaling.apply(problem)
    cost = scaling.polynomials(objective)
    size = max(float(np.abs(cost.coefficients.mid).max(initial=0.0)), 1e-300)
    free = scaling.scale > 0
    reach = np.where(free, 1.0 - margin, 0.0)
    begin = np.where(free, (start - scaling.centre) / np.where(free, scaling.scale, 1.0), 0.0)
    # The method breaks down on equalities that depend on each other.
    equal = scaled.equalities
    if equal.n_rows > 1:
        equal = equal.take(independent(_jacobian(equal, np.clip(begin, -reach, reach))))
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

    found = minimize(  # type: ignore[call-overload]
        value,
        np.clip(begin, -reach, reach),
        jac=lambda t: _jacobian(cost, t)[0] / size,
        method="SLSQP",
        bounds=Bounds(-reach, reach),
        constraints=constraints,
        options={"maxiter": 200, "ftol": 1e-14},
    )
    t = np.clip(found.x, -reach, reach)
    if not np.isfinite(t).all():
        return None
    violated = np.abs(scaled.equalities.evaluate(t)).max(initial=0.0) > FEASIBLE
    violated = violated or scaled.inequalities.evaluate(t).min(initial=0.0) < -FEASIBLE
    # A box end is met exactly: a product that vanishes there then vanishes to the last digit.
    point = np.where(t == 1.0, problem.upper, np.where(t == -1.0, problem.lower, scaling.recover(t)))
    return None if violated else np.clip(point, problem.lower, problem.upper)


def _jacobian(family: Polynomials, point: Array) -> Array:
    rows, columns, values = family.jacobian(point)
    shape = (family.n_rows, len(point))
    return np.asarray(sparse.coo_matrix((values, (rows, columns)), shape=shape).toarray(), dtype=np.float64)
