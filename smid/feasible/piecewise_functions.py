"""Kinks: Max, Min, Abs and sign as new signals, beside lines that are polynomial.

Every piecewise function is written with the positive part ``p(x) = max(0, x)`` and the sign:

    max(a, b) = b + p(a - b),    min(a, b) = -max(-a, -b),    |x| = 2 p(x) - x,    p(-x) = p(x) - x.

Each distinct argument becomes one :class:`Kink`, a signal that the lines read instead. Arguments that differ by a shift
of time or by their sign share one kink. The argument of a kink may read earlier kinks.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum
from functools import lru_cache, reduce

import sympy

from smid.models import Line, Model
from smid.models.hidden_states import without_hidden_states
from smid.models.symbols import references, signal, t

KINKS = (sympy.Max, sympy.Min, sympy.Abs, sympy.sign)


class Kind(Enum):
    """The two functions that all others are written with."""

    POSITIVE_PART = "max(0, x)"
    SIGN = "sign(x)"


@dataclass(frozen=True)
class Kink:
    """One positive part or sign: the name of the signal for its value, and its argument at time t."""

    name: str
    kind: Kind
    argument: sympy.Expr

    @property
    def constant(self) -> bool:
        """Tell whether the argument holds parameters only, so that the value is the same at all times."""
        return not references(self.argument)


@dataclass(frozen=True)
class Unfolded:
    """A model's lines without piecewise functions, and the kinks that they read, each after those that it reads itself.

    The lines read kinks that depend on time as signals, and constant kinks as symbols.
    """

    lines: tuple[Line, ...]
    kinks: tuple[Kink, ...]


@lru_cache(maxsize=64)
def unfold(model: Model) -> Unfolded:
    """Replace every Max, Min, Abs and sign in a model's lines by a kink.

    Examples
    --------
    >>> from smid.models import OutputError, Parameter
    >>> u, d = signal("u"), Parameter("d", 0, 1)
    >>> model = OutputError().insert_before("u", lambda u: sympy.Max(0, u - d.symbol), parameters=[d])
    >>> [(kink.name, kink.argument) for kink in unfold(model).kinks]
    [('kink1', -d + u[t])]
    """
    model = without_hidden_states(model)
    if not any(line.expression.has(*KINKS) for line in model.lines):
        return Unfolded(model.lines, ())
    found: dict[tuple[Kind, sympy.Expr], Kink] = {}
    names = _free_names(model)

    # Return the kink of an argument; arguments that differ by a shift or their sign share one.
    def value(kind: Kind, x: sympy.Expr) -> sympy.Expr:
        x = sympy.expand(x)
        if x.is_number:
            return sympy.Max(0, x) if kind is Kind.POSITIVE_PART else sympy.sign(x)
        lag = min((lag for _, lag in references(x)), default=0)
        now = sympy.expand(x.xreplace({t: t + lag}))
        if (kind, sympy.expand(-now)) in found:
            return value(kind, -x) + x if kind is Kind.POSITIVE_PART else -value(kind, -x)
        if (kind, now) not in found:
            found[kind, now] = Kink(next(names), kind, now)
        kink = found[kind, now]
        return sympy.Symbol(kink.name, real=True) if kink.constant else signal(kink.name)[t - lag]

    def larger(a: sympy.Expr, b: sympy.Expr) -> sympy.Expr:
        return a + value(Kind.POSITIVE_PART, b - a)

    # Replace the innermost functions first.
    def rewritten(expression: sympy.Expr) -> sympy.Expr:
        if isinstance(expression, sympy.Indexed) or not expression.has(*KINKS):
            return expression
        arguments = [rewritten(a) for a in expression.args]
        if isinstance(expression, sympy.Max):
            return reduce(larger, arguments)
        if isinstance(expression, sympy.Min):
            return -reduce(larger, [-a for a in arguments])
        if isinstance(expression, sympy.Abs):
            return 2 * value(Kind.POSITIVE_PART, arguments[0]) - arguments[0]
        if isinstance(expression, sympy.sign):
            return value(Kind.SIGN, arguments[0])
        return expression.func(*arguments)

    lines = tuple(replace(line, expression=rewritten(line.expression)) for line in model.lines)
    return Unfolded(lines, tuple(found.values()))


def _free_names(model: Model) -> Iterator[str]:
    taken = {p.name for p in model.parameters} | {line.signal for line in model.lines} | {*model.inputs}
    taken |= {*model.channels} | {m.noise for m in model.measurements if m.noise is not None}
    count = 0
    while True:
        count += 1
        if f"kink{count}" not in taken:
            yield f"kink{count}"
