"""A model with free coefficients: linear in all that it does not know, where the diagnosed one has products of it.

Written out, each line is a sum of products of signals, each with a coefficient in which parameters alone occur. Over
wide boxes, products of parameters cost most of what the samples say, and boxes are cut without end. So each
coefficient becomes an unknown of its own, with the range that it has over the boxes of the parameters. If no free
coefficients fit, no parameters do.

A static curve of an input with few levels takes few values in a window, whatever the curve is. Each value is such a
coefficient. So a bias in front of a polynomial, a dead zone and a saturation need no cuts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
import sympy

from relaxations.algebra.arrays import Array
from smid.data import Channel, Dataset
from smid.identification.inversion.record import Record
from smid.models import Line, Model, Parameter, signal, t
from smid.models.hidden_states import first_instants, without_hidden_states
from smid.models.structure import exogenous
from smid.models.symbols import inlined, number, plain_symbols, references, unused

_MORE = 2.0
"""So many coefficients for each parameter are worth a proof: more of them hardly leave a contradiction."""

_LARGEST = 1000
"""Parts of a line: longer ones, which hold the same part again and again, take minutes to be written out."""


@dataclass(frozen=True)
class _Curve:
    """A static signal: what it is at each level, and for each experiment at which samples, shape (n, levels)."""

    signal: str
    values: tuple[sympy.Expr, ...]
    samples: tuple[Array, ...]


def with_free_coefficients(record: Record, bounds: Mapping[str, float]) -> Record | None:
    """Return the record of the model with free coefficients; None where there are too many, or none.

    Hidden states that enter linearly are eliminated: what is left is linear in coefficients again.

    Parameters
    ----------
    record
        With finite boxes of the parameters, in samples.
    bounds
        Of each noisy channel, in its unit.
    """
    sizes: dict[sympy.Basic, int] = {}
    if record.model.enclosed or any(_size(line.expression, sizes) > _LARGEST for line in record.model.lines):
        return None
    found = _freed(_without_curves(record, bounds), bounds)
    if found is None or _first(found).items() - _first(record).items():
        return None  # what cancels must not move the sample from which a line holds
    if found.hidden:
        model = replace(found.model, bounds={})
        plain = without_hidden_states(model)
        if set(plain.states) <= {m.signal for m in plain.measurements}:
            shorter = _freed(Record(plain, found.data, bounds, whole=found.whole), bounds)
            since = first_instants(model)
            if shorter is not None and all(first >= since.get(name, 0) for name, first in _first(shorter).items()):
                found = shorter
    return found if len(found.model.parameters) <= _MORE * len(record.model.parameters) else None


def _without_curves(record: Record, bounds: Mapping[str, float]) -> Record:
    """Return the record with static curves written as their values at each level."""
    model, data, taken = record.model, record.data, set(record.model.names)
    written: dict[str, sympy.Expr] = {}
    for curve in _curves(model, data):
        levels = [_new(f"{curve.signal}_at_{place}", taken) for place in range(len(curve.values))]
        for place, name in enumerate(levels):
            data = _with_channel(data, name, [own[:, place] for own in curve.samples])
        terms = (value * signal(name)[t] for value, name in zip(curve.values, levels, strict=True))
        written[curve.signal] = sympy.Add(*terms)
    if not written:
        return record
    lines = {line.signal: inlined(line.expression, written) for line in model.lines}
    needed = _needed(lines, {m.signal for m in model.measurements})
    return Record(
        replace(
            model,
            lines=tuple(Line(signal(name)[t], own) for name, own in lines.items() if name in needed),
            bounds={name: ends for name, ends in model.bounds.items() if name in needed},
            constraints=(),
            origins={},
        ),
        data,
        bounds,
        whole=record.whole,
    )


def _freed(record: Record, bounds: Mapping[str, float]) -> Record | None:
    """Return the record with a free coefficient for each bent one; None where there are none, or one has no ends."""
    model = record.model
    coefficients = _Coefficients(set(model.names))
    lines = tuple(Line(signal(e.signal)[t], coefficients.free(e.expression)) for e in model.lines)
    values = tuple(coefficients.symbols)
    if not values:
        return None
    ends = Record(replace(model, constraints=values), record.data, bounds).constraint_ends()
    if not np.isfinite(ends).all():
        return None
    free = [
        Parameter(str(own), low, high)
        for own, (low, high) in zip(coefficients.symbols.values(), ends.tolist(), strict=True)
    ]
    occurring = {name for line in lines for name in plain_symbols(line.expression)}
    parameters = tuple(p for p in (*model.parameters, *free) if p.name in occurring)
    freed = replace(model, parameters=parameters, lines=lines, constraints=(), values={})
    return Record(freed, record.data, bounds, whole=record.whole)


class _Coefficients:
    """Symbols in place of coefficients in which parameters occur, each coefficient once."""

    def __init__(self, taken: set[str]) -> None:
        self._taken = taken
        self.symbols: dict[sympy.Expr, sympy.Symbol] = {}

    def free(self, expression: sympy.Expr) -> sympy.Expr:
        """Return an expression with free coefficients, also within functions of signals."""
        found: dict[sympy.Expr, sympy.Expr] = {}
        for term in sympy.Add.make_args(sympy.expand_mul(expression)):
            own, rest = term.as_independent(sympy.Indexed, as_Add=False)
            rest = sympy.Mul(*map(self._within, sympy.Mul.make_args(rest)))
            found[rest] = found.get(rest, sympy.Integer(0)) + own
        return sympy.Add(*(self._symbol(own) * rest for rest, own in found.items()))

    def _within(self, factor: sympy.Expr) -> sympy.Expr:
        # The sides of a condition stay as they are.
        if isinstance(factor, sympy.Indexed | sympy.Piecewise) or not factor.has(sympy.Indexed):
            return factor
        inner = [self.free(own) if own.is_Add or own.is_Mul else self._within(own) for own in factor.args]
        return factor.func(*inner)

    def _symbol(self, coefficient: sympy.Expr) -> sympy.Expr:
        coefficient = sympy.factor_terms(coefficient)
        if coefficient.is_number or coefficient.is_Symbol:
            return coefficient
        if coefficient not in self.symbols:
            self.symbols[coefficient] = sympy.Symbol(_new("coefficient", self._taken), real=True)
        return self.symbols[coefficient]


def _size(expression: sympy.Basic, known: dict[sympy.Basic, int]) -> int:
    """Return the number of parts of an expression written out; what occurs twice counts twice."""
    if expression not in known:
        known[expression] = 1 + sum(_size(own, known) for own in expression.args)
    return known[expression]


def _new(wanted: str, taken: set[str]) -> str:
    name = unused(wanted, taken)
    taken.add(name)
    return name


def _first(record: Record) -> dict[str, int]:
    return dict(zip(record.tape.signals, record.tape.first.tolist(), strict=True))


def _needed(lines: Mapping[str, sympy.Expr], shown: set[str]) -> set[str]:
    """Return the signals that measurements show, and all that these read."""
    needed, waiting = set[str](), sorted(shown & set(lines))
    while waiting:
        name = waiting.pop()
        if name not in needed:
            needed.add(name)
            waiting += [read for read, _ in references(lines[name]) if read in lines]
    return needed


def _curves(model: Model, data: Dataset) -> Iterator[_Curve]:
    """Yield the static signals that others read, if they have no more levels than parameters of their own."""
    shown = {m.signal for m in model.measurements}
    known = set(exogenous(model.lines)) - shown
    static: dict[str, sympy.Expr] = {}
    for line in model.lines:
        expression = inlined(line.expression, static)
        if line.signal not in shown and all(name in known and lag == 0 for name, lag in references(expression)):
            static[line.signal] = expression
    others = [line for line in model.lines if line.signal not in static]
    read = {name for line in others for name, _ in line.reads}
    elsewhere = {name for line in others for name in plain_symbols(line.expression)}
    for name, expression in static.items():
        own = plain_symbols(expression) - elsewhere
        channels = sorted({channel for channel, _ in references(expression)})
        if name not in read or not own or not channels:
            continue
        samples = [np.column_stack([run.values[channel] for channel in channels]) for run in data.experiments]
        levels = np.unique(np.concatenate(samples), axis=0)
        if not np.isfinite(levels).all() or len(levels) > len(own) + 1:
            continue
        atoms = [signal(channel)[t] for channel in channels]
        values = tuple(
            expression.xreplace(dict(zip(atoms, map(number, level), strict=True))) for level in levels.tolist()
        )
        if sum(not value.is_number for value in values) <= len(own):
            yield _Curve(
                name,
                values,
                tuple((run[:, None, :] == levels[None]).all(axis=2).astype(np.float64) for run in samples),
            )


def _with_channel(data: Dataset, name: str, samples: list[Array]) -> Dataset:
    runs = tuple(
        replace(run, values={**run.values, name: own}) for run, own in zip(data.experiments, samples, strict=True)
    )
    return replace(data, experiments=runs, channels=(*data.channels, Channel(name)), resampling=())
