"""Hidden states taken out of a model: what is left relates the measured signals to each other.

A state that no channel shows has no "measurement minus noise", so no box follows from the data. But where the hidden
states h enter linearly, with coefficients that are parameters and numbers, they can be eliminated. With q the shift by
one sample back, the lines are

    M(q) h = g,    w_i - f_i = E_i(q) h,

where g and f_i read inputs and measured signals only, in any way. Multiplied by the determinant of M they give

    det M(q) (w_i - f_i) = E_i(q) adj M(q) g,

a line of w_i alone. The hidden states of a feasible point fulfil it whatever the parameters are, so nothing is lost:
the set can only become larger, and it does not where the states can be observed through one output.

A line that combines others holds from the first sample at which all of them hold: what the model does not compute of
the first samples is anything.

A hidden state that enters otherwise can be eliminated where a measured signal shows it with a number as its factor, as
a position shows the velocity behind it: ``h = (w_i - f_i) / number``, some samples later.

A state with bounds of its own (`Model.bound`) stays.

Reference: Kailath, Linear Systems (1980), section 6.2 (matrix fraction descriptions).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Set
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import sympy
from sympy.polys.domains import QQ
from sympy.polys.matrices import DomainMatrix

from smid.models.model import Model
from smid.models.parts import Line
from smid.models.symbols import inlined, references, signal, t

__all__ = ["first_instants", "without_hidden_states"]

_Q = sympy.Symbol("q")
_OPAQUE = (sympy.Function, sympy.NumberSymbol, sympy.Pow)  # taken as symbols, apart from whole powers
_Lines = dict[str, tuple[sympy.Expr, int]]  # by signal: the expression, and the first sample from which it holds


def without_hidden_states(model: Model) -> Model:
    """Return the model of plain lines that is bounded: without the hidden states that can be eliminated.

    Examples
    --------
    >>> from smid.models import Parameter, Measurement, signal, t
    >>> x, h, a = signal("x"), signal("h"), Parameter("a", 0, 1)
    >>> lines = (Line(x[t], x[t - 1] / 2 + h[t - 1]), Line(h[t], a.symbol * h[t - 1] + signal("u")[t - 1]))
    >>> print(without_hidden_states(Model("m", (a,), lines, (Measurement("y", "x", "eta"),))).lines[0])
    x[t] = a*(x[t - 1] - x[t - 2]/2) + u[t - 2] + x[t - 1]/2
    """
    return _reduced(model)[0]


def first_instants(model: Model) -> Mapping[str, int]:
    """Return the first sample at which each line holds, where hidden states are eliminated."""
    return _reduced(model)[1]


@lru_cache(maxsize=256)
def _reduced(model: Model) -> tuple[Model, Mapping[str, int]]:
    plain = model.discretised()
    shown = {m.signal for m in plain.measurements}
    hidden = frozenset(plain.states) - shown - plain.bounds.keys()
    if not hidden:
        return plain, {}
    # Put what has no memory and reads a hidden state in its place.
    lines = {line.signal: line.expression for line in plain.lines}
    static = {name: own for name, own in lines.items() if name not in plain.states and name not in shown}
    while missed := {name for name, own in static.items() if not _reads(own, hidden | static.keys())}:
        static = {name: own for name, own in static.items() if name not in missed}
    if _stay(lines, static, hidden, shown):
        return plain, {}
    whole = {name: inlined(own, static) for name, own in lines.items() if name not in static}
    since = {name: max((lag for _, lag in references(own)), default=0) for name, own in whole.items()}
    found = _eliminated({name: (own, since[name]) for name, own in whole.items()}, hidden)
    if found is None:
        return plain, {}
    kept = tuple(Line(signal(name)[t], own) for name, (own, _) in found.items())
    return replace(plain, lines=kept), {name: first for name, (_, first) in found.items()}


def _stay(
    lines: Mapping[str, sympy.Expr], static: Mapping[str, sympy.Expr], hidden: frozenset[str], shown: set[str]
) -> bool:
    """Return whether the lines, one by one, show that no hidden state can be eliminated.

    Kinks of kinks, put in the place of what reads them, would take sympy minutes to tell the same.
    """
    reached = hidden | static.keys()
    atoms = [signal(n)[t - lag] for own in lines.values() for n, lag in sorted(references(own)) if n in reached]
    curved = {name for name, own in lines.items() if not own.is_polynomial(*atoms)}
    # What reads a curved line is curved; a measured signal that is not may show a state.
    while more := {name for name, own in lines.items() if _reads(own, curved & static.keys())} - curved:
        curved |= more
    straight = [_Linear.of(inlined(lines[name], static), hidden) for name in shown & lines.keys() - curved]
    return bool(curved) and not any(part is not None and part.shown for part in straight)


def _eliminated(lines: _Lines, hidden: frozenset[str]) -> _Lines | None:
    """Return the lines without hidden states; None where they stay."""
    if not hidden:
        return lines
    parts = {name: _Linear.of(own, hidden) for name, (own, _) in lines.items()}
    known = {name: part for name, part in parts.items() if part is not None}
    left = {name: own for name, own in lines.items() if name not in hidden}
    if len(known) == len(lines):
        since = {name: first for name, (_, first) in lines.items()}
        return {name: _through(name, known, since) if known[name].factors else own for name, own in left.items()}
    for name in left:
        if name in known and (shown := known[name].shown):
            found = _solved(lines, name, *shown, known[name].rest)
            if found is not None:
                return _eliminated(found, hidden - {shown[0]})
    return None


@dataclass(frozen=True)
class _Linear:
    """An expression as a sum of hidden signals with factors, by signal and lag, and a rest that reads none."""

    factors: Mapping[tuple[str, int], sympy.Expr]
    rest: sympy.Expr

    @staticmethod
    def of(expression: sympy.Expr, hidden: frozenset[str]) -> _Linear | None:
        """Return the parts; None where it is not linear, or a factor reads a signal."""
        atoms = {(name, lag): signal(name)[t - lag] for name, lag in sorted(references(expression)) if name in hidden}
        if not atoms:
            return _Linear({}, expression)
        if not expression.is_polynomial(*atoms.values()):
            return None
        # Slopes, because a polynomial of sympy would expand coefficients that are quotients, for minutes.
        slopes = {key: expression.diff(atom) for key, atom in atoms.items()}
        factors = {key: sympy.expand(own) if own.has(*atoms.values()) else own for key, own in slopes.items()}
        if any(references(factor) for factor in factors.values()):
            return None
        return _Linear(factors, expression.xreplace(dict.fromkeys(atoms.values(), sympy.S.Zero)))

    @property
    def shown(self) -> tuple[str, int, sympy.Expr] | None:
        """Return the hidden signal that this shows, its lag and factor: the only one, with a number."""
        if len(self.factors) != 1:
            return None
        (((name, lag), factor),) = self.factors.items()
        return (name, lag, factor) if factor.is_number and factor else None


def _through(name: str, parts: Mapping[str, _Linear], since: Mapping[str, int]) -> tuple[sympy.Expr, int]:
    """Return the line of a measured signal, without the hidden ones that it reads."""
    behind = [state for state, _ in parts[name].factors]
    for state in behind:  # it grows on the way
        behind += [other for other, _ in parts[state].factors if other not in behind]
    behind = list(dict.fromkeys(behind))

    # The coefficients are elements of the field of quotients of parameters, in which sums are quick.
    factors = [factor for reader in (name, *behind) for factor in parts[reader].factors.values()]
    opaque = {part: sympy.Dummy() for factor in factors for part in factor.atoms(*_OPAQUE) if not _is_quotient(part)}
    # A symbol more, because a field needs one.
    field = QQ.frac_field(*_symbols(factor.xreplace(opaque) for factor in factors), sympy.Dummy())
    ring = field.poly_ring(_Q)
    shift, known = ring.from_sympy(_Q), {dummy: part for part, dummy in opaque.items()}

    def row(reader: str) -> list[Any]:
        found = dict.fromkeys(behind, ring.zero)
        for (state, lag), factor in parts[reader].factors.items():
            found[state] += field.from_sympy(factor.xreplace(opaque)) * shift**lag
        return list(found.values())

    def by_lag(polynomial: Any) -> Iterator[tuple[int, sympy.Expr]]:
        for (lag,), factor in sorted(polynomial.terms()):
            yield lag, field.to_sympy(factor).xreplace(known)

    count = len(behind)
    matrix = DomainMatrix.eye(count, ring) - DomainMatrix([row(state) for state in behind], (count, count), ring)
    adjugate, past = matrix.to_dense().adj_det()
    (weights,) = (DomainMatrix([row(name)], (1, count), ring) * adjugate).to_dense().to_list()
    rest = parts[name].rest
    line, first = rest, since[name]
    for lag, factor in by_lag(past):
        if lag:
            line -= factor * _shifted(signal(name)[t] - rest, lag)
            first = max(first, lag + since[name])
    for state, weight in zip(behind, weights, strict=True):
        for lag, factor in by_lag(weight):
            line += factor * _shifted(parts[state].rest, lag)
            first = max(first, lag + since[state])
    return line, first


def _is_quotient(part: sympy.Expr) -> bool:
    """Return whether a power is one that a quotient of polynomials can have."""
    return isinstance(part, sympy.Pow) and bool(part.exp.is_Integer)


def _symbols(factors: Iterable[sympy.Expr]) -> list[sympy.Symbol]:
    return sorted({symbol for factor in factors for symbol in factor.free_symbols}, key=str)


def _solved(lines: _Lines, name: str, state: str, lag: int, factor: sympy.Expr, rest: sympy.Expr) -> _Lines | None:
    """Return the lines with a hidden state in terms of the signal that shows it; None where a line reads it earlier."""
    others = {other: own for other, own in lines.items() if other not in (name, state)}
    (of_state, state_since), since = lines[state], lines[name][1]
    own = {name: (rest + factor * _shifted(of_state, lag), max(since, lag + state_since))}
    found = {}
    for other, (expression, first) in (others | own).items():
        reads = [k for n, k in references(expression) if n == state]
        if any(k < lag for k in reads):
            return None
        shown = {signal(state)[t - k]: _shifted((signal(name)[t] - rest) / factor, k - lag) for k in reads}
        found[other] = expression.xreplace(shown), max([first, *(k - lag + since for k in reads)])
    return found


def _reads(expression: sympy.Expr, names: Set[str]) -> bool:
    return any(name in names for name, _ in references(expression))


def _shifted(expression: sympy.Expr, lag: int) -> sympy.Expr:
    return expression.xreplace({t: t - lag})
