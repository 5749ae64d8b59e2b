"""The largest bound that the arithmetic of a step allows, whatever the step rests on.

Only the conditions beside the arithmetic refuse a mutant that claims it.

``r = objective - sum p h - sum weight sigma g`` is computed in fractions in the step's variables t, and r_0 - sum |r_i|
is the bound. No condition is looked at: no sign of a weight or a scale, no box, no side of a kink.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from math import floor
from typing import Any

from benchmarks.soundness.mutations.exact import number, terms_of

__all__ = ["Polynomial", "View", "claim_all", "claimed", "stated_view", "views"]

Ball = tuple[Fraction, Fraction]  # middle and radius
Polynomial = dict[tuple[int, ...], Ball]

MOST_TERMS = 20_000


class TooLong(ValueError):
    """There is no repair: the polynomial grows beyond what it is worth, or a box is missing."""


@dataclass(frozen=True)
class View:
    """The rows that a step refers to by number."""

    equalities: list[Polynomial]
    inequalities: list[Polynomial]
    kinks: list[tuple[int, bool, Polynomial]]
    box: list[tuple[Fraction | None, Fraction | None]]


def polynomial(listed: Any) -> Polynomial:
    """Read a polynomial of the file."""
    total: Polynomial = {}
    for mid, rad, monomial in terms_of(listed):
        _add(total, tuple(sorted(monomial)), mid, rad)
    return total


def stated_view(document: Any) -> View:
    """Return the rows of the statement."""

    def end(value: Any) -> Fraction | None:
        return None if value is None else number(value)

    return View(
        [polynomial(row) for row in document["equalities"]],
        [polynomial(row) for row in document["inequalities"]],
        [(k["variable"], k["kind"] == "sign", polynomial(k["argument"])) for k in document.get("kinks", [])],
        [(end(low), end(high)) for low, high in document["box"]],
    )


def claim_all(document: Any) -> int:
    """Let every step claim the most that its arithmetic allows, from the inside out, and return how many changed."""
    changed = 0
    for _, step, view in views(document["steps"], stated_view(document)):
        best = claimed(step, view)
        if best is not None and best != step["bound"]:
            step["bound"] = best
            changed += 1
    return changed


def views(steps: list[Any], view: View) -> Iterator[tuple[list[Any], Any, View]]:
    """Yield the steps that claim a bound, with their list and their rows, those inside first."""
    for step in list(steps):
        if "reach" in step:
            cone = _cone(step["reach"], view)
            for face in step["reach"]["faces"]:
                yield from views(face["steps"], cone)
        for part in step.get("parts", []):
            yield from views(part["steps"], view)
        if "level" in step:
            below = _plus({(): (number(step["level"]), _ZERO)}, _scaled(polynomial(step["objective"]), -_ONE))
            yield from views(step["steps"], replace(view, inequalities=[*view.inequalities, below]))
        if "sides" in step:
            yield from views(step["steps"], _decided(step, view))
        if "bound" in step:
            yield steps, step, view


def claimed(step: Any, view: View) -> str | None:
    """Return the largest bound of a step as a float in hexadecimal, or None where there is no formula for it."""
    if "parts" in step:
        best = []
        for part in step["parts"]:
            own = [number(s["bound"]) for s in part["steps"] if s.get("objective") == step["objective"]]
            if not own:
                return None
            best.append(max(own))
        return _rounded_down(min(best)) if best else None
    if "level" in step:
        found = [number(own["bound"]) for own in step["steps"] if own.get("objective") == step["objective"]]
        return _rounded_down(min(max(found), number(step["level"]))) if found else None
    if "products" not in step:
        return None
    try:
        residual = _residual(step, view)
    except TooLong:
        return None
    return _rounded_down(
        residual.get((), (Fraction(0),) * 2)[0] - sum(abs(mid) * (m != ()) + rad for m, (mid, rad) in residual.items())
    )


def _residual(step: Any, view: View) -> Polynomial:
    centre, scale = [number(v) for v in step["centre"]], [number(v) for v in step["scale"]]
    moved: dict[tuple[str, int], Polynomial] = {}

    def row(kind: str, k: int) -> Polynomial:
        if (kind, k) not in moved:
            rows = view.equalities if kind == "equality" else view.inequalities
            moved[kind, k] = _moved(rows[k], centre, scale)
        return moved[kind, k]

    total = _moved(polynomial(step["objective"]), centre, scale)
    for k, terms in step["equalities"]:
        multiplier = polynomial([[value, 0, monomial] for value, monomial in terms])
        _subtract(total, _times(row("equality", k), multiplier))
    for product in step["products"]:
        part = _squares(product["basis"], product["factor"])
        part = {m: (mid * number(product["weight"]), rad) for m, (mid, rad) in part.items()}
        for kind, k in product["of"]:
            part = _times(part, row(kind, k) if kind == "inequality" else _BOX[kind](k))
        _subtract(total, part)
    return total


_ONE, _ZERO = Fraction(1), Fraction(0)
_BOX = {
    "above": lambda v: {(): (_ONE, _ZERO), (v,): (_ONE, _ZERO)},
    "below": lambda v: {(): (_ONE, _ZERO), (v,): (-_ONE, _ZERO)},
    "inside": lambda v: {(): (_ONE, _ZERO), (v, v): (-_ONE, _ZERO)},
}


def _add(total: Polynomial, monomial: tuple[int, ...], mid: Fraction, rad: Fraction) -> None:
    old = total.get(monomial)
    total[monomial] = (mid, rad) if old is None else (old[0] + mid, old[1] + rad)


def _subtract(total: Polynomial, part: Polynomial) -> None:
    for m, (mid, rad) in part.items():
        _add(total, m, -mid, rad)


def _times(left: Polynomial, right: Polynomial) -> Polynomial:
    if len(left) * len(right) > MOST_TERMS:
        raise TooLong
    total: Polynomial = {}
    for m, (a, p) in left.items():
        for n, (b, q) in right.items():
            _add(total, tuple(sorted(m + n)), a * b, abs(a) * q + p * abs(b) + p * q if p or q else _ZERO)
    return total


def _moved(own: Polynomial, centre: list[Fraction], scale: list[Fraction]) -> Polynomial:
    """Put ``centre + scale t`` in the place of each variable."""
    total: Polynomial = {}
    for monomial, (mid, rad) in own.items():
        if len(monomial) > 8:
            raise TooLong
        part: Polynomial = {(): (_ONE, _ZERO)}
        for v in monomial:
            part = _times(part, {(): (centre[v], _ZERO), (v,): (scale[v], _ZERO)})
        for m, (value, _) in part.items():
            _add(total, m, value * mid, abs(value) * rad)
    return total


def _squares(basis: list[list[int]], factor: list[list[Any]]) -> Polynomial:
    rows = [[number(value) for value in row] for row in factor]
    total: Polynomial = {}
    for b, left in zip(basis, rows, strict=True):
        for c, right in zip(basis, rows, strict=True):
            _add(total, tuple(sorted([*b, *c])), sum((p * q for p, q in zip(left, right, strict=True)), _ZERO), _ZERO)
    return total


def _scaled(own: Polynomial, size: Fraction) -> Polynomial:
    return {m: (mid * size, rad * abs(size)) for m, (mid, rad) in own.items()}


def _plus(*parts: Polynomial) -> Polynomial:
    total: Polynomial = {}
    for part in parts:
        for m, (mid, rad) in part.items():
            _add(total, m, mid, rad)
    return total


# ---------------------------------------------------------------- rows that a step inside others sees


def _with_values(own: Polynomial, values: dict[int, Polynomial]) -> Polynomial:
    total: Polynomial = {}
    for monomial, ball in own.items():
        part: Polynomial = {tuple(v for v in monomial if v not in values): ball}
        for v in monomial:
            if v in values:
                part = _times(part, values[v])
        total = _plus(total, part)
    return total


def _decided(step: Any, view: View) -> View:
    """Return the rows with the values of decided kinks, and the rows of open ones behind."""
    sides = dict(step["sides"])
    values: dict[int, Polynomial] = {}
    arguments = []
    for n, (variable, is_sign, argument) in enumerate(view.kinks):
        arguments.append(_with_values(argument, values))
        if n in sides:
            constant: Polynomial = {(): (Fraction(sides[n]), _ZERO)} if is_sign else {}
            values[variable] = arguments[n] if sides[n] > 0 and not is_sign else constant
    more = []
    for kind, n, *ends in step["rows"]:
        s: Polynomial = {(view.kinks[n][0],): (_ONE, _ZERO)}
        one: Polynomial = {(): (_ONE, _ZERO)}
        x, e = arguments[n], [number(end) for end in ends]
        if kind == "side":
            more.append(_scaled(x, Fraction(sides.get(n, 1))))
        elif kind == "above":
            more.append(_plus(s, _scaled(x, Fraction(-1))))
        elif kind == "chord":
            more.append(_plus(_scaled(x, e[1]), _scaled(s, e[0] - e[1]), _scaled(one, -e[1] * e[0])))
        elif kind == "low":
            more.append(_plus(_scaled(x, Fraction(2)), _scaled(s, e[0]), _scaled(one, -e[0])))
        else:
            more.append(_plus(_scaled(x, Fraction(-2)), _scaled(s, e[0]), _scaled(one, e[0])))
    return replace(
        view,
        equalities=[_with_values(row, values) for row in view.equalities],
        inequalities=[*(_with_values(row, values) for row in view.inequalities), *more],
    )


def _cone(reach: Any, view: View) -> View:
    """Return the rows times s; those that are not affine in the moved variables stay as they are."""
    sizes = {k: number(size) for k, size in reach["variables"]}
    moved, s = {*sizes, *reach["riding"]}, len(view.box)

    def times_s(row: Polynomial) -> Polynomial:
        most = max((sum(v in moved for v in m) for m in row), default=0)
        if most != 1:
            return row
        total: Polynomial = {}
        for m, (mid, rad) in row.items():
            size = next((sizes.get(v, _ONE) for v in m if v in moved), None)
            if size is None:
                _add(total, (*m, s), mid, rad)
            else:
                _add(total, m, mid * size, rad * abs(size))
        return total

    below, above = [], []
    for v in reach["riding"]:
        low, high = view.box[v]
        if low is None or high is None:
            raise TooLong
        below.append({(s,): (high, _ZERO), (v,): (-_ONE, _ZERO)})
        above.append({(s,): (-low, _ZERO), (v,): (_ONE, _ZERO)})
    rows = [times_s(row) for row in view.inequalities]
    return View([times_s(row) for row in view.equalities], [*rows, *below, *above], [], [*view.box, (_ZERO, _ONE)])


def _rounded_down(value: Fraction) -> str | None:
    """Return a float in hexadecimal, no larger; None beyond the range of floats."""
    if abs(value) > Fraction(10) ** 300:
        return None
    shift = 60 - max(abs(value.numerator).bit_length() - value.denominator.bit_length(), -200)
    scaled = Fraction(floor(value * Fraction(2) ** shift))
    return str(scaled / Fraction(2) ** shift) if value else "0"
