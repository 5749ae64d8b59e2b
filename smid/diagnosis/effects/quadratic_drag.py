"""Quadratic drag: a force against motion in proportion to the square of speed, ``-b v |v|``.

Reference: hybrid thesis, section 5.3 (aerodynamic resistance of the arm).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.motion import motions
from smid.diagnosis.effects.naming import find, fresh, quantity
from smid.models import Model

__all__ = ["EFFECT"]


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put it on each motion."""
    for motion in motions(model, site):
        state = motion.state
        usual = motion.force_scale / motion.speed_scale**2
        drag = fresh(model, f"{motion.kind}_drag", (0, 10 * usual), "", 0.0)
        yield Extension(
            model.add_term(state.line.signal, -drag.symbol * motion.speed * sympy.Abs(motion.speed), [drag]),
            tuple({drag.name: share * usual} for share in (0.1, 0.02, 0.5)),
            f"{state.own} as {motion.kind}",
        )


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
    rivals=("viscous_friction", "coulomb_friction", "power_law", "operating_point"),
    needs="a state that is the output, or a speed",
)
