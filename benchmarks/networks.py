"""Training a ten-neuron CPX: smid beside scipy with finite differences and scikit-learn, on the same samples.

All fit the same 70 % of ``20C_step_a``, scaled to [-1, 1], without early stopping, from 3 random starts.  smid and
scipy begin at the same weights; scikit-learn draws its own (Glorot).  Each stops by its own rule: smid when 20 steps
lower the error by less than 1e-4 of itself, scipy's MINPACK at its default tolerances of 1e-8, scikit-learn at its
defaults but for the limit of iterations.  smid and scipy take 100 Jacobians at most, so that finite differences, 62
simulations each, end within minutes.  BLAS has one thread.
"""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable

import numpy as np
from scipy.optimize import least_squares

from relaxations.algebra.arrays import Array
from smid.data.bundled import load_clutch
from smid.networks import (
    Method,
    NetworkError,
    TanhNetwork,
    delayed,
    descend,
    gauss_newton,
    gradient_descent,
    levenberg_marquardt,
    nguyen_widrow,
    random_split,
    scaling_of,
)

try:
    from sklearn.exceptions import ConvergenceWarning
    from sklearn.neural_network import MLPRegressor
    from threadpoolctl import threadpool_limits
except ImportError:
    raise SystemExit("this benchmark compares with scikit-learn: pip install scikit-learn") from None

SIZES, STARTS, JACOBIANS, RECORD = (4, 10), 3, 100, "20C_step_a"


def _problem() -> tuple[NetworkError, float]:
    values = load_clutch(RECORD).experiments[0].values
    rows = random_split(values["position"].size, 1).training
    inputs = delayed([values["current"], values["pressure"]], [(1, 2), (1, 2)])[rows]
    target = values["position"][rows][:, None]
    scaling = scaling_of(target, ["position"])
    scaled = scaling_of(inputs, ["current"] * 2 + ["pressure"] * 2).apply(inputs)
    return NetworkError(SIZES, scaled, scaling.apply(target)[:, 0]), float(scaling.half_range[0])


def _smid(method: Method, problem: NetworkError, start: Array) -> float:
    return descend(method, problem, start, iterations=JACOBIANS).best


def _scipy(problem: NetworkError, start: Array, jacobian: str) -> float:
    def residuals(theta: Array) -> Array:
        return TanhNetwork(SIZES, theta)(problem.inputs) - problem.targets

    def derivatives(theta: Array) -> Array:
        return TanhNetwork(SIZES, theta).linearise(problem.inputs).by_weights

    # As many Jacobians as smid may take; MINPACK counts the evaluations of a finite difference too.
    if jacobian == "analytic":
        found = least_squares(residuals, start, jac=derivatives, method="lm", max_nfev=JACOBIANS)
    else:
        found = least_squares(residuals, start, jac="2-point", method="lm", max_nfev=JACOBIANS * (start.size + 1))
    return 2.0 * float(found.cost) / problem.targets.size


def _sklearn(problem: NetworkError, seed: int, solver: str) -> float:
    network = MLPRegressor(
        hidden_layer_sizes=SIZES[1:], activation="tanh", solver=solver, alpha=0.0, max_iter=5000, random_state=seed
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        network.fit(problem.inputs, problem.targets)
    return float(np.mean((network.predict(problem.inputs) - problem.targets) ** 2))


def run() -> str:
    """Return the comparison as Markdown."""
    problem, unit = _problem()
    starts = [nguyen_widrow(SIZES, seed).weights for seed in range(STARTS)]
    rivals: dict[str, Callable[[int], float]] = {
        "smid, Levenberg-Marquardt": lambda k: _smid(levenberg_marquardt, problem, starts[k]),
        "smid, Gauss-Newton": lambda k: _smid(gauss_newton, problem, starts[k]),
        "smid, gradient descent": lambda k: _smid(gradient_descent, problem, starts[k]),
        "scipy least_squares 'lm', finite differences": lambda k: _scipy(problem, starts[k], "2-point"),
        "scipy least_squares 'lm', smid's Jacobian": lambda k: _scipy(problem, starts[k], "analytic"),
        "scikit-learn MLPRegressor 'lbfgs'": lambda k: _sklearn(problem, k, "lbfgs"),
        "scikit-learn MLPRegressor 'adam'": lambda k: _sklearn(problem, k, "adam"),
    }
    lines = [
        f"## Training CPX, 61 parameters, {problem.targets.size} samples, {STARTS} starts",
        "",
        "| method | seconds a start, median | MSE [mm^2], median | least | time over smid's |",
        "|---|---|---|---|---|",
    ]
    first = 0.0
    with threadpool_limits(1):
        descend(levenberg_marquardt, problem, starts[0], iterations=3)  # what a first call costs is no one's method
        for name, fit in rivals.items():
            seconds, errors = [], []
            for k in range(STARTS):
                begun = time.perf_counter()
                errors.append(unit**2 * fit(k))
                seconds.append(time.perf_counter() - begun)
            median = float(np.median(seconds))
            first = first or median
            print(f"{name}: {sum(seconds):.1f} s", file=sys.stderr, flush=True)
            lines.append(
                f"| {name} | {median:.2f} | {np.median(errors):.5f} | {min(errors):.5f} | {median / first:.1f} |"
            )
    return "\n".join(lines)


if __name__ == "__main__":
    print(run())
