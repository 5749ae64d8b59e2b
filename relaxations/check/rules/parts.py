"""Parts of the set, shared by the rules of branches and of hulls.

Claim: every point of the set lies in one of the parts. One of three conditions is checked.

- The parts are ranges of one variable, and their union covers the variable's box.
- The parts are ranges, and an equality is a single monomial. At every point one of its variables is zero. For each
  variable that can be zero, a range of this variable contains zero.
- The parts are both sides of one positive part ``max(0, a)``: at every point a >= 0 or a <= 0. (A sign that is zero
  belongs to neither side, so its sides are refused.)
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from relaxations.check.rules.bound import at_most
from relaxations.check.statement import Box, Context, Prove, Theorem, may_vanish, narrow
from relaxations.check.steps import OneSide, Range


@dataclass(frozen=True)
class Part:
    """A part after its steps: its box, its theorems, and whether it is proven empty."""

    where: str
    box: Box
    proven: list[Theorem]
    empty: bool


def parts(given: Iterable[Range | OneSide], equality: int | None, context: Context, prove: Prove) -> Iterator[Part]:
    """Check the steps of each part and, after the last one, that the parts cover the set."""
    ranges: list[Range] = []
    sides: list[OneSide] = []
    # Apply the steps of each part on its range or side.
    for number, part in enumerate(given, start=1):
        stated = context.stated
        if isinstance(part, OneSide):
            kink = stated.kink(part.kink, context.where)
            context.require(not kink.sign, f"part {number}: a sign that is zero belongs to neither side")
            sides.append(part)
            stated = replace(stated, chosen={**stated.chosen, part.kink: part.side})
        here = context.inside(f"part {number}", stated)
        if isinstance(part, Range):
            ranges.append(part)
            narrow(here.box, part.variable, part.low, part.high)
        empty = prove(part.steps, here)
        yield Part(here.where, here.box, here.proven, empty)

    # After the last part: do they cover the set?
    if sides:
        both = not ranges and len({s.kink for s in sides}) == 1 and {s.side for s in sides} == {1, -1}
        context.require(both, "the parts are not both sides of one kink")
    elif equality is not None:
        context.require(equality in context.stated.vanishing, f"equality {equality} is not a single monomial")
        for v in sorted(context.stated.vanishing[equality]):
            zero = any(part.variable == v and part.low <= 0 <= part.high for part in ranges)
            context.require(zero or not may_vanish(context.box[v]), f"no part covers {context.name(v)} = 0")
    else:
        _check_cover(ranges, context)


def _check_cover(ranges: list[Range], context: Context) -> None:
    """Check that ranges of one variable cover its box without a gap."""
    context.require(len({part.variable for part in ranges}) == 1, "the parts are not in one variable")
    v = ranges[0].variable
    (reached, upper), name = context.ends(v), context.name(v)
    for part in sorted(ranges, key=lambda part: part.low):
        at_most(context, part.low, reached, "the parts cover the box: lower end <= upper end before it", name)
        reached = max(reached, part.high)
    at_most(context, upper, reached, "the parts cover the box: upper <= last upper end", name)
