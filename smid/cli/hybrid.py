"""``smid hybrid``: the studies of the hybrid thesis."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

import click

from smid.cli.face import Progress
from smid.cli.options import json_option, report_option
from smid.cli.outputs import Outputs
from smid.hybrid.reactor import reactor_study
from smid.reports import versions
from smid.reports.hybrid import reactor_page


class Study(Protocol):
    """What every study gives."""

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        ...


@click.group(invoke_without_command=True)
@click.pass_context
def hybrid(context: click.Context) -> None:
    """Repeat the studies of the hybrid thesis on simulated plants."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


@hybrid.command()
@click.option("--starts", type=click.IntRange(min=1), default=3, show_default=True, help="Random starts of a network.")
@click.option("--iterations", type=click.IntRange(min=1), default=300, show_default=True, help="Most steps from each.")
@click.option("--seed", type=click.IntRange(min=0), default=1, show_default=True, help="Of noise and starts.")
@json_option
@report_option
def reactor(starts: int, iterations: int, seed: int, json_: str | None, report: str | None) -> None:
    """Join networks to a reactor's first principles (section 6.2, tables 5 and 6)."""
    outputs = checked_outputs(json_, report)
    with Progress() as progress:
        study = reactor_study(starts=starts, iterations=iterations, seed=seed, progress=progress)
    settings = {"starts": str(starts), "iterations": str(iterations), "seed": str(seed)}
    publish(outputs, "reactor", study, lambda path, asked: reactor_page(study, path, asked), settings)


def checked_outputs(json: str | None, report: str | None) -> Outputs:
    """Return where the results go, once it is known that they can be written there."""
    outputs = Outputs(json, report)
    outputs.check()
    return outputs


def publish(
    outputs: Outputs,
    name: str,
    study: Study,
    page: Callable[[str, dict[str, str]], Path],
    settings: dict[str, str],
) -> None:
    """Print a study and write the files that were asked for."""
    outputs.say(study)
    outputs.write({"schema": f"smid.hybrid-{name}/1", **study.to_dict(), "versions": versions()})
    if outputs.report is not None:
        page(outputs.report, {**settings, "command": f"smid hybrid {name}"})
        outputs.say(f"report: {outputs.report}")
