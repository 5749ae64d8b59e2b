"""Operating point: a parameter of the dynamics depends on the level, ``p -> p + p1 s``, or its pace or gain does.

s is the output over its scale, its square, or, for the pace, the input over its scale.
Reference: Toth, Modeling and Identification of Linear Parameter-Varying Systems (2010), chapter 1 (quasi-LPV).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.naming import fresh, quantity, signal_of
from smid.diagnosis.effects.plant import output_signal
from smid.diagnosis.effects.varying import extensions, sentence, told
from smid.models import Model, signal, t
from smid.models.symbols import number

__all__ = ["EFFECT"]


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Let each parameter of the states' lines, their pace and their gain follow the level."""
    w, u = signal(output_signal(model, site)), signal(signal_of(model, site.input))
    high, full = number(site.scale(site.output)), number(site.scale(site.input))
    for suffix, label, vary in (
        ("with_output", "with the output", lambda lag: w[t - lag] / high),
        ("with_square", "with the output squared", lambda lag: (w[t - lag] / high) ** 2),
    ):
        yield from extensions(model, suffix, vary, label=label, states_only=True)
    # What depends on the level often levels off: a spring or slack that is taken up.
    half = fresh(model, "half_level", (0.01 * site.scale(site.output), site.scale(site.output)), site.unit(site.output))
    yield from extensions(
        model,
        "with_level",
        lambda lag: w[t - lag] / (sympy.Abs(w[t - lag]) + half.symbol),
        (half, (0.1 * half.upper, 0.4 * half.upper)),
        label="with the output, levelling off",
        parameters=False,
        kinds=("pace",),
    )
    # A gain that depends on the input is a curve of the input, another effect: only the pace is left.
    yield from extensions(
        model,
        "with_input",
        lambda lag: u[t - lag] / full,
        label="with the input",
        states_only=True,
        parameters=False,
        kinds=("pace",),
    )


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say how much the parameter moves over the range."""
    name, amount = next((n, v) for n, v in values.items() if not n.startswith("half_level"))
    parameter, what = name.rsplit("_with_", 1)
    channel = site.input if what.startswith("input") else site.output
    full = quantity(site.scale(channel), site.unit(channel))
    way = "with the square of" if what.startswith("square") else "with"
    named, much = told(parameter, amount)
    return f"{sentence(named)} depends on the level: {way} {channel} it changes {much} from zero to {full}."


EFFECT = Effect(
    "operating_point",
    "a parameter of the dynamics depends on the level",
    extend,
    describe,
    rivals=("power_law", "input_curve", "output_curve", "quadratic_drag", "direction_dependence"),
    needs="parameters in the lines of the states",
)
