"""``smid demo``: identify on the bundled, simulated clutch records, see the model fail on steps, and learn why."""

from __future__ import annotations

import os
import sys
import time
import webbrowser
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import click

from relaxations.search.hierarchy import Reason
from smid.cli.console import INTERRUPTED, Progress
from smid.cli.options import json_option
from smid.cli.outputs import Outputs, pdf_warnings_told
from smid.data import Dataset
from smid.data.bundled import load_clutch, true_parameters
from smid.diagnosis import Diagnosis, diagnose
from smid.fitting.validate import Validation, validate
from smid.identification.error_bound import ErrorBound, error_bound
from smid.identification.estimate import Estimate
from smid.identification.identify import identify
from smid.models import Hammerstein
from smid.reports import check_report
from smid.reports import report as write_report
from smid.reports.documents import identify_document

RECORD, OTHER = "hammerstein_20C_ramp_a", "hammerstein_20C_ramp_b"
STEPS = "varying_pole_20C_steps"
ACTUATOR, SAMPLES_OF_ACTUATOR = ("20C_ramp_a", "20C_step_b", "60C_ramp_a", "m20C_ramp_a"), 1000
SAMPLES = 200  # two ramps: enough for narrow intervals, few enough for some seconds
NOISE_BOUND = 0.3  # bar; data/README.md: the bound that the simulated noise keeps
WHY_THIS_BOUND = (
    "Noise bound: 0.3 bar, which the simulated noise is known to keep. The least bound would be too small: "
    "there the intervals shrink to a point, whatever the truth is."
)
NOTE = (
    "The model fits the rest of its record, and the other one of the same plant. It does not fit the records of the "
    "whole actuator: these have hysteresis, a pole that varies with pressure and direction, and temperatures, and this "
    "model has none of it. smid clutch hammerstein shows what identifying on them gives."
)
TRUTH_OF_THE_STEPS = (
    "The base model was identified on ramps. This record was made by a plant whose pole depends on the pressure, which "
    "the diagnosis was not told; so its verdict can be checked."
)
STEPS_NOTE = (
    "On a short record of steps one thing alone is wrong: the plant of that record has a pole that depends on the "
    "pressure. The diagnosis below is told neither this nor what else might be wrong."
)


@click.command()
@click.option(
    "--report",
    type=click.Path(dir_okay=False),
    default="smid-report.html",
    show_default=True,
    help="Where to write the page; the one of the identification goes beside it.",
)
@click.option(
    "--since", type=float, metavar="S", help="Count the time from then, in seconds since 1970; else from the start."
)
@json_option
@click.pass_context
def demo(context: click.Context, report: str, since: float | None, json_: str | None) -> None:
    """Identify a clutch actuator on bundled records (simulated), diagnose where it fails, and open a report."""
    # So far this process has only been loaded: its processor time is the time since its start.
    began = time.time() - time.process_time() if since is None else since
    outputs = Outputs(json_, report)
    pages = (Path(report).with_stem(f"{Path(report).stem}-identification"), Path(report))
    check_report(pages[0])
    whole, steps = load_clutch(RECORD), load_clutch(STEPS)
    data = replace(whole.crop(0, SAMPLES), source=f"{whole.source}, samples 0:{SAMPLES}")
    rest = replace(whole.crop(SAMPLES), source=f"{whole.source}, samples {SAMPLES}:{whole.n_samples}")
    truth = true_parameters(RECORD)
    outputs.say(f"Data: {data.source}. They are simulated, not measured.")
    with Progress() as progress:
        bound, estimate = _identify(outputs, data, progress)
    if estimate is None:
        context.exit(INTERRUPTED)
    outputs.say(f"{estimate}\n\n{_against(truth, estimate)}\n")
    first = time.time() - began
    actuator = replace(load_clutch(ACTUATOR).crop(0, SAMPLES_OF_ACTUATOR), outputs=("pressure",))
    runs = [validate(estimate.model, record, NOISE_BOUND) for record in (rest, load_clutch(OTHER), actuator, steps)]
    outputs.say("Free runs of the central model over other samples:")
    for run in runs:
        outputs.say(f"\n{run.data.source}\n{run}")
    outputs.say(f"\n{NOTE}\n{STEPS_NOTE}\n")
    outputs.write(identify_document(estimate, bound, runs))
    diagnosis = None
    if estimate.reason is not Reason.INTERRUPTED:
        with Progress() as progress:
            diagnosis = diagnose(estimate.model, steps, NOISE_BOUND, progress=progress)
        outputs.say(f"Diagnosis of {steps.source}\n{diagnosis}\n")
    with pdf_warnings_told():
        page = _write(estimate, bound, runs, diagnosis, truth, pages)
    outputs.say(f"First interval on screen after {first:.1f} s, report after {time.time() - began:.1f} s.")
    outputs.say(page.resolve())
    show(page)
    if diagnosis is None or diagnosis.interrupted:
        click.echo("interrupted: what is printed is proven; effects that were not tried may explain more", err=True)
        context.exit(INTERRUPTED)


def _identify(outputs: Outputs, data: Dataset, progress: Progress) -> tuple[ErrorBound, Estimate | None]:
    """Enclose the least noise bound, and the parameters; without these where Ctrl-C came before."""
    model = Hammerstein(poles=1, powers=(5, 4, 3), input_scale=0.01, unit_dc_gain=True, stable=True)
    bound = error_bound(model, data, progress=progress)
    outputs.say(f"{str(bound)[0].upper()}{str(bound)[1:]}.\n{WHY_THIS_BOUND}\n")
    if bound.reason is Reason.INTERRUPTED:
        return bound, None
    return bound, identify(model, data, NOISE_BOUND, order=2, progress=progress)


def _write(
    estimate: Estimate,
    bound: ErrorBound,
    runs: Sequence[Validation],
    diagnosis: Diagnosis | None,
    truth: dict[str, float],
    pages: tuple[Path, Path],
) -> Path:
    """Write the page of the identification and that of the diagnosis, and return the one to read first."""
    identification, first = pages
    settings = {"noise bound": WHY_THIS_BOUND, "solver": "clarabel", "command": "smid demo"}
    written = write_report(
        estimate,
        identification,
        bound,
        runs,
        truth=truth,
        notes=(NOTE, STEPS_NOTE),
        settings={**settings, "order asked for": "2"},
        links={} if diagnosis is None else {"Why the model fails on steps: the diagnosis": first.name},
    )
    if diagnosis is None:
        return written
    links = {"How the model was identified, and what of it is proven": identification.name}
    return write_report(diagnosis, first, notes=(TRUTH_OF_THE_STEPS,), settings=settings, links=links)


def show(page: Path) -> None:
    """Open the page in the browser, where somebody sits before one."""
    display = sys.platform in ("darwin", "win32") or os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")
    if display and sys.stdout.isatty() and not os.environ.get("CI"):
        webbrowser.open(page.resolve().as_uri())


def _against(truth: dict[str, float], estimate: Estimate) -> str:
    """Say whether the parameters that made the data lie inside the intervals, as they must."""
    missed = [i.name for i in estimate.intervals if not i.lower <= truth[i.name] <= i.upper]
    values = ", ".join(f"{name} = {value:g}" for name, value in truth.items())
    verdict = f"NOT inside: {', '.join(missed)}" if missed else "inside every interval"
    return f"The parameters that made the data ({values}) lie {verdict}."
