"""Intervals of records with missing samples: is the truth inside, and what does a missing sample cost.

    python -m benchmarks.gaps --runs 250 --minutes 15
    python -m benchmarks.gaps --runs 250 --minutes 15 --channel input

Each run draws a record of an output-error model (pole, gain and input at random, uniform noise within its bound) and
takes away a tenth of its outputs or inputs, or 50 in a row. It is identified as it is (missing outputs are unknowns,
missing inputs split it), as the parts between the missing samples, as the longest part alone, and without any sample
missing. Printed are the runs whose intervals hold the truth and lie within those of the parts, and the medians of the
widths and times. One process, one core.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import DataError, Dataset
from smid.display.table import Table
from smid.identification.identify import identify
from smid.models import OutputError

SAMPLES = 100
GAP = 50
SHARE = 0.1
GAPS = (1e-7, 1e-3)  # an interval may be wider than another by so much of the value, and of the width
HEADER = (
    "missing",
    "runs",
    "truth inside",
    "within the parts",
    "within the longest",
    "narrower than the longest",
    "width : longest",
    "width : parts",
    "width : complete",
    "time : parts",
    "time : complete",
    "median s",
)


@dataclass(frozen=True)
class Found:
    """Ends of the intervals, shape (p, 2), and the time."""

    ends: Array
    seconds: float

    @property
    def widths(self) -> Array:
        """Return the widths of the intervals."""
        return self.ends[:, 1] - self.ends[:, 0]

    def within(self, other: Found) -> bool:
        """Return whether every interval lies within the other's, but for the gap that counts as tight."""
        slack = GAPS[0] * np.abs(other.ends).max() + GAPS[1] * other.widths
        return bool(
            (self.ends[:, 0] >= other.ends[:, 0] - slack).all() and (self.ends[:, 1] <= other.ends[:, 1] + slack).all()
        )


@dataclass(frozen=True)
class Run:
    """One record: the truth, and what was found in four ways; None where no part is left."""

    truth: Array
    gaps: Found
    complete: Found
    parts: Found | None
    longest: Found | None


def _found(data: Dataset, order: int, bound: float) -> Found:
    began = time.perf_counter()
    intervals = identify(OutputError(na=order, stable=True), data, bound).intervals
    seconds = time.perf_counter() - began
    return Found(np.array([(i.lower, i.upper) for i in intervals]), seconds)


def one(seed: int, order: int, channel: str, lost: Callable[[np.random.Generator], Array]) -> Run:
    """Return what was found on a record."""
    random = np.random.default_rng(seed)
    poles = random.uniform(0.3, 0.9, order)
    truth = np.array([*np.poly(poles)[1:], random.uniform(0.2, 2.0)])
    u = np.repeat(random.uniform(-1, 1, SAMPLES), random.integers(2, 6))[:SAMPLES]
    w = np.zeros(SAMPLES)
    for k in range(order, SAMPLES):
        w[k] = truth[-1] * u[k - 1] - truth[:-1] @ w[k - order : k][::-1]
    bound = 0.05 * float(np.abs(w).max())
    y = w + random.uniform(-bound, bound, SAMPLES)
    whole = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    measured = {"input": u.copy(), "output": y.copy()}
    measured[channel][lost(random)] = np.nan
    data = Dataset.from_arrays(input={"u": measured["input"]}, output={"y": measured["output"]}, sampling_time=1.0)
    try:
        parts = data.without_gaps()
        longest = parts.with_experiments([max(parts.experiments, key=lambda run: run.n_samples)])
        split, alone = _found(parts, order, bound), _found(longest, order, bound)
    except DataError:
        split = alone = None
    return Run(truth, _found(data, order, bound), _found(whole, order, bound), split, alone)


def row(name: str, runs: list[Run]) -> tuple[str, ...]:
    """Return the counts and medians of many runs."""
    pairs = [(r.gaps, r.parts, r.longest) for r in runs if r.parts is not None and r.longest is not None]
    inside = sum(bool(((r.gaps.ends[:, 0] <= r.truth) & (r.truth <= r.gaps.ends[:, 1])).all()) for r in runs)
    narrower = sum(bool((g.widths < longest.widths).all()) for g, _, longest in pairs)

    def ratio(one: list[Array]) -> str:
        return f"{np.median(np.concatenate(one)):.3f}" if one else "-"

    return (
        name,
        str(len(runs)),
        f"{inside} of {len(runs)}",
        f"{sum(g.within(parts) for g, parts, _ in pairs)} of {len(pairs)}",
        f"{sum(g.within(longest) for g, _, longest in pairs)} of {len(pairs)}",
        f"{narrower} of {len(pairs)}",
        ratio([g.widths / longest.widths for g, _, longest in pairs]),
        ratio([g.widths / parts.widths for g, parts, _ in pairs]),
        ratio([r.gaps.widths / r.complete.widths for r in runs]),
        ratio([np.array([g.seconds / parts.seconds]) for g, parts, _ in pairs]),
        ratio([np.array([r.gaps.seconds / r.complete.seconds]) for r in runs]),
        f"{np.median([r.gaps.seconds for r in runs]):.2f}",
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=250, help="Of each kind of missing samples.")
    parser.add_argument("--order", type=int, default=1)
    parser.add_argument("--channel", choices=("output", "input"), default="output", help="Where samples are missing.")
    parser.add_argument("--minutes", type=float, default=15.0, help="No run begins after so many.")
    options = parser.parse_args()
    kinds: dict[str, Callable[[np.random.Generator], Array]] = {
        "10 % at random": lambda random: random.choice(SAMPLES, round(SHARE * SAMPLES), replace=False),
        f"{GAP} in a row": lambda random: random.integers(12, SAMPLES - GAP - 12) + np.arange(GAP),
    }
    end = time.monotonic() + 60 * options.minutes
    found: dict[str, list[Run]] = {name: [] for name in kinds}
    for seed in range(options.runs):
        for name, lost in kinds.items():
            if time.monotonic() < end:
                found[name].append(one(seed, options.order, options.channel, lost))
    rows = tuple(row(name, runs) for name, runs in found.items() if runs)
    caption = f"Output error of order {options.order}, {SAMPLES} samples, missing {options.channel}s."
    print(Table(caption, HEADER, rows, "l" + "r" * 11))


if __name__ == "__main__":
    main()
