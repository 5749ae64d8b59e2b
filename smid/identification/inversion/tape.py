"""The equations of a model as a list of operations on affine forms.

Each distinct part of an expression is one operation. What parameters alone decide is computed once, before the run
through time.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import reduce

import numpy as np
import sympy
from sympy.core.relational import Relational

from relaxations.algebra.affine_functions import Function
from relaxations.algebra.arrays import Array, Index, Mask
from relaxations.algebra.ball_arithmetic import EPSILON, TINY
from smid.identification.inversion.operations import Operation
from smid.identification.inversion.rates import Rates
from smid.models import Model, ModelError
from smid.models.discretise import summed
from smid.models.parts import Line, Measurement
from smid.models.structure import causal_order, first_samples, is_clock, state_lags
from smid.models.symbols import VALUE, references, signal, t

__all__ = ["Tape", "Writer", "tape_of"]


_FUNCTIONS = {
    sympy.exp: Function.EXP,
    sympy.log: Function.LOG,
    sympy.sin: Function.SIN,
    sympy.cos: Function.COS,
    sympy.tanh: Function.TANH,
    sympy.atan: Function.ATAN,
    sympy.sign: Function.SIGN,
    sympy.floor: Function.FLOOR,
    sympy.Abs: Function.ABS,
}
_SEEN = "~"  # no name holds it
_ONCE, _EACH, _INNER = range(3)
"""When an operation is made: for a box, at each sample, or at each stage of a step of the integration."""
_READS = {
    Operation.NUMBER: 0,
    Operation.PARAMETER: 0,
    Operation.CHANNEL: 0,
    Operation.PAST: 0,
    Operation.STAGE: 0,
    Operation.SOLUTION: 0,
    Operation.SCALE: 1,
    Operation.DEFINE: 1,
    Operation.APPLY: 1,
    Operation.PHI: 1,
    Operation.ADD: 2,
    Operation.SUBTRACT: 2,
    Operation.MULTIPLY: 2,
    Operation.LARGER: 2,
    Operation.CHOOSE: 3,
}
"""So many of an operation's places are forms."""


@dataclass(frozen=True, eq=False)
class Tape:
    """Operations, and what they read and define.

    Parameters
    ----------
    signals
        In the order in which they are defined.
    seen
        Whether each channel is read less its noise, as a sensor's; a channel of the data that a line reads is exact.
    once, each
        Shape (n, 4) each: an operation and up to three places that it reads. The k-th of both together, and of inner,
        writes form k.
    inner
        Operations at a stage of a step of the integration, shape (n, 4); none for a model without rates.
    sections, integrated
        See :func:`.integration.integrate`.
    numbers
        Shape (n_once + n_each + n_inner, 2).
    defined
        Form of each signal at the present sample.
    remembered
        Whether each signal is read at later samples.
    first
        The sample from which each signal is computed; before it, a state has initial samples.
    states
        Whether the past of each signal decides its future.
    clocks
        Whether each signal is a clock, which is zero at sample 0.
    depth
        Longest lag.
    measured
        Channel and signal of each measured output, and of each further channel of an input.
    shown
        Place of the channel of each of them.
    rows
        For each measured output, the form that is zero where the model fits the sample.
    constraints
        Forms that are not negative.
    shared
        Forms of parameters alone that the lines read, and that are not linear.
    """

    parameters: tuple[str, ...]
    signals: tuple[str, ...]
    channels: tuple[str, ...]
    seen: Mask
    once: Index
    each: Index
    inner: Index
    sections: Index
    integrated: Index
    numbers: Array
    defined: Index
    remembered: Mask
    first: Index
    states: Mask
    clocks: Mask
    depth: int
    measured: tuple[tuple[str, str], ...]
    shown: Index
    rows: Index
    constraints: Index
    shared: Index


class Writer:
    """Operations being written; what is known of an expression is written once."""

    def __init__(self, parameters: tuple[str, ...], signals: tuple[str, ...]) -> None:
        self.parameters = {sympy.Symbol(name, real=True): k for k, name in enumerate(parameters)}
        self.signals = {name: k for k, name in enumerate(signals)}
        self.channels: dict[str, int] = {}
        self.known: dict[object, int] = {}
        self.now: dict[str, int] = {}
        self.stages: dict[sympy.Symbol, int] = {}
        self.entries: list[tuple[int, tuple[int, int, int, int], tuple[float, float]]] = []

    def put(
        self, operation: Operation, *places: int, number: float = 0.0, error: float = 0.0, when: int = _EACH
    ) -> int:
        """Return the form that an operation writes."""
        padded = (int(operation), *places, *[0] * (3 - len(places)))
        key = (padded, number, error)
        if key not in self.known:
            self.entries.append((when, (padded[0], padded[1], padded[2], padded[3]), (number, error)))
            self.known[key] = len(self.entries) - 1
        return self.known[key]

    def of(self, operation: Operation, *forms: int, number: float = 0.0) -> int:
        """Put an operation on forms: it is made when the last of them is."""
        return self.put(operation, *forms, number=number, when=max(self.entries[k][0] for k in forms))

    def apply(self, function: Function, a: int, exponent: float = 0.0) -> int:
        """Return the form of a function of another. The logarithm of zero is the one that a power of zero has."""
        return self.put(Operation.APPLY, a, int(function), number=exponent, when=self.entries[a][0])

    def number(self, value: sympy.Expr) -> int:
        """Return the form of a number; ModelError where it is not finite."""
        nearest = float(value)
        if not np.isfinite(nearest):
            raise ModelError(f"a line of the model holds {value}: give a finite number")
        is_exact = value.is_Rational and sympy.Rational(nearest) == value
        error = 0.0 if is_exact else abs(nearest) * 2 * EPSILON + TINY
        return self.put(Operation.NUMBER, number=nearest, error=error, when=_ONCE)

    def ordered(self) -> tuple[tuple[Index, Index, Index], Array, dict[int, int]]:
        """Return the operations once, each and inner, as they are made, their numbers, and the place of each form."""
        order = sorted(range(len(self.entries)), key=lambda k: self.entries[k][0])
        place = {old: new for new, old in enumerate(order)}
        made = [(self.entries[k][0], _placed(self.entries[k][1], place)) for k in order]
        once, each, inner = (
            np.array([entry for level, entry in made if level == when], dtype=np.int64).reshape(-1, 4)
            for when in (_ONCE, _EACH, _INNER)
        )
        return (once, each, inner), np.array([self.entries[k][2] for k in order]).reshape(-1, 2), place

    def write(self, node: sympy.Basic) -> int:
        """Return the form of an expression, with its operations if there are none yet."""
        if node not in self.known:
            self.known[node] = self._written(node)
        return self.known[node]

    def _written(self, node: sympy.Basic) -> int:
        if node in self.parameters:
            return self.put(Operation.PARAMETER, self.parameters[node], when=_ONCE)
        if node in self.stages:
            return self.put(Operation.STAGE, self.stages[node], when=_INNER)
        if isinstance(node, sympy.Indexed):
            return self._read(node)
        if node.is_number:
            return self.number(node)
        if isinstance(node, sympy.Add):
            return reduce(lambda a, b: self.of(Operation.ADD, a, b), self._sorted(node.args))
        if isinstance(node, sympy.Mul):
            return self._product(node)
        if isinstance(node, sympy.Pow):
            return self._power(node.base, node.exp)
        if isinstance(node, sympy.Max):
            return reduce(self._larger, map(self.write, node.args))
        if isinstance(node, sympy.Min):
            return reduce(self._smaller, map(self.write, node.args))
        if isinstance(node, sympy.Piecewise):
            return self._piecewise(node.args)
        if node.func in (sympy.sinh, sympy.cosh, sympy.tan):
            return self.write(node.rewrite(sympy.sin if node.func is sympy.tan else sympy.exp))
        if node.func is sympy.ceiling:
            return self._scaled(self.apply(Function.FLOOR, self._scaled(self.write(node.args[0]), -1.0)), -1.0)
        if node.func is sympy.log:  # it is of no power, so that of zero is no number
            a = self.write(node.args[0])
            return self.put(Operation.APPLY, a, int(Function.LOG), 1, when=self.entries[a][0])
        if node.func in _FUNCTIONS:
            return self.apply(_FUNCTIONS[node.func], self.write(node.args[0]))
        known = sorted({*(f.__name__ for f in _FUNCTIONS), "Max", "Min", "Piecewise", "ceiling", "sqrt", "tan"})
        raise ModelError(
            f"inversion has no enclosure of {node.func} in '{node}': write the line with {', '.join(known)}"
        )

    def _sorted(self, nodes: tuple[sympy.Basic, ...]) -> list[int]:
        """Return the forms of expressions, those made first first, so that they are joined as seldom as possible."""
        return sorted(map(self.write, nodes), key=lambda k: self.entries[k][0])

    def _scaled(self, a: int, factor: float) -> int:
        return self.of(Operation.SCALE, a, number=factor)

    def _product(self, node: sympy.Mul) -> int:
        if (found := _geometric(node)) is not None:
            return self._geometric_sum(*found)
        factor, rest = node.as_coeff_Mul()
        exact = factor.is_Rational and sympy.Rational(float(factor)) == factor
        if factor != 1 and exact:
            return self._scaled(self.write(rest), float(factor))
        return reduce(lambda a, b: self.of(Operation.MULTIPLY, a, b), self._sorted(node.args))

    def _geometric_sum(self, base: sympy.Expr, count: sympy.Expr, rest: sympy.Expr) -> int:
        r"""Return the form of ``rest (1 - base**count) / (1 - base)``, which a base of one does not divide by zero.

        With phi(z) = (exp(z) - 1) / z it is ``rest count phi(count log(base)) / phi(log(base))``.
        """
        found = sympy.Dummy("sum")
        if (base, count) not in self.known:
            logarithm = self.apply(Function.LOG, self.write(base))
            above = self.of(Operation.PHI, self.of(Operation.MULTIPLY, self.write(count), logarithm))
            below = self.apply(Function.RECIPROCAL, self.of(Operation.PHI, logarithm))
            ratio = self.of(Operation.MULTIPLY, above, below)
            self.known[base, count] = self.of(Operation.MULTIPLY, self.write(count), ratio)
        self.known[found] = self.known[base, count]
        return self.write(rest * found)

    def _power(self, base: sympy.Expr, exponent: sympy.Expr) -> int:
        if base == sympy.E:
            return self.apply(Function.EXP, self.write(exponent))
        if not exponent.is_number:
            form = self.write(base)
            value = self.apply(
                Function.EXP, self.of(Operation.MULTIPLY, self.write(exponent), self.apply(Function.LOG, form))
            )
            if base.is_nonnegative:
                return value
            # A whole power of a negative number has a value, too, of which the logarithm of -1 says nothing.
            return self.of(Operation.CHOOSE, form, value, self.apply(Function.LOG, self.number(sympy.Integer(-1))))
        if exponent.could_extract_minus_sign():
            return self.apply(Function.RECIPROCAL, self.write(base**-exponent))
        form = self.write(base)
        if exponent == sympy.S.Half:
            return self.apply(Function.ROOT, form)
        if exponent.is_Integer:
            squared = self.apply(Function.SQUARE, self._power(base, exponent // 2)) if exponent > 1 else form
            return self.of(Operation.MULTIPLY, squared, form) if exponent % 2 and exponent > 1 else squared
        nearest = float(exponent)
        if sympy.Rational(nearest) == exponent:
            return self.apply(Function.POWER, form, nearest)
        return self.apply(
            Function.EXP, self.of(Operation.MULTIPLY, self.number(exponent), self.apply(Function.LOG, form))
        )

    def _larger(self, a: int, b: int) -> int:
        return self.of(Operation.LARGER, a, b)

    def _smaller(self, a: int, b: int) -> int:
        return self._scaled(self._larger(self._scaled(a, -1.0), self._scaled(b, -1.0)), -1.0)

    def _piecewise(self, branches: tuple[sympy.Basic, ...]) -> int:
        (value, condition), *rest = branches
        if condition == sympy.true or not rest:
            return self.write(value)
        if not isinstance(condition, Relational) or condition.func in (sympy.Eq, sympy.Ne):
            raise ModelError(f"inversion does not read the condition '{condition}': write it as one inequality")
        above, chosen, other = condition.gts - condition.lts, self.write(value), self._piecewise(tuple(rest))
        strict = isinstance(condition, sympy.StrictGreaterThan | sympy.StrictLessThan)
        if above.could_extract_minus_sign():  # the opposite: no product rounds what an input of zero decides
            above, chosen, other, strict = -above, other, chosen, not strict
        return self.of(Operation.CHOOSE, self.write(above), chosen, other, number=float(strict))

    def _read(self, node: sympy.Indexed) -> int:
        ((name, lag),) = references(node)
        if name not in self.signals:
            place = self.channels.setdefault(name, len(self.channels))
            return self.put(Operation.CHANNEL, place, lag)
        return self.put(Operation.PAST, self.signals[name], lag) if lag else self.now[name]


def tape_of(model: Model) -> Tape:
    """Return the tape of a model; lines in derivatives are integrated.

    Raises
    ------
    ModelError
        For a function without an enclosure.
    """
    read = {m.signal: m for m in reversed(model.measurements) if m.signal in model.inputs}
    rates = Rates.of(model.lines)
    seen = (Line(signal(name)[t], _seen(m)) for name, m in read.items())
    lines = causal_order((*seen, *summed(model.lines)))
    parameters, signals = tuple(p.name for p in model.parameters), tuple(line.signal for line in lines)
    writer = Writer(parameters, signals)
    constraints = [writer.write(constraint) for constraint in model.constraints]
    integrated, counts = _integrated(writer, rates)
    for line in lines:
        if line.signal in rates.states:
            form = writer.put(Operation.SOLUTION, rates.states.index(line.signal))
        else:
            form = writer.write(line.expression)
        writer.now[line.signal] = writer.put(Operation.DEFINE, form, writer.signals[line.signal])
    outputs = [m for m in model.measurements if read.get(m.signal) is not m]
    rows = [writer.write(signal(m.signal)[t] - _seen(m)) for m in outputs]
    (once, each, inner), written, place = writer.ordered()
    first, states = first_samples(lines), state_lags(lines)
    lags = [(name, lag) for line in lines for name, lag in line.reads]
    return Tape(
        parameters,
        signals,
        tuple(name.removesuffix(_SEEN) for name in writer.channels),
        np.array([name.endswith(_SEEN) for name in writer.channels]),
        once,
        each,
        inner,
        np.array(counts, dtype=np.int64),
        np.array([[place[k] for k in own] for own in integrated], dtype=np.int64).reshape(-1, 6),
        written,
        np.array([place[writer.now[name]] for name in signals], dtype=np.int64),
        np.array([any(name == own and lag for name, lag in lags) for own in signals]),
        np.array([first[name] for name in signals], dtype=np.int64),
        np.array([name in states for name in signals]),
        np.array([is_clock(line) for line in lines]),
        max((lag for _, lag in lags), default=0),
        tuple((m.channel, m.signal) for m in outputs),
        np.array([writer.channels[_name(m)] for m in outputs], dtype=np.int64),
        np.array([place[k] for k in rows], dtype=np.int64),
        np.array([place[k] for k in constraints], dtype=np.int64),
        _shared(once, np.concatenate([each, inner])),
    )


def _geometric(node: sympy.Mul) -> tuple[sympy.Expr, sympy.Expr, sympy.Expr] | None:
    """Return b, s and the rest of a product with (1 - b**s) / (1 - b), where b is positive."""
    for divisor in node.args:
        base = 1 - divisor.base if divisor.is_Pow and divisor.exp == -1 else sympy.S.Zero
        for factor in node.args if base.is_positive else ():
            power = 1 - factor
            if power.is_Pow and power.base == base:
                return base, power.exp, node / divisor / factor
    return None


def _shared(once: Index, later: Index) -> Index:
    """Return the operations on parameters alone whose results others read, and which leave something over."""
    bent = (Operation.MULTIPLY, Operation.APPLY, Operation.CHOOSE, Operation.LARGER, Operation.PHI)
    read = {k for operation, *places in later.tolist() for k in places[: _READS[Operation(operation)]] if k < len(once)}
    return np.array(sorted(k for k in read if once[k, 0] in bent), dtype=np.int64)


def _integrated(writer: Writer, rates: Rates) -> tuple[list[list[int]], list[int]]:
    """Write what integration reads of each state, and return its forms, and how many operations there are after each.

    The last ones give the states at the next sample.
    """
    writer.stages = {stage: k for k, stage in enumerate(rates.stages)}
    zero, n = writer.number(sympy.Integer(0)), range(len(rates.states))

    def total(terms: Iterable[int]) -> int:
        return reduce(lambda a, b: writer.of(Operation.ADD, a, b), terms, zero)

    def product(factor: sympy.Expr, *forms: int) -> Iterator[int]:
        if factor != 0:
            yield reduce(lambda a, b: writer.of(Operation.MULTIPLY, a, b), forms, writer.write(factor))

    def count() -> int:
        return sum(when == _INNER for when, _, _ in writer.entries)

    begin = [writer.put(Operation.PAST, writer.signals[name], 1) for name in rates.states]
    rate = [writer.write(own) for own in rates.rates]
    counts = [count()]
    slopes = rates.slopes
    own = [writer.write(slopes[i][i]) for i in n]
    others = [total(k for j in n if j != i for k in product(slopes[i][j], rate[j])) for i in n]
    first = [total((others[i], *product(slopes[i][i], rate[i]))) for i in n]
    counts.append(count())
    second = [
        total(
            (
                *(k for j in n if j != i for k in product(slopes[i][j], first[j])),
                *(k for (j, m), bend in rates.bends[i].items() for k in product(bend, rate[j], rate[m])),
            )
        )
        for i in n
    ]
    counts.append(count())
    return [list(places) for places in zip(begin, rate, own, first, others, second, strict=True)], counts


def _seen(measurement: Measurement) -> sympy.Expr:
    """Return the signal as its channel shows it, the channel without its noise."""
    inverse = VALUE if measurement.inverse is None else measurement.inverse
    return inverse.xreplace({VALUE: signal(_name(measurement))[t]})


def _name(measurement: Measurement) -> str:
    """Return the name of a channel as a sensor with or without noise shows it."""
    return measurement.channel if measurement.noise is None else measurement.channel + _SEEN


def _placed(entry: tuple[int, ...], place: Mapping[int, int]) -> tuple[int, ...]:
    """Return an operation that reads forms by their final places."""
    operation, *reads = entry
    forms = _READS[Operation(operation)]
    return operation, *(place[k] if n < forms else k for n, k in enumerate(reads))
