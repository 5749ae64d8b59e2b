"""Rule: kinks whose side is known, and inequalities for the others.

Claim: the theorems of the steps, on the constraints with the values of some kinks substituted, and with further rows.

Proof. Let x be a point of the set, and a the argument of a kink s, between low and high on the box.

- If low >= 0, or if the part of the set takes the side a >= 0, then max(0, a) is a; if high <= 0, it is 0. If low > 0
  the sign is 1, and if high < 0 it is -1. In each constraint the kink is replaced by this value.
- A kink lies between the values at low and high, which narrows its box.
- "side": on a part that takes a side, side a >= 0. "above": max(0, a) >= a. For L <= min(low, 0), U >= max(high, 0):
  "chord": U (a - L) >= (U - L) s, because the positive part is convex and equality holds at a = L and at a = U.
  "low": 2 a >= L (1 - s), "high": 2 a <= U (1 + s), for s = 1 and a > 0, s = -1 and a < 0, s = 0 and a = 0. ∎
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction

from relaxations.check.arithmetic import ONE, ZERO, End, Interval, Polynomial, constant, substituted, value_range
from relaxations.check.rules.quotient import quotient
from relaxations.check.statement import Context, Kink, Prove, Stated, Theorem, emptiness, narrow, tighten
from relaxations.check.steps import Row, Sides

ENDS = {(False, "side"): 0, (False, "above"): 0, (False, "chord"): 2, (True, "low"): 1, (True, "high"): 1}


def sides(step: Sides, context: Context, prove: Prove) -> list[Theorem]:
    """Return the theorems of the steps inside a step."""
    for n in step.sides:
        context.stated.kink(n, context.where)
    # In order: substitute earlier kinks into the argument, then use the kink's value or narrow its box.
    values, arguments = dict[int, Polynomial](), list[tuple[Polynomial, Interval]]()
    for n, kink in enumerate(context.stated.kinks):
        a = substituted(kink.argument, values, context.work)
        low, high = value_range(a, context.box, context.work)
        arguments.append((a, (low, high)))
        if n in step.sides:
            values[kink.variable] = _value(n, kink, step.sides[n], a, (low, high), context)
        else:
            narrow(context.box, kink.variable, *_between(kink, low, high))
    # Substitute the values into all constraints, and add the further rows.
    rows = [_row(number, row, step.sides, arguments, context) for number, row in enumerate(step.rows)]

    def put(given: list[Polynomial | None]) -> Iterator[Polynomial | None]:
        return (None if row is None else substituted(row, values, context.work) for row in given)

    stated: Stated = replace(
        context.stated,
        equalities=list(put(context.stated.equalities)),
        inequalities=[*put(context.stated.inequalities), *rows],
    )
    # Narrow the boxes of defined variables, then apply the steps.
    here = replace(context, stated=stated, proven=[])
    for definition in step.defined:
        for theorem in quotient(definition, here, prove):
            tighten(here.box, theorem)
    return [*here.proven, emptiness(context.where)] if prove(step.steps, here) else here.proven


def _value(n: int, kink: Kink, side: int, a: Polynomial, between: Interval, context: Context) -> Polynomial:
    """Return the value of a kink whose side is known."""
    least = between[0] if side > 0 else -between[1]
    decided = least > 0 or (least == 0 and not kink.sign) or context.stated.chosen.get(n) == side
    context.require(decided, f"the box does not decide on {context.name(kink.variable)}, side {side}")
    if kink.sign:
        return constant(side)
    return a if side > 0 else Polynomial()


def _between(kink: Kink, low: End, high: End) -> Interval:
    """Return the range of a kink's value, given that of its argument."""
    if kink.sign:
        return (ZERO if low >= 0 else -ONE), (ZERO if high <= 0 else ONE)
    return max(low, ZERO), max(high, ZERO)


def _row(
    number: int, row: Row, known: dict[int, int], arguments: list[tuple[Polynomial, Interval]], context: Context
) -> Polynomial:
    """Return an inequality between a kink s and its argument a."""
    kink, (a, (low, high)) = context.stated.kink(row.kink, context.where), arguments[row.kink]

    def require(condition: bool, message: str) -> None:
        context.require(condition, f"row {number}: {message}")

    def combined(of_a: Fraction | int, of_s: Fraction | int, rest: Fraction | int) -> Polynomial:
        linear = Polynomial({(kink.variable,): Fraction(of_s), (): Fraction(rest)})
        return a.scaled(Fraction(of_a)).plus(linear)

    fits = ENDS.get((kink.sign, row.kind)) == len(row.ends)
    require(fits, f"{row.kind!r} with {len(row.ends)} ends is not a row of this kink")
    if row.kind == "side":
        chosen = context.stated.chosen.get(row.kink)
        require(chosen is not None and chosen == known.get(row.kink), "no part chooses this side")
        return combined(known[row.kink], 0, 0)
    if row.kind == "above":
        return combined(-1, 1, 0)
    if row.kind in ("chord", "low"):
        require(row.ends[0] <= min(low, ZERO), "the box does not keep the argument from below it")
    if row.kind in ("chord", "high"):
        require(row.ends[-1] >= max(high, ZERO), "the box does not keep the argument from above it")
    first, last = row.ends[0], row.ends[-1]
    if row.kind == "chord":
        return combined(last, first - last, -last * first)
    return combined(2, first, -first) if row.kind == "low" else combined(-2, last, last)
