"""Options that several commands share."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import click

from smid.identification.identify import METHODS

Command = Callable[..., Any]
FILE = click.Path(dir_okay=False)


@dataclass(frozen=True)
class NoiseBound:
    """A noise bound as it is typed: a number in the output's unit, or a multiple of the least bound.

    Parameters
    ----------
    relative
        Whether ``value`` multiplies the upper end of :func:`smid.error_bound`.
    """

    value: float
    relative: bool


def read_noise_bound(context: click.Context, parameter: click.Parameter, text: str | None) -> NoiseBound | None:
    """Read ``0.3`` or ``1.2x``; a usage error for anything else."""
    if text is None:
        return None
    relative = text.strip().lower().endswith("x")
    try:
        value = float(text.strip()[:-1] if relative else text)
    except ValueError:
        value = math.nan
    trouble = ""
    if not math.isfinite(value):
        trouble = "is no bound: give a number such as 0.3, or a factor such as 1.2x"
    elif relative and value < 1:
        trouble = "is below the least bound, where no parameters fit: give 1x or more"
    elif value <= 0:
        trouble = "is not positive: give a positive number in the output's unit"
    if trouble:
        raise click.BadParameter(f"{text!r} {trouble}", context, parameter)
    return NoiseBound(value, relative)


def apply_all(*options: Command) -> Command:
    """Return one decorator out of several, in the order of the help page."""

    def decorate(command: Command) -> Command:
        for option in reversed(options):
            command = option(command)
        return command

    return decorate


column_options = apply_all(
    click.option("--input", "input_", required=True, metavar="U", help="Column of the input."),
    click.option("--output", required=True, metavar="Y", help="Column of the output."),
    click.option("--sampling-time", type=float, metavar="S", help="Seconds; else from the time stamps."),
    click.option("--time", metavar="COL", help="Column of time stamps; else the one called time."),
)
model_option = click.option("--model", required=True, type=FILE, metavar="TOML", help="Model class and its fields.")
input_noise_option = click.option(
    "--input-noise-bound",
    type=click.FloatRange(min=0, min_open=True),
    metavar="D",
    help="Noise bound of the input, for models with input noise.",
)
solver_option = click.option("--solver", default="clarabel", show_default=True, help="clarabel, or any of cvxpy's.")

record_options = apply_all(
    click.argument("data", type=FILE),
    column_options,
    click.option("--start", type=int, metavar="K", help="First sample to use, counted from 0."),
    click.option("--stop", type=int, metavar="K", help="First sample not to use any more."),
    model_option,
)

data_options = apply_all(record_options, input_noise_option)

solver_options = apply_all(
    click.option("--order", type=click.IntRange(min=1), help="Relaxation order; else the usual one."),
    click.option("--method", type=click.Choice(METHODS), default="auto", show_default=True),
    solver_option,
)

seconds_option = click.option(
    "--seconds",
    type=click.FloatRange(min=0, min_open=True),
    default=math.inf,
    metavar="T",
    help="Time allowed, in seconds; then what is proven by then is printed. [default: no limit]",
)
json_option = click.option(
    "--json", "json_", metavar="F", help="Write the result as JSON (docs/json.md); - is standard output."
)
report_option = click.option(
    "--report", type=FILE, metavar="F", help="Write the result as a page: .html, .pdf (by Chromium), .md or .json."
)
certificate_option = click.option(
    "--certificate",
    type=FILE,
    metavar="F",
    help="Write the proof of the ends, for python -m relaxations.check F.",
)
