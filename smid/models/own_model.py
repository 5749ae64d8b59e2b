"""A model from equations as text, and back: what a model file of the class ``OwnModel`` holds.

Each name in an equation is a parameter, an input, or a signal with an equation of its own; so a name that is misspelt
is none of them, and is refused. A signal without an index is the signal now: ``level`` is ``level[t]``.
"""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from inspect import Signature, signature
from numbers import Real
from typing import Any

import sympy

from smid.models.errors import ModelError, refuse_unknown
from smid.models.expressions import Refusal, TextError, constraints_from_text, from_text, to_text
from smid.models.model import Model
from smid.models.parts import Line, Measurement, Parameter, check_name
from smid.models.symbols import VALUE, signal, t, unused
from smid.models.units import check_units

__all__ = ["Box", "Channels", "OwnModel", "fields_of"]

Channels = Sequence[str] | Mapping[str, str | Mapping[str, Any] | Sequence[Mapping[str, Any]]]
"""Channels, or the signal that each channel shows; a table gives ``signal``, ``noise`` and ``inverse``."""

Box = float | tuple[float, float] | Mapping[str, Any]
"""What is known of a parameter: its value, a range, or a table of ``range``, ``unit`` and ``null``."""

_EQUATION = re.compile(r"\s*(?P<rate>d\s*/\s*dt\s+)?(?P<name>\w+)\s*(?:\[\s*t\s*\]\s*)?=(?!=)(?P<right>.*)", re.DOTALL)


def OwnModel(
    equations: Sequence[str],
    outputs: Channels,
    inputs: Channels = (),
    parameters: Mapping[str, Box] = {},
    *,
    constraints: Sequence[str] = (),
    units: Mapping[str, str] = {},
    values: Mapping[str, float] = {},
    name: str = "own model",
    description: str = "",
    scheme: str = "rk4",
    substeps: int = 1,
    sampling_time: float | None = None,
    origins: Mapping[str, str] = {},
    bounds: Mapping[str, tuple[float, float]] = {},
) -> Model:
    """Return a model of equations that are given as text.

    Parameters
    ----------
    equations
        One for each signal: ``"w[t] = -a*w[t-1] + b*u[t-1]"``, or ``"d/dt level = (k*u - c*sqrt(level))/A"`` with
        times in seconds.
    outputs
        Channels that measure signals with equations: names, or by channel the signal, or a table of ``signal``,
        ``noise`` (true, false or its name; true if not given) and ``inverse``, the inverse curve of the sensor in
        ``value``.
    inputs
        Channels of the inputs: names, or tables as for the outputs. An input is exact unless ``noise`` is given.
    parameters
        By name: a number that is known, a range ``[lower, upper]``, or a table of ``range``, ``unit`` and ``null``,
        the value at which the parameter has no effect.
    constraints
        Prior knowledge on parameters, as in ``"a1 + a2 <= 1"``.
    units
        Of channels and signals, as in ``{"level": "m"}``. Data in other units are refused, and so is an equation whose
        terms have different units, as far as units are known (see `smid.models.units`).
    values
        Values of parameters where they are known, such as those of a central model.
    name, description
        For the reader.
    scheme
        How equations ``d/dt`` are integrated: ``euler``, ``trapezoidal``, ``rk4`` or ``rosenbrock``.
    substeps
        Steps of the scheme per sample.
    sampling_time
        In seconds; by default that of the record.
    origins
        Effects that added parameters and signals, by name: a diagnosis writes them.

    bounds
        Of hidden states, signals with an equation that no output shows: by name ``[lower, upper]``, which holds at all
        samples.

    Raises
    ------
    ModelError
        If an equation cannot be read, a name in it has neither range, nor equation, nor input, or units differ.

    Examples
    --------
    >>> print(OwnModel(["d/dt level = (k*u - c*level)/A"], ["level"], ["u"], {"k": [0, 9], "c": [0, 1], "A": 2}))
    own model
      d/dt level_true[t] = (-c*level_true[t] + k*u[t])/A
      level[t] = level_true[t] + eta[t]
      k in [0, 9]
      c in [0, 1]
      A in [2, 2]
      integrated by rk4, 1 step per sample, inputs held
    """
    for what, texts in (("equations", equations), ("constraints", constraints)):
        if isinstance(texts, str) or not all(isinstance(text, str) for text in texts):
            raise ModelError(f"{what} is {texts!r}: give a list of texts")
    known = tuple(_parameter(key, entry) for key, entry in parameters.items())
    split = [_Equation.of(text) for text in equations]
    shown = [_Shown.of("output", *item) for item in _entries("outputs", outputs)]
    given = [_Shown.of("input", *item) for item in _entries("inputs", inputs)]
    own = [part.name for part in split]
    _check_roles(shown, given, own)
    # A measured signal cannot have the name of a channel.
    measured = [*shown, *(item for item in given if item.is_measured)]
    names = dict.fromkeys([*own, *(item.signal for item in given)])
    taken = {*names, *parameters, *(item.channel for item in (*shown, *given))}
    hidden = {item.channel for item in measured}
    signals = {name: unused(f"{name}_true", taken) if name in hidden else name for name in names}
    taken |= set(signals.values())

    in_equations = _Names(parameters.keys(), signals)
    lines = [Line(signal(signals[part.name])[t], in_equations.read(part.text, part.start), part.rate) for part in split]
    read = {name for line in lines for name, _ in line.reads}
    for item in given:
        # A channel with the name of a parameter may wait for an effect that reads it.
        if signals[item.signal] not in read and item.channel not in parameters:
            raise ModelError(f"the input {item.channel!r} is in no equation: use it in one, or leave it out")
    measurements = []
    for item in measured:
        noise = unused(item.kind_of_noise, taken) if item.noise is True else item.noise or None
        taken.add(noise or "")
        inverse = None if item.inverse is None else _Names({*parameters, VALUE.name}).read(item.inverse)
        measurements.append(Measurement(item.channel, signals[item.signal], noise, inverse))
    in_constraints = _Names(parameters.keys()).visit
    known_of_parameters = tuple(one for text in constraints for one in constraints_from_text(text, in_constraints))
    integration: dict[str, Any] = {"scheme": scheme, "substeps": substeps, "sampling_time": sampling_time}
    model = Model(
        name,
        known,
        tuple(lines),
        tuple(measurements),
        known_of_parameters,
        values,
        description,
        origins=origins,
        units=units,
        **integration,
    )
    refuse_unknown("channel or signal in units", units, (*model.channels, *(line.signal for line in model.lines)))
    check_units(model)
    refuse_unknown("hidden state in bounds", bounds, set(own) - {item.signal for item in measured})
    return model.bound(**bounds)


@dataclass(frozen=True)
class _Equation:
    """The left-hand side of an equation, and where its right-hand side starts."""

    text: str
    name: str
    rate: bool
    start: int

    @staticmethod
    def of(text: str) -> _Equation:
        found = _EQUATION.match(text)
        if found is None:
            raise TextError(text, 1, "an equation begins with the signal that it defines: write w[t] = or d/dt w =")
        return _Equation(text, found["name"], found["rate"] is not None, found.start("right"))


@dataclass(frozen=True)
class _Names(ast.NodeTransformer):
    """The names that a text may use: parameters, and signals with their names in the model."""

    parameters: Collection[str]
    signals: Mapping[str, str] = field(default_factory=dict)

    def read(self, text: str, start: int = 0) -> sympy.Expr:
        """Return the expression in a text from a column on; a signal without an index is the signal now."""
        try:
            return from_text(" " * start + text[start:], self.visit)
        except TextError as error:
            raise TextError(text, error.column, error.why) from None

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if node.id in self.parameters:
            return node
        now = ast.Name("t", ast.Load())
        return ast.copy_location(ast.Subscript(self._signal(node), ast.copy_location(now, node), ast.Load()), node)

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        if not isinstance(node.value, ast.Name):
            return node
        if node.value.id in self.parameters and node.value.id not in self.signals:
            raise Refusal(node, f"{node.value.id!r} is a parameter: leave out its index")
        return ast.copy_location(ast.Subscript(self._signal(node.value), node.slice, ast.Load()), node)

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        return node  # refused as it is written

    def visit_Call(self, node: ast.Call) -> ast.expr:
        return ast.copy_location(ast.Call(node.func, [self.visit(item) for item in node.args], node.keywords), node)

    def _signal(self, node: ast.Name) -> ast.Name:
        if node.id not in self.signals:
            raise Refusal(node, self._advice(node.id))
        return ast.copy_location(ast.Name(self.signals[node.id], ast.Load()), node)

    def _advice(self, name: str) -> str:
        if "__" in name:
            return f"the name {name!r} holds '__': take another one"
        near = get_close_matches(name, [*self.parameters, *self.signals], n=1)
        hint = f", did you mean {near[0]!r}?" if near else ":"
        if not self.signals:
            return f"{name!r} is no parameter{hint} give its range in parameters, as in {name} = [0, 1]"
        return (
            f"{name!r} is no parameter, no input, and has no equation{hint} give its range in parameters, as in "
            f"{name} = [0, 1], or name it in inputs"
        )


@dataclass(frozen=True)
class _Shown:
    """A channel and the signal that it shows."""

    role: str
    channel: str
    signal: str
    noise: str | bool
    inverse: str | None

    @staticmethod
    def of(role: str, channel: str, entry: str | Mapping[str, Any]) -> _Shown:
        check_name(channel, "channel")
        place = f"the {role} {channel!r}"
        given = {"signal": entry} if isinstance(entry, str) else entry
        if not isinstance(given, Mapping):
            raise ModelError(f"{place} is {entry!r}: give the name of a signal, or a table")
        refuse_unknown(f"entry of {place}", given, ("signal", "noise", "inverse"))
        made = {"signal": channel, "noise": role == "output", "inverse": None, **given}
        if not isinstance(made["noise"], str | bool):
            raise ModelError(f"the noise of {place} is {made['noise']!r}: give true, false or a name")
        if not isinstance(made["inverse"], str | None):
            raise ModelError(f"the inverse of {place} is {made['inverse']!r}: give a text in value")
        check_name(made["signal"], "signal")
        return _Shown(role, channel, **made)

    @property
    def is_measured(self) -> bool:
        """Whether the channel differs from the signal."""
        return self.noise is not False or self.inverse is not None or self.channel != self.signal

    @property
    def kind_of_noise(self) -> str:
        return "eta" if self.role == "output" else "zeta"


def _entries(role: str, channels: Channels) -> Iterator[tuple[str, Any]]:
    """Yield each channel with what is said of it; several signals may be readings of one channel."""
    if isinstance(channels, str):
        raise ModelError(f"{role} is {channels!r}: give a list of channels, or a table")
    for channel in channels:
        entry = channels[channel] if isinstance(channels, Mapping) else {}
        for one in entry if isinstance(entry, list | tuple) else (entry,):
            yield channel, one


def _check_roles(shown: Sequence[_Shown], given: Sequence[_Shown], own: Sequence[str]) -> None:
    """Refuse an output without an equation, and an input with one."""
    for item in shown:
        if item.signal not in own:
            listed = ", ".join(own) or "none"
            raise ModelError(
                f"the output {item.channel!r} shows {item.signal!r}, which has no equation: add "
                f"{item.signal}[t] = ..., or name a signal that has one ({listed})"
            )
    for item in given:
        if item.signal in own:
            raise ModelError(f"the input {item.signal!r} has an equation: remove the equation, or name it in outputs")


def _parameter(name: str, entry: Any) -> Parameter:
    given = entry if isinstance(entry, Mapping) else {"range": entry}
    refuse_unknown(f"entry of parameter {name!r}", given, ("range", "unit", "null"))
    span, unit, null = given.get("range", (-math.inf, math.inf)), given.get("unit", ""), given.get("null")
    ends = tuple(span) if isinstance(span, list | tuple) else (span, span)
    if len(ends) != 2 or not all(map(_is_number, ends)):
        raise ModelError(f"parameter {name!r} is {span!r}: give its value, or a range [lower, upper]")
    if not isinstance(unit, str):
        raise ModelError(f"the unit of parameter {name!r} is {unit!r}: give a text")
    if null is not None and not _is_number(null):
        raise ModelError(f"null of parameter {name!r} is {null!r}: give the number at which it has no effect")
    return Parameter(name, ends[0], ends[1], unit, null)


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool) and not math.isnan(value)


def fields_of(model: Model) -> dict[str, Any]:
    """Return the fields with which `OwnModel` makes this model again; what has its default is left out.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> fields_of(OutputError(fixed={"a1": -0.5}))["equations"]
    ['w[t] = b0*u[t - 1] + w[t - 1]/2']
    """
    own = {line.signal for line in model.lines}
    shown: dict[str, dict[str, Any]] = {"outputs": {}, "inputs": {}}
    measured = {item.signal for item in model.measurements}
    for name in model.inputs:
        if name not in measured:
            shown["inputs"][name] = name
    for item in model.measurements:
        entry = {"signal": item.signal, "noise": item.noise or False}
        if item.inverse is not None:
            entry["inverse"] = to_text(item.inverse)
        side = shown["outputs" if item.signal in own else "inputs"]
        side.setdefault(item.channel, []).append(entry)
    defaults = {name: one.default for name, one in signature(OwnModel).parameters.items()}
    fields = {
        "name": model.name,
        "description": model.description,
        "equations": [
            f"{'d/dt ' if line.rate else ''}{line.target} = {to_text(line.expression)}" for line in model.lines
        ],
        "constraints": [f"{to_text(bound)} >= 0" for bound in model.constraints],
        "scheme": model.scheme,
        "substeps": model.substeps,
        "sampling_time": model.sampling_time,
        "outputs": {channel: _short(entry) for channel, entry in shown["outputs"].items()},
        "inputs": {channel: _short(entry) for channel, entry in shown["inputs"].items()},
        "parameters": {item.name: _box(item) for item in model.parameters},
        "units": dict(model.units),
        "values": dict(model.values),
        "origins": dict(model.origins),
        "bounds": {name: list(box) for name, box in model.bounds.items()},
    }
    # The defaults of lists and tables are empty.
    return {
        name: value
        for name, value in fields.items()
        if defaults[name] is Signature.empty or (value if isinstance(value, list | dict) else value != defaults[name])
    }


def _short(entry: Any) -> Any:
    return entry[0] if isinstance(entry, list) and len(entry) == 1 else entry


def _box(parameter: Parameter) -> Any:
    span = parameter.lower if parameter.lower == parameter.upper else [parameter.lower, parameter.upper]
    more = {"unit": parameter.unit or None, "null": parameter.null}
    given = {name: value for name, value in more.items() if value is not None}
    return {"range": span, **given} if given else span
