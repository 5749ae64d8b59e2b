"""Recursive set-membership: does the truth stay inside, how long does an update take, when is a change seen, how wide.

    python -m benchmarks.recursive_sets                        all of it, some ten minutes on two cores
    python -m benchmarks.recursive_sets time changes           some of it

- truth: 200 seeded runs of 5000 samples over random plants; the noise is uniform, or at its bound with random sign, or
  at its bound for long stretches.  (At the bound less one part in 10^12: the simulated output is rounded.)
- time: one update of models of 6 parameters, beside an ellipsoid, a zonotope and padasip's RLS (pip install padasip);
  processor time on the same samples.
- drift: 200 seeded runs of 2000 samples whose parameters change slowly within a stated bound; also with noisy inputs
  and with two inputs.
- changes: a pole that changes in the middle of 600 samples, 100 seeds, and the same seeds without a change.
- widths: before and after a refinement, beside the batch intervals of `smid.identify` on the same samples, and for
  equation errors beside linear programs over all samples, an ellipsoid and a zonotope.
- window: the exact intervals over a sliding window, and what they cost.
- clutch: the Hammerstein model on the thesis's records, ramps (which it made) and steps (which it cannot explain).
"""

from __future__ import annotations

import os

from relaxations.algebra.arrays import Array

# Before NumPy is imported: matrices this small gain nothing from threads, and threads make timings useless.
os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np
from scipy.optimize import linprog
from scipy.signal import lfilter

from benchmarks.recursive_rivals import Ellipsoid, Zonotope
from smid import Dataset, OutputError, identify
from smid.data.bundled import load_clutch
from smid.recursive import Arx
from smid.recursive.locate_change import locate_change
from smid.recursive.set_membership import RecursiveSet
from smid.recursive.sliding_window import SlidingWindow

RUNS, SAMPLES = 200, 5000
SEEDS, CHANGED, LENGTH = 100, 300, 600
WITHIN = 50
INSIDE = 1 - 1e-12
"""Share of the bound that the noise keeps to: the simulated output is rounded, so the truth is true up to that only."""
REACH = 20.0
"""First box of each numerator coefficient, both ways; the plants' are within 2."""


@dataclass(frozen=True, eq=False)
class Record:
    """A simulated record, and the parameters behind it: constant, or one row for each sample."""

    arx: Arx
    truth: Array
    u: Array
    y: Array
    noise_bound: float
    error: str = "output"

    @property
    def bounds(self) -> dict[str, tuple[float, float]]:
        """First box of the numerator."""
        return {name: (-REACH, REACH) for name in self.arx.names if name.startswith("b")}

    def estimator(self, **options: Any) -> RecursiveSet:
        """Return a set that has seen nothing."""
        return RecursiveSet(self.arx, self.noise_bound, self.bounds, error=self.error, **options)


def poles_of(generator: np.random.Generator, count: int) -> Array:
    """Draw poles: real ones, or one complex pair among them."""
    real = generator.uniform(-0.5, 0.95, count).astype(complex)
    if count >= 2 and generator.random() < 0.5:
        pole = generator.uniform(0.3, 0.9) * np.exp(1j * generator.uniform(0.2, 2.0))
        real[:2] = pole, np.conj(pole)
    return np.asarray(np.poly(real).real[1:])


def noise_of(generator: np.random.Generator, n: int, kind: str) -> Array:
    """Draw noise within one."""
    if kind == "uniform":
        return generator.uniform(-1, 1, n) * INSIDE
    held = 1 if kind == "extreme" else 25
    return np.repeat(generator.choice([-1.0, 1.0], -(-n // held)), held)[:n] * INSIDE


def record(seed: int, na: int, nb: int, n: int, error: str = "output", kind: str = "uniform") -> Record:
    """Simulate a random plant; the noise is 1 to 10 % of the output's largest magnitude."""
    generator = np.random.default_rng(seed)
    a, b = poles_of(generator, na), generator.uniform(-1, 1, nb + 1) + 1.0
    u = np.repeat(generator.choice([-1.0, 1.0], n), int(generator.integers(1, 4)))[:n]
    numerator, denominator = np.append(0.0, b), np.append(1.0, a)
    w = lfilter(numerator, denominator, u)
    bound = float(generator.uniform(0.01, 0.1) * np.abs(w).max())
    noise = bound * noise_of(generator, n, kind)
    y = w + noise if error == "output" else w + lfilter([1.0], denominator, noise)
    return Record(Arx(na, nb), np.concatenate([a, b]), u, y, bound, error)


FAMILIES: tuple[tuple[str, int, int, str], ...] = (
    ("output error, 1 pole", 1, 0, "output"),
    ("output error, 2 poles", 2, 1, "output"),
    ("output error, 3 poles", 3, 2, "output"),
    ("equation error, 3 poles", 3, 2, "equation"),
)
KINDS = ("uniform", "extreme", "held")


def stays(seed: int) -> tuple[str, str, bool, float]:
    """Return family and noise of a run, whether the truth was inside at every sample, and the final width of a1."""
    name, na, nb, error = FAMILIES[seed % len(FAMILIES)]
    kind = KINDS[seed // len(FAMILIES) % len(KINDS)]
    case = record(seed, na, nb, SAMPLES, error, kind)
    estimator = case.estimator()
    inside = True
    for u, y in zip(case.u.tolist(), case.y.tolist(), strict=True):
        estimator.update(u, y)
        inside &= bool((estimator.lower <= case.truth).all() and (case.truth <= estimator.upper).all())
    inside &= estimator.empty is None
    return name, kind, inside, float((estimator.upper - estimator.lower)[0])


def truth() -> str:
    """Return how often the truth stayed inside."""
    began = time.perf_counter()
    with ProcessPoolExecutor(2) as pool:
        results = list(pool.map(stays, range(RUNS), chunksize=5))
    rows = []
    for name, na, nb, _ in FAMILIES:
        own = [inside for family, _, inside, _ in results if family == name]
        cells = [name, str(na + nb + 1), f"{sum(own)} of {len(own)}"]
        for kind in KINDS:
            widths = [width for family, other, _, width in results if (family, other) == (name, kind)]
            cells.append(f"{np.median(widths):.2g}, {max(widths):.2g}")
        rows.append(cells)
    head = ["model", "parameters", "truth inside at every sample", *(f"width of a1, {kind} noise" for kind in KINDS)]
    return section(f"Truth, {RUNS} runs of {SAMPLES} samples; final widths: median, largest", head, rows, began)


def timing() -> str:
    """Return what one update takes."""
    began = time.perf_counter()
    rows = []
    for title, error, options in (
        ("output error and drift", "output", {"drift": 1e-4}),
        ("errors in variables", "output", {"input_noise_bound": 0.01}),
        ("errors in variables and drift", "output", {"input_noise_bound": 0.01, "drift": 1e-4}),
        ("output error", "output", {}),
        ("equation error", "equation", {}),
    ):
        case = record(5, 3, 2, 3000, error)
        samples = list(zip(case.u.tolist(), case.y.tolist(), strict=True))
        rows.append([f"smid, {title}", *times([clocked(case.estimator(**options).update, samples) for _ in range(3)])])
    # The rivals are given the regressors, ready-made.
    bound, first = case.noise_bound, case.estimator()
    equations = list(
        zip(case.arx.matrix(case.u, case.y), case.y[case.arx.max_lag :].tolist(), [bound] * len(case.y), strict=False)
    )
    for rival in (Ellipsoid, Zonotope):
        runs = [clocked(rival(first.lower, first.upper).update, equations) for _ in range(3)]
        rows.append([rival.__name__.lower(), *times(runs)])
    if find_spec("padasip") is not None:
        from padasip.filters import FilterRLS

        pairs = [(value, row) for row, value, _ in equations]
        runs = [clocked(FilterRLS(n=6, mu=0.995, w="zeros").adapt, pairs) for _ in range(3)]
        rows.append(["padasip RLS", *times(runs)])
    head = ["one update, 6 parameters", "median ms", "mean ms", "99 % below ms", "largest ms"]
    return section("Time of one update, 6 parameters; the fastest of three runs, sample by sample", head, rows, began)


def clocked(update: Callable[..., object], samples: Sequence[tuple[object, ...]]) -> list[float]:
    """Return the milliseconds of each update."""
    result = []
    for sample in samples:
        began = time.thread_time()
        update(*sample)
        result.append(1e3 * (time.thread_time() - began))
    return result


def times(runs: Sequence[Sequence[float]]) -> list[str]:
    """Summarise the fastest run at each sample: the rest is other load."""
    best = np.min(runs, axis=0)
    figures = (np.median(best), best.mean(), np.quantile(best, 0.99), best.max())
    return [f"{figure:.3f}" for figure in figures]


def changing(seed: int, before: float, after: float, share: float) -> Record:
    """Simulate one pole that changes in the middle, at unit gain: ``w[t] = p w[t-1] + (1 - p) u[t-1]``."""
    generator = np.random.default_rng(seed)
    pole = np.where(np.arange(LENGTH) < CHANGED, before, after)
    u, w = generator.choice([-1.0, 1.0], LENGTH), np.zeros(LENGTH)
    for k in range(1, LENGTH):
        w[k] = pole[k] * w[k - 1] + (1 - pole[k]) * u[k - 1]
    bound = share * float(np.abs(w).max())
    y = w + bound * noise_of(generator, LENGTH, "uniform")
    return Record(Arx(), np.column_stack([-pole, 1 - pole]), u, y, bound)


def alarms(task: tuple[int, float, float, float]) -> tuple[list[int], int, bool]:
    """Return the samples of the certified changes, the length of the first one's located stretch, and soundness."""
    case = changing(*task)
    estimator, inside = case.estimator(), True
    for k, (u, y) in enumerate(zip(case.u.tolist(), case.y.tolist(), strict=True)):
        if estimator.update(u, y) is None and (estimator.empty is not None or k < CHANGED):
            inside &= bool((estimator.lower <= case.truth[k]).all() and (case.truth[k] <= estimator.upper).all())
    changes = estimator.history.changes
    if not changes:
        return [], 0, inside
    located = locate_change(estimator, changes[0], case.u, case.y)
    inside &= located.after < CHANGED <= located.sample
    return [change.sample for change in changes], located.sample - located.after, inside


POLES = ((0.8, 0.6, 0.03), (0.8, 0.6, 0.1), (0.8, 0.75, 0.03), (0.8, 0.8, 0.03), (0.8, 0.8, 0.1))
"""Before, after, and the noise bound as a share of the largest output."""


def changes() -> str:
    """Return when a change of the pole is certified, and whether one is where there is none."""
    began = time.perf_counter()
    rows = []
    with ProcessPoolExecutor(2) as pool:
        for before, after, share in POLES:
            tasks = [(seed, before, after, share) for seed in range(SEEDS)]
            found = list(pool.map(alarms, tasks, chunksize=5))
            delays = [samples[0] - CHANGED for samples, _, _ in found if samples]
            stretches = [stretch for samples, stretch, _ in found if samples]
            true = before != after
            rows.append(
                [
                    f"{before} to {after}" if true else f"stays {before}",
                    f"{share:.0%}",
                    f"{sum(0 <= d < WITHIN for d in delays)} of {SEEDS}" if true else "",
                    f"{np.median(delays):.0f}, {max(delays)}" if delays else "",
                    f"{np.median(stretches):.0f}, {max(stretches)}" if stretches else "",
                    str(sum(d < 0 for d in delays) + sum(len(s) > true for s, _, _ in found)),
                    f"{sum(inside for *_, inside in found)} of {SEEDS}",
                ]
            )
    head = [
        "pole",
        "noise",
        f"certified within {WITHIN} samples",
        "delay: median, largest",
        "located within: median, largest",
        "false alarms",
        "truth inside",
    ]
    return section(f"A change of the pole at sample {CHANGED} of {LENGTH}, {SEEDS} seeds", head, rows, began)


DRIFTS: tuple[tuple[str, int, int, int, float], ...] = (
    ("1 pole", 1, 0, 1, 0.0),
    ("2 poles", 2, 1, 1, 0.0),
    ("1 pole, noisy input", 1, 0, 1, 0.02),
    ("1 pole, 2 inputs", 1, 0, 2, 0.0),
)
"""Title, poles, degree of the numerator, inputs, and the noise bound of the inputs, which are 1 or -1."""


def drifting(seed: int, na: int, nb: int, inputs: int, input_bound: float, n: int = 2000) -> tuple[Record, Array]:
    """Simulate a plant whose poles and gains follow slow sines; return it with the largest change per sample."""
    generator, arx = np.random.default_rng(seed), Arx(na, nb, inputs=inputs)
    others = len(arx.names) - na

    def slow(count: int) -> Array:
        return np.sin(
            2 * np.pi * np.arange(n)[:, None] / generator.uniform(1500, 4000, count) + generator.uniform(0, 6, count)
        )

    poles = generator.uniform(0.2, 0.85, na) + generator.uniform(0.02, 0.1, na) * slow(na)
    theta = np.column_stack(
        [
            np.array([np.poly(own)[1:] for own in poles]),
            generator.uniform(0.5, 2, others) * (1 + 0.1 * slow(others)),
        ]
    )
    u, w, reach = generator.choice([-1.0, 1.0], (n, inputs)), np.zeros(n), arx.max_lag
    for k in range(reach, n):
        row = arx.row(w[k - na : k][::-1].tolist(), *(u[k - nb - 1 : k + 1, c][::-1].tolist() for c in range(inputs)))
        w[k] = np.dot(row, theta[k])
    bound = float(generator.uniform(0.01, 0.05)) * float(np.abs(w).max())
    y = w + bound * noise_of(generator, n, "uniform")
    measured = u + input_bound * INSIDE * generator.uniform(-1, 1, u.shape)
    return Record(arx, theta, measured, y, bound), np.abs(np.diff(theta, axis=0)).max(axis=0) * (1 + 1e-9)


def follows(seed: int) -> tuple[int, bool, bool, float, int]:
    """Return plant, whether it was always inside, false proofs, width of a1, and samples inside without a drift."""
    which = seed % len(DRIFTS)
    case, step = drifting(seed, *DRIFTS[which][1:])
    options = {"input_noise_bound": DRIFTS[which][4]}
    share, sets = (
        0,
        (
            case.estimator(drift=dict(zip(case.arx.names, step.tolist(), strict=True)), **options),
            case.estimator(**options),
        ),
    )
    inside = True
    for k, (u, y) in enumerate(zip(case.u.tolist(), case.y.tolist(), strict=True)):
        held = []
        for own in sets:
            own.update(u, y)
            held.append(bool((own.lower <= case.truth[k]).all() and (case.truth[k] <= own.upper).all()))
        inside &= held[0]
        share += held[1]
    history = sets[0].history
    width = float(np.median((history.upper - history.lower)[500:, 0]))
    return which, inside, bool(history.changes), width, share


def drift() -> str:
    """Return how often the present parameters stay inside while they drift."""
    began, rows = time.perf_counter(), []
    with ProcessPoolExecutor(2) as pool:
        results = list(pool.map(follows, range(RUNS), chunksize=5))
    for which, (title, *_) in enumerate(DRIFTS):
        own = [result for result in results if result[0] == which]
        rows.append(
            [
                title,
                f"{sum(inside for _, inside, *_ in own)} of {len(own)}",
                str(sum(changed for _, _, changed, *_ in own)),
                f"{np.median([width for *_, width, _ in own]):.2g}",
                f"{np.mean([share for *_, share in own]) / 2000:.0%}",
            ]
        )
    head = [
        "plant",
        "present parameters inside at every sample",
        "runs with a false proof of a change",
        "width of a1, median",
        "samples inside without a drift bound",
    ]
    return section(f"Slow drift, {RUNS} runs of 2000 samples", head, rows, began)


PLANTS: tuple[tuple[str, Array, Array], ...] = (
    ("0.8", np.array([-0.8]), np.array([1.0])),
    ("0.8, 0.6", np.poly([0.8, 0.6])[1:], np.array([1.0, 0.5])),
    ("0.7 ± 0.4i", np.poly([0.7 + 0.4j, 0.7 - 0.4j]).real[1:], np.array([1.0, 0.5])),
)


def plant_record(a: Array, b: Array, n: int, seed: int = 0, error: str = "output") -> Record:
    """Simulate a plant with 3 % of noise."""
    generator = np.random.default_rng(seed)
    u = generator.choice([-1.0, 1.0], n)
    w = lfilter(np.append(0.0, b), np.append(1.0, a), u)
    bound = 0.03 * float(np.abs(w).max())
    noise = bound * noise_of(generator, n, "uniform")
    y = w + noise if error == "output" else w + lfilter([1.0], np.append(1.0, a), noise)
    return Record(Arx(len(a), len(b) - 1), np.concatenate([a, b]), u, y, bound, error)


def batch(case: Record, n: int) -> tuple[Array, Array, float, str]:
    """Return the batch intervals of the first samples, the processor seconds that they took, and why they ended."""
    reach = {p.name: (p.lower, p.upper) for p in OutputError(case.arx.na, case.arx.nb, stable=True).parameters}
    bounds = {name: reach[name] for name in case.arx.names if name.startswith("a")} | case.bounds
    data = Dataset.from_arrays(input={"u": case.u[:n]}, output={"y": case.y[:n]}, sampling_time=1.0)
    began = time.process_time()
    model = OutputError(case.arx.na, case.arx.nb, bounds=bounds)
    found = identify(model, data, case.noise_bound, tolerance=1e-2, seconds=BATCH_LIMIT)
    seconds = time.process_time() - began
    ends = found.intervals
    return np.array([i.lower for i in ends]), np.array([i.upper for i in ends]), seconds, found.reason.name.lower()


BATCH_LIMIT = 120.0  # seconds
PIECES = (16, 64, 256)


CASES = (
    *PLANTS,
    *((f"2 poles, random {seed}", seed, 2) for seed in (0, 1, 2, 4, 5, 6, 7)),
    ("3 poles, random 0", 0, 3),
)


def beside_batch(case: tuple[Any, ...]) -> list[str]:
    """Return a row: widths before and after refinements as multiples of the batch widths, and the times."""
    title, first, second = case
    known = (
        plant_record(first, second, 400) if isinstance(first, np.ndarray) else record(first, second, second - 1, 400)
    )
    low, high, seconds, reason = batch(known, 400)
    ratios, spent, inside = list[str](), list[str](), True
    for pieces in (0, *PIECES):
        estimator = known.estimator()
        for sample in zip(known.u.tolist(), known.y.tolist(), strict=True):
            estimator.update(*sample)
        before = time.process_time()
        if pieces:
            estimator.refine(pieces)
            spent.append(f"{time.process_time() - before:.1f}")
        ratio = (estimator.upper - estimator.lower) / (high - low)
        ratios.append(f"{ratio.min():.2f} to {ratio.max():.2f}")
        inside &= bool((estimator.lower <= known.truth).all() and (known.truth <= estimator.upper).all())
    return [title, *ratios, "yes" if inside else "no", f"{seconds:.1f}, {reason}", ", ".join(spent)]


def widths() -> str:
    """Return how much wider the recursive intervals are than the batch ones, before and after a refinement."""
    began = time.perf_counter()
    with ProcessPoolExecutor(2) as pool:
        rows = list(pool.map(beside_batch, CASES))
    head = [
        "poles",
        "recursive / batch, over the parameters",
        *(f"refined in {pieces} pieces / batch" for pieces in PIECES),
        "truth inside",
        "batch s, ended by",
        "refinement s",
    ]
    text = section("Width beside batch intervals, output error, N = 400", head, rows, began)
    return f"{text}\n\n{linear_widths()}"


def linear_widths() -> str:
    """Return the widths for equation errors, beside linear programs over all samples, an ellipsoid and a zonotope."""
    began = time.perf_counter()
    rows = []
    for na, nb in ((1, 0), (2, 1), (3, 2)):
        a = np.poly([0.8, 0.5, -0.3][:na])[1:]
        case = plant_record(a, np.array([1.0, 0.5, 0.2])[: nb + 1], 2000, error="equation")
        estimator = case.estimator()
        lower, upper = estimator.lower, estimator.upper
        rivals = (Ellipsoid(lower, upper), Zonotope(lower, upper))
        matrix, y = case.arx.matrix(case.u, case.y), case.y[case.arx.max_lag :]
        for row, value in zip(matrix, y.tolist(), strict=True):
            for rival in rivals:
                rival.update(row, value, case.noise_bound)
        for sample in zip(case.u.tolist(), case.y.tolist(), strict=True):
            estimator.update(*sample)
        system = np.concatenate([matrix, -matrix]), np.concatenate([y, -y]) + case.noise_bound
        box = list(zip(lower, upper, strict=True))
        axes = np.eye(len(lower))
        exact = np.array([[-linprog(-s * c, *system, bounds=box).fun for s in (1, -1)] for c in axes]).sum(axis=1)
        ratios = [(s.upper - s.lower) / exact for s in (estimator, *rivals)]
        rows.append([str(len(lower)), f"{exact[0]:.2g}", *(f"{r.min():.4g} to {r.max():.4g}" for r in ratios)])
    head = ["parameters", "exact width of a1", "smid / exact", "ellipsoid / exact", "zonotope / exact"]
    return section("Width beside linear programs over all samples, equation error, N = 2000", head, rows, began)


def window() -> str:
    """Return the intervals over a sliding window."""
    began = time.perf_counter()
    rows = []
    for title, a, b in PLANTS:
        case = plant_record(a, b, 300)
        model = OutputError(case.arx.na, case.arx.nb, stable=True, bounds=case.bounds)
        estimator = SlidingWindow(model, case.noise_bound, window=100, every=50)
        recursive, inside, spent = case.estimator(), True, 0.0
        for sample in zip(case.u.tolist(), case.y.tolist(), strict=True):
            before = time.perf_counter()
            estimator.update(*sample)
            spent += time.perf_counter() - before
            recursive.update(*sample)
            inside &= all(i.lower <= t <= i.upper for i, t in zip(estimator.intervals, case.truth, strict=True))
        ours = recursive.upper - recursive.lower
        widths = [i.width for i in estimator.intervals]
        rows.append(
            [
                title,
                " ".join(f"{w:.2g}" for w in widths),
                " ".join(f"{w:.2g}" for w in ours),
                "yes" if inside else "no",
                f"{spent / 5:.2f}",
            ]
        )
    head = ["poles", "window of 100, widths", "recursive set of all 300, widths", "truth inside", "s for each window"]
    return section("Sliding window, every 50 samples", head, rows, began)


def clutch() -> str:
    """Return what the sets say on records of the clutch."""
    began = time.perf_counter()
    rows = []
    arx = Arx(powers=(5, 4, 3), input_scale=0.01)
    for name in ("hammerstein_20C_ramp_a", "hammerstein_20C_ramp_b", "varying_pole_20C_steps"):
        data = load_clutch(name)
        run = data.experiments[0].values
        estimator = RecursiveSet(arx, 0.3, {name: (-1.0, 1.0) for name in arx.names[1:]})
        for sample in zip(run[data.inputs[0]].tolist(), run[data.outputs[0]].tolist(), strict=True):
            estimator.update(*sample)
        changes = estimator.history.changes
        rows.append(
            [
                name,
                str(data.n_samples),
                "" if changes else f"[{estimator.lower[0]:.5f}, {estimator.upper[0]:.5f}]",
                str(len(changes)),
                str(changes[0]) if changes else "",
            ]
        )
    head = ["record", "samples", "alpha", "empty sets", "the first"]
    return section("Clutch, Hammerstein model of powers 5, 4, 3, noise bound 0.3 bar", head, rows, began)


def section(title: str, head: Sequence[str], rows: Sequence[Sequence[str]], began: float) -> str:
    lines = [" | ".join(row) for row in (head, ["---"] * len(head), *rows)]
    table = "\n".join(f"| {line} |" for line in lines)
    return f"## {title}\n\n{table}\n\n{time.perf_counter() - began:.0f} s."


SECTIONS = {
    "truth": truth,
    "time": timing,
    "drift": drift,
    "changes": changes,
    "widths": widths,
    "window": window,
    "clutch": clutch,
}


def main(names: Sequence[str]) -> None:
    """Print the sections asked for, as they come."""
    unknown = [name for name in names if name not in SECTIONS]
    if unknown:
        raise SystemExit(f"no section {unknown[0]!r}: choose from {', '.join(SECTIONS)}")
    for name in names or SECTIONS:
        print(SECTIONS[name](), end="\n\n", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
