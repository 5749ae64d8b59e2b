"""Direction: rising and falling follow different dynamics.

Of the output: the increment e of a state becomes ``e + c |e|``, faster by 1 + c up and 1 - c down; a line of order two
goes on at this pace (`smid.diagnosis.effects.parts.stretched`).  Of the input: a parameter becomes ``p + dp d`` with d
= +1 after the input rose and -1 after it fell, held while it stands still.
Reference: the filling and emptying of the clutch, hybrid thesis.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial

import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.naming import free_name, fresh, signal_of
from smid.diagnosis.effects.parts.plant import output_signal, state_lines, with_increment
from smid.diagnosis.effects.parts.stretched import stretched
from smid.diagnosis.effects.parts.varying import Varied, extensions
from smid.models import Model, signal, t

__all__ = ["EFFECT"]


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Scale the increment of each state by its sign; then let parameters depend on the direction of output or input."""
    for state in state_lines(model):
        bend = fresh(model, f"{state.own}_directional", (-0.95, 0.95), "", 0.0)
        extended = stretched(model, state, partial(_by_direction, bend.symbol), [bend])
        if extended is None:
            size = sympy.Abs(state.increment, evaluate=False)  # see `swapped`
            extended = with_increment(model, state, state.increment + bend.symbol * size, [bend])
        yield Extension(
            extended, ({bend.name: 0.3}, {bend.name: -0.3}), f"{state.own} rising and falling", describe=_bent
        )
    w = signal(output_signal(model, site))
    yield from extensions(
        model,
        "with_rise",
        lambda lag: sympy.sign(w[t - lag] - w[t - lag - 1]),
        partial(_differs, site.output),
        label=f"with the direction of {site.output}",
        states_only=True,
        kinds=("gain",),  # the time constant varies in the extensions above
    )
    name = free_name(model, f"{site.input}_direction")
    u, d = signal(signal_of(model, site.input)), signal(name)
    way = sympy.sign(u[t] - u[t - 1])
    turned = model.with_line(name, way + (1 - sympy.Abs(way)) * d[t - 1])
    # A gain that depends on the input's direction is another effect, hysteresis.
    yield from extensions(
        turned,
        "with_direction",
        lambda lag: d[t - lag],
        partial(_differs, site.input),
        label=f"with the direction of {site.input}",
        states_only=True,
        kinds=("pace",),
    )


def _by_direction(bend: sympy.Expr, increment: sympy.Expr) -> sympy.Expr:
    return 1 + bend * sympy.sign(increment)


def _bent(values: Mapping[str, float], site: Site) -> str:
    (bend,) = values.values()
    return f"{site.output} rises at {1 + bend:.0%} and falls at {1 - bend:.0%} of the speed the model gives."


def _differs(channel: str, varied: Varied, values: Mapping[str, float], _site: Site) -> str:
    return f"{varied.what} differs {varied.much(values, 2)} between a rising and a falling {channel}."


EFFECT = Effect(
    "direction_dependence",
    "rising and falling follow different dynamics",
    extend,
    needs="a model with a state",
)
