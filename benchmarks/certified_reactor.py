"""Certified intervals of the reactor over seeded noisy records, for the plants of table 2 that its law can name.

They hold for the solutions of the differential equation, from the prior of `Reactor`. Seconds are of the processor.

    python -m benchmarks.certified_reactor --seeds 100
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from relaxations.algebra.arrays import Array
from smid import Dataset, identify
from smid.display.table import Table
from smid.models import Reactor
from smid.signals import noisy_staircase, prbs, qprts, sine
from smid.theses.hybrid import MISMATCHES, simulate_reactor

PLANTS = ("time_constant", "factor", "power")
NOISE_BOUND, TOLERANCE = 0.005, 0.2
STEPS = 20  # between two samples


def inputs(n: int) -> dict[str, Array]:
    """Give the thesis's signals around 0.5, none below 0.1."""
    return {
        "sine": sine(n, amplitude=0.4, offset=0.5),
        "noisy staircase": noisy_staircase(n, seed=1, amplitude=0.35, offset=0.5, noise_amplitude=0.05),
        "PRBS": prbs(n, seed=1, amplitude=0.4, offset=0.5, clock_period=4.0),
        "QPRTS": qprts(n, seed=1),
    }


def row(plant: str, name: str, u: Array, seeds: int) -> tuple[str, ...]:
    mismatch = MISMATCHES[plant]
    # A linear rate is integrated exactly, whatever the step is.
    model = Reactor(None, None, mismatch.x, scheme="enclosed", substeps=1 if mismatch.x == 1 else STEPS)
    clean = simulate_reactor(plant, u, 1.0)
    truths, inside, widths, seconds = (mismatch.tau, mismatch.a), 0, [], []
    for seed in range(seeds):
        noise = np.random.default_rng(seed).uniform(-NOISE_BOUND, NOISE_BOUND, len(u))
        data = Dataset.from_arrays(input=u, output=clean + noise, sampling_time=1.0)
        began = time.process_time()
        found = identify(model, data, NOISE_BOUND, tolerance=TOLERANCE)
        seconds.append(time.process_time() - began)
        ends = {name: found[name] for name in ("tau", "a")}
        inside += all(end.lower <= truth <= end.upper for end, truth in zip(ends.values(), truths, strict=True))
        widths.append([end.width / truth for end, truth in zip(ends.values(), truths, strict=True)])
    shares = [f"{100 * w:.3g}%" for w in np.median(widths, axis=0)]
    return plant, name, f"{inside} of {seeds}", *shares, f"{np.median(seconds):.1f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--samples", type=int, default=200)
    options = parser.parse_args()
    started = time.perf_counter()
    rows = []
    for plant in PLANTS:
        for name, u in inputs(options.samples).items():
            rows.append(row(plant, name, u, options.seeds))
            print("  ".join(rows[-1]), flush=True)
    print()
    header = ("plant", "input", "truth inside", "tau", "a", "median s")
    print(Table(f"Relative widths (medians), |noise| <= {NOISE_BOUND:g}", header, tuple(rows), "llrrrr"))
    print(f"{time.perf_counter() - started:.0f} s in all")


if __name__ == "__main__":
    main()
