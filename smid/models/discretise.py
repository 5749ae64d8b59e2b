"""From differential equations to lines of samples, by Runge-Kutta steps or, for stiff rates, linearly implicit ones.

A rate line says ``d/dt x = f(x, u)``.  Over the interval from sample t-1 to sample t,

- inputs are held at their value at t-1 (zero order hold), and so is every plain line that is free of the states at
  the same time, and every plain line with a memory of its own (a play operator);
- plain lines without memory that read a state at the same time are put into the rates, so that each stage of a step
  sees their value at that stage;
- what a rate reads at ``t - k``, k >= 1, is a delayed sample and is held too.

With h the sampling time over the number of substeps, a step is

    euler        x + h k1                             k1 = f(x)
    trapezoidal  x + h/2 (k1 + k2)                    k2 = f(x + h k1)          (Heun's explicit form)
    rk4          x + h/6 (k1 + 2 k2 + 2 k3 + k4)      k2 = f(x + h/2 k1), k3 = f(x + h/2 k2), k4 = f(x + h k3)
    rosenbrock   see `smid.models.rosenbrock`; it also holds where h is far above the fastest time constant

The slopes become helper lines.  A single state whose rate is ``s x + g`` with s free of signals needs none: the step
is ``P(hs) x + h Q(hs) g``, P the exponential series cut at the order of the scheme and ``Q(z) = (P(z) - 1) / z``, which
the simulator runs as a linear filter.

All numbers are exact fractions here, because intervals are proven for these lines: the sampling time is the fraction
that its float is.

Reference: Hairer, Norsett, Wanner, "Solving Ordinary Differential Equations I", section II.1.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import count

import sympy
from sympy.core.function import Application

from smid.models.parts import Line
from smid.models.rosenbrock import affine_step, rosenbrock_step
from smid.models.structure import groups
from smid.models.symbols import number, plain_symbols, references, signal, swapped, t

__all__ = ["ENCLOSED", "SCHEMES", "discretise", "held_rates", "read_by", "summed"]

_HALF = sympy.Rational(1, 2)

_RK4 = (_HALF, _HALF, sympy.Integer(1)), tuple(sympy.Rational(weight, 6) for weight in (1, 2, 2, 1))

ENCLOSED = "enclosed"
"""The scheme whose intervals hold for the differential equation itself; it is simulated by rk4."""

_EXPLICIT: dict[str, tuple[tuple[sympy.Expr, ...], tuple[sympy.Expr, ...]]] = {
    "euler": ((), (sympy.Integer(1),)),
    "trapezoidal": ((sympy.Integer(1),), (_HALF, _HALF)),
    "rk4": _RK4,
    ENCLOSED: _RK4,
}
"""Per scheme: how far along the slope before it each further slope is taken, and the weights of the slopes.

The number of slopes is also the order of each of these schemes."""

SCHEMES = (*_EXPLICIT, "rosenbrock")
"""Names of the schemes."""


def discretise(
    lines: Sequence[Line],
    scheme: str,
    substeps: int,
    sampling_time: float,
    taken: Collection[str] = (),
    fixed: Mapping[sympy.Symbol, sympy.Expr] | None = None,
) -> tuple[Line, ...]:
    """Return plain lines that compute the samples of the rate lines' solutions.

    Parameters
    ----------
    sampling_time
        In seconds.

    Examples
    --------
    >>> x, u = signal("x"), signal("u")
    >>> print(discretise([Line(x[t], u[t] - x[t] ** 2, rate=True)], "euler", 1, 0.5)[0].expression)
    u[t - 1]/2 - x[t - 1]**2/2 + x[t - 1]
    """
    lines = [Line(line.target, swapped(line.expression, fixed or {}), line.rate) for line in lines]
    plain, rates = [line for line in lines if not line.rate], held_rates(lines)
    states = list(rates)
    if not states:
        return tuple(plain)
    step = number(sampling_time) / substeps
    if len(states) == 1:
        name = states[0]
        slope = sympy.diff(rates[name], signal(name)[t])  # as it is: expanded it may fill the memory
        if not slope.atoms(sympy.Indexed):
            return (*plain, Line(signal(name)[t], _affine(name, rates[name], slope, scheme, substeps, step)))
    names = _free_names({*taken, *states, *(line.signal for line in lines)})
    return (*plain, *_steps(states, rates, scheme, substeps, step, names))


def held_rates(lines: Sequence[Line]) -> dict[str, sympy.Expr]:
    """Return the rates, written in ``x[t]``, the state at the stage, and in samples at t-1 and before.

    Examples
    --------
    >>> x, u = signal("x"), signal("u")
    >>> held_rates([Line(x[t], u[t] - x[t], rate=True)])
    {'x': u[t - 1] - x[t]}
    """
    plain = [line for line in lines if not line.rate]
    rates = {line.signal: line.expression for line in lines if line.rate}
    memory = {line.signal for group, recursive in groups(plain) if recursive for line in group}
    moving: dict[sympy.Expr, sympy.Expr] = {}
    for line in plain:
        now = {name for name, lag in line.reads if lag == 0}
        if line.signal not in memory and any(name in rates or signal(name)[t] in moving for name in now):
            moving[line.target] = swapped(line.expression, moving)
    result = {}
    for name, rate in rates.items():
        inlined = swapped(rate, moving)
        earlier = {
            signal(read)[t - lag]: signal(read)[t - lag - 1]
            for read, lag in references(inlined)
            if lag > 0 or read not in rates
        }
        result[name] = swapped(inlined, earlier)
    return result


def summed(lines: Sequence[Line]) -> tuple[Line, ...]:
    """Return lines that read what the solutions of the rates read, and at which samples: a sum for each solution.

    Examples
    --------
    >>> x, u = signal("x"), signal("u")
    >>> print(summed([Line(x[t], u[t] - x[t] ** 2, rate=True)])[0])
    x[t] = u[t - 1] + x[t - 1]
    """
    rates = held_rates(lines)
    return tuple(read_by(line.signal, rates[line.signal]) if line.rate else line for line in lines)


def read_by(name: str, rate: sympy.Expr) -> Line:
    """Return a line that reads what the solution of a held rate reads: a sum.

    Examples
    --------
    >>> x, u = signal("x"), signal("u")
    >>> print(read_by("x", u[t - 1] - x[t] ** 2))
    x[t] = u[t - 1] + x[t - 1]
    """
    signals = {signal(read)[t - max(lag, 1)] for read, lag in {*references(rate), (name, 1)}}
    parameters = (sympy.Symbol(parameter, real=True) for parameter in plain_symbols(rate))
    return Line(signal(name)[t], sympy.Add(*signals, *parameters))


def _affine(name: str, rate: sympy.Expr, slope: sympy.Expr, scheme: str, substeps: int, step: sympy.Expr) -> sympy.Expr:
    forcing = swapped(rate, {signal(name)[t]: sympy.Integer(0)})
    z = step * slope
    if scheme in _EXPLICIT:
        order = len(_EXPLICIT[scheme][1])
        growth = sum((z**k / sympy.factorial(k) for k in range(order + 1)), sympy.Integer(0))
        drive = sum((z**k / sympy.factorial(k + 1) for k in range(order)), sympy.Integer(0))
    else:
        growth, drive = affine_step(z)
    repeated = sum((growth**k for k in range(substeps)), sympy.Integer(0))
    return growth**substeps * signal(name)[t - 1] + step * drive * repeated * forcing


def _steps(
    states: Sequence[str],
    rates: Mapping[str, sympy.Expr],
    scheme: str,
    substeps: int,
    step: sympy.Expr,
    names: Iterator[str],
) -> Iterator[Line]:
    start: dict[str, sympy.Expr] = {name: signal(name)[t - 1] for name in states}
    for part in range(substeps):
        last = part == substeps - 1
        targets = {x: signal(x if last else next(names))[t] for x in states}
        if scheme in _EXPLICIT:
            yield from _explicit_step(scheme, start, rates, step, targets, names)
        else:
            yield from rosenbrock_step(start, rates, step, targets, names)
        start = dict(targets)


def _explicit_step(
    scheme: str,
    start: Mapping[str, sympy.Expr],
    rates: Mapping[str, sympy.Expr],
    step: sympy.Expr,
    targets: Mapping[str, sympy.Expr],
    names: Iterator[str],
) -> Iterator[Line]:
    advances, weights = _EXPLICIT[scheme]
    slopes: list[dict[str, sympy.Expr]] = []
    for advance in (sympy.Integer(0), *advances):
        point = {x: start[x] + (step * advance * slopes[-1][x] if slopes else 0) for x in start}
        # One pass: what a state is replaced by reads earlier samples only.
        stage = {signal(x)[t]: point[x] for x in start}
        values = {x: swapped(rates[x], stage) for x in start}
        if len(weights) > 1:
            helpers = {x: signal(next(names))[t] for x in start}
            yield from (Line(helpers[x], values[x]) for x in start)
            values = helpers
        slopes.append(values)
    for x in start:
        moved = sum((weight * slope[x] for weight, slope in zip(weights, slopes, strict=True)), sympy.Integer(0))
        # What holds functions stays as it is: written out it would hold them more often, and be enclosed less well.
        moved = step * moved if moved.has(Application) else sympy.expand(step * moved)
        yield Line(targets[x], start[x] + moved)


def _free_names(taken: Collection[str]) -> Iterator[str]:
    """Yield names for helper lines that nothing in the model has."""
    return (name for name in (f"stage{number}" for number in count(1)) if name not in taken)
