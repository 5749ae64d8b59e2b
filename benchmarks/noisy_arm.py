"""Good, moderate and bad runs of the embedded arm from noisy records, by where they start.

    python -m benchmarks.noisy_arm [--cache FILE] [--workers 1]

The records are of six_unequal, with seeds that chose no setting. The validation records have no noise. Every result is
kept at once, and a further run leaves out what is there.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.resumable import kept, run
from smid.display.table import Table
from smid.theses.hybrid.arm import WAYS, run_embedded

RECORDS, STARTS, FRESH = 3, 4, 1000  # seeds that chose no setting
NOISE: dict[str, tuple[float, float, tuple[str, ...]]] = {
    "2 mrad, 10 s": (0.002, 10.0, ("global", "multistart", "white", "certified")),
    "1 % of the span, 10 s": (2.39, 10.0, ("global", "multistart", "white", "certified")),
    "1 % of the span, 60 s": (2.39, 60.0, ("global", "multistart", "white")),
}
"""Noise bound in rad, duration in seconds, and ways; to prove intervals from 60 s takes more than five minutes."""


@dataclass(frozen=True)
class NoisyRuns:
    """One way from one record: counts, 1/J and errors as shares of the span, of each start and of the white model."""

    label: str
    way: str
    record: int
    counts: list[int]
    theta: list[float]
    validation: list[list[float]]
    white: list[float]


def noisy(label: str, way: str, record: int) -> NoisyRuns:
    """Estimate the embedded arm from all starts of one record."""
    bound, duration, _ = NOISE[label]
    seeds = range(FRESH + STARTS * record, FRESH + STARTS * (record + 1))
    made = {"noise_bound": bound, "noise_seed": FRESH + record, "duration": duration}
    found = run_embedded("six_unequal", way, seeds, **made)
    return NoisyRuns(
        label, way, record, list(found.counts), found.theta.tolist(), found.validation.tolist(), found.white.tolist()
    )


def table(results: list[NoisyRuns]) -> Table:
    """Return a row for each record length, noise and start."""
    rows = []
    for label, way in ((label, way) for label, (*_, ways) in NOISE.items() for way in ways):
        runs = [one for one in results if (one.label, one.way) == (label, way)]
        if not runs:
            continue
        theta = np.concatenate([one.theta for one in runs])
        white = np.median([one.white for one in runs], axis=0)
        middle = np.median(np.concatenate([one.validation for one in runs]), axis=0)
        rows.append(
            (
                label,
                WAYS[way].label,
                "/".join(map(str, np.sum([one.counts for one in runs], axis=0))),
                *(f"{100 * share:.2g} %" for share in (*white, *middle)),
                " to ".join(f"{end:.2f}" for end in np.percentile(theta, [5, 95])),
            )
        )
    header = ("record", "start", "good/moderate/bad", "white, slower", "white, other", "slower", "other kind")
    header += ("1/J, 5 to 95 %",)
    return Table(
        f"six_unequal, {RECORDS} noisy records of {STARTS} starts each; medians of the free-run errors, of the span.",
        header,
        tuple(rows),
        "llrrrrrr",
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cache", type=Path, default=Path(".cache/noisy_arm.jsonl"))
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args()
    results = [NoisyRuns(**entry) for entry in kept(options.cache)]
    known = {(one.label, one.way, one.record) for one in results}
    asked = ((label, way, k) for k in range(RECORDS) for label, (*_, ways) in NOISE.items() for way in ways)
    cases = [case for case in asked if case not in known]
    for result in run(options.cache, noisy, cases, options.workers):
        results.append(result)
        print(f"{result.label}, {result.way}, record {result.record}: {result.counts}", file=sys.stderr, flush=True)
    print(table(results))


if __name__ == "__main__":
    main()
