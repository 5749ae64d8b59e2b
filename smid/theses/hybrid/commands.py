"""``smid hybrid``: the studies of the hybrid thesis."""

from __future__ import annotations

import click

from smid.cli.console import Progress
from smid.cli.options import json_option, report_option
from smid.cli.outputs import Outputs
from smid.cli.studies import publish
from smid.signals import TABLE_F1
from smid.theses.hybrid.arm import arm_study
from smid.theses.hybrid.inputs import input_study
from smid.theses.hybrid.pages import arm_page, inputs_page, reactor_page
from smid.theses.hybrid.reactor import reactor_study


@click.command()
@click.option("--starts", type=click.IntRange(min=1), default=3, show_default=True, help="Random starts of a network.")
@click.option("--iterations", type=click.IntRange(min=1), default=300, show_default=True, help="Most steps from each.")
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Of noise and starts.")
@json_option
@report_option
def reactor(starts: int, iterations: int, seed: int, json_: str | None, report: str | None) -> None:
    """Join networks to a reactor's first principles (section 6.2, tables 5 and 6)."""
    outputs = Outputs(json_, report)
    with Progress() as progress:
        study = reactor_study(starts=starts, iterations=iterations, seed=seed, progress=progress)
    settings = {"starts": str(starts), "iterations": str(iterations), "seed": str(seed)}
    publish(outputs, "hybrid reactor", study, lambda path, asked: reactor_page(study, path, asked), settings)


@click.command()
@click.option("--starts", type=click.IntRange(min=1), default=20, show_default=True, help="Of each estimation.")
@click.option(
    "--input", "names", type=click.Choice(list(TABLE_F1)), multiple=True, help="Of table F.1; by default all."
)
@json_option
@report_option
def arm(starts: int, names: tuple[str, ...], json_: str | None, report: str | None) -> None:
    """Estimate the rotating arm, white and with a network for its friction (section 6.3, tables 8 and F.2)."""
    outputs = Outputs(json_, report)
    with Progress() as progress:
        study = arm_study(starts, inputs=names or tuple(TABLE_F1), progress=progress)
    settings = {"starts": str(starts), "inputs": ", ".join(names) or "all"}
    publish(outputs, "hybrid arm", study, lambda path, asked: arm_page(study, path, asked), settings)


@click.command()
@click.option("--samples", type=click.IntRange(min=100), default=600, show_default=True, help="Of each record.")
@click.option(
    "--noise-bound", type=click.FloatRange(min=0, min_open=True), default=0.002, show_default=True, help="In rad."
)
@click.option("--budget", type=click.IntRange(min=0), default=12, show_default=True, help="Inputs to search; 0: none.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of noise and search.")
@json_option
@report_option
def inputs(samples: int, noise_bound: float, budget: int, seed: int, json_: str | None, report: str | None) -> None:
    """Certify the rotating arm under each input: what do they tell (table F.1, section 7.4)."""
    outputs = Outputs(json_, report)
    if budget == 1:
        raise click.BadParameter("1 input is the one by hand: give at least 2, or 0", param_hint="--budget")
    with Progress() as progress:
        study = input_study(samples=samples, noise_bound=noise_bound, budget=budget, seed=seed, progress=progress)
    settings = {
        "samples": str(samples),
        "noise bound": f"{noise_bound:g} rad",
        "budget": str(budget),
        "seed": str(seed),
    }
    publish(outputs, "hybrid inputs", study, lambda path, asked: inputs_page(study, path, asked), settings)
