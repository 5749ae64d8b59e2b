"""A model with free coefficients: linear in all that it does not know, where the diagnosed one has products of it.

Written out, each line is a sum of products of signals, each with a coefficient in which parameters alone occur. Over
wide boxes, products of parameters cost most of what the samples say, and boxes are cut without end. So each
coefficient becomes an unknown of its own, with the range that it has over the boxes of the parameters. If no free
coefficients fit, no parameters do.

What the inputs drive through a curve or a hysteresis takes few values in a window (:mod:`.driven`), and each of them
times what it is multiplied by is such a coefficient. So the parameters of these effects need no cuts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import sympy

from smid.data import Dataset
from smid.diagnosis.proof.driven import Driven, driven_signals, upstream
from smid.diagnosis.proof.posed import with_channel
from smid.identification.inversion.record import Record
from smid.models import Line, Model, Parameter, signal, t
from smid.models.hidden_states import first_instants, without_hidden_states
from smid.models.structure import exogenous
from smid.models.symbols import inlined, plain_symbols, references, unused

_Ends = tuple[float, float]

_ROUNDED = 1 + 1e-9
_MORE = 2.0
"""So many coefficients for each parameter are worth a proof: more of them hardly leave a contradiction."""

_LARGEST = 1000
"""Parts of a line: longer ones, which hold the same part again and again, take minutes to be written out."""


def with_free_coefficients(record: Record, bounds: Mapping[str, float]) -> tuple[Record, ...]:
    """Return records of the model with free coefficients: with few numbers of what inputs drive, and with many.

    Hidden states that enter linearly are eliminated: what is left is linear in coefficients again. None is returned
    where there are too many coefficients, or none.

    Parameters
    ----------
    record
        With finite boxes of the parameters, in samples.
    bounds
        Of each noisy channel, in its unit.
    """
    if record.model.enclosed:
        return ()
    many, known = list(driven_signals(record)), len(record.model.parameters)
    few = [one for one in many if one.few]
    choices = [few, many] if len(few) < len(many) else [many]
    found = (_free(*_without_driven(record, bounds, some), bounds, known) for some in choices)
    return tuple(one for one in found if one is not None)


def _free(driven: Record, numbers: Mapping[str, str], bounds: Mapping[str, float], known: int) -> Record | None:
    """Return the record with free coefficients of one whose driven signals are numbers."""
    sizes = dict[sympy.Basic, int]()
    if any(_size(line.expression, sizes) > _LARGEST for line in driven.model.lines):
        return None
    found = _freed(driven, bounds, numbers)
    if found is None or _first(found).items() - _first(driven).items():
        return None  # what cancels must not move the sample from which a line holds
    if found.hidden:
        model = replace(found.model, bounds={})
        plain = without_hidden_states(model)
        if set(plain.states) <= {m.signal for m in plain.measurements}:
            shorter = _freed(Record(plain, found.data, bounds, whole=found.whole), bounds, numbers)
            since = first_instants(model)
            if shorter is not None and all(first >= since.get(name, 0) for name, first in _first(shorter).items()):
                found = shorter
    return found if len(found.model.parameters) <= _MORE * (known + len(numbers)) else None


def _without_driven(
    record: Record, bounds: Mapping[str, float], signals: Sequence[Driven]
) -> tuple[Record, dict[str, str]]:
    """Return the record with driven signals written as their numbers.

    With it the channels that tell which number each sample has, and the signal that each is of.
    """
    model, data, taken = record.model, record.data, {*record.model.names, *record.data.names}
    written, parameters, numbers = dict[str, sympy.Expr](), list[Parameter](), dict[str, str]()
    for driven in signals:
        names = [_new(f"{driven.signal}_at_{place}", taken) for place in range(len(driven.values))]
        for place, name in enumerate(names):
            data = with_channel(data, name, [own[:, place] for own in driven.samples])
        terms = (value * signal(name)[t] for value, name in zip(driven.values, names, strict=True))
        written[driven.signal] = sympy.Add(*terms)
        parameters += driven.parameters
        numbers |= dict.fromkeys(names, driven.signal)
    if not written:
        return record, {}
    lines = {line.signal: inlined(line.expression, written) for line in model.lines}
    needed = upstream(lines, {m.signal for m in model.measurements})
    model = replace(
        model,
        parameters=(*model.parameters, *parameters),
        lines=tuple(Line(signal(name)[t], own) for name, own in lines.items() if name in needed),
        bounds={name: ends for name, ends in model.bounds.items() if name in needed},
        constraints=(),
        origins={},
    )
    return Record(model, data, bounds, whole=record.whole), numbers


def _freed(record: Record, bounds: Mapping[str, float], numbers: Mapping[str, str]) -> Record | None:
    """Return the record with a free coefficient for each bent one; None where there are none, or one has no ends."""
    model = _multiplied_out(record.model)
    coefficients = _Coefficients(set(model.names))
    lines = tuple(Line(signal(e.signal)[t], coefficients.free(e.expression)) for e in model.lines)
    values = tuple(coefficients.symbols)
    if not values:
        return None
    ends = Record(replace(model, constraints=values), record.data, bounds).constraint_ends()
    boxes = {p.symbol: (p.lower, p.upper) for p in model.parameters}
    boxes |= dict(zip(coefficients.symbols.values(), map(tuple, ends.tolist()), strict=True))
    boxes |= _told(model, lines, record.data, bounds, boxes, numbers)
    occurring = {name for line in lines for name in plain_symbols(line.expression)}
    parameters = tuple(Parameter(str(own), *box) for own, box in boxes.items() if str(own) in occurring)
    if not all(np.isfinite([p.lower, p.upper]).all() for p in parameters):
        return None
    freed = replace(model, parameters=parameters, lines=lines, constraints=(), values={})
    return Record(freed, record.data, bounds, whole=record.whole)


def _multiplied_out(model: Model) -> Model:
    """Return the model with static polynomials of the inputs multiplied out, in the lines that read them."""
    shown, static = {m.signal for m in model.measurements}, dict[str, sympy.Expr]()
    known = set(exogenous(model.lines)) - shown
    for line in model.lines:
        expression = inlined(line.expression, static)
        is_static = line.signal not in shown and all(name in known for name, _ in references(expression))
        if is_static and expression.is_polynomial(*expression.atoms(sympy.Indexed)):
            static[line.signal] = sympy.expand(expression)
    others = (line for line in model.lines if line.signal not in static)
    return replace(model, lines=tuple(replace(own, expression=inlined(own.expression, static)) for own in others))


def _within(box: _Ends, reach: float) -> _Ends:
    low, high = max(box[0], -reach), min(box[1], reach)
    return (low, high) if low <= high else box


def _told(
    model: Model,
    lines: Sequence[Line],
    data: Dataset,
    bounds: Mapping[str, float],
    boxes: Mapping[sympy.Symbol, _Ends],
    numbers: Mapping[str, str],
) -> dict[sympy.Symbol, _Ends]:
    """Return ends of the numbers of a driven signal, as the measurements tell them.

    Where a measured state reads one such signal at one lag, it is the sum of one number and of products of bounded
    signals and coefficients.
    """
    largest = {name: max(float(np.abs(run.values[name]).max()) for run in data.experiments) for name in data.names}
    shown = (m for m in model.measurements if m.noise and not m.inverse)
    largest |= {m.signal: largest[m.channel] + bounds[m.channel] for m in shown}
    found = dict[sympy.Symbol, _Ends]()
    for line in lines:
        own, read_from, rest = list[sympy.Symbol](), set[tuple[str, int]](), largest.get(line.signal, np.inf)
        for term in sympy.Add.make_args(line.expression):
            factor, read = term.as_independent(sympy.Indexed, as_Add=False)
            ((name, lag),) = references(read) if isinstance(read, sympy.Indexed) else (("", 0),)
            if name in numbers:
                own.append(factor)
                read_from.add((numbers[name], lag))
            else:
                size = abs(float(factor)) if factor.is_number else max(map(abs, boxes.get(factor, (np.inf,))))
                rest += size * (1.0 if read == 1 else largest.get(name, np.inf))
        if len(read_from) == 1 and np.isfinite(rest):
            found |= {one: _within(boxes[one], rest * _ROUNDED) for one in own if one in boxes}
    return found


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
