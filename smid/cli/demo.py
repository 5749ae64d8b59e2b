"""``smid demo``: identify on the bundled clutch records, see the model fail on steps, and find why."""

from __future__ import annotations

import os
import sys
import time
import webbrowser
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import click

from relaxations.search.enclosure import Reason
from smid.cli.console import INTERRUPTED, Command, Progress
from smid.cli.options import json_option
from smid.cli.outputs import Outputs, pdf_warnings_printed
from smid.data import Dataset
from smid.data.bundled import load_clutch, true_parameters
from smid.diagnosis import Diagnosis, diagnose
from smid.identification.error_bound import ErrorBound, error_bound
from smid.identification.estimate import Estimate
from smid.identification.identify import identify
from smid.models import Hammerstein
from smid.reports import check_report
from smid.reports import report as write_report
from smid.reports.documents import identify_document
from smid.reports.page import capitalised
from smid.validation import Validation, validate

RECORD, OTHER = "hammerstein_20C_ramp_a", "hammerstein_20C_ramp_b"
STEPS = "varying_pole_20C_steps"
ACTUATOR, SAMPLES_OF_ACTUATOR = ("20C_ramp_a", "20C_step_b", "60C_ramp_a", "m20C_ramp_a"), 1000
SAMPLES = 200  # two ramps: enough for narrow intervals, few enough for some seconds
NOISE_BOUND = 0.3  # bar; data/README.md: the simulated noise keeps this bound
WHY_THIS_BOUND = (
    "Noise bound: 0.3 bar. The simulated noise keeps this bound. The least noise bound is too small for an "
    "identification: with it the intervals shrink to a point for any data."
)
NOTE = (
    "The model fits the rest of its record, and the other record of the same plant. It does not fit the records of the "
    "whole actuator. The actuator has hysteresis, several temperatures, and a pole that varies with pressure and "
    "direction; the model has none of these. The command smid clutch hammerstein identifies on those records."
)
STEPS_NOTE = (
    "The record of steps comes from a plant with one difference: its pole depends on the pressure. The diagnosis does "
    "not know this difference."
)
TRUTH_OF_THE_STEPS = (
    "The base model was identified on ramps. The plant that made this record has a pole that depends on the pressure. "
    "The diagnosis does not know this, so the reader can check its verdict."
)


@dataclass(frozen=True)
class Identified:
    """What the demo found before the diagnosis."""

    bound: ErrorBound
    estimate: Estimate
    runs: Sequence[Validation]
    truth: dict[str, float]


@click.command(cls=Command)
@click.option(
    "--report",
    type=click.Path(dir_okay=False),
    default="smid-report.html",
    show_default=True,
    help="Report of the diagnosis; the report of the identification is written beside it.",
)
@click.option(
    "--since",
    type=float,
    metavar="S",
    help="Start of the printed times, in seconds since 1970. [default: the start of the command]",
)
@json_option
@click.pass_context
def demo(context: click.Context, report: str, since: float | None, json_: str | None) -> None:
    """Identify a clutch actuator on simulated records, and find why the model fails on steps."""
    # So far this process has only been loaded: its processor time is the time since its start.
    began = time.time() - time.process_time() if since is None else since
    outputs = Outputs(json_, report)
    pages = (Path(report).with_stem(f"{Path(report).stem}-identification"), Path(report))
    check_report(pages[0])
    steps = load_clutch(STEPS)
    # Identify on two ramps, and simulate the model on other samples.
    found = _identified(outputs, steps)
    if found is None:
        context.exit(INTERRUPTED)
    first = time.time() - began
    outputs.write(identify_document(found.estimate, found.bound, found.runs))
    # Diagnose the model on steps, where it fails.
    diagnosis = None
    if found.estimate.reason is not Reason.INTERRUPTED:
        with Progress() as progress:
            diagnosis = diagnose(found.estimate.model, steps, NOISE_BOUND, progress=progress)
        outputs.say(f"Diagnosis of {steps.source}\n{diagnosis}\n")
    with pdf_warnings_printed():
        page = _write(found, diagnosis, pages)
    outputs.say(f"First interval on screen after {first:.1f} s, report after {time.time() - began:.1f} s.")
    outputs.say(page.resolve())
    show(page)
    if diagnosis is None or diagnosis.interrupted:
        message = "interrupted: all printed bounds are proven; effects that were not tested may explain more"
        click.echo(message, err=True)
        context.exit(INTERRUPTED)


def _identified(outputs: Outputs, steps: Dataset) -> Identified | None:
    """Identify the model, simulate it on other samples and print both; None if Ctrl-C came before the intervals."""
    whole, truth = load_clutch(RECORD), true_parameters(RECORD)
    data = replace(whole.crop(0, SAMPLES), source=f"{whole.source}, samples 0:{SAMPLES}")
    rest = replace(whole.crop(SAMPLES), source=f"{whole.source}, samples {SAMPLES}:{whole.n_samples}")
    outputs.say(f"Data: {data.source}. They are simulated, not measured.")
    model = Hammerstein(poles=1, powers=(5, 4, 3), input_scale=0.01, unit_dc_gain=True, stable=True)
    with Progress() as progress:
        bound = error_bound(model, data, progress=progress)
        outputs.say(f"{capitalised(str(bound))}.\n{WHY_THIS_BOUND}\n")
        if bound.reason is Reason.INTERRUPTED:
            return None
        estimate = identify(model, data, NOISE_BOUND, order=2, progress=progress)
    outputs.say(f"{estimate}\n\n{_against(truth, estimate)}\n")
    actuator = replace(load_clutch(ACTUATOR).crop(0, SAMPLES_OF_ACTUATOR), outputs=("pressure",))
    runs = [validate(estimate.model, record, NOISE_BOUND) for record in (rest, load_clutch(OTHER), actuator, steps)]
    outputs.say("Free runs of the central model over other samples:")
    for run in runs:
        outputs.say(f"\n{run.data.source}\n{run}")
    outputs.say(f"\n{NOTE}\n{STEPS_NOTE}\n")
    return Identified(bound, estimate, runs, truth)


def _write(found: Identified, diagnosis: Diagnosis | None, pages: tuple[Path, Path]) -> Path:
    """Write the reports of the identification and of the diagnosis, and return the one to read first."""
    identification, first = pages
    settings = {
        "noise bound": WHY_THIS_BOUND.removeprefix("Noise bound: "),
        "solver": "clarabel",
        "command": "smid demo",
    }
    written = write_report(
        found.estimate,
        identification,
        found.bound,
        found.runs,
        truth=found.truth,
        notes=(NOTE, STEPS_NOTE),
        settings={**settings, "order": "2"},
        links={} if diagnosis is None else {"Why the model fails on steps: the diagnosis": first.name},
    )
    if diagnosis is None:
        return written
    links = {"How the model was identified, and what is proven": identification.name}
    return write_report(diagnosis, first, notes=(TRUTH_OF_THE_STEPS,), settings=settings, links=links)


def show(page: Path) -> None:
    """Open the report in the browser, if the command runs on a desktop."""
    display = sys.platform in ("darwin", "win32") or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if display and sys.stdout.isatty() and not os.environ.get("CI"):
        webbrowser.open(page.resolve().as_uri())


def _against(truth: dict[str, float], estimate: Estimate) -> str:
    """Return the sentence on whether the parameters that made the data lie inside the intervals."""
    missed = [i.name for i in estimate.intervals if not i.lower <= truth[i.name] <= i.upper]
    values = ", ".join(f"{name} = {value:g}" for name, value in truth.items())
    verdict = f"NOT inside: {', '.join(missed)}" if missed else "inside every interval"
    return f"The parameters that made the data ({values}) lie {verdict}."
