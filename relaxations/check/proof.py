"""A proof is a list of steps. Each step applies one rule, and may use the theorems and the box of earlier steps."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from relaxations.check import steps
from relaxations.check.rules.bound import bound
from relaxations.check.rules.branches import branches
from relaxations.check.rules.cuts import cuts
from relaxations.check.rules.fixed import fixed
from relaxations.check.rules.hull import hull
from relaxations.check.rules.level import level
from relaxations.check.rules.quotient import quotient
from relaxations.check.rules.reach import reach
from relaxations.check.rules.sides import sides
from relaxations.check.statement import Context, Prove, Theorem, emptiness, settle, tighten

Rule = Callable[[Any, Context, Prove], list[Theorem]]

RULES: dict[type, Rule] = {
    steps.Bound: bound,
    steps.Branches: branches,
    steps.Cuts: cuts,
    steps.Fixed: fixed,
    steps.Hull: hull,
    steps.Level: level,
    steps.Quotient: quotient,
    steps.Reach: reach,
    steps.Sides: sides,
}


def prove(proof: Iterable[Any], context: Context) -> bool:
    """Apply the steps, add their theorems to the context, and return whether the set is proven empty.

    Invariant: every point of the context's set lies in its box and satisfies its theorems. The head of each rule proves
    that the rule keeps the invariant. A theorem about one variable narrows the box.
    """
    empty = settle(context)
    for number, step in enumerate(proof, start=1):
        if empty:  # further claims are trivially true
            break
        here = context.at(number)
        for theorem in RULES[type(step)](step, here, prove):
            context.proven.append(theorem)
            tighten(context.box, theorem)
            empty = empty or theorem.empty
        empty = settle(here) or empty
    return empty


def conclusion(proof: Iterable[Any], context: Context) -> list[Theorem]:
    """Return the theorems of a whole proof."""
    if prove(proof, context) and not any(theorem.empty for theorem in context.proven):
        context.proven.append(emptiness("all steps"))
    return context.proven
