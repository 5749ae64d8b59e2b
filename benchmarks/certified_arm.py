"""Certified intervals of the arm over seeded noisy records: is the truth inside, and what does each input tell.

    python -m benchmarks.certified_arm --seeds 100
    python -m benchmarks.certified_arm --identify six_unequal     (one record by `identify`, for comparison)

For each row of table F.1, the tailored signal, and (--optimised) the one whose intervals are the narrowest: how often
the thesis's arm lies inside all four intervals, and their median relative widths.  The prior is `PRIOR`, no starting
value.  The motion is exact (`exact_motion`), 12 s sampled every 0.02 s, the noise uniform within the bound.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, ProcessPoolExecutor
from functools import partial

import numpy as np

from relaxations.algebra.arrays import Array
from smid import Dataset, identify
from smid.design import shrinking_input
from smid.display.table import Table
from smid.models import RotatingArm
from smid.theses.hybrid.arm.exact_motion import ARM, exact_motion
from smid.theses.hybrid.certified import PRIOR, CertifiedArm, certify_arm
from smid.theses.hybrid.certified.box import CONSTANTS
from smid.theses.hybrid.inputs import arm_inputs, arm_tailored, arm_widths
from smid.theses.hybrid.inputs.input_study import NARROW, SAMPLES, SAMPLING_TIME, TAILORED

# Of the general method: steps between two samples, and what is known of the speed beforehand, in rad/s.
STEPS, FASTEST, TOLERANCE, SECONDS = 2, 100.0, 0.5, 120.0
STICKING = {"Ws": (0.4, 10.0)}


def inputs(samples: int, noise_bound: float, budget: int) -> dict[str, Array]:
    found = arm_inputs(samples)
    if budget:
        family = arm_tailored(samples, SAMPLING_TIME)
        widths = partial(
            arm_widths, sampling_time=SAMPLING_TIME, noise_bound=noise_bound, seed=10_000, prior=dict(NARROW)
        )
        best = shrinking_input(family, widths, budget=budget, starts=[TAILORED])
        print(best, end="\n\n", flush=True)
        found["optimised"] = best.input
    return found


def record(u: Array, noise_bound: float, seed: int) -> Dataset:
    angle = exact_motion(u, SAMPLING_TIME)[:, 0]
    noise = np.random.default_rng(seed).uniform(-noise_bound, noise_bound, len(u))
    return Dataset.from_arrays(input=u, output=angle + noise, sampling_time=SAMPLING_TIME)


def certified(u: Array, noise_bound: float, seed: int) -> CertifiedArm:
    return certify_arm(record(u, noise_bound, seed), noise_bound)


def by_identify(u: Array, noise_bound: float, prior: Mapping[str, tuple[float, float]]) -> str:
    """Return the intervals of the differential equation that the general method proves of the first record."""
    model = RotatingArm(None, friction=True, drag=True, scheme="enclosed", substeps=STEPS)
    began = time.process_time()
    found = identify(
        model.bound(**prior, speed=(-FASTEST, FASTEST)),
        record(u, noise_bound, 0),
        noise_bound,
        tolerance=TOLERANCE,
        seconds=SECONDS,
    )
    ends = ", ".join(f"{name} {found[name].lower:.6g} to {found[name].upper:.6g}" for name in CONSTANTS)
    return f"prior {dict(prior)}: {ends} ({time.process_time() - began:.0f} s of the processor)"


def row(name: str, found: list[CertifiedArm]) -> tuple[str, ...]:
    inside = sum(f.holds(ARM) for f in found)
    widths = [f"{100 * np.median([f.relative_width(k) for f in found]):.3g}%" for k in CONSTANTS]
    lowest = min(f.intervals["Ws"][0] for f in found)
    highest = max(f.intervals["Ws"][1] for f in found)
    told = sum(f.determined("Ws") for f in found)
    return (
        name,
        f"{inside} of {len(found)}",
        *widths,
        f"[{lowest:.3g}, {highest:.3g}]",
        f"{told} of {len(found)}",
        f"{np.median([f.seconds for f in found]):.1f}",
    )


def results(
    pool: Executor, signals: dict[str, Array], noise_bound: float, seeds: int
) -> Iterator[tuple[str, list[CertifiedArm]]]:
    for name, u in signals.items():
        run: Callable[[int], CertifiedArm] = partial(certified, u, noise_bound)
        yield name, list(pool.map(run, range(seeds)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--samples", type=int, default=SAMPLES)
    parser.add_argument("--noise", type=float, default=0.002, help="Bound in rad; 0.002 is an encoder of 1571 lines.")
    parser.add_argument(
        "--optimised", type=int, default=24, metavar="BUDGET", help="Inputs to look at; 0 leaves it out."
    )
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--identify", metavar="INPUT", choices=arm_inputs(SAMPLES), help="One record by `identify`.")
    options = parser.parse_args()
    if options.identify:
        for prior in (NARROW | STICKING, PRIOR | STICKING):
            print(by_identify(arm_inputs(options.samples)[options.identify], options.noise, prior), flush=True)
        return
    started = time.perf_counter()
    print(f"prior: {dict(PRIOR)}; |noise| <= {options.noise:g} rad; {options.samples} samples")
    signals = inputs(options.samples, options.noise, options.optimised)
    rows = []
    with ProcessPoolExecutor(options.workers) as pool:
        for name, found in results(pool, signals, options.noise, options.seeds):
            rows.append(row(name, found))
            print("  ".join(rows[-1]), flush=True)
    header = ("input", "truth inside", "1/J", "b", "Wd", "Ws", "range of Ws [Nm]", "Ws told", "median s")
    print()
    print(Table("Relative widths of certified intervals (medians)", header, tuple(rows), "lrrrrrrrr"))
    print(f"{time.perf_counter() - started:.0f} s in all")


if __name__ == "__main__":
    main()
