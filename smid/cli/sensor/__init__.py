"""``smid sensor``: virtual sensors of any record."""

from __future__ import annotations

import click

from smid.cli.console import Commands

__all__ = ["sensor"]


@click.pass_context
def _show_help(context: click.Context) -> None:
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


sensor = Commands(
    "sensor",
    callback=_show_help,
    invoke_without_command=True,
    help="Train a virtual sensor on records, run it, check it, and export it to C or ONNX.",
    targets={
        "train": ("smid.cli.sensor.train:train", "Train sensors on records, choose one, and test it."),
        "run": (
            "smid.cli.sensor.run:run",
            "Run a sensor over a record, sample by sample, also where samples are lost.",
        ),
        "check": ("smid.cli.sensor.check:check", "Compare a sensor with the measured output of records."),
        "dead-zones": (
            "smid.cli.sensor.dead_zones:dead_zones",
            "Find dead zones between channels, with certified thresholds.",
        ),
        "export": ("smid.cli.sensor.export:export", "Write a sensor as C99 or ONNX."),
    },
)
