"""The printed report: the problem that the file states, then its theorems."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from contextlib import suppress
from fractions import Fraction
from typing import Any

from relaxations.check.arithmetic import Interval, Polynomial
from relaxations.check.forms import shown_name
from relaxations.check.read import Document
from relaxations.check.statement import Theorem, shown

MOST_LINES = 20  # for variables, and for each entry of an origin


def report(document: Document, theorems: Iterable[Theorem]) -> Iterator[str]:
    """Yield the printed lines for an accepted file."""
    stated, box = document.stated, document.box
    counts = {
        "variable": len(stated.names),
        "equality": len(stated.equalities),
        "inequality": len(stated.inequalities),
        "kink": len(stated.kinks),
    }
    yield "accepted: " + ", ".join(counted(number, what) for what, number in counts.items() if number or what != "kink")
    if document.origin is None:
        yield "origin: not stated, so the proof is about the polynomials in this file"
    else:
        yield "origin, as this file states it (smid verify compares it with a model and with data):"
        yield from (f"  {line}" for line in entries(document.origin, ""))
    best = strongest(theorems)
    yield "stated box:"
    first = {v for theorem in best for v in theorem.objective.variables}
    order = [*sorted(first), *(v for v in range(len(box)) if v not in first)]
    for v in order[:MOST_LINES]:
        yield f"  {shown_name(stated.names[v])} in {interval(box[v])}"
    if len(order) > MOST_LINES:
        yield f"  ... and {counted(len(order) - MOST_LINES, 'further variable')}"
    yield "proven:"
    for theorem in best:
        yield f"  {_claim(theorem, stated.names)} ({theorem.step})"


def strongest(theorems: Iterable[Theorem]) -> list[Theorem]:
    """Return the strongest theorem on each objective, or only the theorem that the set is empty."""
    best: dict[frozenset[Any], Theorem] = {}
    for theorem in theorems:
        if theorem.empty:
            return [theorem]
        key = frozenset((*theorem.objective.mid.items(), "radii", *theorem.objective.rad.items()))
        if key not in best or theorem.bound > best[key].bound:
            best[key] = theorem
    return list(best.values())


def _claim(theorem: Theorem, names: list[str]) -> str:
    """Return a theorem as text."""
    if theorem.empty:
        return "no point satisfies all constraints"
    if theorem.single is None:
        return f"{_written(theorem.objective, names)} >= {shown(theorem.bound)}"
    variable, slope = theorem.single
    end = theorem.bound / slope
    return f"{shown_name(names[variable])} " + (f">= {shown(end)}" if slope > 0 else f"<= {above(end)}")


def _written(polynomial: Polynomial, names: list[str]) -> str:
    """Return a polynomial as text; a long one by its number of terms."""
    monomials = sorted(polynomial.monomials, key=lambda m: (-len(m), m))
    if len(monomials) > 6 or polynomial.rad:
        return f"the objective ({counted(len(monomials), 'term')})"
    terms = []
    for m in monomials:
        value = polynomial.mid.get(m, Fraction(0))
        factors = [shown_name(names[v]) for v in m]
        if abs(value) != 1 or not factors:
            factors.insert(0, _exactly(abs(value)))
        terms.append(("- " if value < 0 else "+ ") + "*".join(factors))
    text = " ".join(terms).removeprefix("+ ")
    return text.replace("- ", "-", 1) if text.startswith("- ") else text or "0"


def interval(ends: Interval) -> str:
    """Return a box as text, of which each end is exact."""
    low, high = ends
    left = f"[{_exactly(low)}" if isinstance(low, Fraction) else "(-inf"
    right = f"{_exactly(high)}]" if isinstance(high, Fraction) else "inf)"
    return f"{left}, {right}"


def _exactly(value: Fraction) -> str:
    """Return the shortest decimal of a float, or a fraction if no float has this value."""
    try:
        nearest = float(value)
    except OverflowError:
        nearest = 0.0
    text = repr(nearest).removesuffix(".0") if Fraction(nearest) == value else str(value)
    return text if len(text) <= 60 else f"about {shown(value)}"


def above(value: Fraction) -> str:
    """Return a decimal that is at least the value."""
    return shown(-value).removeprefix("-") if value > 0 else shown(-value) if value == 0 else f"-{shown(-value)}"


def counted(number: int, what: str) -> str:
    """Return a number with a noun in the singular or plural."""
    plural = what.removesuffix("y") + "ies" if what.endswith("y") else what + "s"
    return f"{number} {what if number == 1 else plural}"


def entries(value: Any, name: str) -> Iterator[str]:
    """Yield one escaped line for each entry of an origin."""
    inside = (
        list(value.items()) if isinstance(value, dict) else list(enumerate(value)) if isinstance(value, list) else None
    )
    if inside is None:
        yield f"{name}: {_entry(value)}"
        return
    for key, entry in inside[:MOST_LINES]:
        yield from entries(entry, f"{name}.{_entry(key)}" if name else _entry(key))
    if len(inside) > MOST_LINES:
        yield f"{name}: ... and {counted(len(inside) - MOST_LINES, 'further entry')}"


def _entry(value: Any) -> str:
    """Return a value as printable ASCII text."""
    text = value if isinstance(value, str) and value.isascii() and value.isprintable() else json.dumps(value)
    with suppress(ValueError, OverflowError):
        text = repr(float.fromhex(text)) if text.startswith(("0x", "-0x")) else text
    return text if len(text) <= 200 else f"({len(text)} characters)"
