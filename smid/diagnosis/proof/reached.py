"""Where inputs drive hidden states: ranges that they never leave while the inputs stay within those of the record.

A window begins in the middle of a record. What a lag of an input remembers then is not known, but only what inputs
have driven it to: here from where a fit has it, by any inputs in the range of the record and any parameters in their
boxes. Ranges of all states are widened by what a line makes of them, until no line leads out of them.

Reference: Blanchini, Set invariance in control, Automatica 35 (1999) 1747-1767.
"""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Iterator, Mapping

import numpy as np
import sympy

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.models import Model
from smid.models.structure import exogenous
from smid.models.symbols import inlined, references

__all__ = ["driven_lines", "reached", "spans"]

_Ends = tuple[float, float]

_ROUNDS = 10
_SAME = 1e-9  # of a range: less is rounding
_ROOM = 1e-6  # of a range
_SHORT = 25  # operations of a line
_MOST = 12  # symbols of which all corners are taken
_ANYTHING = (-math.inf, math.inf)


def spans(data: Dataset) -> dict[str, _Ends]:
    """Return the least and the largest value of each channel."""
    columns = {name: [run.values[name] for run in data.experiments] for name in data.names}
    return {name: (float(min(map(np.nanmin, own))), float(max(map(np.nanmax, own)))) for name, own in columns.items()}


def driven_lines(model: Model) -> dict[str, sympy.Expr]:
    """Return the lines that read inputs and one another alone."""
    shown = {m.signal for m in model.measurements}
    known = set(exogenous(model.lines)) - shown
    lines = {line.signal: line.expression for line in model.lines if line.signal not in shown and not line.rate}
    while foreign := [
        own for own, line in lines.items() if {name for name, _ in references(line)} - known - set(lines)
    ]:
        for own in foreign:
            del lines[own]
    return lines


def reached(model: Model, inputs: Mapping[str, _Ends], signals: Mapping[str, Array]) -> dict[str, _Ends]:
    """Return the ranges of the hidden states that inputs alone drive, but for those that grow without end.

    Parameters
    ----------
    inputs
        The range of each channel.
    signals
        Of a run.
    """
    driven = driven_lines(model)
    # What a short sum or product says of its signals is lost where they are taken apart.
    sums = {name: own for name, own in driven.items() if own.is_Add or own.is_Mul}
    short = {name: own for name, own in sums.items() if name not in model.states and own.count_ops() <= _SHORT}
    lines = {name: inlined(own, short) for name, own in driven.items() if name not in short}
    atoms = set().union(*(line.atoms(sympy.Indexed) for line in lines.values()))
    parameters = {p.symbol: (p.lower, p.upper) for p in model.parameters}
    ranges = {name: (float(signals[name][-1]),) * 2 for name in lines}
    for count in itertools.count():
        before, spans_now = ranges, {**inputs, **ranges}
        known = parameters | {atom: spans_now[str(atom.base.label)] for atom in atoms}
        ranges = {name: _joined(ranges[name], _ends(line, known)) for name, line in lines.items()}
        growing = [name for name in lines if not _within(ranges[name], before[name])]
        if not growing:
            break
        ranges |= dict.fromkeys(growing, _ANYTHING) if count >= _ROUNDS else {}
    found = {name: _with_room(ends) for name, ends in ranges.items() if name in model.states and ends[0] < ends[1]}
    return {name: ends for name, ends in found.items() if np.isfinite(ends).all()}


def _with_room(ends: _Ends) -> _Ends:
    """Return wider ends: no run is verified to keep within ends that it touches."""
    room = _ROOM * (ends[1] - ends[0])
    return ends[0] - room, ends[1] + room


def _joined(ends: _Ends, others: _Ends) -> _Ends:
    return min(ends[0], others[0]), max(ends[1], others[1])


def _within(ends: _Ends, others: _Ends) -> bool:
    room = _SAME * (others[1] - others[0])
    return others[0] - room <= ends[0] and ends[1] <= others[1] + room


def _ends(expression: sympy.Expr, known: dict[sympy.Basic, _Ends]) -> _Ends:
    """Return the range of an expression of symbols: exact where it is linear in each of its functions and symbols."""
    if expression not in known:
        is_function = not (expression.is_number or expression.is_Add or expression.is_Mul)
        known[expression] = (_ends_of_function if is_function else _ends_at_corners)(expression, known)
    return known[expression]


def _ends_at_corners(expression: sympy.Expr, known: dict[sympy.Basic, _Ends]) -> _Ends:
    parts = list(dict.fromkeys(_parts(expression)))
    symbols = [sympy.Dummy() for _ in parts]
    plain = expression.xreplace(dict(zip(parts, symbols, strict=True)))
    if len(parts) > _MOST or max(_degrees(plain).values(), default=0) > 1:
        return _ANYTHING
    ends = np.array([_ends(part, known) for part in parts]).reshape(-1, 2)
    if not np.isfinite(ends).all():
        return _ANYTHING
    values = np.asarray(sympy.lambdify(symbols, plain)(*np.array(list(itertools.product(*ends))).T))
    return float(values.min()), float(values.max())


def _degrees(expression: sympy.Expr) -> Counter[sympy.Symbol]:
    """Return at most which power of each symbol a polynomial holds."""
    if expression.is_Symbol:
        return Counter([expression])
    degrees = Counter[sympy.Symbol]()
    for own in map(_degrees, expression.args):
        degrees = degrees + own if expression.is_Mul else degrees | own
    return degrees


def _parts(expression: sympy.Expr) -> Iterator[sympy.Expr]:
    """Yield the symbols and functions that an expression is a polynomial of."""
    if expression.is_Add or expression.is_Mul:
        for own in expression.args:
            yield from _parts(own)
    elif not expression.is_number:
        yield expression


def _ends_of_function(part: sympy.Expr, known: dict[sympy.Basic, _Ends]) -> _Ends:
    """Return the range of a function of expressions."""
    lows, highs = zip(*(_ends(own, known) for own in part.args), strict=True)
    if isinstance(part, sympy.Max):
        return max(lows), max(highs)
    if isinstance(part, sympy.Min):
        return min(lows), min(highs)
    if isinstance(part, sympy.sign):
        return float(np.sign(lows[0])), float(np.sign(highs[0]))
    if isinstance(part, sympy.Abs):
        return max(lows[0], -highs[0], 0.0), max(-lows[0], highs[0])
    if isinstance(part, sympy.exp):
        return float(np.exp(lows[0])), float(np.exp(highs[0]))
    if part.is_Pow and part.exp == -1 and lows[0] > 0:
        return 1 / highs[0], 1 / lows[0]
    return _ANYTHING
