"""Diagnose measured records, and compare the extended models with published figures.

    python -m benchmarks.measured_diagnosis FOLDER [--output docs/measured.md] [--only RECORD ...]

FOLDER holds the records, one folder each; they are not part of the project. Every record is diagnosed in the same
way: a base model of low order, all effects of the library, no noise bound. The test part is the last 20 % of every
run, or the runs of the published split. No fit and no choice uses it; both models are simulated on it once, at the
end. Of a whole test run, the first 50 samples (or as many as the record gives) tell the initial states and do not
count.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from smid import Dataset, Model, OutputError
from smid.data import load_record
from smid.diagnosis import Diagnosis, diagnose
from smid.diagnosis.parts import free_run_of_new
from smid.diagnosis.search.compare import rms
from smid.fitting.binding import bind
from smid.models import Line, Measurement, Parameter, signal, t

START = 50  # samples of a test run that its initial states are fitted to
SERVO_RUNS = ("chirp_0", "prbs_31", "prbs_32", "triangle_64", "triangle_65", "square_76", "square_77", "ramp_52")


@dataclass(frozen=True, eq=False)
class Case:
    """A record and how it is diagnosed.

    Parameters
    ----------
    record : str
        Name of the set.
    load : callable (Dataset) -> Dataset
        Choice of runs and channels, and of the part that is used.
    how : str
        What `load` does, for the reader.
    model : Model
        The base model.
    base : str
        The base model in words.
    known : str
        What is known to be missing.
    share : float or tuple of str
        The test part: a share of every run, at its end, or runs.
    test : str
        The run whose test part is the published one, or a run that the diagnosis does not load at all.
    published : str
        Published figures on that test part.
    factor, unit : float, str
        From the record's unit to the unit of the published figures.
    """

    record: str
    load: Callable[[Dataset], Dataset]
    how: str
    model: Model
    base: str
    known: str
    share: float | tuple[str, ...] = 0.2
    test: str = ""
    published: str = ""
    factor: float = 1.0
    unit: str = ""


@dataclass(frozen=True, eq=False)
class CaseResult:
    """What was found on a record; the RMSEs on the test part in the unit of the published figures."""

    case: Case
    diagnosis: Diagnosis
    test: tuple[float, float] | None
    seconds: float


def two_tanks() -> Model:
    """Give two equal tanks in succession, each emptying in proportion to its level, and a sensor of unknown zero."""
    outflow, pump, zero = (
        Parameter("outflow", 1e-4, 0.2, "1/s"),
        Parameter("pump", 0, 1),
        Parameter("zero", -20, 20, "V"),
    )
    upper, level, u, seen = signal("upper"), signal("w"), signal("u"), signal("seen")
    k = outflow.symbol
    lines = (
        Line(upper[t], pump.symbol * u[t] - k * upper[t], rate=True),
        Line(level[t], k * upper[t] - k * level[t], rate=True),
        Line(seen[t], level[t] + zero.symbol),
    )
    return Model("two tanks", (outflow, pump, zero), lines, (Measurement("y", "seen", "eta"),), scheme="euler")


def newton() -> Model:
    """Give a mass and the force on it: ``M x'' = K u``."""
    gain = Parameter("gain", 0, 10)
    position, speed, u = signal("x"), signal("v"), signal("u")
    lines = (Line(position[t], speed[t], rate=True), Line(speed[t], gain.symbol * u[t], rate=True))
    return Model("Newton's law", (gain,), lines, (Measurement("y", "x", "eta"),))


def damper() -> Model:
    """Give a viscous damper with a preload: ``F = c v + F0``."""
    damping, preload = Parameter("c"), Parameter("preload")
    line = Line(signal("w")[t], damping.symbol * signal("velocity")[t] + preload.symbol)
    return Model("viscous damper", (damping, preload), (line,), (Measurement("force", "w", "eta"),))


def whole(data: Dataset) -> Dataset:
    """Take a record as it is."""
    return data


def without(data: Dataset, *drop: str) -> Dataset:
    """Leave channels out: the reference of a controller is no cause of what the plant does."""
    runs = tuple(
        replace(r, values={name: samples for name, samples in r.values.items() if name not in drop})
        for r in data.experiments
    )
    channels = tuple(c for c in data.channels if c.name not in drop)
    outputs = tuple(name for name in data.outputs if name not in drop)
    inputs = tuple(name for name in data.inputs if name not in drop)
    return replace(data, experiments=runs, channels=channels, inputs=inputs, outputs=outputs)


def cycles(data: Dataset) -> Dataset:
    """Cut the positioning record at the cycles of its reference, 6.224 s long."""
    run = without(data, "reference_position").experiments[0]
    parts = tuple(
        replace(run, name=f"cycle{k + 1}", values={n: x[6224 * k : 6224 * k + 6160] for n, x in run.values.items()})
        for k in range(4)
    )
    return without(data, "reference_position").with_experiments(parts)


SECOND = OutputError(2, 1, offset=True)
CASES = (
    Case(
        "ced_prbs",
        whole,
        "all three runs",
        OutputError(3, 2, offset=True),
        "linear, order 3",
        "the sensor does not see the sign of the speed",
        0.2,
        test="prbs1",
        published="constant 0.698, magnitude of a linear output 0.174",
        unit="ticks/s",
    ),
    Case(
        "emps",
        cycles,
        "the cycles of the reference as four runs, without the reference",
        newton(),
        "Newton's law",
        "Coulomb and viscous friction, force offset",
        ("cycle4",),
    ),
    Case(
        "cascaded_tanks",
        whole,
        "",
        two_tanks(),
        "two linear tanks in succession",
        "square-root outflow, overflow",
        ("validation",),
        test="validation",
        published="linear 0.588, polynomial NARX 0.413, SUBNET 0.37, grey box 0.191",
        unit="V",
    ),
    Case("daisy_hairdryer", whole, "", SECOND, "linear, order 2, delay 1", "delay"),
    Case("box_jenkins_gas_furnace", whole, "", SECOND, "linear, order 2, delay 1", "delay"),
    Case(
        "hydraulic_actuator",
        whole,
        "",
        SECOND,
        "linear, order 2",
        "valve dead zone, load dependence",
        0.5,
        test="experiment",
    ),
    Case(
        "quarter_drone",
        lambda data: without(data, "reference_angle").decimate(10, held=["thrust"]),
        "every 10th sample, without the reference",
        SECOND,
        "linear, order 2",
        "gravity, dead zone of the thrust",
    ),
    Case(
        "servo_rate_limit",
        lambda data: data.select(SERVO_RUNS),
        "eight of the hundred runs, of five kinds",
        OutputError(1, 0, offset=True),
        "linear, order 1",
        "delay, rate limit",
    ),
    Case(
        "mr_damper_labcontrol",
        lambda data: data.select(("A.1", "A.5", "A.10")).crop(0, 600),
        "three of the ten runs, 6 s each",
        damper(),
        "viscous damper with preload",
        "hysteresis against velocity",
    ),
    Case(
        "silverbox",
        lambda data: data.select("multisine"),
        "the multisine",
        SECOND,
        "linear, order 2",
        "hardening cubic spring",
        test="arrow",
        published="linear 14.4, polynomial NARX 2.25, SUBNET 1.4, GP-NARX 0.60",
        factor=1e3,
        unit="mV",
    ),
    Case(
        "daisy_cstr",
        lambda data: without(data, "temperature").crop(0, 4500).decimate(3, held=["coolant_flow"]),
        "the concentration only, the first 4500 samples, every third",
        SECOND,
        "linear, order 2",
        "gain and damping depend on the operating point",
    ),
    Case("daisy_heating_system", whole, "", SECOND, "linear, order 2", "left unnamed by its source"),
)


def tested(
    model: Model, simulated: tuple[NDArray[np.float64], ...], case: Case, found: Diagnosis, full: Dataset
) -> float:
    """Return the RMSE of a free run on the test part, in the unit of the published figures."""
    names = [r.name for r in found.data.experiments]
    if case.test in names and found.test[names.index(case.test)].any():
        e = names.index(case.test)
        held = found.test[e]
        error = (found.data.experiments[e].values[found.output] - simulated[e])[held]
        return rms([error]) * case.factor
    part = full.select(case.test)
    free = free_run_of_new(model, part, START)[found.output]
    error = part.experiments[0].values[found.output] - free
    return rms([error[part.n_init :]]) * case.factor


def run(case: Case, folder: Path) -> CaseResult:
    """Diagnose one record."""
    began = time.perf_counter()
    full = load_record(case.record, folder)
    data = case.load(full)
    found = diagnose(bind(case.model, data), data, test=case.share, workers=1)
    test = None
    if case.test:
        pairs = ((found.base, found.simulated), (found.model, found.extended))
        before, after = (tested(model, simulated, case, found, full) for model, simulated in pairs)
        test = (before, after)
    return CaseResult(case, found, test, time.perf_counter() - began)


HEAD = """# Diagnosis of measured records

This page shows which effects `smid.diagnose` names on public measured records, and the RMSE before and after.
`python -m benchmarks.measured_diagnosis FOLDER --output docs/measured.md` writes the page. The records are
not part of the project. {}

| record | known to be missing | named, in order | test RMSE: base | extended | s |
|---|---|---|---|---|---|
"""
TEST_HEAD = """
## Against published figures

Free-run RMSE on the published test part.

| record | linear model | extended model | published |
|---|---|---|---|
"""


def page(results: Sequence[CaseResult]) -> str:
    """Return the tables, and the sentences of each diagnosis, as Markdown."""
    about = " ".join((__doc__ or "").split("not part of the project. ", 1)[-1].split())
    lines = [HEAD.format(about).rstrip("\n")]
    for o in results:
        d = o.diagnosis
        names = ", ".join(f"`{c.effect}`" + (f" ({c.label})" if c.label else "") for c in d.causes) or "nothing"
        verdict = f" (ambiguous: {' or '.join(d.alternatives)})" if d.alternatives else ""
        after = f"{d.gain.rmse_after:.4g} {d.unit}".rstrip()
        cells = (o.case.record, o.case.known, names + verdict, f"{d.gain.rmse_before:.4g}", after, f"{o.seconds:.0f}")
        lines.append("| " + " | ".join(cells) + " |")
    lines.append(TEST_HEAD.rstrip("\n"))
    for o in results:
        if o.test is not None:
            before, after = (f"{value:.3g} {o.case.unit}".rstrip() for value in o.test)
            lines.append(f"| {o.case.record} | {before} | {after} | {o.case.published or '-'} |")
    lines.append(
        "\n## Sentences of the diagnosis\n\nThe percentage after a sentence is the probability of the cause.\n"
    )
    for o in results:
        d = o.diagnosis
        part = f" ({o.case.how})" if o.case.how else ""
        lines.append(f"**{o.case.record}**{part}; base: {o.case.base}. {d.conclusion}")
        lines += [f"- {c.sentence} ({c.confidence:.0%})" for c in d.causes]
        unexplained = "The remaining error is more than noise: no effect of the library explains it."
        left = unexplained if d.unexplained else "The remaining error is no more than noise."
        lines.append(f"- {left}\n")
    return "\n".join(lines).rstrip("\n") + "\n"


def main() -> None:
    """Print each record as it comes, and write the tables."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.measured_diagnosis", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("folder", type=Path, help="folder of the measured records")
    parser.add_argument("--output", type=Path, help="Markdown file to write")
    parser.add_argument("--only", nargs="+", metavar="RECORD", help="these records only")
    arguments = parser.parse_args()
    results = []
    for case in CASES:
        if arguments.only and case.record not in arguments.only:
            continue
        if not (arguments.folder / case.record).is_dir():
            print(f"{case.record}: skipped, it is not in the folder", flush=True)
            continue
        results.append(run(case, arguments.folder))
        print(f"\n{case.record}, {results[-1].seconds:.0f} s:\n{results[-1].diagnosis}", flush=True)
        if arguments.output:
            arguments.output.write_text(page(results), encoding="utf-8")


if __name__ == "__main__":
    main()
