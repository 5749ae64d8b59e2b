"""Where an effect can act on a model: input, output, state lines, and parameters.

A *state line* defines a signal from that signal's own past, ``w[t] = f(w[t-1], u[t-1])``, or gives its rate, ``d/dt w =
f(w, u)``.  What it adds is the *increment* f - w[t-1], or the rate f; forces, leaks and directions act on it. A line
behind which another effect was inserted (``w_raw = f(w[t-1]), w = min(w_raw, s)``) is still a state line: its *own*
signal is the one that it reads back. States that effects added are left out, see `Model.origins`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import sympy
from sympy.core.function import Application

from smid.diagnosis.effects.effect import Site
from smid.diagnosis.effects.parts.naming import signal_of
from smid.models import Line, Model, Parameter, signal, t
from smid.models.symbols import number, plain_symbols, references, swapped

__all__ = [
    "StateLine",
    "base_parameters",
    "entries",
    "is_linear",
    "let_vary",
    "magnitude",
    "multiplied_out",
    "output_signal",
    "scaled",
    "shown_at",
    "state_lines",
    "static_end",
    "with_increment",
    "without_effects",
]


@dataclass(frozen=True)
class StateLine:
    """A line of the plant that carries a state.

    Parameters
    ----------
    line
        The line.
    own
        The signal it reads back: the line's, or what another effect made of it.
    numbers
        Values of the fixed parameters: a power fixed at one is no power.
    """

    line: Line
    own: str
    numbers: Mapping[sympy.Symbol, sympy.Expr]

    @property
    def lag(self) -> int:
        """Samples back at which the line reads signals: 0 for a rate, 1 for a difference equation."""
        return 0 if self.line.rate else 1

    @property
    def level(self) -> sympy.Expr:
        """The state that the line reads."""
        return signal(self.own)[t - self.lag]

    @property
    def increment(self) -> sympy.Expr:
        """What the line adds to the state per sample, or its rate per second."""
        return self.line.expression if self.line.rate else self.line.expression - self.level

    @property
    def order(self) -> int:
        """How many of its own samples the line reads; 1 for a rate."""
        return max((lag for name, lag in self.line.reads if name == self.own), default=1) or 1

    def own_coefficient(self, lag: int) -> sympy.Expr:
        """Return the factor of the state at a lag, from the terms that are linear in it."""
        return self.coefficient(signal(self.own)[t - lag])

    def coefficient(self, reference: sympy.Indexed) -> sympy.Expr:
        """Return the factor of a signal at a lag, from the terms that are linear in it."""
        own = str(reference.base.label)
        total = sympy.Integer(0)
        for term in sympy.Add.make_args(multiplied_out(swapped(self.line.expression, self.numbers))):
            factor = term / reference
            if term.has(reference) and not any(name == own for name, _ in references(factor)):
                total += factor
        return total

    def inflow(self, source: StateLine) -> sympy.Expr:
        """Return the factor at which another state flows into this one; 0 for a bare copy, as of speed to position."""
        factor = self.coefficient(source.level)
        return factor if source.own != self.own and factor.free_symbols else sympy.Integer(0)

    @property
    def drive(self) -> sympy.Expr:
        """The expression of the line with its own past set to zero."""
        own = {signal(name)[t - lag]: sympy.Integer(0) for name, lag in self.line.reads if name == self.own}
        return swapped(self.line.expression, own)

    @property
    def leak(self) -> sympy.Expr:
        """The factor of the state in ``increment = -leak * state + ...``, at rest; 0 for an integrator."""
        if self.line.rate:
            return multiplied_out(-self.own_coefficient(0))
        total = sum((self.own_coefficient(lag) for lag in range(1, self.order + 1)), sympy.Integer(0))
        return multiplied_out(1 - total)


def without_effects(model: Model, expression: sympy.Expr) -> sympy.Expr:
    """Return an expression of the model where the parameters that effects added do nothing."""
    nulls = {p.symbol: number(p.null) for p in model.parameters if p.name in model.origins and p.null is not None}
    return multiplied_out(swapped(expression, nulls))


def multiplied_out(expression: sympy.Expr) -> sympy.Expr:
    """Expand products, but not inside functions, where nothing is linear and expansion takes minutes."""
    powers = {power for power in expression.atoms(sympy.Pow) if not power.exp.is_Integer}
    curves = {curve: sympy.Dummy(real=True) for curve in expression.atoms(Application) | powers}
    closed = sympy.expand(swapped(expression, curves))
    return swapped(closed, {dummy: curve for curve, dummy in curves.items()})


def output_signal(model: Model, site: Site) -> str:
    """Return the state behind the main output, before any sensor curve or lag; without one, the measured signal."""
    measured = signal_of(model, site.output)
    owns = {state.own for state in state_lines(model)}
    now = {line.signal: {name for name, lag in line.reads if lag == 0} for line in model.lines}
    waiting = [measured]
    seen: set[str] = set()
    while waiting:
        name = waiting.pop(0)
        if name in owns:
            return name
        seen.add(name)
        # In the order of the lines, whatever the signals are called.
        waiting += [line.signal for line in model.lines if line.signal in now.get(name, set()) - seen]
    return measured


def shown_at(model: Model, site: Site, state: StateLine) -> str:
    """Return the output channel that shows a state; the main one where none does."""
    shown = (name for name in model.output_channels if output_signal(model, replace(site, output=name)) == state.own)
    return next(shown, site.output)


def entries(model: Model, state: StateLine, input: str) -> tuple[str, ...]:
    """List the signals by which an input enters a state's line: itself, or what effects have made of it."""
    by_name = {line.signal: line for line in model.lines}
    states = {name for other in state_lines(model) for name in (other.own, other.line.signal)}

    def carries(name: str, seen: frozenset[str]) -> bool:
        reads = {read for read, _ in by_name[name].reads} - states - seen if name in by_name else set()
        return name == input or any(carries(read, seen | reads) for read in sorted(reads))

    read = sorted({name for name, lag in state.line.reads if lag == state.lag} - states)
    return tuple(name for name in read if carries(name, frozenset((name,))))


def is_linear(model: Model) -> bool:
    """Return whether all lines are sums of signals with constant factors, and a constant."""
    terms = (term for line in model.lines for term in sympy.Add.make_args(multiplied_out(line.expression)))
    read = ((term, term.atoms(sympy.Indexed)) for term in terms)
    curved = any(m.inverse is not None for m in model.measurements)
    return not curved and all(not found or not (term / next(iter(found))).atoms(sympy.Indexed) for term, found in read)


def static_end(model: Model, name: str) -> str:
    """Return the last signal in a chain of static functions that are the only readers of each other."""
    readers: dict[str, list[Line]] = {}
    for line in model.lines:
        for read in {read for read, _ in line.reads}:
            readers.setdefault(read, []).append(line)
    while len(readers.get(name, ())) == 1:
        (curve,) = readers[name]
        # A signal that only a sensor reads is not part of the plant.
        if curve.rate or curve.reads != {(name, 0)} or curve.signal not in readers:
            break
        name = curve.signal
    return name


def state_lines(model: Model) -> tuple[StateLine, ...]:
    """List the lines that carry the plant's states, in the model's order."""
    found = []
    numbers = {p.symbol: number(p.lower) for p in model.parameters if p.lower == p.upper}
    for line in model.lines:
        own = None if line.signal in model.origins else _own(model, line)
        if own is not None and line.reads:
            found.append(StateLine(line, own, numbers))
    return tuple(found)


def _own(model: Model, line: Line) -> str | None:
    past = {name for name, lag in line.reads if lag > 0}
    if line.rate or line.signal in past:
        return line.signal
    # What is computed from this line at the same time, step by step.
    downstream = [line.signal]
    for name in downstream:
        for other in model.lines:
            if (name, 0) in other.reads and other.signal not in downstream and not other.rate:
                downstream.append(other.signal)
                if other.signal in past:
                    return other.signal
    return None


def with_increment(
    model: Model, state: StateLine, increment: sympy.Expr, parameters: Iterable[Parameter] = ()
) -> Model:
    """Return the model with another increment, or rate, of a state line."""
    expression = increment if state.line.rate else state.level + increment
    return model.replace_line(state.line.signal, expression, parameters)


def base_parameters(model: Model) -> tuple[Parameter, ...]:
    """List the parameters of the plant, fixed ones too: those its states depend on and that no effect brought in."""
    lines = {line.signal for line in _upstream(model)}
    used = {name for line in model.lines if line.signal in lines for name in plain_symbols(line.expression)}
    return tuple(p for p in model.parameters if p.name in used and p.name not in model.origins)


def _upstream(model: Model) -> Iterator[Line]:
    """Yield the lines that the plant's states depend on, also through lines that effects added, but without those."""
    by_name = {line.signal: line for line in model.lines}
    waiting = [state.line.signal for state in state_lines(model)]
    for name in waiting:
        if name not in model.origins:
            yield by_name[name]
        reads = sorted({other for other, _ in by_name[name].reads})
        waiting += [other for other in reads if other in by_name and other not in waiting]


def let_vary(
    model: Model,
    parameter: Parameter,
    vary: Callable[[sympy.Symbol, int], sympy.Expr],
    parameters: Iterable[Parameter] = (),
    *,
    states_only: bool = False,
) -> Model | None:
    """Replace a parameter, where the plant's lines use it, by an expression that may hold it again."""
    states = {state.line.signal: state for state in state_lines(model)}
    names = set(states) if states_only else {line.signal for line in _upstream(model)}
    changed, lines = False, []
    for line in model.lines:
        if line.signal in names and parameter.name in plain_symbols(line.expression):
            lag = states[line.signal].lag if line.signal in states else 0
            line = replace(line, expression=swapped(line.expression, {parameter.symbol: vary(parameter.symbol, lag)}))
            changed = True
        lines.append(line)
    return replace(model, parameters=(*model.parameters, *parameters), lines=tuple(lines)) if changed else None


def scaled(model: Model, parameter: Parameter, factor: Parameter) -> Model | None:
    """Multiply a parameter by a new one wherever the plant's lines use it; None where they do not."""
    return let_vary(model, parameter, lambda symbol, _: symbol * factor.symbol, [factor])


def magnitude(model: Model, parameter: Parameter) -> float:
    """Return the size of a parameter with its sign: its value, else the middle or end of its box, else 1."""
    value = model.values.get(parameter.name)
    if not value:
        ends = [end for end in (parameter.lower, parameter.upper) if abs(end) != float("inf")]
        value = sum(ends) / len(ends) if ends else 0.0
        value = value or max((abs(end) for end in ends), default=0.0)
    return float(value) or 1.0
