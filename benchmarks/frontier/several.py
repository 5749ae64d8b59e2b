"""Several poles or channels, hidden states, a varying or slow pole, a dead zone, outliers: one record of each.

Every end is certified, and met by verified parameters. Each record runs in a process of its own.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import sympy
from scipy.signal import lfilter

from benchmarks.frontier.growth import apart
from benchmarks.records import Known
from smid import Dataset, ErrorsInVariables, Model, OutputError, OwnModel, Parameter, identify, verify

GAP = 1e-2
LIMIT = 120.0  # s a record
NOISE = 0.05


@dataclass(frozen=True)
class Run:
    """One record identified: processor time without and with the certificate, and of its check; the file's kB.

    Further the largest gap / width, the samples in windows, and whether the truth is inside.
    """

    seconds: float
    certified: float
    checked: float
    size: float
    gap: float
    held: int
    inside: bool


def _inputs(rng: np.random.Generator, count: int, n: int) -> np.ndarray:
    return np.repeat(rng.uniform(-1, 1, (count, n)), 3, axis=1)[:, :n]


def _known(
    name: str, model: Model, u: dict[str, np.ndarray], y: dict[str, np.ndarray], truth: dict[str, float]
) -> Known:
    data = Dataset.from_arrays(input=u, output=y, sampling_time=1.0)
    noisy = {c: NOISE for c in (*y, *(("u",) if name.startswith("errors") else ()))}
    return Known(name, model, data, noisy, tuple(truth[p.name] for p in model.parameters))


def output_error(n: int) -> Known:
    """Make a record of two complex poles."""
    rng = np.random.default_rng(0)
    u = _inputs(rng, 1, n)[0]
    w = lfilter([0, 0.8, 0.4], [1, -1.2, 0.5], u)
    truth = {"a1": -1.2, "a2": 0.5, "b0": 0.8, "b1": 0.4}
    return _known(
        "output error, na = 2, nb = 1",
        OutputError(2, 1, stable=True),
        {"u": u},
        {"y": w + rng.uniform(-NOISE, NOISE, n)},
        truth,
    )


def four_poles(n: int) -> Known:
    """Make a record of four poles and four coefficients of the input."""
    rng = np.random.default_rng(0)
    u = _inputs(rng, 1, n)[0]
    a, b = (-1.7, 1.17, -0.4, 0.05), (0.8, 0.4, -0.2, 0.1)
    truth = {f"a{k + 1}": v for k, v in enumerate(a)} | {f"b{k}": v for k, v in enumerate(b)}
    y = lfilter([0, *b], [1.0, *a], u) + rng.uniform(-NOISE, NOISE, n)
    return _known("output error, na = 4, nb = 3", OutputError(4, 3, stable=True), {"u": u}, {"y": y}, truth)


def hidden_state(n: int) -> Known:
    """Make a record of two states, of which the first is measured and nothing is known of the second."""
    rng = np.random.default_rng(0)
    u, x, hidden = _inputs(rng, 1, n)[0], np.zeros(n), 0.3
    truth = {"a": 1.2, "c": -0.5, "b0": 0.8, "b1": 0.4}
    for k in range(1, n):
        now = truth["a"] * x[k - 1] + hidden + truth["b0"] * u[k - 1]
        x[k], hidden = now, truth["c"] * x[k - 1] + truth["b1"] * u[k - 1]
    equations = ["x[t] = a*x[t-1] + h[t-1] + b0*u[t-1]", "h[t] = c*x[t-1] + b1*u[t-1]"]
    model = OwnModel(equations, {"y": "x"}, ["u"], {"a": [-2, 2], "c": [-1, 1], "b0": [-3, 3], "b1": [-3, 3]})
    return _known("state space, one state hidden", model, {"u": u}, {"y": x + rng.uniform(-NOISE, NOISE, n)}, truth)


def spring(n: int) -> Known:
    """Make a record of the position of a mass on a damped spring."""
    rng = np.random.default_rng(0)
    u, x, speed = _inputs(rng, 1, n)[0], np.zeros(n), 0.0
    truth = {"k": 4.0, "c": 1.5, "b": 10.0}
    for i in range(1, n):
        force = truth["b"] * u[i - 1] - truth["k"] * x[i - 1] - truth["c"] * speed
        x[i], speed = x[i - 1] + 0.1 * speed, speed + 0.1 * force
    equations = ["d/dt x = v", "d/dt v = b*u - k*x - c*v"]
    box = {name: [0.0, 20.0] for name in truth}
    model = OwnModel(equations, {"y": "x"}, ["u"], box, scheme="euler", sampling_time=0.1)
    data = Dataset.from_arrays(input={"u": u}, output={"y": x + rng.uniform(-NOISE, NOISE, n)}, sampling_time=0.1)
    return Known("mass, spring and damper, from its position", model, data, {"y": NOISE}, tuple(truth.values()))


def outliers(n: int) -> Known:
    """Make a record of one pole, of which three outputs lie off."""
    rng = np.random.default_rng(0)
    u = _inputs(rng, 1, n)[0]
    y = lfilter([0, 0.9], [1, -0.7], u) + rng.uniform(-NOISE, NOISE, n)
    y[[n // 5, n // 2, n - 40]] += np.array([3.0, -10.0, 50.0]) * NOISE
    model = OutputError(1, stable=True)
    return _known("output error, 3 outliers", model, {"u": u}, {"y": y}, {"a1": -0.7, "b0": 0.9})


def errors_in_variables(n: int) -> Known:
    """Make a record of three poles, both channels noisy."""
    rng = np.random.default_rng(0)
    u = _inputs(rng, 1, n)[0]
    a, b = (-1.5, 0.85, -0.2), (0.8, 0.4, -0.2)
    w = lfilter(b, [1.0, *a], u)
    noise = rng.uniform(-NOISE, NOISE, (2, n))
    truth = {f"a{k + 1}": v for k, v in enumerate(a)} | {f"b{k}": v for k, v in enumerate(b)}
    model = ErrorsInVariables(3, 2, stable=True)
    return _known("errors in variables, na = 3, nb = 2", model, {"u": u + noise[0]}, {"y": w + noise[1]}, truth)


def two_by_two(n: int) -> Known:
    """Make a record of two inputs and two outputs, each with two poles of its own."""
    rng = np.random.default_rng(0)
    u = _inputs(rng, 2, n)
    truth = {"a1_y1": -1.2, "a2_y1": 0.5, "b0_y1_u1": 0.8, "b0_y1_u2": 0.4}
    truth |= {"a1_y2": -0.9, "a2_y2": 0.3, "b0_y2_u1": -0.5, "b0_y2_u2": 1.0}
    w = [lfilter([0, 1], [1, -1.2, 0.5], 0.8 * u[0] + 0.4 * u[1]), lfilter([0, 1], [1, -0.9, 0.3], u[1] - 0.5 * u[0])]
    y = np.array(w) + rng.uniform(-NOISE, NOISE, (2, n))
    model = OutputError(na=2, input=["u1", "u2"], output=["y1", "y2"], stable=True)
    return _known("two inputs, two outputs", model, dict(u1=u[0], u2=u[1]), dict(y1=y[0], y2=y[1]), truth)


def varying(n: int) -> Known:
    """Make a record of a pole and a gain that follow a channel."""
    rng = np.random.default_rng(0)
    u, r, w = _inputs(rng, 1, n)[0], np.sin(0.01 * np.arange(n)) + rng.uniform(-0.2, 0.2, n), np.zeros(n)
    for k in range(1, n):
        w[k] = (0.7 - 0.15 * r[k - 1]) * w[k - 1] + (0.8 + 0.3 * r[k - 1]) * u[k - 1]
    truth = {"a0": -0.7, "a1": 0.15, "b0": 0.8, "b1": 0.3}
    box = {name: [-1, 1] if name.startswith("a") else [-3, 3] for name in truth}
    model = OwnModel(["w[t] = -(a0 + a1*r[t-1])*w[t-1] + (b0 + b1*r[t-1])*u[t-1]"], {"y": "w"}, ["u", "r"], box)
    y = w + rng.uniform(-NOISE, NOISE, n)
    return _known("pole that follows a channel", model, {"u": u, "r": r}, {"y": y}, truth)


def dead_zone(n: int) -> Known:
    """Make a record of a dead zone before one pole."""
    rng = np.random.default_rng(0)
    u = _inputs(rng, 1, n)[0]
    w = lfilter([0, 0.9], [1, -0.7], np.maximum(0.0, u - 0.3))
    threshold = Parameter("d", 0, 1, null=0.0)
    model = OutputError(1, 0, stable=True, bounds={"b0": (-3, 3)}).insert_before(
        "u", lambda x: sympy.Max(0, x - threshold.symbol), parameters=[threshold]
    )
    truth = {"a1": -0.7, "b0": 0.9, "d": 0.3}
    return _known("dead zone of the input", model, {"u": u}, {"y": w + rng.uniform(-NOISE, NOISE, n)}, truth)


def slow(n: int) -> Known:
    """Make a record of a pole that remembers thousands of samples."""
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(-1, 1, n // 200 + 1), 200)[:n]
    w = lfilter([0, 0.002], [1, -0.999], u)
    model, truth = OutputError(1, stable=True), {"a1": -0.999, "b0": 0.002}
    return _known("pole at 0.999", model, {"u": u}, {"y": w + rng.uniform(-NOISE, NOISE, n)}, truth)


CASES: dict[str, tuple[Callable[[int], Known], int]] = {
    "output error": (output_error, 2000),
    "four poles": (four_poles, 200),
    "hidden state": (hidden_state, 100),
    "spring": (spring, 200),
    "outliers": (outliers, 300),
    "two by two": (two_by_two, 1000),
    "varying": (varying, 20_000),
    "dead zone": (dead_zone, 20_000),
    "slow": (slow, 100_000),
    "errors in variables": (errors_in_variables, 200),
}


def one(kind: str, n_samples: int) -> Run:
    """Identify one record."""
    known = CASES[kind][0](n_samples)
    allowed = 3 if kind == "outliers" else 0
    solve = partial(
        identify, known.model, known.data, known.noise_bound, tolerance=GAP, seconds=LIMIT, outliers=allowed
    )
    started = time.process_time()
    estimate = solve()
    seconds = time.process_time() - started
    inside = all(i.lower <= t <= i.upper for i, t in zip(estimate, known.truth, strict=True))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "proof.json"
        started = time.process_time()
        solve(certificate=file)
        certified, size = time.process_time() - started, file.stat().st_size / 1e3
        started = time.process_time()
        verify(file, known.data, known.model, known.noise_bound)
        checked = time.process_time() - started
    gap, held = max(i.gap / i.width for i in estimate), sum(map(len, estimate.windows))
    return Run(seconds, certified, checked, size, gap, held, inside)


def run() -> str:
    """Return the table as Markdown."""
    lines = [
        "## Several poles, several channels, varying poles",
        "",
        f"Asked for is a gap of {GAP:g} of the width of each interval, in at most {LIMIT:g} s. Times are processor "
        "times.",
        "",
        "| model | parameters | N | samples in windows | s | s with certificate | its kB | its check s | gap / width | "
        "truth inside |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for kind, (make, n) in CASES.items():
        known, r = make(n), apart(one, kind, n)
        lines.append(
            f"| {known.name} | {len(known.truth)} | {n} | {r.held or 'all'} | {r.seconds:.1f} | "
            f"{r.certified:.1f} | {r.size:.0f} | {r.checked:.1f} | {r.gap:.1e} | {'yes' if r.inside else 'no'} |"
        )
        print(lines[-1], flush=True)
    return "\n".join(lines)
