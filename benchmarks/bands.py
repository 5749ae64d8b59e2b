"""Check certified bands on random problems: the truth and sampled models that fit must lie inside.

``python -m benchmarks.bands [PROBLEMS]`` prints a line for each kind of model: failures, times beside the intervals,
and the width of the verified band as a share of the certified one.
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass

import numpy as np

import smid
from relaxations.algebra.arrays import Array

PROBLEMS, MODELS = 200, 1000
SAMPLES, FREQUENCIES = [1, 3, 8, 30], [0.3, 5.0, 25.0]


@dataclass(frozen=True)
class Problem:
    """A record that a plant ``w[t] = -sum a_i w[t-i] + sum b_j x[t-delay-j]`` made, with uniform noise.

    ``curve`` maps the input to x: a polynomial for a Hammerstein model, the identity otherwise.
    """

    model: smid.Model
    data: smid.Dataset
    bounds: dict[str, float]
    a: Array
    b: Array
    delay: int


def random_problem(kind: str, seed: int) -> Problem:
    """Return a random problem with one or two stable poles and one or two numerator coefficients."""
    random = np.random.default_rng([seed, *map(ord, kind)])
    poles, zeros, n = int(random.integers(1, 3)), int(random.integers(2)), int(random.integers(30, 51))
    if poles == 1:
        a = np.array([-random.uniform(0.2, 0.9)])
    else:
        radius, angle = random.uniform(0.4, 0.85), random.uniform(0.2, 1.6)
        a = np.array([-2 * radius * np.cos(angle), radius**2])
    b = random.uniform(0.3, 1.0, 1 + zeros) * random.choice([-1, 1])
    noise = random.uniform(0.02, 0.1)
    u = random.choice([-1, 1], n) * random.uniform(0.5, 1, n)
    x, delay, bounds, measured = u, 1, {"y": 1.1 * noise}, u
    stable = {"stable": True}
    if kind == "Hammerstein":
        b *= (1 + a.sum()) / b.sum()  # unit static gain
        x = 0.8 * u + 0.5 * u**3
        boxes = {f"gamma{k}": (-10, 10) for k in (1, 2)} | {f"beta{k}": (-10, 10) for k in range(zeros)}
        model = smid.Hammerstein(poles, (3, 1), zeros, bounds=boxes, **stable)
    elif kind == "errors in variables":
        delay, bounds["u"] = 0, 0.5 * noise
        measured = u + random.uniform(-0.5 * noise, 0.5 * noise, n)
        model = smid.ErrorsInVariables(poles, zeros, **stable)
    else:
        model = smid.OutputError(poles, zeros, **stable)
    w = simulate(a[None], b[None], delay, x[None], random.uniform(-0.1, 0.1, (1, poles)))[0]
    y = w + random.uniform(-noise, noise, n)
    data = smid.Dataset.from_arrays(input={"u": measured}, output={"y": y}, sampling_time=0.1)
    return Problem(model, data, bounds, a, b, delay)


def simulate(a: Array, b: Array, delay: int, x: Array, first: Array) -> Array:
    """Return the outputs of many models, shape (n_models, n): from rest before the first sample without `first`."""
    w = np.zeros(x.shape)
    for t in range(x.shape[1]):
        if t < first.shape[1]:
            w[:, t] = first[:, t]
            continue
        past = sum((a[:, i - 1] * w[:, t - i] for i in range(1, a.shape[1] + 1) if t >= i), np.zeros(len(x)))
        lags = [(j, t - delay - j) for j in range(b.shape[1]) if t - delay - j >= 0]
        w[:, t] = sum((b[:, j] * x[:, s] for j, s in lags), np.zeros(len(x))) - past
    return w


def feasible_models(problem: Problem, estimate: smid.Estimate, count: int, seed: int = 0) -> tuple[Array, Array]:
    """Return a and b of sampled models that fit all samples within the bounds, checked by simulation.

    Candidates are random mixtures of the estimate's verified points, noise included, and points somewhat outside.
    """
    random = np.random.default_rng(seed)
    assert estimate.enclosure is not None
    known = np.array(estimate.enclosure.witnesses)
    feasible = smid.FeasibleSet(problem.model, problem.data, problem.bounds)
    names = list(feasible.problem.names)
    run = problem.data.experiments[0].values
    y, u = run["y"], run["u"]
    lag = feasible.model.max_lag
    found: list[tuple[Array, Array]] = []
    for _ in range(20):
        weights = random.dirichlet(np.full(len(known), 0.2), count)
        spread = random.uniform(0.8, 1.2, (count, 1))
        points = (spread * weights + (1 - spread) / len(known)) @ known
        of = dict(zip(names, points.T, strict=True))
        a, b = coefficients(of)
        true = u - np.stack([of.get(f"zeta[{t}]", np.zeros(count)) for t in range(len(u))], 1)
        x = true
        if "gamma1" in of:
            x = of["gamma1"][:, None] * true**3 + of["gamma2"][:, None] * true
        # A noise that no equation holds is free.
        first = np.stack([y[t] - of.get(f"eta[{t}]", np.zeros(count)) for t in range(lag)], 1)
        fits = (np.abs(y - simulate(a, b, problem.delay, x, first)) <= problem.bounds["y"]).all(axis=1)
        fits &= (np.abs(u - true) <= problem.bounds.get("u", 0.0)).all(axis=1)
        found.append((a[fits], b[fits]))
        if sum(len(part[0]) for part in found) >= count:
            break
    return np.concatenate([part[0] for part in found])[:count], np.concatenate([part[1] for part in found])[:count]


def coefficients(of: dict[str, Array]) -> tuple[Array, Array]:
    """Return a and b of parameters by name; a Hammerstein model's last b follows from its unit static gain."""
    stems = ("alpha", "beta") if "gamma1" in of else ("a", "b")
    a = np.stack([of[name] for name in (f"{stems[0]}{k}" for k in range(1, 9)) if name in of] or [of["alpha"]], 1)
    given = [of[name] for name in ("beta", *(f"{stems[1]}{k}" for k in range(9))) if name in of]
    if "gamma1" in of:
        given.append(1 + a.sum(axis=1) - sum(given, np.zeros(len(a))))
    return a, np.stack(given, 1)


def outside(problem: Problem, step: smid.ResponseBand, bode: smid.ResponseBand, a: Array, b: Array) -> int:
    """Return how many of some models have a response outside the bands, by plain floating point."""
    period, slack = problem.data.sampling_time, 1e-9
    k = np.rint(step.at / period).astype(int)
    ones = np.ones((len(a), int(k.max()) + 1))
    h = simulate(a, b, problem.delay, ones, np.zeros((len(a), 0)))[:, k]
    q = np.exp(-1j * bode.at * period)
    powers = q[None] ** np.arange(1, 10)[:, None]
    above = (b @ np.concatenate([np.ones((1, len(q))), powers])[: b.shape[1]]) * q**problem.delay
    below = 1 + a @ powers[: a.shape[1]]
    gain, phase = np.abs(above / below), np.degrees(np.angle(above) - np.angle(below))
    middle = 0.5 * (bode["phase"].lower + bode["phase"].upper)
    phase = phase + 360 * np.round((np.where(np.isfinite(middle), middle, 0.0) - phase) / 360)
    bad = np.zeros(len(a), dtype=bool)
    for band, values in ((step["response"], h), (bode["gain"], gain), (bode["phase"], phase)):
        room = slack * (1 + np.abs(values))
        bad |= ((values < band.lower - room) | (values > band.upper + room)).any(axis=1)
    return int(bad.sum())


@dataclass
class Score:
    """Sums over the problems of one kind."""

    problems: int = 0
    models: int = 0
    failures: int = 0
    infinite: int = 0
    seconds: tuple[float, float, float] = (0.0, 0.0, 0.0)
    shares: tuple[float, ...] = ()


def run(kind: str, count: int, score: Score) -> None:
    """Add problems of one kind to a score."""
    for seed in range(count):
        problem = random_problem(kind, seed)
        times = [time.perf_counter()]
        estimate = smid.identify(problem.model, problem.data, problem.bounds)
        times.append(time.perf_counter())
        step = smid.step(estimate, SAMPLES)
        times.append(time.perf_counter())
        bode = smid.bode(estimate, FREQUENCIES)
        times.append(time.perf_counter())
        a, b = feasible_models(problem, estimate, MODELS, seed)
        score.problems += 1
        score.models += len(a)
        score.failures += outside(problem, step, bode, np.vstack([problem.a, a]), np.vstack([problem.b, b]))
        score.seconds = tuple(s + t for s, t in zip(score.seconds, np.diff(times), strict=True))  # type: ignore[assignment]
        for band in (*step.bands, *bode.bands):
            width, inner = band.upper - band.lower, band.inner_upper - band.inner_lower
            score.infinite += int((~np.isfinite(width)).sum())
            kept = np.isfinite(width) & (width > 1e-6 * np.max(width[np.isfinite(width)], initial=0.0))
            score.shares += tuple((inner[kept] / width[kept]).tolist())


def main(problems: int) -> None:
    """Print the table."""
    print("model                 problems  models  outside  infinite  identify    step    bode  verified: 5 %, median")
    for kind, share in (("output error", 0.6), ("Hammerstein", 0.25), ("errors in variables", 0.15)):
        score = Score()
        run(kind, round(share * problems), score)
        each = [f"{s / score.problems:.2f} s" for s in score.seconds]
        low, middle = np.quantile(score.shares, [0.05, 0.5])
        print(
            f"{kind:20}  {score.problems:8}  {score.models:6}  {score.failures:7}  {score.infinite:8}  "
            f"{each[0]:>8} {each[1]:>6} {each[2]:>6}   {low:.3f}, {middle:.3f}",
            flush=True,
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else PROBLEMS)
