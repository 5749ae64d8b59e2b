"""Levenberg and Marquardt's method: between Gauss-Newton's step and a short step down the gradient.

    (G + mu I) d = -g,    G = J'J / n,    g = J'r / n,    rho = (E(theta) - E(theta + d)) / (mu d'd - g'd)

The error fell: accept, ``mu <- mu max(1/3, 1 - (2 rho - 1)^3)``; else ``mu <- mu nu, nu <- 2 nu`` and try again, nu
beginning at 2.  Marquardt, and Hagan and Menhaj, divide and multiply by ten; then every other step of a network's
training is refused, and half the evaluations are lost.  Nielsen's rho compares the fall with what the quadratic model
promised, and keeps mu where both agree.

A step that gives no finite error counts as one that did not lower it.  Inputs and outputs of a network are scaled to
[-1, 1], so the identity serves as well as Marquardt's diagonal of G, and a weight that has no effect yet does not make
the step singular.

References: Marquardt, "An algorithm for least-squares estimation of nonlinear parameters", SIAM J. Appl. Math. 11
(1963); Hagan, Menhaj, "Training feedforward networks with the Marquardt algorithm", IEEE Trans. Neural Networks 5
(1994); Madsen, Nielsen, Tingleff, "Methods for non-linear least squares problems", IMM, DTU (2004), algorithm 3.16.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from smid.networks.least_squares import Iterate, LeastSquares, NormalEquations
from smid.networks.network import Array

__all__ = ["levenberg_marquardt"]

START, SMALLEST, LARGEST = 1e-3, 1e-15, 1e12


def levenberg_marquardt(problem: LeastSquares, start: Array) -> Iterator[Iterate]:
    """Descend by damped Gauss-Newton steps.

    Parameters
    ----------
    start
        Shape (p,). Where to begin.

    Yields
    ------
    Iterate
        The start, then each accepted point.

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
    theta, damping, factor = start, START, 2.0
    system = problem.normal_equations(theta)
    yield Iterate(theta, system.error)
    while damping <= LARGEST:
        step = _step(system, damping)
        error = problem.error(theta + step)
        if error < system.error:
            promised = float(step @ (damping * step - system.gradient))
            ratio = (system.error - error) / promised
            damping, factor = max(damping * max(1.0 / 3.0, 1.0 - (2.0 * ratio - 1.0) ** 3), SMALLEST), 2.0
            theta = theta + step
            system = problem.normal_equations(theta)
            yield Iterate(theta, system.error)
        else:
            damping, factor = damping * factor, 2.0 * factor


def _step(system: NormalEquations, damping: float) -> Array:
    try:
        factor = cho_factor(system.gram + damping * np.eye(system.gradient.size))
    except LinAlgError:  # the damping is lost in rounding: a longer step than that has no meaning
        return np.full(system.gradient.shape, np.nan)
    return -np.asarray(cho_solve(factor, system.gradient))
