"""The constraints of a model's parameters, such as those of stability, in fits.

Boxes are kept by the trust-region method itself. Where its least squares violate a constraint, sequential quadratic
programming goes on from there to a local minimum that keeps the constraints, in unknowns scaled by their sensitivities.

Reference: Kraft, A software package for sequential quadratic programming, DFVLR-FB 88-28 (1988).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import sympy
from scipy.optimize import NonlinearConstraint, minimize

from relaxations.algebra.arrays import Array
from smid.fitting.problem import Fitting

KEPT = 1e-7  # a smaller violation counts as rounding
_ITERATIONS = 100
_LEAST = 1e-6  # cost of a sample, in variances of its channel, that is none


@dataclass(frozen=True)
class Constraints:
    """Functions of the unknowns of a fit that must not be negative.

    Parameters
    ----------
    value
        Returns shape (m,) for unknowns of shape (n_free,).
    slopes
        Returns shape (m, n_free).
    """

    value: Callable[[Array], Array]
    slopes: Callable[[Array], Array]

    @staticmethod
    def of(problem: Fitting) -> Constraints:
        """Return those of the model; fixed parameters are numbers in them, and without others there are none."""
        model, names = problem.model, problem.run.parameters
        fixed = {p.symbol: p.lower for p in model.parameters if p.lower == p.upper}
        stated = sympy.Matrix([expression.subs(fixed) for expression in model.constraints])
        symbols = [model.parameter(name).symbol for name in names]
        count = len(model.constraints)
        if not (count and names):
            return Constraints(lambda _: np.empty(0), lambda _: np.empty((0, problem.n_free)))
        # A list of symbols makes functions of one vector.
        value = sympy.lambdify([symbols], stated)
        slope = sympy.lambdify([symbols], stated.jacobian(symbols))

        def slopes(vector: Array) -> Array:
            whole = np.zeros((count, problem.n_free))
            whole[:, : len(names)] = slope(vector[: len(names)])
            return whole

        return Constraints(lambda vector: np.asarray(value(vector[: len(names)]), float).reshape(-1), slopes)

    def violated(self, vector: Array) -> bool:
        """Return whether a constraint is violated by more than rounding."""
        return bool(self.value(vector).min(initial=0.0) < -KEPT)

    def active(self, vector: Array) -> bool:
        """Return whether a constraint is an equation there."""
        return bool(self.value(vector).min(initial=np.inf) < KEPT)


def constrained(problem: Fitting, vector: Array, constraints: Constraints) -> Array:
    """Return a local minimiser of the squared error that keeps the constraints, from one that may violate them."""
    size = np.linalg.norm(problem.jacobian(vector), axis=0)
    scale = np.divide(1.0, size, out=np.ones_like(size), where=(size > 0) & np.isfinite(size))
    lower, upper = problem.box
    start = problem.residual(vector)
    cost = max(float(np.sum(start**2)), _LEAST * len(start))

    def value(x: Array) -> float:
        error = problem.residual(x * scale)
        return float(np.sum(error**2)) / cost if np.isfinite(error).all() else 1e12

    def gradient(x: Array) -> Array:
        error, slopes = problem.residual(x * scale), problem.jacobian(x * scale)
        return np.asarray(np.nan_to_num(2 * (error @ slopes) * scale / cost, posinf=0.0, neginf=0.0))

    with np.errstate(all="ignore"):  # a run may diverge on the way
        found = minimize(
            value,
            vector / scale,
            jac=gradient,
            method="SLSQP",
            bounds=list(zip(lower / scale, upper / scale, strict=True)),
            constraints=NonlinearConstraint(
                lambda x: constraints.value(x * scale), 0.0, np.inf, jac=lambda x: constraints.slopes(x * scale) * scale
            ),
            options={"maxiter": _ITERATIONS, "ftol": 1e-10},
        )
    return np.asarray(np.clip(found.x * scale, lower, upper))
