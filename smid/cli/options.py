"""Options that several commands share.

A group of options is a frozen dataclass: each field carries its option, or another group under
``"group"``. :func:`takes` adds the
options of some groups to a command, and calls the command with one object for each group.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import wraps
from typing import Any

import click

from smid.identification.identify import METHODS

Command = Callable[..., Any]
FILE = click.Path(dir_okay=False)
POSITIVE = click.FloatRange(min=0, min_open=True)
INPUT = {"multiple": True, "metavar": "U", "help": "Column of an input; repeatable. [default: as in the model]"}
OUTPUT = {"multiple": True, "metavar": "Y", "help": "Column of an output; repeatable. [default: as in the model]"}
SOLVER = {"default": "clarabel", "show_default": True, "help": "Conic solver: clarabel, or any solver of cvxpy."}


def option(*flags: str, **settings: Any) -> Any:
    """Return a dataclass field for an option; without flags, the field's name is the flag."""
    return field(metadata={"decorator": click.option, "flags": flags, "settings": settings})


def argument(**settings: Any) -> Any:
    """Return a dataclass field for an argument of a command."""
    return field(metadata={"decorator": click.argument, "flags": (), "settings": settings})


def group(of: type) -> Any:
    """Return a dataclass field for another group of options."""
    return field(metadata={"group": of})


def takes(**groups: type) -> Callable[[Command], Command]:
    """Return a decorator that adds the options of groups, and gives the command one object for each group."""

    def decorate(command: Command) -> Command:
        @wraps(command)
        def call(*args: Any, **values: Any) -> Any:
            made = {name: _made(of, values) for name, of in groups.items()}
            return command(*args, **values, **made)

        decorated: Command = call
        for add in reversed([add for of in groups.values() for add in _decorators(of)]):
            decorated = add(decorated)
        return decorated

    return decorate


def _decorators(of: type) -> Iterator[Callable[[Command], Command]]:
    """Return click's decorators for the fields of a group, in the order of the help page."""
    for one in fields(of):
        meta = one.metadata
        if "group" in meta:
            yield from _decorators(meta["group"])
        elif meta["decorator"] is click.argument:
            yield click.argument(one.name, **meta["settings"])
        else:
            flags = meta["flags"] or (f"--{one.name.replace('_', '-')}",)
            yield click.option(*flags, one.name, **meta["settings"])


def _made(of: type, values: dict[str, Any]) -> Any:
    """Take the values of a group out of those that click read, and return the group."""
    nested = {one.name: one.metadata.get("group") for one in fields(of)}
    return of(**{name: _made(inner, values) if inner else values.pop(name) for name, inner in nested.items()})


@dataclass(frozen=True)
class NoiseBound:
    """A noise bound as the user types it: a number in the channel's unit, or a multiple of the least noise bound.

    Without a channel it is that of every output.
    """

    value: float
    relative: bool
    channel: str | None = None

    def __str__(self) -> str:
        value = f"{self.value:g} x least noise bound" if self.relative else f"{self.value:g}"
        return value if self.channel is None else f"{self.channel} {value}"


def read_noise_bound(context: click.Context, parameter: click.Parameter, text: str | None) -> NoiseBound | None:
    """Return the noise bound in a text such as ``0.3`` or ``1.2x``; raise a usage error for anything else."""
    if text is None:
        return None
    relative = text.strip().lower().endswith("x")
    try:
        value = float(text.strip()[:-1] if relative else text)
    except ValueError:
        value = math.nan
    trouble = ""
    if not math.isfinite(value):
        trouble = "is not a noise bound: give a number such as 0.3, or a factor such as 1.2x"
    elif relative and value < 1:
        trouble = "is below the least noise bound, where no parameters fit the data: give 1x or more"
    elif value <= 0:
        trouble = "is not positive: give a positive number in the output's unit"
    if trouble:
        raise click.BadParameter(f"{text!r} {trouble}", context, parameter)
    return NoiseBound(value, relative)


def read_noise_bounds(
    context: click.Context, parameter: click.Parameter, text: str | None
) -> tuple[NoiseBound, ...] | None:
    """Return the noise bounds in a text such as ``0.3`` or ``level=0.01,pressure=1.2x``."""
    if text is None:
        return None
    bounds = list[NoiseBound]()
    parts = text.split(",")
    for part in parts:
        name, equals, value = part.rpartition("=")
        bound = read_noise_bound(context, parameter, value)
        assert bound is not None
        if len(parts) > 1 and not name.strip():
            raise click.BadParameter(f"{part!r} names no channel: write level=0.01,pressure=0.3", context, parameter)
        bounds.append(replace(bound, channel=name.strip()) if equals else bound)
    return tuple(bounds)


def read_known_bounds(
    context: click.Context, parameter: click.Parameter, text: str | None
) -> tuple[NoiseBound, ...] | None:
    """Return noise bounds as `read_noise_bounds`, but no factors."""
    bounds = read_noise_bounds(context, parameter, text)
    if any(bound.relative for bound in bounds or ()):
        raise click.BadParameter(f"{text!r} is a factor: give a number in the unit of the channel", context, parameter)
    return bounds


def read_units(context: click.Context, parameter: click.Parameter, text: str | None) -> dict[str, str]:
    """Return the units in a text such as ``u=V,y=bar``, by column."""
    pairs = [part.split("=") for part in (text or "").split(",") if part.strip()]
    if any(len(pair) != 2 or not pair[0].strip() for pair in pairs):
        raise click.BadParameter(f"{text!r} gives no units: write them as in u=V,y=bar", context, parameter)
    return {name.strip(): unit.strip() for name, unit in pairs}


def read_delimiter(_context: click.Context, _parameter: click.Parameter, text: str | None) -> str | None:
    r"""Return the separator of columns; a shell passes a tab as ``tab`` or ``\t`` more easily than as itself."""
    return "\t" if text in ("tab", r"\t") else text


@dataclass(frozen=True)
class Reading:
    """How a file of columns is read, where its cells do not tell."""

    delimiter: str | None = option(
        metavar="C", callback=read_delimiter, help="Separator of the columns: , ; tab or a blank. [default: detected]"
    )
    decimal: str | None = option(
        type=click.Choice([".", ","]), help="Sign before the decimals. [default: detected, or asked for]"
    )
    missing: tuple[str, ...] = option(
        multiple=True,
        metavar="VALUE",
        help="Value that marks a missing sample, such as -9999 or Bad; none: no value does. Repeatable.",
    )
    units: Mapping[str, str] = option(
        callback=read_units, metavar="U=V,...", help="Units by column. [default: from the header]"
    )
    encoding: str | None = option(
        metavar="NAME", help="Encoding of a text file, such as cp437. [default: detected, or asked for]"
    )


@dataclass(frozen=True)
class Columns:
    """The columns of a file that a command reads."""

    input: Sequence[str] = option(**INPUT)
    output: Sequence[str] = option(**OUTPUT)
    sampling_time: float | None = option(
        type=float, metavar="S", help="Sampling time in seconds. [default: from the time stamps]"
    )
    time: str | None = option(
        metavar="COL", help="Column of time stamps. [default: the column named time, or the only one of dates]"
    )
    reading: Reading = group(Reading)


@dataclass(frozen=True)
class EstimateColumns(Columns):
    """The columns of a record to simulate; those that the user does not name are those of the estimate."""

    sampling_time: float | None = option(
        type=float, metavar="S", help="Sampling time in seconds. [default: as in the estimate]"
    )


@dataclass(frozen=True)
class Record:
    """A record in a CSV file, and the samples to take from it."""

    columns: Columns = group(Columns)
    path: str = argument(type=FILE, metavar="DATA")
    start: int | None = option(type=int, metavar="K", help="First sample to use, counted from 0.")
    stop: int | None = option(type=int, metavar="K", help="First sample after the last one to use.")


@dataclass(frozen=True)
class Problem:
    """A model file, and the noise bound of the input."""

    model: str = option(required=True, type=FILE, metavar="TOML", help="File with the model class and its settings.")
    input_noise_bound: tuple[NoiseBound, ...] | None = option(
        callback=read_known_bounds,
        metavar="D|U=D,...",
        help="Noise bound of the inputs, for models with input noise: one number, or one for each input.",
    )


@dataclass(frozen=True)
class Solve:
    """How bounds are computed."""

    order: int | None = option(
        type=click.IntRange(min=1), help="Relaxation order. [default: the usual order of the method]"
    )
    method: str = option(
        type=click.Choice(METHODS),
        default="auto",
        show_default=True,
        help="Relaxation of the polynomial problem, or inversion of the free run.",
    )
    solver: str = option(**SOLVER)


seconds_option = click.option(
    "--seconds",
    type=POSITIVE,
    default=math.inf,
    metavar="T",
    help="Time limit in seconds. At the limit, smid prints what is proven so far. [default: no limit]",
)
json_option = click.option(
    "--json", "json_", metavar="F", help="Write the result as JSON (docs/json.md); - is standard output."
)
report_option = click.option(
    "--report", type=FILE, metavar="F", help="Write a report: .html, .pdf (printed by Chromium), .md or .json."
)
certificate_option = click.option(
    "--certificate",
    type=FILE,
    metavar="F",
    help="Write the proof of the bounds; python -m relaxations.check F checks it.",
)
