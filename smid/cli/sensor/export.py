"""``smid sensor export``: a sensor as C99 or ONNX."""

from __future__ import annotations

import click

from smid.cli.console import Command
from smid.cli.options import FILE
from smid.cli.sensor.reading import load_sensor
from smid.reports import check_writable
from smid.sensors import export_c, export_onnx


@click.command(cls=Command)
@click.argument("sensor", type=FILE)
@click.argument("target", type=FILE, metavar="TARGET")
def export(sensor: str, target: str) -> None:
    """Write a sensor as C99 or as ONNX.

    SENSOR is a file that smid sensor train --save wrote. A TARGET that ends in .c is C99, a source file with its header
    beside it. The code allocates nothing, bridges lost samples, and does a bounded number of operations at each update.
    The header says which inputs it takes, in which units. A TARGET that ends in .onnx is an ONNX model of one update,
    which does not bridge lost samples.
    """
    check_writable(target)
    if target.endswith(".onnx"):
        click.echo(f"model: {export_onnx(load_sensor(sensor), target)}")
        return
    source, header = export_c(load_sensor(sensor), target)
    click.echo(f"source: {source}\nheader: {header}")
