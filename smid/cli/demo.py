"""``smid demo``: the main job on the bundled, simulated clutch records."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from relaxations.hierarchy import Reason
from smid.cli.documents import identify_document
from smid.cli.face import INTERRUPTED, Progress
from smid.cli.options import json_option
from smid.cli.outputs import Outputs
from smid.error_bound import error_bound
from smid.estimate import Estimate
from smid.identify import identify
from smid.models import Hammerstein
from smid.records import load_clutch, true_parameters
from smid.reports import report as write_report
from smid.validate import validate

RECORD = "clutch_20C_ramp_a"
OTHERS = ("clutch_20C_ramp_b", "clutch_60C_ramp_a", "clutch_m20C_ramp_a")
SAMPLES = 200  # two ramps: enough for narrow intervals, few enough for some seconds
NOISE_BOUND = 0.3  # bar; data/README.md: the bound that the simulated noise keeps
WHY_THIS_BOUND = (
    "Noise bound: 0.3 bar, which the simulated noise is known to keep. The least bound would be too small: "
    "there the intervals shrink to a point, whatever the truth is."
)
NOTE = (
    "The model was identified at 20 °C. It fits the rest of that record and the other one at 20 °C. It does "
    "not fit at 60 °C and at -20 °C: the parameters move with the temperature, and this model has none."
)


@click.command()
@click.option(
    "--report",
    type=click.Path(dir_okay=False),
    default="smid-report.html",
    show_default=True,
    help="Where to write the page.",
)
@json_option
@click.pass_context
def demo(context: click.Context, report: str, json_: str | None) -> None:
    """Run the main job on bundled records of a clutch actuator (simulated), and write a report."""
    outputs = Outputs(json_, report)
    outputs.check()
    whole = load_clutch(RECORD)
    data = replace(whole.crop(0, SAMPLES), source=f"{whole.source}, samples 0:{SAMPLES}")
    rest = replace(whole.crop(SAMPLES), source=f"{whole.source}, samples {SAMPLES}:{whole.n_samples}")
    truth = true_parameters(RECORD)
    model = Hammerstein(poles=1, powers=(5, 4, 3), input_scale=0.01, unit_dc_gain=True, stable=True)
    outputs.say(f"Data: {data.source}. They are simulated, not measured.")
    with Progress() as progress:
        bound = error_bound(model, data, progress=progress)
        outputs.say(f"{str(bound)[0].upper()}{str(bound)[1:]}.\n{WHY_THIS_BOUND}\n")
        if bound.reason is Reason.INTERRUPTED:
            context.exit(INTERRUPTED)
        estimate = identify(model, data, NOISE_BOUND, order=2, progress=progress)
    outputs.say(f"{estimate}\n\n{_against(truth, estimate)}\n")
    runs = [validate(estimate.model, record, NOISE_BOUND) for record in (rest, *map(load_clutch, OTHERS))]
    outputs.say("Free runs of the central model over other samples:")
    for run in runs:
        outputs.say(f"\n{run.data.source}\n{run}")
    outputs.say(f"\n{NOTE}\n")
    outputs.write(identify_document(estimate, bound, runs))
    settings = {
        "noise bound": WHY_THIS_BOUND,
        "order asked for": "2",
        "solver": "clarabel",
        "command": "smid demo",
    }
    page = write_report(estimate, Path(report), bound, runs, truth=truth, notes=(NOTE,), settings=settings)
    outputs.say(page.resolve())
    if estimate.reason is Reason.INTERRUPTED:
        click.echo("interrupted: what is printed is proven", err=True)
        context.exit(INTERRUPTED)


def _against(truth: dict[str, float], estimate: Estimate) -> str:
    """Say whether the parameters that made the data lie inside the intervals, as they must."""
    missed = [i.name for i in estimate.intervals if not i.lower <= truth[i.name] <= i.upper]
    values = ", ".join(f"{name} = {value:g}" for name, value in truth.items())
    verdict = f"NOT inside: {', '.join(missed)}" if missed else "inside every interval"
    return f"The parameters that made the data ({values}) lie {verdict}."
