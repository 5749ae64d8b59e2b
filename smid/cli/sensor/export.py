"""``smid sensor export``: a sensor as C99."""

from __future__ import annotations

import click

from smid.cli.console import Command
from smid.cli.options import FILE
from smid.cli.sensor.reading import load_sensor
from smid.reports import check_writable
from smid.sensors import export_c


@click.command(cls=Command)
@click.argument("sensor", type=FILE)
@click.argument("source", type=FILE, metavar="SOURCE.c")
def export(sensor: str, source: str) -> None:
    """Write a sensor as C99: a source file, and its header beside it.

    SENSOR is a file that smid sensor train --save wrote. The code allocates nothing, bridges lost samples, and
    does a bounded number of operations at each update. The header says which inputs it takes, in which units.
    """
    check_writable(source)
    written = export_c(load_sensor(sensor), source)
    click.echo(f"source: {written[0]}\nheader: {written[1]}")
