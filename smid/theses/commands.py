"""``smid clutch`` and ``smid hybrid``: the studies of the two theses, found by the command line as entry points."""

from __future__ import annotations

from collections.abc import Mapping

import click

from smid.cli.console import Commands


def _studies(room: str, text: str, lines: Mapping[str, str]) -> Commands:
    """Return the group of a thesis's commands, with one line of help for each command."""

    @click.pass_context
    def show_help(context: click.Context) -> None:
        if context.invoked_subcommand is None:
            click.echo(context.get_help())

    targets = {name: (f"smid.theses.{room}.commands:{name}", line) for name, line in lines.items()}
    return Commands(room, callback=show_help, invoke_without_command=True, help=text, targets=targets)


clutch = _studies(
    "clutch",
    "Repeat the studies of the clutch thesis on simulated records (data/README.md).",
    {
        "hammerstein": "Identify a Hammerstein model in three phases (section 3.2).",
        "holds": "Repeat tables 5.1 to 5.4 on records with long holds and strong hysteresis.",
        "plants": "Compare one sensor with those of the thesis on six plants (section 6.2).",
        "records": "List the bundled records.",
        "recursive": "Estimate recursively, and certify recursive sets (sections 3.3 and 6.2).",
        "sensors": "Train virtual sensors of the position (chapter 5, section 6.2).",
    },
)
hybrid = _studies(
    "hybrid",
    "Repeat the studies of the hybrid thesis on simulated plants.",
    {
        "arm": "Estimate the rotating arm, with and without a network (section 6.3).",
        "inputs": "Certify the rotating arm under each input (table F.1, section 7.4).",
        "reactor": "Join networks to a reactor's first principles (section 6.2).",
    },
)
