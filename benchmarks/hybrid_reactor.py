"""Hybrid models of the reactor: tables 5 and 6, the time constant, and a record that others simulated.

    python -m benchmarks.hybrid_reactor [--record cstr.dat] [--starts 3] [--iterations 300]

Without a record only the simulated plants of the thesis are done.  The record is DaISy's 98-002, a cooled reactor; it
does not come with the project.  Its models are estimated on the first samples and run freely over the rest:

- first principles with a constant reaction rate, which is estimated; and with Arrhenius's law, which is given
- series and parallel: a network after or beside the concentration of the former
- embedded: a network of the temperature in place of the rate
- linear: output error of order three with an offset, from six starts
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from relaxations.algebra.arrays import Array
from smid import Dataset, OutputError
from smid.display.table import Table, figure
from smid.fitting.binding import bind
from smid.fitting.fit import fit
from smid.fitting.problem import Fit
from smid.hybrid import BackCouplings, HybridEstimate, embedded, estimate, network_of, parallel, series
from smid.models import Model, signal, t
from smid.theses.hybrid.cooled_reactor import arrhenius, cooled_reactor
from smid.theses.hybrid.reactor import other_conditions, output_errors, requirement_study, time_constant_study

SAMPLING_TIME = 6.0  # s
TRAINED = 1500  # samples
CENTRE, HALF_RANGE = 440.0, 10.0  # K: what brings the temperature near [-1, 1]


def load(path: str) -> Dataset:
    """Read DaISy's columns: time in minutes, coolant flow, concentration, temperature."""
    columns = np.loadtxt(path)
    return Dataset.from_arrays(
        input={"q": columns[:, 1]},
        output={"Ca": columns[:, 2], "T": columns[:, 3]},
        sampling_time=SAMPLING_TIME,
        units={"q": "l/min", "Ca": "mol/l", "T": "K"},
    )


def compare(data: Dataset, iterations: int, say: Callable[[str], None]) -> str:
    """Return the table of held-out errors, and what the embedded network learned of the rate."""
    used = [np.arange(run.n_samples) < TRAINED for run in data.experiments]
    rows = []

    def score(name: str, run: Callable[[], Fit]) -> Fit:
        say(name)
        started = time.perf_counter()
        found = run()
        seconds = time.perf_counter() - started
        errors = [
            figure(float(np.sqrt(np.mean(found.residual(data, channel)[0][TRAINED:] ** 2))))
            if channel in found.simulated[0]
            else "-"
            for channel in ("Ca", "T")
        ]
        rows.append((name, f"{found.n_free}", *errors, f"{seconds:.1f}"))
        return found

    white = bind(cooled_reactor(known_rate=False), data)
    constant = score("first principles, constant rate", lambda: fit(white, data, used))
    rate = constant.model.values["r"]
    white = white.bound(r=(rate, rate))
    score("first principles, Arrhenius's law", lambda: fit(bind(cooled_reactor(known_rate=True), data), data, used))
    score("linear", lambda: fit(bind(OutputError(3, 2, offset=True), _single(data)), _single(data), used))
    for join in (series, parallel):
        hybrid = join(white, BackCouplings(2, 2), (4,), output="Ca")
        score(
            hybrid.topology,
            lambda hybrid=hybrid: estimate(hybrid, data, used, starts=2, iterations=iterations, seed=1).fit,
        )
    found = []

    def embed() -> Fit:
        found.append(estimate(_embedded(white), data, used, starts=2, iterations=iterations, seed=1))
        return found[0].fit

    score("embedded", embed)
    table = Table(
        f"Free run over the {data.n_samples - TRAINED} samples after the {TRAINED} that were fitted.",
        ("model", "numbers fitted", "RMSE Ca in mol/l", "RMSE T in K", "s"),
        tuple(rows),
        "lrrrr",
    )
    return f"{table}\n\n{_learned(found[0], rate, data.values('T'))}"


def _single(data: Dataset) -> Dataset:
    return Dataset.from_arrays(
        input={"q": data.values("q")}, output={"Ca": data.values("Ca")}, sampling_time=data.sampling_time
    )


def _embedded(white: Model) -> object:
    c, temperature = signal("c")[t], signal("theta")[t]
    factors = {"c": -c, "theta": white.parameter("h").symbol * c}
    return embedded(white, factors, [(temperature - CENTRE) / HALF_RANGE], (2,))


def _learned(found: HybridEstimate, rate: float, temperature: Array) -> str:
    network = network_of(found.model, found.hybrid.term)
    visited = np.linspace(temperature.min(), temperature.max(), 50)
    learned = rate + network((visited[:, None] - CENTRE) / HALF_RANGE)
    true = np.array([float(arrhenius(value)) for value in visited])
    largest = 100 * float(np.max(np.abs(learned / true - 1.0)))
    return (
        f"The embedded network's rate differs from Arrhenius's law by at most {largest:.2g} % "
        f"from {visited[0]:.0f} to {visited[-1]:.0f} K."
    )


def main() -> None:
    """Print each part as it comes."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--record", type=Path, help="DaISy's cstr.dat")
    parser.add_argument("--starts", type=int, default=3)
    parser.add_argument("--iterations", type=int, default=300)
    asked = parser.parse_args()

    def say(line: str) -> None:
        print(line, file=sys.stderr, flush=True)

    effort = {"starts": asked.starts, "iterations": asked.iterations}
    for study in (output_errors, other_conditions, requirement_study, time_constant_study):
        started = time.perf_counter()
        print(f"{study(**effort, progress=say)}\n{time.perf_counter() - started:.0f} s\n", flush=True)
    if asked.record is not None:
        if not asked.record.is_file():
            raise SystemExit(f"{asked.record} is no file: give DaISy's cstr.dat (98-002)")
        print(compare(load(str(asked.record)), asked.iterations, say))


if __name__ == "__main__":
    main()
