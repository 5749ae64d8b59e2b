"""Edits of a model's parameters and priors, each giving a new model; methods of `Model`."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

import sympy

from smid.models.errors import ModelError
from smid.models.expressions import shown
from smid.models.parts import Edit, Parameter
from smid.models.symbols import canonical, number, swapped

if TYPE_CHECKING:
    from smid.models.model import Model

__all__ = [
    "bound",
    "edited_by",
    "find_parameter",
    "fix",
    "substitute",
    "with_constraint",
    "with_parameter",
    "with_values",
]


def find_parameter(model: Model, name: str) -> Parameter:
    """Find a parameter by name, or raise a `ModelError` that lists those there are."""
    for parameter in model.parameters:
        if parameter.name == name:
            return parameter
    names = ", ".join(parameter.name for parameter in model.parameters)
    raise ModelError(f"the model has no parameter {name!r}: its parameters are {names}")


def edited_by(
    model: Model, origin: str, reserved: Iterable[str] = (), places: Mapping[str, str] = MappingProxyType({})
) -> Model:
    """Return the model with an origin for all parameters and signals that the following edits add.

    Parameters
    ----------
    origin
        Name of the effect; "" ends its edits.
    reserved
        Names that new signals and parameters must not take, beside those of the model.
    places
        Where the edits are made, see `smid.models.parts.Edit`; by default next to the channels.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> model = OutputError().edited_by("friction").with_parameter(Parameter("Fc", 0))
    >>> dict(model.origins)
    {'Fc': 'friction'}
    """
    return replace(model, edit=Edit(origin, frozenset(reserved), places) if origin else None)


def origins_with(model: Model, added: Iterable[str]) -> dict[str, str]:
    """Return the origins of the model, and that of the edit for what is added."""
    return {**model.origins, **(dict.fromkeys(added, model.edit.origin) if model.edit else {})}


def with_parameter(model: Model, *parameters: Parameter) -> Model:
    """Add parameters, for later edits to use.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> [p.name for p in OutputError().with_parameter(Parameter("Fc", 0)).parameters]
    ['a1', 'b0', 'Fc']
    """
    origins = origins_with(model, (item.name for item in parameters))
    return replace(model, parameters=(*model.parameters, *parameters), origins=origins)


def with_values(model: Model, values: Mapping[str, float]) -> Model:
    """Set parameter values, keeping those already set.

    Raises
    ------
    ModelError
        If a name is not the name of a parameter, or a value is not finite.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> dict(OutputError().with_values({"a1": -0.5}).values)
    {'a1': -0.5}
    """
    return replace(model, values={**model.values, **values})


def fix(model: Model, **values: float) -> Model:
    """Replace parameters by numbers.

    Raises
    ------
    ModelError
        If a number lies outside the box or contradicts a constraint.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> print(OutputError().fix(a1=-0.5).lines[0].expression)
    b0*u[t - 1] + w[t - 1]/2
    """
    for name, value in values.items():
        parameter = find_parameter(model, name)
        if not (math.isfinite(value) and parameter.lower <= value <= parameter.upper):
            box = f"[{parameter.lower:g}, {parameter.upper:g}]"
            raise ModelError(f"{name} = {value} lies outside its box {box}: change the value or the box")
        model = _replace_symbol(model, parameter, number(value), ())
    return model


def bound(model: Model, **boxes: tuple[float, float]) -> Model:
    """Replace the boxes of parameters, and bound hidden states: signals with memory that no channel measures.

    Raises
    ------
    ModelError
        If a box is empty, the name unknown, or the signal measured; bounds of a state must be finite.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> OutputError().bound(a1=(-1, 0)).parameter("a1").upper
    0
    """
    states = set(model.states) - {m.signal for m in model.measurements}
    known = {parameter.name for parameter in model.parameters}
    for name, (low, high) in boxes.items():
        if name in known:
            continue
        if name not in {line.signal for line in model.lines}:
            find_parameter(model, name)
        if name not in states:
            raise ModelError(
                f"{name!r} is not a hidden state: its bounds follow from a channel, or from the signals in its line"
            )
        if not (math.isfinite(low) and math.isfinite(high) and low <= high):
            raise ModelError(f"the bounds of {name!r} are [{low}, {high}]: give finite ones, the lower one first")
    changed = tuple(
        replace(parameter, lower=boxes[parameter.name][0], upper=boxes[parameter.name][1])
        if parameter.name in boxes
        else parameter
        for parameter in model.parameters
    )
    signals = {name: box for name, box in boxes.items() if name not in known}
    return replace(model, parameters=changed, bounds={**model.bounds, **signals})


def substitute(model: Model, name: str, expression: sympy.Expr, new_parameters: Iterable[Parameter] = ()) -> Model:
    """Replace a parameter by an expression, as in ``alpha -> alpha0 + alpha1 T[t]``.

    An expression in parameters keeps the old box and constraints, now as constraints on the new parameters.
    An expression that reads a signal varies in time: constraints on the old constant, and its box, no longer
    mean anything and are dropped, which can only enlarge the feasible set.

    Raises
    ------
    ModelError
        If a sensor's curve uses the parameter and the expression reads a signal.

    Examples
    --------
    >>> from smid.models import OutputError, signal, t
    >>> k = Parameter("k")
    >>> print(OutputError().substitute("b0", k.symbol * signal("T")[t], [k]).lines[0].expression)
    -a1*w[t - 1] + k*T[t]*u[t - 1]
    """
    return _replace_symbol(model, find_parameter(model, name), canonical(expression), new_parameters)


def _without_denominator(constraint: sympy.Expr, parameters: Iterable[Parameter]) -> sympy.Expr:
    """Multiply ``constraint >= 0`` by a denominator that the boxes show to be positive, for a polynomial."""
    signs = {item.symbol: sympy.Dummy(nonnegative=True) for item in parameters if item.lower >= 0}
    numerator, denominator = sympy.fraction(sympy.together(constraint))
    # A zero there belongs to no value of the old parameter, and the numerator's sign can only admit more.
    return numerator if denominator.xreplace(signs).is_nonnegative and not denominator.is_number else constraint


def _replace_symbol(model: Model, old: Parameter, expression: sympy.Expr, new_parameters: Iterable[Parameter]) -> Model:
    new_parameters = tuple(new_parameters)
    swap = {old.symbol: expression}
    constraints = model.constraints
    if expression.atoms(sympy.Indexed):
        constraints = tuple(item for item in constraints if old.symbol not in item.free_symbols)
    else:
        if not expression.is_number:
            box = (expression - number(old.lower),) if math.isfinite(old.lower) else ()
            box += (number(old.upper) - expression,) if math.isfinite(old.upper) else ()
            constraints += tuple(_without_denominator(item, (*model.parameters, *new_parameters)) for item in box)
        constraints = tuple(item.xreplace(swap) for item in constraints)
        for before, after in zip(model.constraints, constraints, strict=False):
            if after.is_negative:
                clash = f"{old.name} = {shown(expression)} contradicts '{shown(before)} >= 0'"
                raise ModelError(f"{clash}: change one of them")
        constraints = tuple(item for item in constraints if not item.is_number)
    return replace(
        model,
        parameters=(*(item for item in model.parameters if item.name != old.name), *new_parameters),
        lines=tuple(replace(line, expression=swapped(line.expression, swap)) for line in model.lines),
        measurements=tuple(
            item if item.inverse is None else replace(item, inverse=item.inverse.xreplace(swap))
            for item in model.measurements
        ),
        constraints=constraints,
        values={name: value for name, value in model.values.items() if name != old.name},
        origins=origins_with(model, (item.name for item in new_parameters)),
    )


def with_constraint(model: Model, *expressions: sympy.Expr) -> Model:
    """Add prior knowledge: each expression in the parameters is >= 0.

    Raises
    ------
    ModelError
        If an expression reads a signal or an unknown parameter.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> OutputError().with_constraint(1 - sympy.Symbol("a1")).constraints
    (1 - a1,)
    """
    return replace(model, constraints=(*model.constraints, *expressions))
