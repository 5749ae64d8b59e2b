"""Seeded random problems of two states, of which the record shows the first alone."""

from __future__ import annotations

import numpy as np

from benchmarks.soundness.random_problems import RandomProblem
from smid import Dataset, Model, OwnModel

KINDS = ("spring, position alone", "oscillator, one state hidden")
STEP = 0.1
BOX = 20.0
SMALL = {"a": (-1.0, 1.0), "c": (-0.5, 0.5), "b": (-3.0, 3.0)}


def hidden_problem(seed: int, kind: str) -> RandomProblem:
    """Draw a problem; its length, parameters, input, initial state and noise come from the seed."""
    rng = np.random.default_rng([seed, 5])
    n = int(rng.integers(15, 60))
    u, hidden, seen = np.repeat(rng.uniform(-1, 1, n), 3)[:n], float(rng.normal()), np.full(n, float(rng.normal()))
    if kind == KINDS[0]:
        truth = {"k": float(rng.uniform(1, 15)), "c": float(rng.uniform(0.5, 5)), "b": float(rng.uniform(2, 18))}
        for t in range(1, n):
            force = truth["b"] * u[t - 1] - truth["k"] * seen[t - 1] - truth["c"] * hidden
            seen[t], hidden = seen[t - 1] + STEP * hidden, hidden + STEP * force
    else:
        truth = {name: float(rng.uniform(0.8 * low, 0.8 * high)) for name, (low, high) in SMALL.items()}
        for t in range(1, n):
            seen[t], hidden = (
                truth["a"] * seen[t - 1] + hidden,
                truth["c"] * seen[t - 1] + 0.3 * hidden + truth["b"] * u[t - 1],
            )
    bound = float(rng.uniform(0.005, 0.05)) * float(np.std(seen))
    noise = rng.uniform(-1, 1, n) if rng.random() < 0.5 else (1 - 1e-9) * rng.choice([-1.0, 1.0], n)
    data = Dataset.from_arrays(input={"u": u}, output={"x": seen + bound * noise}, sampling_time=STEP)
    return RandomProblem(kind, _model(kind), data, {"x": bound}, truth)


def farthest(problem: RandomProblem, at: int) -> float:
    """Return a size that no position of this sample has for any parameters in their boxes: the hidden state cancels."""
    x, bound = problem.data.values("x"), problem.noise_bound["x"]
    top = float(np.abs(problem.data.values("u")).max())
    last, before = abs(x[at - 1]) + bound, abs(x[at - 2]) + bound
    if problem.kind == KINDS[0]:  # x_t - 2 x_t-1 + x_t-2 = h^2 (b u - k x_t-2) - h c (x_t-1 - x_t-2)
        return 2 * last + before + STEP**2 * BOX * (top + before) + STEP * BOX * (last + before) + bound
    # x_t = a x_t-1 + c x_t-2 + 0.3 (x_t-1 - a x_t-2) + b u
    return 1.3 * last + 0.8 * before + SMALL["b"][1] * top + bound


def _model(kind: str) -> Model:
    if kind == KINDS[0]:
        boxes = {name: [0.0, BOX] for name in "kcb"}
        equations = ["d/dt x = v", "d/dt v = b*u - k*x - c*v"]
        return OwnModel(equations, ["x"], ["u"], boxes, scheme="euler", sampling_time=STEP)
    equations = ["x[t] = a*x[t-1] + h[t-1]", "h[t] = c*x[t-1] + 0.3*h[t-1] + b*u[t-1]"]
    return OwnModel(equations, ["x"], ["u"], {name: list(box) for name, box in SMALL.items()})
