"""Quadratic drag: a force against motion in proportion to the square of speed, ``-b v |v|``.

References: hybrid thesis, section 5.3 (aerodynamic resistance of the arm); Strang, SIAM Journal on Numerical Analysis 5
(1968) 506-517 (splitting a step).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.motion import Motion, motions
from smid.diagnosis.effects.parts.naming import find, fresh, quantity
from smid.models import Model, Parameter, signal, t
from smid.models.symbols import swapped

__all__ = ["EFFECT"]


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put it on each motion: as a term of its rate or step, and in a step as what drag does all along it."""
    for motion in motions(model, site):
        usual = motion.force_scale / motion.speed_scale**2
        drag = fresh(model, f"{motion.kind}_drag", (0, 10 * usual), "", 0.0)
        starts = tuple({drag.name: share * usual} for share in (0.1, 0.02, 0.5))
        label, line = f"{motion.state.own} as {motion.kind}", motion.state.line
        force = drag.symbol * motion.speed * sympy.Abs(motion.speed)
        yield Extension(model.add_term(line.signal, -force, [drag]), starts, label)
        if not line.rate:
            yield Extension(_along_a_step(model, motion, drag), starts, f"{label}, along the step")


def _along_a_step(model: Model, motion: Motion, drag: Parameter) -> Model:
    """Let drag act for half a step, then the rest of the model, then drag for the other half.

    Alone it takes a speed v to ``v / (1 + b |v|)`` within a step, however long that is.
    """

    def slowed(v: sympy.Expr) -> sympy.Expr:
        return v / (1 + drag.symbol * sympy.Abs(v) / 2)

    line, state = motion.state.line, signal(motion.state.own)
    last = state[t - 1]
    if motion.kind == "speed":
        model = model.replace_line(line.signal, swapped(line.expression, {last: slowed(last)}), [drag])
        return model.insert_after(line.signal, slowed)
    before = {state[t - 2]: last - slowed(last - state[t - 2])}
    model = model.replace_line(line.signal, swapped(line.expression, before), [drag])
    return model.insert_after(line.signal, lambda w: last + slowed(w - last))


def describe(values: Mapping[str, float], site: Site) -> str:  # noqa: ARG001  (every effect is called alike)
    """Say how large it is."""
    return (
        f"A force against motion grows with the square of speed: {quantity(find(values, 'drag') or 0.0)} times speed "
        "squared."
    )


EFFECT = Effect(
    "quadratic_drag",
    "a force against motion that grows with the square of speed",
    extend,
    describe,
    needs="a state that is the output, or a speed",
)
