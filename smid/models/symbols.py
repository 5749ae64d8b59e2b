"""The symbols that the lines of a model are written in: time, signals, and what an expression refers to."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Iterator, Mapping
from fractions import Fraction
from functools import cmp_to_key, lru_cache
from typing import Any

import sympy
from sympy.core.function import Application
from sympy.functions.elementary.piecewise import ExprCondPair

from relaxations.algebra.ball_arithmetic import outwards
from smid.models.errors import ModelError

__all__ = [
    "VALUE",
    "as_written",
    "canonical",
    "distinct_parts",
    "end",
    "number",
    "packed",
    "plain_symbols",
    "references",
    "rename_signals",
    "rewritten",
    "signal",
    "swapped",
    "t",
    "unevaluated",
    "unpacked",
    "unused",
]

t = sympy.Symbol("t", integer=True)
"""Discrete time, the only index of a signal."""

VALUE = sympy.Symbol("value", real=True)
"""The argument of a sensor's inverse curve: the measured value without its noise."""


def signal(name: str) -> sympy.IndexedBase:
    """Return the signal of that name, to be indexed by time as in ``signal("w")[t - 1]``.

    Parameters
    ----------
    name
        Name of the signal.

    Examples
    --------
    >>> w = signal("w")
    >>> w[t - 1] + 1
    w[t - 1] + 1
    """
    return _indexed(name)


# Sympy deduces all that follows from an assumption, again for each object of the same name.
@lru_cache(maxsize=4096)
def _indexed(name: str) -> sympy.IndexedBase:
    return sympy.IndexedBase(name, real=True)


@lru_cache(maxsize=4096)
def _sample(name: str, lag: int) -> sympy.Indexed:
    return signal(name)[t - lag]


def unused(wanted: str, taken: Collection[str]) -> str:
    """Return a name that is not taken: the wanted one, else the wanted one with the first free number from 2 on."""
    numbered = (f"{wanted}{count}" for count in itertools.count(2))
    return next(name for name in itertools.chain((wanted,), numbered) if name not in taken)


def number(value: float) -> sympy.Rational:
    """Return a number as an exact fraction; a float is a fraction with a power of two below.

    Examples
    --------
    >>> number(2.0), number(0.5)
    (2, 1/2)
    >>> number(0.1) == sympy.Rational(1, 10)  # no float is a tenth
    False
    """
    try:
        exact = sympy.sympify(value)
    except sympy.SympifyError:
        exact = None
    if not (isinstance(exact, sympy.Number) and exact.is_finite):
        raise ModelError(f"{value} is not a finite number: give a decimal or a fraction")
    return sympy.Rational(exact)


def end(value: float, direction: int) -> float:
    """Return an end of a closed box as a float, rounded outwards where no float has that value.

    Examples
    --------
    >>> third = Fraction(1, 3)
    >>> end(third, -1) < third < end(third, 1)
    True
    """
    if isinstance(value, float):
        return value
    if sympy.sympify(value) in (sympy.oo, -sympy.oo):
        return float(value)
    exact = number(value)
    rounded = outwards(Fraction(int(exact.p), int(exact.q)), direction)
    return value if isinstance(value, int) and value == rounded else rounded


def _lag(reference: sympy.Indexed) -> int:
    """Return k for ``name[t - k]``."""
    index = reference.indices[0]
    symbols = [symbol for symbol in index.free_symbols if symbol.name == "t"]
    lag = symbols[0] - index if len(reference.indices) == 1 and symbols else None
    if lag is None or not lag.is_Integer:
        raise ModelError(f"'{reference}' is not a signal at a fixed lag: index it as [t - k], k a whole number")
    return int(lag)


@lru_cache(maxsize=4096)
def references(expression: sympy.Expr) -> frozenset[tuple[str, int]]:
    """List the signals an expression reads, each with its lag.

    Examples
    --------
    >>> sorted(references(signal("w")[t - 1] * signal("u")[t]))
    [('u', 0), ('w', 1)]
    """
    return frozenset((str(item.base.label), _lag(item)) for item in _signals(expression))


def inlined(expression: sympy.Expr, lines: Mapping[str, sympy.Expr]) -> sympy.Expr:
    """Put lines in place of their signals until none is left.

    Examples
    --------
    >>> print(inlined(signal("w")[t - 1], {"w": signal("v")[t] + 1, "v": signal("u")[t - 1]}))
    u[t - 2] + 1
    """
    while found := [(name, lag) for name, lag in references(expression) if name in lines]:
        expression = expression.xreplace(
            {signal(name)[t - lag]: lines[name].xreplace({t: t - lag}) for name, lag in found}
        )
    return expression


@lru_cache(maxsize=4096)
def plain_symbols(expression: sympy.Expr) -> frozenset[str]:
    """List the names of the symbols outside any signal: parameters, and ``VALUE`` in a sensor curve.

    Examples
    --------
    >>> sorted(plain_symbols(sympy.Symbol("a") * signal("w")[t - 1]))
    ['a']
    """
    return frozenset(part.name for part in distinct_parts(expression) if isinstance(part, sympy.Symbol))


def _signals(expression: sympy.Expr) -> set[sympy.Indexed]:
    return {node for node in distinct_parts(expression) if isinstance(node, sympy.Indexed)}


def distinct_parts(expression: sympy.Expr) -> Iterator[sympy.Basic]:
    """Yield each part of an expression once, however often it occurs; a signal at a lag is one part.

    Examples
    --------
    >>> a = sympy.Symbol("a")
    >>> sorted(map(str, distinct_parts(sympy.exp(a) + a)))
    ['a', 'a + exp(a)', 'exp(a)']
    """
    seen: set[sympy.Basic] = set()
    waiting: list[sympy.Basic] = [expression]
    while waiting:
        node = waiting.pop()
        if node not in seen:
            seen.add(node)
            yield node
            if not isinstance(node, sympy.Indexed):
                waiting.extend(node.args)


def canonical(expression: sympy.Expr) -> sympy.Expr:
    """Rewrite every symbol and signal with this package's assumptions, and every float as the fraction that it is.

    For sympy, ``Symbol("a")`` and ``Symbol("a", real=True)`` differ: without this step the first would count as an
    undefined parameter. Sympy rounds sums and products of floats; proofs need exactly the numbers that were given.

    Examples
    --------
    >>> canonical(sympy.Symbol("a")) == sympy.Symbol("a", real=True)
    True
    >>> canonical(0.25 * sympy.Symbol("a"))
    a/4
    """
    try:
        expression = sympy.sympify(expression, strict=True)
    except sympy.SympifyError:
        raise ModelError(f"{expression!r} is not a sympy expression: build it from symbols and signals") from None
    if not isinstance(expression, sympy.Expr):
        raise ModelError(f"{expression!r} is not an expression: give the right-hand side only, without a relation")
    return _canonical(expression)


# Edits of a model leave most of its lines as they are.
@lru_cache(maxsize=4096)
def _canonical(expression: sympy.Expr) -> sympy.Expr:
    ours: dict[sympy.Basic, sympy.Expr] = {}
    for part in distinct_parts(expression):
        if isinstance(part, sympy.Indexed):
            ours[part] = _sample(str(part.base.label), _lag(part))
        elif isinstance(part, sympy.Symbol):
            ours[part] = sympy.Symbol(part.name, real=True)
        elif isinstance(part, sympy.Float) and part.is_finite:
            ours[part] = sympy.Rational(part)
    other = {theirs: own for theirs, own in ours.items() if theirs != own}
    return swapped(expression, other) if other else expression


def swapped(expression: sympy.Expr, swap: Mapping[sympy.Expr, sympy.Expr]) -> sympy.Expr:
    """Replace parts of an expression as ``xreplace`` does, without evaluating functions, extremes and powers again.

    Sympy's evaluation of their arguments takes longer than a simulation. Where symbols and signals only get other
    names, nothing is evaluated.

    Examples
    --------
    >>> a, b = sympy.symbols("a b")
    >>> swapped(sympy.Max(0, a + 1), {a: b})
    Max(0, b + 1)
    """
    return rewritten(expression, dict(swap), _renamed if _only_renames(expression, swap) else as_written)


def _only_renames(expression: sympy.Expr, swap: Mapping[sympy.Expr, sympy.Expr]) -> bool:
    names = set(swap.values())
    if len(names) < len(swap) or not all(isinstance(own, sympy.Symbol | sympy.Indexed) for own in names):
        return False
    return all(isinstance(old, sympy.Symbol | sympy.Indexed) for old in swap) and not names & (
        {part for part in distinct_parts(expression) if isinstance(part, sympy.Symbol | sympy.Indexed)} - swap.keys()
    )


def rewritten(
    expression: sympy.Expr,
    done: dict[sympy.Expr, sympy.Expr],
    build: Callable[[sympy.Expr, list[sympy.Expr]], sympy.Expr],
) -> sympy.Expr:
    """Rewrite an expression from its leaves; a part that occurs many times is rewritten once.

    `done` holds the parts that are rewritten already, and grows. `build` makes a node from its rewritten arguments.
    """
    if expression not in done:
        is_leaf = not expression.args or isinstance(expression, sympy.Indexed)
        below = [] if is_leaf else [rewritten(argument, done, build) for argument in expression.args]
        done[expression] = expression if is_leaf else build(expression, below)
    return done[expression]


def unevaluated(function: Callable[..., sympy.Expr], arguments: list[sympy.Expr]) -> sympy.Expr:
    """Return a node as its arguments give it.

    Examples
    --------
    >>> x = sympy.Symbol("x")
    >>> unevaluated(sympy.Add, [x, x])
    x + x
    """
    # A branch of a Piecewise is a pair, which sympy never evaluates.
    return function(*arguments) if function is ExprCondPair else function(*arguments, evaluate=False)


def as_written(node: sympy.Expr, arguments: list[sympy.Expr]) -> sympy.Expr:
    """Return a node with other arguments, evaluated only where that is quick: what `swapped` builds with."""
    if all(new is old for new, old in zip(arguments, node.args, strict=True)):
        return node
    if node.is_Add or node.is_Mul:
        keeps = any(map(_is_curved, arguments))
    else:
        is_power = isinstance(node, sympy.Pow) and (arguments[0].is_Add or not arguments[1].is_number)
        keeps = is_power or isinstance(node, Application)
    if keeps and not all(argument.is_number for argument in arguments):
        return unevaluated(node.func, arguments)
    return node.func(*arguments)


@lru_cache(maxsize=4096)
def _is_curved(node: sympy.Expr) -> bool:
    """Return whether an expression holds a function, an extreme, or a power with a variable exponent."""
    is_power = isinstance(node, sympy.Pow) and not node.exp.is_number
    return is_power or isinstance(node, Application) or any(map(_is_curved, node.args))


def _renamed(node: sympy.Expr, arguments: list[sympy.Expr]) -> sympy.Expr:
    if all(new is old for new, old in zip(arguments, node.args, strict=True)):
        return node
    if node.is_Add or node.is_Mul:
        # Sympy's own order, by which sums of the same terms are equal.
        arguments.sort(key=_SYMPY_ORDER)
    return unevaluated(node.func, arguments)


def _compare(a: sympy.Expr, b: sympy.Expr) -> int:
    return int(b.is_number) - int(a.is_number) or int(a.compare(b))


_SYMPY_ORDER = cmp_to_key(_compare)


def packed(expression: sympy.Expr) -> tuple[Any, ...]:
    """Write an expression for pickle: its distinct parts, each a leaf or a function of parts before it.

    Sympy's own pickle evaluates what it reads, see `swapped`.
    """
    places: dict[sympy.Expr, int] = {}
    parts = list[Any]()

    def place(node: sympy.Expr) -> int:
        if node not in places:
            is_leaf = not node.args or isinstance(node, sympy.Indexed)
            part = node if is_leaf else (node.func, *map(place, node.args))
            places[node] = len(parts)
            parts.append(part)
        return places[node]

    place(expression)
    return tuple(parts)


def unpacked(parts: tuple[Any, ...]) -> sympy.Expr:
    """Return the expression that `packed` wrote."""
    done = list[sympy.Expr]()
    for part in parts:
        if isinstance(part, tuple):
            function, *places = part
            part = unevaluated(function, [done[k] for k in places])
        done.append(part)
    return done[-1]


def rename_signals(expression: sympy.Expr, names: dict[str, str]) -> sympy.Expr:
    """Rename signals in an expression; lags stay.

    Examples
    --------
    >>> rename_signals(signal("w")[t - 1], {"w": "z"})
    z[t - 1]
    """
    replacement = {
        item: _sample(names[str(item.base.label)], _lag(item))
        for item in _signals(expression)
        if str(item.base.label) in names
    }
    return swapped(expression, replacement)
