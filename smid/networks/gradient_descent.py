"""Gradient descent with an adaptive learning rate (back propagation).

    theta <- theta - rate J'r / n;    the error fell:  accept,  rate <- 2 rate;    else  rate <- rate / 2,  try again

Reference: hybrid thesis, appendix H (h.5); Vogl et al., "Accelerating the convergence of the back-propagation method",
Biological Cybernetics 59 (1988), here without steps that raise the error.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from relaxations.algebra.arrays import Array
from smid.networks.least_squares import Iterate, LeastSquares, box_of

__all__ = ["gradient_descent"]

START, FACTOR, SMALLEST = 0.1, 2.0, 1e-12


def gradient_descent(problem: LeastSquares, start: Array) -> Iterator[Iterate]:
    """Yield the start, shape (p,), then each accepted point.

    Examples
    --------
    >>> import numpy as np
    >>> from smid.networks.least_squares import NormalEquations
    >>> class Line:
    ...     def error(self, theta):
    ...         return float(theta @ theta)
    ...     def normal_equations(self, theta):
    ...         return NormalEquations(self.error(theta), theta, np.eye(theta.size))
    >>> errors = [i.error for i in gradient_descent(Line(), np.array([1.0, -2.0]))]
    >>> sorted(errors, reverse=True) == errors, errors[-1] < 1e-20
    (True, True)
    """
    lower, upper = box_of(problem, start)
    theta, rate = np.clip(start, lower, upper), START
    system = problem.normal_equations(theta)
    yield Iterate(theta, system.error)
    while rate >= SMALLEST:
        trial = np.clip(theta - rate * system.gradient, lower, upper)
        if problem.error(trial) < system.error:
            theta, rate = trial, FACTOR * rate
            system = problem.normal_equations(theta)
            yield Iterate(theta, system.error)
        else:
            rate /= FACTOR
