"""Scaling: every variable to [-1, 1], every constraint to coefficients near one.

The map is ``x = centre + scale * t``. Both floats are taken as exact, and ``scale`` is rounded up until the image of
[-1, 1] contains the box. Rows are multiplied by powers of two, which is exact. Bounds must be finite, because a
certificate ``q'y >= -b'z + r_0 - sum |r_i|`` needs every moment in [-1, 1].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import EPSILON
from relaxations.algebra.polynomial import Polynomials
from relaxations.errors import ProblemError
from relaxations.problem.problem import PolynomialProblem


@dataclass(frozen=True)
class Scaling:
    """The map ``x = centre + scale * t`` with t in [-1, 1].

    Parameters
    ----------
    centre, scale
        Shape (n_variables,).

    Examples
    --------
    >>> import sympy; from relaxations.problem.problem import from_sympy
    >>> x = sympy.Symbol("x")
    >>> problem, objective = from_sympy(x**2, [], [], [x], {x: (2, 6)})
    >>> scaling = Scaling.of_box(problem)
    >>> scaling.polynomials(objective).evaluate(np.array([0.5])).round(6)  # x = 5
    array([25.])
    >>> scaling.recover(np.array([0.5])).round(6)
    array([5.])
    """

    centre: Array
    scale: Array

    @staticmethod
    def of_box(problem: PolynomialProblem, magnitude: Array | None = None) -> Scaling:
        """Return the map from [-1, 1] to the bounds of a problem.

        Variables without finite bounds are scaled by ``magnitude``, which suits a search but not a certificate. Without
        ``magnitude`` they raise ProblemError.
        """
        loose = ~np.isfinite(problem.upper - problem.lower)
        if loose.any() and magnitude is None:
            raise ProblemError(
                f"{', '.join(problem.unbounded[:5])} has no finite box, so that no bound can be certified: "
                "give it lower and upper bounds, or derive them with relaxations.search.boxes.derive_box"
            )
        reach = np.ones(problem.n_variables) if magnitude is None else magnitude
        low, high = np.where(loose, -reach, problem.lower), np.where(loose, reach, problem.upper)
        centre = 0.5 * low + 0.5 * high
        scale = np.maximum(high - centre, centre - low)
        slack = np.where(scale > 0, 4 * EPSILON * (np.abs(centre) + scale), 0.0)
        # A fixed variable keeps its exact value, with scale zero.
        fixed = low == high
        return Scaling(np.where(fixed, low, centre), np.where(fixed, 0.0, scale + slack))

    def apply(self, problem: PolynomialProblem) -> PolynomialProblem:
        """Return the problem in ``t``, each row multiplied by a power of two."""
        loose = ~np.isfinite(problem.upper - problem.lower)
        return PolynomialProblem(
            problem.names,
            np.where(loose, -np.inf, -1.0),
            np.where(loose, np.inf, 1.0),
            _normalise(self.polynomials(problem.equalities)),
            _normalise(self.polynomials(problem.inequalities)),
        )

    def polynomials(self, polynomials: Polynomials) -> Polynomials:
        """Return polynomials of x as polynomials of t; ProblemError if values on the box exceed the float range."""
        with np.errstate(over="ignore", invalid="ignore"):
            scaled = polynomials.substitute_affine(self.centre, self.scale)
        if not np.isfinite(scaled.coefficients.magnitude()).all():
            raise ProblemError(
                "the objective or a constraint takes values beyond 1.8e308 in the box, the largest float: state "
                "the variables in larger units, or give them a smaller box"
            )
        return scaled

    def recover(self, point: Array) -> Array:
        """Return the point x of a point t."""
        return np.asarray(self.centre + self.scale * point, dtype=np.float64)


def _normalise(polynomials: Polynomials) -> Polynomials:
    """Return each polynomial times a power of two, so that its largest coefficient lies in (1/2, 1]."""
    largest = np.zeros(polynomials.n_rows)
    np.maximum.at(largest, polynomials.rows, np.abs(polynomials.coefficients.mid))
    largest[largest == 0] = 1.0
    return polynomials.scale_rows(2.0 ** np.clip(-np.ceil(np.log2(largest)), -1022, 1023))
