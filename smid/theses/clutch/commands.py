"""``smid clutch``: the studies of the clutch thesis on the bundled records, each with its tables."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import click

from smid.cli.console import Progress
from smid.cli.options import json_option, report_option
from smid.cli.outputs import Outputs
from smid.cli.studies import publish
from smid.theses.clutch.hammerstein_study import PART, hammerstein_study
from smid.theses.clutch.overview import record_overview
from smid.theses.clutch.pages import hammerstein_page, records_page, recursive_page, sensors_page
from smid.theses.clutch.recursive_study import RecursiveStudy, recursive_study
from smid.theses.clutch.sensor_chapter import sensor_chapter
from smid.theses.clutch.set_study import SetStudy, set_study


@dataclass(frozen=True)
class _Recursive:
    """The two halves of the recursive chapter."""

    estimators: RecursiveStudy
    sets: SetStudy

    def to_dict(self) -> dict[str, Any]:
        return {"estimators": self.estimators.to_dict(), "sets": self.sets.to_dict()}

    def __str__(self) -> str:
        return f"{self.estimators}\n\nRecursive set-membership\n\n{self.sets}"


@click.command()
@json_option
@report_option
def records(json_: str | None, report: str | None) -> None:
    """List the bundled records."""
    outputs = Outputs(json_, report)
    overview = record_overview()
    publish(outputs, "clutch records", overview, lambda path, asked: records_page(overview, path, asked))


@click.command()
@click.option(
    "--start", type=int, default=PART[0], show_default=True, help="First sample of 20C_ramp_a to identify on."
)
@click.option("--stop", type=int, default=PART[1], show_default=True, help="First sample not to identify on any more.")
@click.option("--order", type=click.IntRange(min=1), default=3, show_default=True, help="Highest relaxation order.")
@json_option
@report_option
def hammerstein(start: int, stop: int, order: int, json_: str | None, report: str | None) -> None:
    """Identify a Hammerstein model in three phases (thesis, section 3.2)."""
    outputs = Outputs(json_, report)
    with Progress() as progress:
        study = hammerstein_study(part=(start, stop), orders=range(1, order + 1), progress=progress)
    settings = {"part": f"20C_ramp_a, samples {start}:{stop}", "orders": f"1 to {order}"}
    publish(outputs, "clutch hammerstein", study, lambda path, asked: hammerstein_page(study, path, asked), settings)


@click.command()
@json_option
@report_option
def recursive(json_: str | None, report: str | None) -> None:
    """Estimate recursively, and certify recursive sets (sections 3.3 and 6.2)."""
    outputs = Outputs(json_, report)
    with Progress() as progress:
        progress("recursive estimators on all records")
        study = _Recursive(recursive_study(), set_study(progress=progress))
    publish(
        outputs,
        "clutch recursive",
        study,
        lambda path, asked: recursive_page(study.estimators, study.sets, path, asked),
    )


@click.command()
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Of splits and starts.")
@json_option
@report_option
def sensors(seed: int, json_: str | None, report: str | None) -> None:
    """Train the virtual sensors of the position, and one for all temperatures (chapter 5, section 6.2)."""
    outputs = Outputs(json_, report)
    with Progress() as progress:
        chapter = sensor_chapter(seed, progress=progress)
    settings = {"seed": str(seed)}
    publish(outputs, "clutch sensors", chapter, lambda path, asked: sensors_page(chapter, path, asked), settings)
