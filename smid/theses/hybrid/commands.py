"""``smid hybrid``: the studies of the hybrid thesis."""

from __future__ import annotations

import click

from smid.cli.console import Progress
from smid.signals import TABLE_F1
from smid.theses.hybrid.arm import arm_study
from smid.theses.hybrid.inputs import input_study
from smid.theses.hybrid.reactor import reactor_study
from smid.theses.study_command import Made, study_command


@study_command
@click.option("--starts", type=click.IntRange(min=1), default=3, show_default=True, help="Random starts of a network.")
@click.option("--iterations", type=click.IntRange(min=1), default=300, show_default=True, help="Most steps from each.")
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Of noise and starts.")
def reactor(progress: Progress, **settings: int) -> Made:
    """Join networks to a reactor's first principles (section 6.2)."""
    return reactor_study(**settings, progress=progress), settings


@study_command
@click.option("--starts", type=click.IntRange(min=1), default=20, show_default=True, help="Of each estimation.")
@click.option(
    "--input", "names", type=click.Choice(list(TABLE_F1)), multiple=True, help="Of table F.1; by default all."
)
def arm(progress: Progress, starts: int, names: tuple[str, ...]) -> Made:
    """Estimate the rotating arm, with and without a network (section 6.3)."""
    study = arm_study(starts, inputs=names or tuple(TABLE_F1), progress=progress)
    return study, {"starts": starts, "inputs": ", ".join(names) or "all"}


@study_command
@click.option("--samples", type=click.IntRange(min=100), default=600, show_default=True, help="Of each record.")
@click.option(
    "--noise-bound", type=click.FloatRange(min=0, min_open=True), default=0.002, show_default=True, help="In rad."
)
@click.option("--budget", type=click.IntRange(min=0), default=12, show_default=True, help="Inputs to search; 0: none.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of noise and search.")
def inputs(progress: Progress, samples: int, noise_bound: float, budget: int, seed: int) -> Made:
    """Certify the rotating arm under each input (table F.1, section 7.4)."""
    if budget == 1:
        raise click.BadParameter("1 input is the one by hand: give at least 2, or 0", param_hint="--budget")
    study = input_study(samples=samples, noise_bound=noise_bound, budget=budget, seed=seed, progress=progress)
    return study, {"samples": samples, "noise bound": f"{noise_bound:g} rad", "budget": budget, "seed": seed}
