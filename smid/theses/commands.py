"""``smid clutch`` and ``smid hybrid``: the studies of the two theses, found by the command line as entry points."""

from __future__ import annotations

import click

from smid.cli.console import Commands

_CLUTCH, _HYBRID = "smid.theses.clutch.commands", "smid.theses.hybrid.commands"


@click.group(
    cls=Commands,
    invoke_without_command=True,
    targets={
        "hammerstein": (f"{_CLUTCH}:hammerstein", "Identify a Hammerstein model in three phases (section 3.2)."),
        "records": (f"{_CLUTCH}:records", "List the bundled records."),
        "recursive": (f"{_CLUTCH}:recursive", "Estimate recursively, and certify recursive sets (3.3, 6.2)."),
        "sensors": (f"{_CLUTCH}:sensors", "Train virtual sensors of the position (chapter 5, section 6.2)."),
    },
)
@click.pass_context
def clutch(context: click.Context) -> None:
    """Repeat the studies of the clutch thesis on simulated records (data/README.md)."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


@click.group(
    cls=Commands,
    invoke_without_command=True,
    targets={
        "arm": (f"{_HYBRID}:arm", "Estimate the rotating arm, with and without a network (section 6.3)."),
        "inputs": (f"{_HYBRID}:inputs", "Certify the rotating arm under each input (table F.1, section 7.4)."),
        "reactor": (f"{_HYBRID}:reactor", "Join networks to a reactor's first principles (section 6.2)."),
    },
)
@click.pass_context
def hybrid(context: click.Context) -> None:
    """Repeat the studies of the hybrid thesis on simulated plants."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())
