"""Edits of a model's lines, each giving a new model, so effects compose; methods of `Model`.

Where a signal is asked for, the name of a channel that measures it is understood too: an effect can be put
on ``"u"`` whether or not the input is measured with noise.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import sympy

from smid.models.chains import signal_of
from smid.models.edit_parameters import origins_with
from smid.models.errors import ModelError
from smid.models.parts import Line, Measurement, Parameter, check_name
from smid.models.symbols import canonical, rename_signals, signal, t, unused

if TYPE_CHECKING:
    from smid.models.model import Model

__all__ = [
    "add_term",
    "free_name",
    "insert_after",
    "insert_before",
    "insert_sensor",
    "rename_channels",
    "replace_line",
    "with_input_noise",
    "with_line",
]

Transformation = Callable[[sympy.Indexed], sympy.Expr]


def _resolve(model: Model, name: str) -> str:
    """Return the signal of that name, or the one that the channel of that name measures or stands for."""
    signals = (*model.inputs, *(line.signal for line in model.lines))
    if name not in signals and name not in {m.channel for m in model.measurements}:
        raise ModelError(f"the model has no signal {name!r}: its signals are {', '.join(signals)}")
    placed = bool(model.edit and name in model.edit.places)
    return signal_of(model, name) if placed or name not in signals else name


def free_name(model: Model, wanted: str) -> str:
    """Return a name that stands for nothing in the model: the wanted one, numbered from 2 where it is taken.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> free_name(OutputError(), "gap"), free_name(OutputError(), "w")
    ('gap', 'w2')
    """
    return unused(wanted, model.taken)


def _extended(
    model: Model, parameters: Iterable[Parameter], lines: Iterable[Line], moved: Mapping[str, str] = {}
) -> Model:
    """Return the model with other lines and more parameters; `moved` gives the new name of a line's own result."""
    parameters, lines = tuple(parameters), tuple(lines)
    old = {line.signal for line in model.lines} | set(moved.values())
    added = [item.name for item in parameters] + [line.signal for line in lines if line.signal not in old]
    origins = origins_with(model, added)
    # The line's own result keeps the origin of the line.
    origins |= {new: origins[name] for name, new in moved.items() if name in origins}
    return replace(model, parameters=(*model.parameters, *parameters), lines=lines, origins=origins)


def _line(model: Model, name: str) -> Line:
    resolved = _resolve(model, name)
    for line in model.lines:
        if line.signal == resolved:
            return line
    raise ModelError(f"{name!r} is an input, no line defines it: use insert_before, or with_line to define it")


def with_line(
    model: Model, name: str, expression: sympy.Expr, parameters: Iterable[Parameter] = (), *, rate: bool = False
) -> Model:
    """Return the model with a line for a new signal, or for one that was an input.

    With `rate`, the expression is the derivative of the signal, per second.

    Raises
    ------
    ModelError
        If the signal is defined already.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> OutputError().with_line("u", signal("r")[t - 1]).inputs
    ('r',)
    """
    return _extended(model, parameters, (*model.lines, Line(signal(name)[t], expression, rate)))


def replace_line(model: Model, name: str, expression: sympy.Expr, parameters: Iterable[Parameter] = ()) -> Model:
    """Return the model with another right-hand side of a signal; the line of a rate stays a rate.

    Raises
    ------
    ModelError
        If no line defines the signal.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> print(OutputError().replace_line("w", signal("u")[t - 3]).lines[0].expression)
    u[t - 3]
    """
    old = _line(model, name)
    new = replace(old, expression=expression)
    return _extended(model, parameters, (new if line is old else line for line in model.lines))


def add_term(model: Model, name: str, term: sympy.Expr, parameters: Iterable[Parameter] = ()) -> Model:
    """Return the model with a term added to the right-hand side of a signal.

    In a rate the term is per second and reads the state as ``x[t]``; ``x[t - 1]`` is the sample before.

    Raises
    ------
    ModelError
        If no line defines the signal.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> friction = Parameter("Fc", 0, null=0)
    >>> term = -friction.symbol * sympy.sign(signal("w")[t - 1])
    >>> print(OutputError().add_term("w", term, [friction]).lines[0].expression)
    -Fc*sign(w[t - 1]) - a1*w[t - 1] + b0*u[t - 1]
    """
    return replace_line(model, name, _line(model, name).expression + canonical(term), parameters)


def insert_before(
    model: Model,
    name: str,
    transformation: Transformation,
    parameters: Iterable[Parameter] = (),
    *,
    new_name: str | None = None,
) -> Model:
    """Return the model with a line between a signal and its readers, as in ``u -> dead_zone(u)``.

    Lines that read the signal now read the new one, at the same lags; measurements still read the signal.
    `transformation` maps ``u[t]`` to the new signal, and may read any signal, also its own past.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> print(OutputError().insert_before("u", lambda u: sympy.Max(0, u)).equations().text[1])
    w[t] = -a1*w[t - 1] + b0*u_new[t - 1]
    """
    old = _resolve(model, name)
    new = new_name or free_name(model, f"{old}_new")
    inserted = Line(signal(new)[t], transformation(signal(old)[t]))
    lines = [replace(line, expression=rename_signals(line.expression, {old: new})) for line in model.lines]
    return _extended(model, parameters, (inserted, *lines))


def insert_after(
    model: Model,
    name: str,
    transformation: Transformation,
    parameters: Iterable[Parameter] = (),
    *,
    raw_name: str | None = None,
) -> Model:
    """Return the model with the result of a line transformed, as in ``w -> min(w, s)``.

    The line's own result gets a new name. Measurements, other lines and the line itself read the transformed signal.
    The raw signal of a rate line is integrated: ``min(x, s)`` winds up beyond s, while all readers see at most s.

    Raises
    ------
    ModelError
        If no line defines the signal.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> print(OutputError().insert_after("w", lambda w: sympy.Min(w, 5)).equations().text[1])
    w[t] = Min(5, w_raw[t])
    """
    old = _line(model, name)
    raw = signal(raw_name or free_name(model, f"{old.signal}_raw"))
    pair = (replace(old, target=raw[t]), Line(old.target, transformation(raw[t])))
    lines = [item for line in model.lines for item in (pair if line is old else (line,))]
    return _extended(model, parameters, lines, {old.signal: str(raw.label)})


def insert_sensor(
    model: Model,
    channel: str,
    transformation: Transformation,
    parameters: Iterable[Parameter] = (),
    *,
    new_name: str | None = None,
) -> Model:
    """Return the model with a line between a signal and its channel, as in ``y = min(w, s) + eta``.

    All lines, feedback included, still read the signal itself.

    Raises
    ------
    ModelError
        If the channel is not an output.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> print(OutputError().insert_sensor("y", lambda w: sympy.Min(w, 5)).measurements[0])
    y[t] = w_seen[t] + eta[t]
    """
    if channel not in model.output_channels:
        raise ModelError(
            f"{channel!r} measures no signal that a line defines: choose one of {', '.join(model.output_channels)}, "
            "or insert_before for an input"
        )
    seen = signal_of(model, channel)
    new = new_name or free_name(model, f"{seen}_seen")
    inserted = Line(signal(new)[t], transformation(signal(seen)[t]))
    if outer := model.edit and model.edit.places.get(channel):
        reader = _line(model, outer)
        moved = replace(reader, expression=rename_signals(reader.expression, {seen: new}))
        return _extended(model, parameters, (inserted, *(moved if line is reader else line for line in model.lines)))
    old = next(item for item in model.measurements if item.channel == channel)
    return replace(
        _extended(model, parameters, (*model.lines, inserted)),
        measurements=tuple(replace(item, signal=new) if item is old else item for item in model.measurements),
    )


def with_input_noise(model: Model, channel: str, noise: str | None = None) -> Model:
    """Return the model with an input measured with noise, ``u[t] = u_true[t] + zeta[t]`` (2.6).

    Raises
    ------
    ModelError
        If the channel is not an input, or noisy already.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> print(OutputError().with_input_noise("u").measurements[1])
    u[t] = u_true[t] + zeta[t]
    """
    exact = [item for item in model.measurements if item.channel == channel and item.noise is None]
    if exact and exact[0].signal in model.inputs:
        noisy = replace(exact[0], noise=noise or free_name(model, "zeta"))
        return replace(model, measurements=tuple(noisy if item is exact[0] else item for item in model.measurements))
    if channel not in model.inputs:
        raise ModelError(f"{channel!r} is not an exact input: choose one of {', '.join(model.inputs)}")
    measured = [item for item in model.measurements if item.signal == channel]
    if measured:
        raise ModelError(f"{channel!r} is measured by {measured[0].channel!r} already: change that measurement")
    true = free_name(model, f"{channel}_true")
    lines = tuple(replace(line, expression=rename_signals(line.expression, {channel: true})) for line in model.lines)
    measurement = Measurement(channel, true, noise or free_name(model, "zeta"))
    return replace(model, lines=lines, measurements=(*model.measurements, measurement))


def rename_channels(model: Model, names: Mapping[str, str], reserved: Iterable[str] = ()) -> Model:
    """Return the model for data whose channels have other names.

    A signal or noise of the model with the name of a channel gets another name. A parameter keeps its name: an input
    channel with that name is read under another one.

    Parameters
    ----------
    names
        Channel of the data by channel of the model; channels that are not listed keep their names.
    reserved
        Further names that signals and noises of the model must not have.

    Raises
    ------
    ModelError
        If one channel stands for two of the model, or a name is not a valid identifier.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> print(rename_channels(OutputError(), {"u": "w"}).lines[0])
    w2[t] = -a1*w2[t - 1] + b0*w[t - 1]
    """
    channels = {old: names.get(old, old) for old in model.channels}
    for channel in channels.values():
        check_name(channel, "channel")
    for channel, count in Counter(channels.values()).items():
        if count > 1:
            raise ModelError(f"the channel {channel!r} stands for {count} channels of the model: rename one of them")
    parameters = {item.name for item in model.parameters}
    exact = [name for name in model.inputs if name not in {item.signal for item in model.measurements}]
    noises = [item.noise for item in model.measurements if item.noise]
    own = [*(name for name in model.inputs if name not in exact), *(line.signal for line in model.lines), *noises]
    taken = {*reserved, *channels.values(), *parameters}
    # Signals and noises that the data do not show get other names than the channels.
    renamed: dict[str, str] = {}
    for name in own:
        renamed[name] = unused(name, {*taken, *own, *renamed.values()}) if name in taken else name
    # An exact input has the name of its channel, unless a parameter has that name.
    read = []
    for name in exact:
        renamed[name] = channels[name]
        if channels[name] in parameters:
            renamed[name] = unused(channels[name], {*taken, *renamed.values()})
            read.append(Measurement(channels[name], renamed[name], None))
    changed = {old: new for old, new in renamed.items() if old != new}
    if not changed and all(old == new for old, new in channels.items()):
        return model
    lines = tuple(
        replace(line, target=signal(renamed[line.signal])[t], expression=rename_signals(line.expression, changed))
        for line in model.lines
    )
    measurements = (
        replace(
            item, channel=channels[item.channel], signal=renamed[item.signal], noise=item.noise and renamed[item.noise]
        )
        for item in model.measurements
    )
    origins = {changed.get(name, name): origin for name, origin in model.origins.items()}
    units = {channels.get(name) or changed.get(name, name): unit for name, unit in model.units.items()}
    bounds = {changed.get(name, name): box for name, box in model.bounds.items()}
    readings = (*measurements, *read)
    return replace(model, lines=lines, measurements=readings, origins=origins, units=units, bounds=bounds)
