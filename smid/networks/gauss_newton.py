"""Gauss-Newton: the least-squares step of the linearised residuals, halved until the error falls.

    d = argmin |J d + r|,   theta <- theta + d / 2^k,   k the least that lowers the error

Where the step is not unique, the shortest one is taken.

Reference: hybrid thesis, (4.3) and appendix G; Nocedal, Wright, "Numerical Optimization", section 10.3.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from relaxations.algebra.arrays import Array
from smid.networks.least_squares import Iterate, LeastSquares, box_of, held

__all__ = ["gauss_newton"]

HALVINGS = 30


def gauss_newton(problem: LeastSquares, start: Array) -> Iterator[Iterate]:
    """Yield the start, shape (p,), then each accepted point.

    Examples
    --------
    >>> from smid.networks.least_squares import NormalEquations
    >>> class Line:
    ...     def error(self, theta):
    ...         return float(theta @ theta)
    ...     def normal_equations(self, theta):
    ...         return NormalEquations(self.error(theta), theta, np.eye(theta.size))
    >>> [i.error for i in gauss_newton(Line(), np.array([1.0, -2.0]))]
    [5.0, 0.0]
    """
    lower, upper = box_of(problem, start)
    theta = np.clip(start, lower, upper)
    system = problem.normal_equations(theta)
    yield Iterate(theta, system.error)
    for _ in iter(int, 1):
        moves = ~held(theta, system.gradient, lower, upper)
        step = np.zeros(theta.shape)
        step[moves] = -np.linalg.lstsq(system.gram[np.ix_(moves, moves)], system.gradient[moves], rcond=None)[0]
        lengths = (np.clip(theta + step / 2**k, lower, upper) for k in range(HALVINGS))
        better = next((trial for trial in lengths if problem.error(trial) < system.error), None)
        if better is None:
            return
        theta = better
        system = problem.normal_equations(theta)
        yield Iterate(theta, system.error)
