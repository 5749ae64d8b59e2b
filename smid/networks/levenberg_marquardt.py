"""Levenberg-Marquardt from one start: `smid.networks.lockstep` with one point and D = 1.

The inputs and outputs of a network are scaled to [-1, 1], so the identity serves as well as Marquardt's diagonal of G.
A weight without effect does not make the step singular. Hagan and Menhaj divide and multiply mu by ten: then about
every second step of a training is rejected. Nielsen's rule keeps mu where the prediction of the error was right.

References: Marquardt, "An algorithm for least-squares estimation of nonlinear parameters", SIAM J. Appl. Math. 11
(1963); Hagan, Menhaj, "Training feedforward networks with the Marquardt algorithm", IEEE Trans. Neural Networks 5
(1994).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from relaxations.algebra.arrays import Array
from smid.networks.least_squares import Iterate, LeastSquares, box_of
from smid.networks.lockstep import Rows, descents

__all__ = ["levenberg_marquardt"]


class _OnePoint:
    """A point of a problem, as `smid.networks.lockstep.Points`."""

    def __init__(self, problem: LeastSquares, theta: Array) -> None:
        self._problem, self._theta = problem, theta
        self.errors = np.array([problem.error(theta)])

    def normal_equations(self, rows: Rows) -> tuple[Array, Array]:  # noqa: ARG002
        system = self._problem.normal_equations(self._theta)
        return system.gradient[None], system.gram[None]


def levenberg_marquardt(problem: LeastSquares, start: Array) -> Iterator[Iterate]:
    """Yield the start, shape (p,), then each accepted point.

    Examples
    --------
    >>> from smid.networks.least_squares import NormalEquations
    >>> class Line:
    ...     def error(self, theta):
    ...         return float(theta @ theta)
    ...     def normal_equations(self, theta):
    ...         return NormalEquations(self.error(theta), theta, np.eye(theta.size))
    >>> *_, last = levenberg_marquardt(Line(), np.array([1.0, -2.0]))
    >>> last.error < 1e-20
    True
    """
    lower, upper = box_of(problem, start)
    inside = np.clip(start, lower, upper)[None]
    found = descents(lambda theta: _OnePoint(problem, theta[0]), inside, lower, upper, scaled=False, fall=0.0)
    for theta, errors, moved in found:
        if moved.size:
            yield Iterate(theta[0].copy(), float(errors[0]))
