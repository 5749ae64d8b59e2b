"""Diagnose measured records, and compare the extended models with published figures.

    python -m benchmarks.measured_diagnosis FOLDER [--output docs/measured.md] [--only RECORD ...]

FOLDER holds the records, one folder each; they are not part of the project. Every record is diagnosed in the same
way: a base model of low order, all effects of the library, no noise bound. The test part is the last 20 % of every
run, or the runs of the published split. No fit and no choice uses it; both models are simulated on it once, at the
end. Of a whole test run, the first 50 samples (or as many as the record gives) tell the initial states and do not
count. Every record is diagnosed twice, with the kernel of OpenBLAS that suits this processor and with that of an
older one. The search ends after 480 s of processor time in one process. Each result is kept in the cache, so an
interrupted run goes on where it stopped; delete the cache when the diagnosis has changed.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.kernels import OLDER, with_kernel
from benchmarks.machine import described
from benchmarks.processor_time import in_processor_time
from benchmarks.resumable import kept
from benchmarks.resumable import run as kept_run
from smid import Dataset, Model, OutputError
from smid.data import load_record
from smid.diagnosis import Diagnosis, diagnose
from smid.diagnosis.parts import free_run_of_new
from smid.diagnosis.search.compare import rms
from smid.fitting.binding import bind
from smid.models import Line, Measurement, Parameter, signal, t

SECONDS = 480.0  # processor time of a diagnosis
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


@dataclass(frozen=True)
class CaseResult:
    """What was found on a record with a kernel of OpenBLAS (empty: that of the processor).

    The RMSEs of `rmse` are on the test part of the diagnosis, in `unit`; those of `published`, if any, on the published
    test part, in the unit of the published figures; first of the base model, then of the extended one.
    """

    record: str
    kernel: str
    named: tuple[str, ...]
    alternatives: tuple[str, ...]
    rmse: tuple[float, float]
    unit: str
    published: tuple[float, float] | None
    conclusion: str
    sentences: tuple[str, ...]
    unexplained: bool
    interrupted: bool
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


def diagnosed(record: str, kernel: str, folder: Path) -> CaseResult:
    """Diagnose one record with a kernel of OpenBLAS."""
    return with_kernel(kernel, _diagnosed, record, kernel, folder)


def _diagnosed(record: str, kernel: str, folder: Path) -> CaseResult:
    (case,) = (case for case in CASES if case.record == record)
    full = load_record(record, folder)
    data = case.load(full)
    began = time.process_time()
    with in_processor_time():
        found = diagnose(bind(case.model, data), data, test=case.share, workers=1, seconds=SECONDS)
    seconds = time.process_time() - began
    published = None
    if case.test:
        pairs = ((found.base, found.simulated), (found.model, found.extended))
        before, after = (tested(model, simulated, case, found, full) for model, simulated in pairs)
        published = (before, after)
    return CaseResult(
        record,
        kernel,
        tuple(f"`{c.effect}`" + (f" ({c.label})" if c.label else "") for c in found.causes),
        found.alternatives,
        (found.gain.rmse_before, found.gain.rmse_after),
        found.unit,
        published,
        found.conclusion,
        tuple(f"{c.sentence} ({c.confidence:.0%})" for c in found.causes),
        found.unexplained,
        found.interrupted,
        seconds,
    )


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
KERNEL_HEAD = """
## With the arithmetic of an older processor

Kernels of OpenBLAS add in another order, so that the last digits differ. Here the kernel {} replaced that of the
processor.

| record | named with it | test RMSE over that of the first table |
|---|---|---|
"""


def page(results: Sequence[CaseResult]) -> str:
    """Return the tables, and the sentences of each diagnosis, as Markdown."""
    about = " ".join((__doc__ or "").split("not part of the project. ", 1)[-1].split())
    cases = {case.record: case for case in CASES}
    found = {(r.record, r.kernel): r for r in results}
    first = [found[name, ""] for name in cases if (name, "") in found]
    pairs = [(r, found[r.record, OLDER]) for r in first if (r.record, OLDER) in found]
    lines = [HEAD.format(about).rstrip("\n")]
    for r in first:
        verdict = f" (ambiguous: {' or '.join(r.alternatives)})" if r.alternatives else ""
        before, after = f"{r.rmse[0]:.4g}", f"{r.rmse[1]:.4g} {r.unit}".rstrip()
        names = ", ".join(r.named) or "nothing"
        seconds = f"{r.seconds:.0f}" + ", ended by time" * r.interrupted
        cells = (r.record, cases[r.record].known, names + verdict, before, after, seconds)
        lines.append("| " + " | ".join(cells) + " |")
    lines.append(TEST_HEAD.rstrip("\n"))
    for r in first:
        if r.published is not None:
            case = cases[r.record]
            before, after = (f"{value:.3g} {case.unit}".rstrip() for value in r.published)
            lines.append(f"| {r.record} | {before} | {after} | {case.published or '-'} |")
    if pairs:
        lines.append(KERNEL_HEAD.format(OLDER).rstrip("\n"))
        for r, other in pairs:
            names = "the same" if other.named == r.named else ", ".join(other.named) or "nothing"
            lines.append(f"| {r.record} | {names} | {other.rmse[1] / r.rmse[1]:.4f} |")
    lines.append(
        "\n## Sentences of the diagnosis\n\nThe percentage after a sentence is the probability of the cause.\n"
    )
    for r in first:
        case = cases[r.record]
        part = f" ({case.how})" if case.how else ""
        lines.append(f"**{r.record}**{part}; base: {case.base}. {r.conclusion}")
        lines += [f"- {sentence}" for sentence in r.sentences]
        unexplained = "The remaining error is more than noise: no effect of the library explains it."
        left = unexplained if r.unexplained else "The remaining error is no more than noise."
        lines.append(f"- {left}\n")
    return "\n".join([*lines, described(("numpy", "scipy"))]) + "\n"


def main() -> None:
    """Print each record as it comes, and write the tables."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.measured_diagnosis", description=(__doc__ or "").splitlines()[0]
    )
    known = [case.record for case in CASES]
    parser.add_argument("folder", type=Path, help="folder of the measured records")
    parser.add_argument("--output", type=Path, help="Markdown file to write")
    parser.add_argument("--only", nargs="+", choices=known, default=known, metavar="RECORD", help="these records only")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--cache", type=Path, default=Path(".cache/measured_diagnosis.jsonl"))
    given = parser.parse_args()
    there = [name for name in given.only if (given.folder / name).is_dir()]
    for name in sorted(set(given.only) - set(there)):
        print(f"{name}: skipped, it is not in the folder", flush=True)
    results = [restored(entry) for entry in kept(given.cache) if entry["record"] in there]
    done = {(r.record, r.kernel) for r in results}
    missing = [(name, kernel, given.folder) for kernel in ("", OLDER) for name in there if (name, kernel) not in done]
    for result in kept_run(given.cache, diagnosed, missing, given.workers):
        results.append(result)
        print(f"\n{result}", flush=True)
    if given.output:
        given.output.write_text(page(results), encoding="utf-8")


def restored(entry: dict[str, Any]) -> CaseResult:
    """Return a result that was kept as JSON, which knows no tuples."""
    return CaseResult(**{name: tuple(value) if isinstance(value, list) else value for name, value in entry.items()})


if __name__ == "__main__":
    main()
