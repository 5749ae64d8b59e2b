"""The paths of a model from its inputs to its outputs, each with orders and a delay of its own.

Output i has one denominator for all its inputs, and path (i, j) a numerator and a delay:
``A_i(q) w_i[t] = sum_j B_ij(q) u_j[t - delay_ij]``, a matrix fraction with a diagonal denominator (Kailath, Linear
Systems, 1980, section 6.2). Where the inputs of one output have poles of their own, A_i holds all of them.

The names of parameters and signals end in the channels that they belong to, as in ``b0_level_pump``. The only input, or
the only output, is not named.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeGuard

from smid.models.edit_lines import free_name, rename_channels
from smid.models.errors import ModelError
from smid.models.model import Model
from smid.models.parts import check_name
from smid.models.transfer import check_count

__all__ = ["Orders", "Output", "Path", "channels_of", "outputs_of", "per_output", "with_channels", "with_noisy_inputs"]

Orders = int | Sequence[int] | Sequence[Sequence[int]]
"""Of all paths, or of each: for each output a list with a number for each input."""


@dataclass(frozen=True)
class Path:
    """The way from one input to one output.

    Parameters
    ----------
    input
        Name of the input until `with_channels`.
    of_input, suffix
        Ends of names that belong to the input, and to the path.
    degree
        Of the numerator.
    delay
        In samples.
    """

    input: str
    of_input: str
    suffix: str
    degree: int
    delay: int


@dataclass(frozen=True)
class Output:
    """One output with its number of poles, and the paths to it; `channel` is its name until `with_channels`."""

    channel: str
    suffix: str
    poles: int
    paths: tuple[Path, ...]


def channels_of(role: str, given: str | Sequence[str]) -> tuple[str, ...]:
    """Return channels as a tuple.

    Raises
    ------
    ModelError
        If there is none, one appears twice, or a name is not a valid identifier.

    Examples
    --------
    >>> channels_of("input", "u")
    ('u',)
    """
    found: tuple[Any, ...] = tuple(given) if _is_list(given) else (given,)
    if not found:
        raise ModelError(f"{role} is an empty list: name at least one channel")
    for channel in found:
        check_name(channel, "channel")
        if found.count(channel) > 1:
            raise ModelError(f"{role} names {channel!r} {found.count(channel)} times: name each channel once")
    return found


def outputs_of(
    input: str | Sequence[str],
    output: str | Sequence[str],
    poles: tuple[str, int | Sequence[int]],
    degrees: tuple[str, Orders],
    delay: Orders,
) -> tuple[Output, ...]:
    """Return the outputs of a model with their paths.

    Parameters
    ----------
    poles, degrees
        Name and value of the option that gives them.

    Raises
    ------
    ModelError
        If channels are named twice, or orders do not fit them.

    Examples
    --------
    >>> both = outputs_of(["pump", "heater"], ["level", "T"], ("na", [2, 1]), ("nb", 0), [[1, 1], [4, 2]])
    >>> [(one.channel, one.poles, [(path.suffix, path.delay) for path in one.paths]) for one in both]
    [('y1', 2, [('_level_pump', 1), ('_level_heater', 1)]), ('y2', 1, [('_T_pump', 4), ('_T_heater', 2)])]
    """
    inputs, outputs = channels_of("input", input), channels_of("output", output)
    counts = per_output(*poles, outputs)
    rows, delays = _per_path(*degrees, inputs, outputs), _per_path("delay", delay, inputs, outputs)
    return tuple(
        Output(
            own,
            _suffix(outputs, i),
            counts[i],
            tuple(
                Path(name, _suffix(inputs, j), _suffix(outputs, i) + _suffix(inputs, j), rows[i][j], delays[i][j])
                for j, name in enumerate(_stand_ins("u", inputs))
            ),
        )
        for i, own in enumerate(_stand_ins("y", outputs))
    )


def per_output(option: str, given: int | Sequence[int], outputs: Sequence[str]) -> tuple[int, ...]:
    """Return a count for each output; ModelError if they do not fit."""
    values: tuple[Any, ...] = tuple(given) if _is_list(given) else (given,) * len(outputs)
    if len(values) != len(outputs):
        raise ModelError(
            f"{option} = {given} does not fit the outputs {', '.join(outputs)}: give one number for all, or a list "
            "with one for each"
        )
    for value in values:
        check_count(option, value, 0)
    return values


def _per_path(option: str, given: Orders, inputs: Sequence[str], outputs: Sequence[str]) -> list[tuple[int, ...]]:
    """Return a row for each output, with a number for each input."""
    ny, nu = len(outputs), len(inputs)
    rows: list[Any] = list(given) if _is_list(given) else [[given] * nu] * ny
    if not any(map(_is_list, rows)):
        # A plain list is of the inputs of the only output, or of the outputs of the only input.
        rows = [rows] if ny == 1 else [[value] for value in rows] if nu == 1 else rows
    if len(rows) != ny or not all(_is_list(row) and len(row) == nu for row in rows):
        plain = [1] * max(nu, ny) if min(nu, ny) == 1 else [[1] * nu] * ny
        raise ModelError(
            f"{option} = {given} does not fit the outputs {', '.join(outputs)} and the inputs {', '.join(inputs)}: "
            f"give one number for all paths, or for each output a list with a number for each input, as in {plain}"
        )
    for row in rows:
        for value in row:
            check_count(option, value, 0)
    return [tuple(row) for row in rows]


def with_channels(model: Model, input: str | Sequence[str], output: str | Sequence[str]) -> Model:
    """Return a model of `outputs_of` with the names of the channels in the data."""
    inputs, outputs = channels_of("input", input), channels_of("output", output)
    names = zip((*_stand_ins("u", inputs), *_stand_ins("y", outputs)), (*inputs, *outputs), strict=True)
    return rename_channels(model, dict(names))


def with_noisy_inputs(model: Model, input: str | Sequence[str]) -> Model:
    """Return the model with all its inputs measured with noise."""
    inputs = channels_of("input", input)
    for k, channel in enumerate(inputs):
        model = model.with_input_noise(channel, free_name(model, f"zeta{_suffix(inputs, k)}"))
    return model


def _is_list(given: object) -> TypeGuard[Sequence[Any]]:
    return isinstance(given, list | tuple)


def _stand_ins(stem: str, channels: Sequence[str]) -> tuple[str, ...]:
    """Return names without an underscore, which no parameter or signal of a path has."""
    return (stem,) if len(channels) == 1 else tuple(f"{stem}{k}" for k in range(1, len(channels) + 1))


def _suffix(channels: Sequence[str], k: int) -> str:
    return "" if len(channels) == 1 else f"_{channels[k]}"
