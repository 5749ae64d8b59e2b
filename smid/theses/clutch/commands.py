"""``smid clutch``: the studies of the clutch thesis on the bundled records."""

from __future__ import annotations

import click

from smid.cli.console import Progress
from smid.theses.clutch.hammerstein_study import PART, hammerstein_study
from smid.theses.clutch.held_chapter import held_chapter
from smid.theses.clutch.overview import record_overview
from smid.theses.clutch.plants import PLANTS
from smid.theses.clutch.plants_chapter import PlantsChapter
from smid.theses.clutch.recursive_chapter import RecursiveChapter
from smid.theses.clutch.recursive_study import recursive_study
from smid.theses.clutch.sensor_chapter import sensor_chapter
from smid.theses.clutch.sensor_study import foreign_study
from smid.theses.clutch.set_study import set_study
from smid.theses.study_command import Made, study_command


@study_command
def records(_progress: Progress) -> Made:
    """List the bundled records."""
    return record_overview(), {}


@study_command
@click.option("--start", type=int, default=PART[0], show_default=True, help="First sample of 20C_ramp_a to use.")
@click.option("--stop", type=int, default=PART[1], show_default=True, help="First sample not to use any more.")
@click.option("--order", type=click.IntRange(min=1), default=3, show_default=True, help="Highest relaxation order.")
def hammerstein(progress: Progress, start: int, stop: int, order: int) -> Made:
    """Identify a Hammerstein model in three phases (section 3.2)."""
    study = hammerstein_study(part=(start, stop), orders=range(1, order + 1), progress=progress)
    return study, {"part": f"20C_ramp_a, samples {start}:{stop}", "orders": f"1 to {order}"}


@study_command
def recursive(progress: Progress) -> Made:
    """Estimate recursively, and certify recursive sets (sections 3.3 and 6.2)."""
    progress("recursive estimators on all records")
    return RecursiveChapter(recursive_study(), set_study(progress=progress)), {}


@study_command
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Of splits and starts.")
def sensors(progress: Progress, seed: int) -> Made:
    """Train virtual sensors of the position (chapter 5, section 6.2)."""
    return sensor_chapter(seed, progress=progress), {"seed": seed}


@study_command
@click.option("--plant", "plants", multiple=True, type=click.Choice(list(PLANTS)), help="Repeat it; all by default.")
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Of noise, splits and starts.")
def plants(progress: Progress, plants: tuple[str, ...], seed: int) -> Made:
    """Compare one sensor with those of the thesis on six plants (section 6.2)."""
    names = plants or tuple(PLANTS)
    return PlantsChapter(foreign_study(names, seed=seed, progress=progress)), {"plants": ", ".join(names), "seed": seed}


@study_command
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Of noise, splits and starts.")
def holds(progress: Progress, seed: int) -> Made:
    """Repeat tables 5.1 to 5.4 on records with long holds and strong hysteresis."""
    return held_chapter(seed, progress=progress), {"seed": seed}
