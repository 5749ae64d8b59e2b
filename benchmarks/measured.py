"""Measured records: certified intervals, and how well the central model runs freely over the half that was held out.

    python -m benchmarks.measured FOLDER

FOLDER holds the records, one folder each; they do not come with the project. Every record goes the same way, with the
same grid of structures:

1. The structure with the least noise bound on the identification samples is taken, among those with a certified one.
2. ``identify`` at 1.1 times the upper end of that bound.
3. The central model runs freely over the other half of the record. Beside it run the minimax fit, which is the witness
   of the least bound, and a least-squares fit of the same structure that begins there.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from relaxations.search.enclosure import Proof
from smid import (
    Dataset,
    ErrorBound,
    Estimate,
    Hammerstein,
    Model,
    ModelError,
    OutputError,
    error_bound,
    identify,
    validate,
)
from smid.models.simulate import simulate

SAMPLES = 200  # at most so many for identification
INFLATION = 1.1
TOLERANCE = 0.02  # of the least bound, for the choice of a structure, and of an interval's width

LINEAR = [
    (f"OE na {na}, nb {nb}, delay {delay}", OutputError(na, nb, delay, offset=True, stable=True))
    for (na, nb), delay in product([(1, 0), (1, 1), (2, 0), (2, 1)], [1, 2, 3])
]
STATIC_CURVE = [
    (f"Hammerstein poles {poles}, delay {delay}", Hammerstein(poles, (3, 2, 1, 0), delay=delay, stable=True))
    for poles, delay in product([1, 2], [1, 2, 3])
]
HEADER = (
    "record",
    "structure",
    "N",
    "least noise bound",
    "largest |y - mean|",
    "widest",
    "ends",
    "gap",
    "fit %: central",
    "minimax",
    "least squares",
    "bound s",
    "identify s",
)


@dataclass(frozen=True)
class Record:
    """A record on disk: its two columns, and how much of it is used.

    Parameters
    ----------
    name, file : str
    columns : tuple of int
        Input and output.
    sampling_time : float
        In seconds.
    delimiter : str or None
    header : int
        Lines to skip.
    every : int
        Every so many samples are kept, where the sampling is far faster than the process.
    """

    name: str
    file: str
    columns: tuple[int, int]
    sampling_time: float
    delimiter: str | None = None
    header: int = 0
    every: int = 1

    def load(self, folder: Path) -> Dataset:
        """Read the record; nothing is centred or scaled."""
        table = np.loadtxt(folder / self.file, delimiter=self.delimiter, skiprows=self.header, usecols=self.columns)
        data = Dataset.from_arrays(
            input={"u": table[:, 0]}, output={"y": table[:, 1]}, sampling_time=self.sampling_time, name=self.name
        )
        return data if self.every == 1 else data.decimate(self.every, antialias=False)


HAIR_DRYER = Record("hair dryer", "daisy_hairdryer/dryer.dat", (0, 1), 0.08)
ACTUATOR = Record("hydraulic actuator", "hydraulic_actuator/actuator.csv", (0, 1), 0.05, ",", 1)
RECORDS = (
    (HAIR_DRYER, LINEAR),
    (Record("gas furnace", "box_jenkins_gas_furnace/gas_furnace.csv", (0, 1), 9.0, ",", 1), LINEAR),
    (ACTUATOR, LINEAR),
    (ACTUATOR, STATIC_CURVE),
    (Record("CSTR", "daisy_cstr/cstr.dat", (1, 2), 6.0, every=3), LINEAR),
)


@dataclass(frozen=True)
class CaseResult:
    """What was found on one record, and the fits on its held-out half, in percent."""

    record: str
    structure: str
    data: Dataset
    bound: ErrorBound
    estimate: Estimate
    fits: tuple[float, float, float]
    bound_seconds: float
    identify_seconds: float

    def row(self) -> tuple[str, ...]:
        """Return the cells of the table."""
        intervals = self.estimate.intervals
        y = self.data.stacked("y")
        proven = sum(p is Proof.PROVEN for i in intervals for p in (i.proof_lower, i.proof_upper))
        widest = max(intervals, key=lambda i: i.width / max(abs(i.centre), 1e-300))
        gap = max(i.gap / i.width if i.width > 0 else 0.0 for i in intervals)
        return (
            self.record,
            self.structure,
            str(self.data.n_samples),
            self.bound.enclosure,
            f"{np.abs(y - y.mean()).max():.4g}",
            f"{widest.name} [{widest.lower:.4g}, {widest.upper:.4g}]",
            f"{proven} of {2 * len(intervals)} proven",
            f"{gap:.1%}",
            *(f"{fit:.1f}" for fit in self.fits),
            f"{self.bound_seconds:.0f}",
            f"{self.identify_seconds:.0f}",
        )


def held_out_fit(model: Model, data: Dataset) -> float:
    """Return the fit of a free run, in percent."""
    return validate(model, data).scores[0].fit_percent


def least_squares_fit(model: Model, data: Dataset, start: dict[str, float]) -> Model:
    """Fit the free run by least squares, from a first guess."""
    names = [p.name for p in model.parameters]
    values = data.experiments[0].values
    signal = model.measurements[0].signal

    def residual(theta: np.ndarray) -> np.ndarray:
        parameters = dict(zip(names, theta.tolist(), strict=True))
        run = simulate(model, values, parameters, {signal: values["y"]}, check=False)["y"]
        return np.nan_to_num((values["y"] - run)[model.max_lag :], nan=1e6, posinf=1e6, neginf=-1e6).clip(-1e6, 1e6)

    fit = least_squares(residual, [start[n] for n in names], x_scale="jac", max_nfev=100)
    return model.with_values(dict(zip(names, fit.x.tolist(), strict=True)))


def choose(
    grid: list[tuple[str, Model]], data: Dataset, say: Callable[[str], None] | None = None
) -> tuple[str, Model, ErrorBound]:
    """Return the structure with the least noise bound."""
    found = []
    for name, model in grid:
        try:
            bound = error_bound(model, data, order=1, tolerance=TOLERANCE, rounds=4, nodes=0)
        except ModelError as error:
            print(f"    {name}: left out, {error}", flush=True)
            continue
        if bound.lower <= 0:  # no box could be proven for its parameters, so it would get no intervals either
            print(f"    {name}: left out, nothing certified about {bound.enclosure}", flush=True)
            continue
        found.append((name, model, bound))
        if say:
            say(f"    {name}: {bound.enclosure} in {bound.seconds:.1f} s")
    return min(found, key=lambda item: item[2].upper)


def run(
    record: Record,
    grid: list[tuple[str, Model]],
    folder: Path,
    samples: int = SAMPLES,
    say: Callable[[str], None] | None = None,
) -> CaseResult:
    """Choose, identify and validate on one record."""
    identification, held_out = record.load(folder).split(0.5)
    identification = identification.crop(0, samples)
    started = time.perf_counter()
    structure, model, bound = choose(grid, identification, say)
    chosen = time.perf_counter()
    estimate = identify(model, identification, INFLATION * bound.upper, tolerance=TOLERANCE, rounds=6)
    identified = time.perf_counter()
    minimax = model.with_values(bound.parameters)
    rival = least_squares_fit(model, identification, dict(bound.parameters))
    fits = (
        held_out_fit(estimate.model, held_out),
        held_out_fit(minimax, held_out),
        held_out_fit(rival, held_out),
    )
    return CaseResult(
        record.name, structure, identification, bound, estimate, fits, chosen - started, identified - chosen
    )


def table(rows: list[tuple[str, ...]]) -> str:
    """Return rows as aligned text, the header first."""
    cells = [HEADER, *rows]
    widths = [max(len(row[k]) for row in cells) for k in range(len(HEADER))]
    return "\n".join("  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip() for row in cells)


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.measured", description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="folder of the measured records")
    parser.add_argument("--samples", type=int, default=SAMPLES, help="identification samples, at most")
    arguments = parser.parse_args()
    started = time.perf_counter()
    rows = []
    for record, grid in RECORDS:
        if not (arguments.folder / record.file).is_file():
            print(f"{record.name}: skipped, {record.file} is not in the folder")
            continue
        print(f"{record.name}:", flush=True)
        result = run(record, grid, arguments.folder, arguments.samples, lambda line: print(line, flush=True))
        print(result.estimate, flush=True)
        rows.append(result.row())
        print("  ".join(rows[-1]), flush=True)
    print(f"\n{table(rows)}\n\n{time.perf_counter() - started:.0f} s in all")


if __name__ == "__main__":
    main()
