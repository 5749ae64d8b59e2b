"""``smid sensor dead-zones``: up to which input an output stays at rest, with certified thresholds."""

from __future__ import annotations

from dataclasses import dataclass

import click

from smid.cli.console import Command, Progress
from smid.cli.options import FILE, POSITIVE, Columns, argument, group, option, takes
from smid.cli.outputs import Outputs, writes
from smid.cli.sensor.reading import SensorColumns, load_records
from smid.identification.dead_zone import dead_zones as find_dead_zones
from smid.models.parts import plain_name
from smid.reports.documents import study_document


def read_pair(
    context: click.Context, parameter: click.Parameter, texts: tuple[str, ...]
) -> tuple[tuple[str, str], ...]:
    """Return the input and the output in texts such as ``current:pressure``."""
    pairs = [tuple(part.strip() for part in text.split(":")) for text in texts]
    for text, pair in zip(texts, pairs, strict=True):
        if len(pair) != 2 or not all(pair):
            raise click.BadParameter(f"{text!r} is no pair: write input:output", context, parameter)
    return tuple((plain_name(first), plain_name(second)) for first, second in pairs)


@dataclass(frozen=True)
class Asked:
    """The records, and the pairs of channels."""

    columns: SensorColumns = group(SensorColumns)
    paths: tuple[str, ...] = argument(nargs=-1, required=True, type=FILE, metavar="DATA...")
    pair: tuple[tuple[str, str], ...] = option(
        multiple=True,
        required=True,
        callback=read_pair,
        metavar="U:Y",
        help="Input and output of a dead zone; repeatable.",
    )
    noise_bound: tuple[float, ...] = option(
        multiple=True,
        type=POSITIVE,
        metavar="D",
        help="Largest error of a point, in the output's unit, one for each pair. [default: 1.2 times the least]",
    )


@click.command(cls=Command)
@takes(asked=Asked)
@writes("json")
def dead_zones(asked: Asked, outputs: Outputs) -> None:
    """Find dead zones: up to which input an output stays at rest, with certified thresholds.

    DATA are records (CSV files) in which the inputs rise slowly from rest.
    """
    if asked.noise_bound and len(asked.noise_bound) != len(asked.pair):
        raise click.UsageError(f"{len(asked.noise_bound)} noise bounds for {len(asked.pair)} pairs: give one for each")
    given = asked.columns
    outputs_read = list(dict.fromkeys(second for _, second in asked.pair))
    inputs_read = [first for first, _ in asked.pair if first not in outputs_read]
    if not inputs_read:
        raise click.UsageError("every channel is an output of a pair: give a pair whose input is none")
    columns = Columns(list(dict.fromkeys(inputs_read)), outputs_read, given.sampling_time, given.time, given.reading)
    data = load_records(asked.paths, columns, [])
    with Progress() as progress:
        found = find_dead_zones(data, asked.pair, noise_bounds=asked.noise_bound or None, progress=progress)
    outputs.say(found)
    outputs.write(study_document("sensor-dead-zones", found.to_dict()))
