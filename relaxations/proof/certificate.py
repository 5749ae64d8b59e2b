"""The certificate: a lower bound that follows from the multipliers by ball arithmetic, whatever the solver said.

With any floats ``lambda`` and any float matrices ``F_j`` put

    r = objective - sum_k lambda_k h_k m_k - sum_j <F_j F_j', g_j b_j b_j'>      (a polynomial).

On the feasible set the two sums are zero and nonnegative, every scaled monomial lies in [-1, 1] and the constant one is
1. Hence ``objective >= r_0 - sum_{i > 0} |r_i|`` there. All coefficients of r are computed with their rounding errors,
those of ``F F'`` included, so the right-hand side is a theorem. With objective zero and a positive bound the feasible
set is empty (a Farkas certificate).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relaxations.algebra.ball_arithmetic import Balls, concatenate, gram
from relaxations.algebra.polynomial import Polynomials
from relaxations.moments.conic import Multipliers
from relaxations.moments.moment import Relaxation


@dataclass(frozen=True)
class Certificate:
    """A proven lower bound of an objective over the feasible set, with its proof.

    Parameters
    ----------
    bound
        ``objective >= bound`` at every feasible point; minus infinity where nothing follows.
    residual
        ``sum_{i > 0} |r_i|``: the loss by the solver's inexactness.
    """

    bound: float
    residual: float
    multipliers: Multipliers


def certify(relaxation: Relaxation, objective: Polynomials, multipliers: Multipliers) -> Certificate:
    """Evaluate the certificate of one objective.

    Parameters
    ----------
    objective
        One row, in the scaled variables.
    multipliers
        Any will do: poor ones give a poor bound, and none a false one.

    Raises
    ------
    ProblemError
        When the objective holds a monomial that the relaxation has no moment for.

    Examples
    --------
    x^2 + x >= -1/4, by hand: the difference is the square of 1/2 + x, the column below times the basis (1, x).

    >>> from relaxations.moments.lasserre_hierarchy import lasserre
    >>> from relaxations.problem.problem import from_sympy
    >>> import sympy
    >>> x = sympy.Symbol("x")
    >>> problem, objective = from_sympy(x**2 + x, [], [], [x], {x: (-1, 1)})
    >>> square, nothing = np.array([[[0.5], [1.0]]]), np.zeros((1, 1, 1))
    >>> proof = certify(lasserre(problem, 1), objective, Multipliers(np.zeros(0), (square, nothing)))
    >>> proof.bound <= -0.25, round(proof.bound, 9)
    (True, -0.25)
    """
    finite = np.isfinite(multipliers.equalities).all() and all(np.isfinite(f).all() for f in multipliers.factors)
    if not finite:
        return Certificate(-np.inf, np.inf, multipliers)
    # A diverging dual may overflow on the way: infinities and NaN spread to the bound, which then proves nothing.
    with np.errstate(over="ignore", invalid="ignore"):
        residual = residual_polynomial(relaxation, objective, multipliers)
        magnitudes = residual[1:].magnitude()
        # A sum of n nonnegative floats, rounded: at most n EPSILON below the exact one.
        total = float(magnitudes.sum()) * (1 + (len(magnitudes) + 4) * 2.0**-52)
        bound = np.nextafter(float(residual.lower[0]) - total, -np.inf)
    return Certificate(float(bound) if np.isfinite(bound) else -np.inf, total, multipliers)


def residual_polynomial(relaxation: Relaxation, objective: Polynomials, multipliers: Multipliers) -> Balls:
    """Return the coefficients of r, one ball per moment, for finite multipliers; ProblemError as :func:`certify`."""
    moments = [relaxation.moments_of(objective.factors), relaxation.equality_moment]
    terms = [
        objective.coefficients,
        -(relaxation.equality_coefficient * Balls.exact(multipliers.equalities[relaxation.equality_row])),
    ]
    for blocks, factors in zip(relaxation.blocks, multipliers.factors, strict=True):
        weights = gram(factors)[blocks.block, blocks.i, blocks.j]
        twice = weights.scaled(np.where(blocks.i == blocks.j, 1.0, 2.0))
        moments.append(blocks.moment)
        terms.append(-(blocks.coefficient * twice))
    return concatenate(terms).segment_sum(np.concatenate(moments), relaxation.n_moments)
