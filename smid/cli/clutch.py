"""``smid clutch``: the studies of the clutch thesis on the bundled records, each with its tables."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

import click

from smid.cli.documents import Document
from smid.cli.face import Progress
from smid.cli.options import json_option, report_option
from smid.cli.outputs import Outputs
from smid.clutch.hammerstein_study import PART, hammerstein_study
from smid.clutch.overview import record_overview
from smid.clutch.recursive_study import recursive_study
from smid.clutch.sensor_chapter import sensor_chapter
from smid.clutch.set_study import set_study
from smid.reports import versions
from smid.reports.clutch import hammerstein_page, records_page, recursive_page, sensors_page


class Study(Protocol):
    """What every study gives."""

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        ...


@click.group(invoke_without_command=True)
@click.pass_context
def clutch(context: click.Context) -> None:
    """Repeat the studies of the clutch thesis on simulated records (data/README.md)."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


@clutch.command()
@json_option
@report_option
def records(json_: str | None, report: str | None) -> None:
    """List the bundled records."""
    outputs = _outputs(json_, report)
    overview = record_overview()
    _publish(outputs, "records", overview, lambda path: records_page(overview, path, _settings("records")))


@clutch.command()
@click.option(
    "--start", type=int, default=PART[0], show_default=True, help="First sample of 20C_ramp_a to identify on."
)
@click.option("--stop", type=int, default=PART[1], show_default=True, help="First sample not to identify on any more.")
@click.option("--order", type=click.IntRange(min=1), default=3, show_default=True, help="Highest relaxation order.")
@json_option
@report_option
def hammerstein(start: int, stop: int, order: int, json_: str | None, report: str | None) -> None:
    """Identify a Hammerstein model in three phases (thesis, section 3.2)."""
    outputs = _outputs(json_, report)
    with Progress() as progress:
        study = hammerstein_study(part=(start, stop), orders=range(1, order + 1), progress=progress)
    settings = _settings("hammerstein", part=f"20C_ramp_a, samples {start}:{stop}", orders=f"1 to {order}")
    _publish(outputs, "hammerstein", study, lambda path: hammerstein_page(study, path, settings))


@clutch.command()
@json_option
@report_option
def recursive(json_: str | None, report: str | None) -> None:
    """Estimate recursively, and certify recursive sets (sections 3.3 and 6.2)."""
    outputs = _outputs(json_, report)
    with Progress() as progress:
        progress("recursive estimators on all records")
        estimators = recursive_study()
        sets = set_study(progress=progress)
    outputs.say(f"{estimators}\n\nRecursive set-membership\n\n{sets}")
    outputs.write(_document("recursive", {"estimators": estimators.to_dict(), "sets": sets.to_dict()}))
    _write(outputs, lambda path: recursive_page(estimators, sets, path, _settings("recursive")))


@clutch.command()
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Of splits and starts.")
@json_option
@report_option
def sensors(seed: int, json_: str | None, report: str | None) -> None:
    """Train the virtual sensors of the position, and one for all temperatures (chapter 5, section 6.2)."""
    outputs = _outputs(json_, report)
    with Progress() as progress:
        chapter = sensor_chapter(seed, progress=progress)
    settings = _settings("sensors", seed=str(seed))
    _publish(outputs, "sensors", chapter, lambda path: sensors_page(chapter, path, settings))


def _document(name: str, content: Document) -> Document:
    return {"schema": f"smid.clutch-{name}/1", **content, "versions": versions()}


def _outputs(json: str | None, report: str | None) -> Outputs:
    outputs = Outputs(json, report)
    outputs.check()
    return outputs


def _settings(command: str, **asked: str) -> dict[str, str]:
    return {**asked, "command": f"smid clutch {command}"}


def _publish(outputs: Outputs, name: str, study: Study, page: Callable[[str], Path]) -> None:
    """Print a study and write the files that were asked for."""
    outputs.say(study)
    outputs.write(_document(name, study.to_dict()))
    _write(outputs, page)


def _write(outputs: Outputs, page: Callable[[str], Path]) -> None:
    if outputs.report is not None:
        page(outputs.report)
        outputs.say(f"report: {outputs.report}")
