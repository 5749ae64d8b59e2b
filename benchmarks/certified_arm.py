"""Certified intervals of the arm over seeded noisy records: is the truth inside, and what does each input tell.

    python -m benchmarks.certified_arm --seeds 13
    python -m benchmarks.certified_arm --seeds 0 --optimised 0 --certificate six_unequal

For each row of table F.1, the tailored signal, and (--optimised) the one whose intervals are the narrowest: how often
the thesis's arm lies inside all four intervals, and their median relative widths.  The intervals are those of
`identify` from the prior `PRIOR`, without a starting value.  The motion is exact (`exact_motion`), 12 s sampled every
0.02 s, the noise uniform within the bound.

With --certificate the first record of an input is proven with and without a file, and the file is checked.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.check import main as check
from smid import Dataset
from smid.design import shrinking_input
from smid.display.table import Table
from smid.identification.estimate import ParameterInterval
from smid.theses.hybrid.arm.exact_motion import ARM, exact_motion
from smid.theses.hybrid.arm.proven import CONSTANTS, PRIOR, is_told, prove_arm
from smid.theses.hybrid.inputs import arm_inputs, arm_tailored, arm_widths
from smid.theses.hybrid.inputs.input_study import NARROW, SAMPLES, SAMPLING_TIME, TAILORED

SECONDS = 120.0
SHORT = ("1/J", "b", "Wd", "Ws")

Found = tuple[dict[str, ParameterInterval], float]


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


def certified(u: Array, noise_bound: float, seed: int) -> Found:
    """Return the intervals from one record, and the processor time."""
    began = time.process_time()
    found = prove_arm(record(u, noise_bound, seed), noise_bound, seconds=SECONDS)
    return {name: found[name] for name in CONSTANTS}, time.process_time() - began


def row(name: str, found: list[Found]) -> tuple[str, ...]:
    arms = [arm for arm, _ in found]
    inside = sum(all(own.lower <= ARM[k] <= own.upper for k, own in arm.items()) for arm in arms)
    widths = [f"{np.median([arm[k].width_percent for arm in arms]):.3g}%" for k in CONSTANTS]
    lowest, highest = min(arm["Ws"].lower for arm in arms), max(arm["Ws"].upper for arm in arms)
    return (
        name,
        f"{inside} of {len(arms)}",
        *widths,
        f"[{lowest:.3g}, {highest:.3g}]",
        f"{sum(is_told(arm['Ws']) for arm in arms)} of {len(arms)}",
        f"{np.median([seconds for _, seconds in found]):.1f}",
    )


def beside_its_certificate(u: Array, noise_bound: float) -> Iterator[tuple[str, ...]]:
    """Yield the widths from the first record without and with a certificate, and what the file costs."""
    data = record(u, noise_bound, 0)
    with TemporaryDirectory() as folder:
        file = Path(folder, "arm.json")
        for name, certificate in (("without", None), ("with", file)):
            began = time.process_time()
            found = prove_arm(data, noise_bound, seconds=SECONDS, certificate=certificate)
            proven = time.process_time() - began
            cost = [f"{proven:.0f}", "", ""]
            if certificate:
                began = time.process_time()
                if check([str(file)]):
                    raise RuntimeError("the certificate is not accepted")
                cost[1:] = f"{time.process_time() - began:.0f}", f"{file.stat().st_size / 1e3:.0f}"
            inside = all(found[k].lower <= ARM[k] <= found[k].upper for k in CONSTANTS)
            yield (name, str(inside), *(f"{found[k].width_percent:.3g}%" for k in CONSTANTS), *cost)


def results(
    pool: Executor, signals: dict[str, Array], noise_bound: float, seeds: int
) -> Iterator[tuple[str, list[Found]]]:
    for name, u in signals.items():
        run: Callable[[int], Found] = partial(certified, u, noise_bound)
        yield name, list(pool.map(run, range(seeds)))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=13)
    parser.add_argument("--samples", type=int, default=SAMPLES)
    parser.add_argument("--noise", type=float, default=0.002, help="Bound in rad; 0.002 is an encoder of 1571 lines.")
    parser.add_argument(
        "--optimised", type=int, default=24, metavar="BUDGET", help="Inputs to look at; 0 leaves it out."
    )
    parser.add_argument("--certificate", metavar="INPUT", help="The input whose first record is proven with a file.")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    started = time.perf_counter()
    print(f"prior: {dict(PRIOR)}; |noise| <= {options.noise:g} rad; {options.samples} samples")
    signals = inputs(options.samples, options.noise, options.optimised)
    if options.certificate and options.certificate not in signals:
        parser.error(f"--certificate is one of {', '.join(signals)}")
    if options.seeds:
        rows = []
        with ProcessPoolExecutor(options.workers) as pool:
            for name, found in results(pool, signals, options.noise, options.seeds):
                rows.append(row(name, found))
                print("  ".join(rows[-1]), flush=True)
        header = ("input", "truth inside", *SHORT, "range of Ws [Nm]", "Ws told", "median s")
        print()
        print(Table("Relative widths of certified intervals (medians)", header, tuple(rows), "lrrrrrrrr"))
    if options.certificate:
        header = ("certificate", "truth inside", *SHORT, "s", "s to check", "kB")
        proofs = tuple(beside_its_certificate(signals[options.certificate], options.noise))
        print(Table(f"Relative widths of certified intervals, {options.certificate}", header, proofs, "llrrrrrrr"))
    print(f"{time.perf_counter() - started:.0f} s in all")


if __name__ == "__main__":
    main()
