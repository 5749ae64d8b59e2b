"""Power law: the state decays as w^x, not as w.

In the increment ``-leak w + ...`` the leak becomes ``leak w |w/S|^(x-1)``, S the scale of the output that shows w; x =
1 is linear. Where a model has a known exponent, as the reactor, that one is released instead. States that flow into
one another (tanks in succession) share one exponent, and the flow between them follows the same law. References:
hybrid thesis, section 5.2 (reaction order); Schoukens and Noel, Three benchmarks addressing open challenges in
nonlinear system identification, IFAC (2017) (cascaded tanks, which empty with the root of their level).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial

import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.naming import fresh
from smid.diagnosis.effects.parts.outflow import cascade_name, cascades, with_outflow
from smid.diagnosis.effects.parts.plant import base_parameters, scaled, shown_at, state_lines
from smid.models import Model, Parameter
from smid.models.symbols import number, plain_symbols

__all__ = ["EFFECT"]

_BOX = (0.2, 4.0)
_STARTS = (0.6, 1.5, 2.5)
# Keeps the slope at zero finite where x < 1; the null value stays exact.
_GUARD = 1e-6
_TINY = 1e-9


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Release a known exponent, else let the leak of each state follow a power."""
    known = tuple(_exponents(model))
    yield from known
    if known:
        return
    states = state_lines(model)
    for vessels in cascades(states):
        label = cascade_name(vessels, states)
        scale = number(site.scale(shown_at(model, site, vessels[0])))
        power = fresh(model, f"{vessels[0].own if len(vessels) == 1 else 'every'}_power", _BOX, "", 1.0)
        bent = with_outflow(model.with_parameter(power), vessels, states, partial(_bent, scale, power))
        yield Extension(bent, tuple({power.name: x} for x in _STARTS), label, describe=partial(_describe, label))


def _bent(scale: sympy.Expr, power: Parameter, level: sympy.Expr) -> sympy.Expr:
    return level * (sympy.Abs(level / scale) + number(_GUARD)) ** (power.symbol - 1)


def _exponents(model: Model) -> Iterator[Extension]:
    states = [state.line.expression for state in state_lines(model)]
    powers = {name for e in states for item in e.atoms(sympy.Pow) for name in plain_symbols(item.exp)}
    for parameter in base_parameters(model):
        if parameter.name in powers and parameter.lower == parameter.upper:
            exponent = fresh(model, f"{parameter.name}_power", _BOX, "", 1.0)
            extended = scaled(model, parameter, exponent)
            if extended is not None:
                extended = _of_any_sign(extended, exponent)
                starts = tuple({exponent.name: x} for x in _STARTS)
                yield Extension(extended, starts, parameter.name, describe=partial(_describe, parameter.name))


def _of_any_sign(model: Model, exponent: Parameter) -> Model:
    """Continue a power to negative numbers as an odd function: measured values near zero may be negative."""

    def odd(power: sympy.Expr) -> sympy.Expr:
        return power.base * (sympy.Abs(power.base) + number(_TINY)) ** (power.exp - 1)

    lines = tuple(
        replace(line, expression=line.expression.replace(lambda e: e.is_Pow and e.exp.has(exponent.symbol), odd))
        for line in model.lines
    )
    return replace(model, lines=lines)


def _describe(what: str, values: Mapping[str, float], site: Site) -> str:
    (power,) = values.values()
    return f"The decay of {site.output} ({what}) follows the power {power:.3g}, not 1."


EFFECT = Effect(
    "power_law",
    "the state decays as a power of itself",
    extend,
    needs="a state that decays in proportion to itself, or a known exponent",
)
