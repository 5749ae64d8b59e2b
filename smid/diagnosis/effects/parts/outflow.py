"""What leaves the states that decay, and where it flows: a law of outflow for a whole cascade at once.

In a line ``-leak w + ...`` the leak is the outflow of w; where another line reads ``inflow w``, it enters that state.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import chain

import sympy

from smid.diagnosis.effects.parts.plant import StateLine
from smid.models import Model

__all__ = ["cascade_name", "cascades", "with_outflow"]


def cascades(states: Sequence[StateLine]) -> list[list[StateLine]]:
    """Group the states that decay, those that flow into one another together."""
    groups: list[list[StateLine]] = []
    for state in (state for state in states if state.leak != 0):
        linked = [g for g in groups if any(state.inflow(other) != 0 or other.inflow(state) != 0 for other in g)]
        groups = [g for g in groups if g not in linked] + [[*chain.from_iterable(linked), state]]
    return groups


def cascade_name(vessels: Sequence[StateLine], states: Sequence[StateLine]) -> str:
    """Say which states a group is."""
    if len(vessels) == 1:
        return vessels[0].own
    return "every state" if len(vessels) == len(states) else f"{vessels[0].own} and what it flows into"


def with_outflow(
    model: Model,
    vessels: Sequence[StateLine],
    states: Sequence[StateLine],
    law: Callable[[sympy.Expr], sympy.Expr],
) -> Model:
    """Let each vessel empty with ``law(level)`` in the place of its level; what leaves it enters the states below."""
    for vessel in vessels:
        change = law(vessel.level) - vessel.level
        model = model.add_term(vessel.line.signal, -vessel.leak * change)
        for other in states:
            model = model.add_term(other.line.signal, other.inflow(vessel) * change)
    return model
