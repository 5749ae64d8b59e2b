"""Bayesian regularisation: the penalty of squared weights, found from the data.

Weights have a Gaussian prior of zero mean and variance s^2, one for the hidden and one for the output weights of each
network. With the sum of squared residuals E, the sum of squared weights W of a group, the Jacobian J and n residuals

    penalty of the group  lambda = sigma^2 / s^2,    sigma^2 = E / (n - gamma),    s^2 = W / gamma
    gamma = sum over the group of (1 - lambda H^-1_ii),    H = J'J + diag(lambda)

gamma counts the weights of the group that the data determine. Descent and update are repeated a few times. Without
noise the penalty vanishes.

References: MacKay, "Bayesian interpolation", Neural Computation 4 (1992); Foresee, Hagan, "Gauss-Newton approximation
to Bayesian learning", ICNN 1997.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from relaxations.algebra.arrays import Array, Index
from smid.hybrid.hybrid_model import HybridModel
from smid.hybrid.problem import HybridError
from smid.networks import Descent, Method, descend

__all__ = ["FIRST", "regularised", "weight_groups"]

FIRST = 1e-5
"""Penalty of the sum of squared residuals before the first update: noise of 1 % and weights of about 3."""

_ROUNDS, _SETTLED = 6, 0.1
_LEAST, _MOST = 1e-12, 1e3  # of the penalties


def weight_groups(problem: HybridError, hybrid: HybridModel) -> list[Index]:
    """Return the places of the hidden weights and of the output weights of each network, without the output's bias."""
    places = {name: k for k, name in enumerate(problem.fitting.run.parameters)}
    groups = []
    for placed in hybrid.networks:
        outer = {parameter.name for parameter in placed.term.output_weights}
        hidden = [p.name for p in placed.term.parameters if p.name not in outer]
        shown = [p.name for p in placed.term.output_weights[:-1]] if hidden else []
        groups += [np.array([places[n] for n in part if n in places], dtype=np.intp) for part in (hidden, shown)]
    return [group for group in groups if group.size]


def with_penalty(problem: HybridError, groups: Sequence[Index], penalties: Sequence[float]) -> HybridError:
    """Return the problem with a penalty of the squares of each group, against the sum of squared residuals."""
    penalty = np.zeros(problem.units.size)
    for group, size in zip(groups, penalties, strict=True):
        penalty[group] = size / problem.count
    return replace(problem, penalty=penalty)


def regularised(
    problem: HybridError, hybrid: HybridModel, theta: Array, method: Method, iterations: int
) -> tuple[HybridError, Descent]:
    """Return the problem with the penalties that belong to its minimum, and the descent to it.

    Parameters
    ----------
    theta
        Shape (p,). Start, near the minimum without or with a small penalty.
    """
    groups, n = weight_groups(problem, hybrid), problem.count
    penalties = [FIRST] * len(groups)
    for _ in range(_ROUNDS):
        problem = with_penalty(problem, groups, penalties)
        system = problem.normal_equations(theta)
        inverse = np.diag(np.linalg.pinv(system.gram * n, hermitian=True))
        power = (system.error - float(problem.penalty @ theta**2)) * n
        determined = [
            max(float(np.sum(1.0 - size * inverse[group])), 1e-3) for group, size in zip(groups, penalties, strict=True)
        ]
        noise = power / max(n - sum(determined), 1.0)
        before = penalties
        penalties = [
            float(np.clip(noise * gamma / max(float(np.sum(theta[group] ** 2)), 1e-12), _LEAST, _MOST))
            for group, gamma in zip(groups, determined, strict=True)
        ]
        problem = with_penalty(problem, groups, penalties)
        descent = descend(method, problem, theta, iterations=iterations, patience=iterations)
        theta = descent.theta
        if np.allclose(np.log(before), np.log(penalties), atol=_SETTLED):
            break
    return problem, descent
