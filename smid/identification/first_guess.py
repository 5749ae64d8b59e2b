"""A first guess by equation error: least squares in the parameters with all noises zero. It is biased.

Equations that read a missing sample are left out.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.optimize import least_squares

from relaxations.algebra.arrays import Array
from relaxations.deadline import check_time
from smid.feasible.feasible_set import FeasibleSet

_NOTHING = (np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))
_STARTS = 4
_NARROW = 1e-9  # relative width of a box that counts as a point


def equation_error_fit(feasible: FeasibleSet) -> tuple[Array, float]:
    """Return the parameters fitted with all noises zero, and the RMS of the equation error in the output's unit."""
    feasible = feasible.without(feasible.missing)
    problem = feasible.problem
    count = len(feasible.model.parameters)
    lower, upper = problem.lower[:count], problem.upper[:count]
    point = np.zeros(problem.n_variables)
    equalities = problem.equalities
    # Signals behind a curve are given explicitly, in terms of the parameters and the data.
    defining, given = (np.concatenate(part) for part in zip(_NOTHING, *feasible.definitions, strict=True))

    def residual(theta: Array) -> Array:
        check_time()
        point[:count] = theta
        point[given] = 0.0
        point[given] = -equalities.evaluate(point)[defining]
        return equalities.evaluate(point)

    def jacobian(theta: Array) -> Array:
        residual(theta)
        rows, columns, values = equalities.jacobian(point)
        whole = sparse.csr_matrix((values, (rows, columns)), shape=(equalities.n_rows, problem.n_variables))
        own = whole[:, :count].toarray()
        return np.asarray(own - whole[:, given] @ own[defining], dtype=np.float64)

    low, high = np.where(np.isfinite(lower), lower, -1.0), np.where(np.isfinite(upper), upper, 1.0)
    generator = np.random.default_rng(0)
    # A box that is a point but for rounding has no float inside that a fit could start from.
    free = ~(np.isfinite(upper - lower) & (upper - lower <= _NARROW * np.minimum(np.abs(lower), np.abs(upper))))
    fits = []
    for k in range(_STARTS):
        start = 0.5 * (low + high) if k == 0 else generator.uniform(low, high)
        theta = np.where(free, start, lower)
        if free.any():
            inside = np.clip(theta[free], np.nextafter(lower[free], np.inf), np.nextafter(upper[free], -np.inf))

            def embed(x: Array, theta: Array = theta) -> Array:
                full = theta.copy()
                full[free] = x
                return full

            fit = least_squares(
                lambda x, embed=embed: residual(embed(x)),  # type: ignore[misc]
                inside,
                jac=lambda x, embed=embed: jacobian(embed(x))[:, free],  # type: ignore[misc]
                bounds=(lower[free], upper[free]),
                x_scale="jac",
                max_nfev=200,
            )
            theta = embed(fit.x)
        # No equation may be left, where every second sample is missing.
        fits.append((float(np.linalg.norm(residual(theta)) / np.sqrt(max(equalities.n_rows, 1))), theta))
    rms, best = min(fits, key=lambda pair: pair[0])
    return best, rms


def magnitudes(feasible: FeasibleSet, parameters: Array, noise: float) -> Array:
    """Return a guess of the size of every variable, for scaling: shape (n_variables,)."""
    guess = np.full(feasible.n_variables, max(noise, 1e-12))
    largest = max(float(np.abs(parameters).max(initial=0.0)), 1e-6)
    outputs = [np.nanmax(np.abs(feasible.data.stacked(c))) for c in feasible.model.output_channels]
    guess[feasible.missing] = max(outputs, default=1.0)
    guess[: len(parameters)] = np.maximum(4 * np.abs(parameters), 1e-3 * largest)
    return guess
