"""The lines of a model as fast functions.

Three kinds of group (see `smid.models.structure.groups`), in the order of preference:

- *static*: one line outside any loop through time; one NumPy expression over all samples.
- *filter*: one line that is linear in its own past with coefficients free of signals,
  ``w[t] = sum_k c_k w[t-k] + f[t]``; f is static and the rest is `scipy.signal.lfilter`.
- *loop*: everything else, sample by sample; on Python floats for one parameter vector or a few (ten times faster than
  NumPy scalars) and on arrays of shape (B,) for many of them.

Arrays have shape (n,), or (B, n) when parameters are batched.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, lru_cache, reduce
from typing import Any

import numpy as np
import sympy
from scipy.signal import lfilter, lfiltic
from sympy.core.function import Application
from sympy.printing.pycode import PythonCodePrinter

from relaxations.algebra.arrays import Array
from smid.models.parts import Line
from smid.models.structure import first_samples, groups
from smid.models.symbols import plain_symbols, references, rewritten, signal, swapped, t

__all__ = ["Group", "compile_lines"]

Function = Callable[..., Any]
Reference = tuple[str, int]

_MANY = 20  # parameter vectors from which a loop on arrays is faster than one on Python floats for each


@dataclass(frozen=True)
class Group:
    """Compiled lines that are computed together.

    Attributes
    ----------
    signals
        Signals the group defines, in causal order.
    first
        First sample that inputs and initial states determine.
    recursive
        Whether the group reads its own past.
    parameters
        Parameters the functions take, first.
    reads
        Signals and lags the functions take, after the parameters: those outside the group, then its own past.
    own
        How many of `reads`, counted from the end, are the group's own past.
    vector
        NumPy function that gives all signals of the group at one time, or over time when static.
    scalar
        The whole loop on Python floats: of parameters, what is read from outside sample by sample, and one list per
        signal that holds its past and is appended to.
    single
        Per line, what it reads and its NumPy function, where `recursive`; for the samples before the first.
    filter
        Coefficients ``c_1, ..., c_K`` (of the parameters) and forcing f of a line linear in its own past.
    """

    signals: tuple[str, ...]
    first: int
    recursive: bool
    parameters: tuple[str, ...]
    reads: tuple[Reference, ...]
    own: int
    vector: Function
    scalar: _Later
    single: tuple[tuple[tuple[Reference, ...], Function], ...]
    filter: tuple[Function, Function] | None

    def warm_up(self, known: dict[str, Array], values: Mapping[str, Any], given: set[str], until: int) -> None:
        """Fill the samples before `until`: given ones stay, computable ones follow, else zero."""
        constants = [values[name] for name in self.parameters]
        for now in range(until):
            # Line by line: a later line of the group may read a given sample of an earlier one at the same
            # time.
            for name, (reads, function) in zip(self.signals, self.single, strict=True):
                if name not in given:
                    arguments = [
                        known[other][..., now - lag] if now >= lag else np.float64(np.nan) for other, lag in reads
                    ]
                    value = function(*constants, *arguments)[0]
                    known[name][..., now] = np.where(np.isfinite(value), value, 0.0)

    def evaluate(self, known: dict[str, Array], values: Mapping[str, Any], start: int) -> None:
        """Compute all samples from `start` on, in place."""
        count = known[self.signals[0]].shape[-1]
        if not self.recursive:
            arguments = [known[name][..., start - lag : count - lag] for name, lag in self.reads]
            known[self.signals[0]][..., start:] = self.vector(*_columns(self, values), *arguments)[0]
        elif self.filter is not None:
            self._filter(known, values, start, count)
        elif known[self.signals[0]].ndim == 1:
            self._scalar_loop(known, values, start, count)
        elif len(known[self.signals[0]]) < _MANY:
            for k in range(len(known[self.signals[0]])):
                row = {name: samples if samples.ndim == 1 else samples[k] for name, samples in known.items()}
                constants = {name: np.ravel(values[name])[k % np.size(values[name])] for name in self.parameters}
                self._scalar_loop(row, constants, start, count)
        else:
            self._batch_loop(known, values, start, count)

    def _filter(self, known: dict[str, Array], values: Mapping[str, Any], start: int, count: int) -> None:
        assert self.filter is not None
        coefficients, forcing = self.filter
        name = self.signals[0]
        result = known[name]
        outside = self.reads[: len(self.reads) - self.own]
        arguments = [known[other][..., start - lag : count - lag] for other, lag in outside]
        drive = np.broadcast_to(
            np.asarray(forcing(*_columns(self, values), *arguments), float),
            (*result.shape[:-1], count - start),
        )
        rows = result.reshape(-1, count)
        drives = drive.reshape(-1, count - start)
        denominators = np.stack(
            [
                np.broadcast_to(np.asarray(item, float), (len(rows),))
                for item in (1.0, *coefficients(*(values[parameter] for parameter in self.parameters)))
            ],
            axis=1,
        )
        denominators[:, 1:] *= -1
        past = range(start - 1, start - denominators.shape[1], -1)
        for row, driven, denominator in zip(rows, drives, denominators, strict=True):
            state = lfiltic([1.0], denominator, y=row[list(past)])
            row[start:] = lfilter([1.0], denominator, driven, zi=state)[0]

    def _scalar_loop(self, known: dict[str, Array], values: Mapping[str, Any], start: int, count: int) -> None:
        constants = [float(values[name]) for name in self.parameters]
        split = len(self.reads) - self.own
        outside = [known[name][start - lag : count - lag].tolist() for name, lag in self.reads[:split]]
        rows = [known[name][:start].tolist() for name in self.signals]
        # Python floats raise, or turn complex, where NumPy gives inf or nan; the caller looks for the first of these.
        with suppress(OverflowError, ZeroDivisionError, ValueError, TypeError):
            self.scalar(constants, zip(*outside, strict=True) if outside else ((),) * (count - start), rows)
        for name, row in zip(self.signals, rows, strict=True):
            samples = np.array(row)
            if np.iscomplexobj(samples):  # a fractional power of a negative number, NaN to NumPy
                samples = np.array([np.nan if isinstance(value, complex) else value for value in row])
            known[name][: len(row)] = samples
            known[name][len(row) :] = np.nan

    def _batch_loop(self, known: dict[str, Array], values: Mapping[str, Any], start: int, count: int) -> None:
        constants = [values[name] for name in self.parameters]
        split = len(self.reads) - self.own
        # Time first, so that one sample of all parameter vectors is contiguous.
        work = {name: np.ascontiguousarray(known[name].T) for name, _ in self.reads}
        work |= {name: np.ascontiguousarray(known[name].T) for name in self.signals}
        outside = [(work[name], lag) for name, lag in self.reads[:split]]
        past = [(work[name], lag) for name, lag in self.reads[split:]]
        rows = [work[name] for name in self.signals]
        for now in range(start, count):
            arguments = [array[now - lag] for array, lag in outside]
            result = self.vector(*constants, *arguments, *[array[now - lag] for array, lag in past])
            for row, value in zip(rows, result, strict=True):
                row[now] = value
        for name in self.signals:
            known[name][...] = work[name].T


def _columns(group: Group, values: Mapping[str, Any]) -> list[Any]:
    """Parameters with a trailing time axis, so that they broadcast against signals of shape (B, n)."""
    return [np.asarray(values[name])[..., np.newaxis] for name in group.parameters]


@lru_cache(maxsize=256)
def compile_lines(lines: tuple[Line, ...]) -> tuple[Group, ...]:
    """Compile lines into groups to be evaluated one after another.

    Examples
    --------
    >>> w, u = signal("w"), signal("u")
    >>> [group.filter is not None for group in compile_lines((Line(w[t], w[t - 1] / 2 + u[t]),))]
    [True]
    """
    first = first_samples(lines)
    return tuple(_compile_group(group, recursive, first[group[0].signal]) for group, recursive in groups(lines))


# Edits of a model leave most of its lines as they are: those are not compiled again.
@lru_cache(maxsize=2048)
def _compile_group(lines: tuple[Line, ...], recursive: bool, first: int) -> Group:
    members = tuple(line.signal for line in lines)
    parameters = tuple(sorted(set().union(*(plain_symbols(line.expression) for line in lines))))
    reads = set().union(*(references(line.expression) for line in lines))
    outside = sorted(read for read in reads if read[0] not in members)
    own = sorted(read for read in reads if read[0] in members and read[1] > 0)
    symbols = {read: sympy.Symbol(f"{read[0]}__{read[1]}", real=True) for read in (*outside, *own)}
    symbols |= {(name, 0): sympy.Symbol(f"{name}__0", real=True) for name in members}
    swap = {signal(name)[t - lag]: symbol for (name, lag), symbol in symbols.items()}
    constants = [sympy.Symbol(name, real=True) for name in parameters]
    arguments = [*constants, *(symbols[read] for read in (*outside, *own))]
    defined = [(symbols[line.signal, 0], swapped(line.expression, swap)) for line in lines]
    single = []
    for line, (symbol, expression) in zip(lines, defined, strict=True) if recursive else ():
        read = tuple(sorted(references(line.expression)))
        function = _function([*constants, *(symbols[item] for item in read)], [(symbol, expression)])
        single.append((read, function))
    return Group(
        members,
        first,
        recursive,
        parameters,
        (*outside, *own),
        len(own),
        _function(arguments, defined),
        _Later(lambda: _loop(constants, [symbols[read] for read in outside], own, symbols, members, defined)),
        tuple(single),
        _linear(defined, constants, [symbols[read] for read in outside], own, symbols) if recursive else None,
    )


def _linear(
    defined: Sequence[tuple[sympy.Symbol, sympy.Expr]],
    constants: Sequence[sympy.Symbol],
    outside: Sequence[sympy.Symbol],
    own: Sequence[Reference],
    symbols: Mapping[Reference, sympy.Symbol],
) -> tuple[Function, Function] | None:
    """Split one line into coefficients of its own past and a forcing, if it is linear there."""
    if len(defined) > 1:
        return None
    expression = defined[0][1]
    name, depth = own[0][0], max(lag for _, lag in own)
    past = [symbols.get((name, lag), sympy.Symbol(f"{name}__{lag}", real=True)) for lag in range(1, depth + 1)]
    # Neither expanded nor differentiated within a curve, which takes minutes for what a friction does: terms that
    # cancel cost a slower loop, no more.
    if any(bent.has(*past) for bent in expression.atoms(Application, sympy.Pow)):
        return None
    slopes = [sympy.diff(expression, symbol) for symbol in past]
    if any(slope.free_symbols - set(constants) for slope in slopes):
        return None
    forcing = swapped(expression, dict.fromkeys(past, sympy.Integer(0)))
    return (
        _Later(lambda: sympy.lambdify(constants, slopes, _NUMPY)),
        _Later(lambda: sympy.lambdify([*constants, *outside], _opaque(forcing), _NUMPY, cse=True)),
    )


# Functions that sympy knows nothing of. Its NumPy printer stacks the arguments of Max, which fails where a scalar meets
# an array; and it would look again for what is known of the arguments of all four, at length and not always in vain.
_OPAQUE = {
    sympy.Max: sympy.Function("maximum_"),
    sympy.Min: sympy.Function("minimum_"),
    sympy.Abs: sympy.Function("magnitude_"),
    sympy.sign: sympy.Function("sign_"),
}
_NUMPY: list[Any] = [
    {"maximum_": np.maximum, "minimum_": np.minimum, "magnitude_": np.abs, "sign_": np.sign},
    "numpy",
]
_SIGN = [(lambda _: True, lambda x: f"(0.0 if {x} == 0 else copysign(1, {x}))")]
_PRINTER = PythonCodePrinter(
    {
        "fully_qualified_modules": False,
        "user_functions": {"maximum_": "max", "minimum_": "min", "magnitude_": "abs", "sign_": _SIGN},
    }
)


def _opaque(expression: sympy.Expr) -> sympy.Expr:
    """Write Max, Min (as nested functions of two), Abs and sign as functions that sympy leaves alone."""
    return rewritten(expression, {}, _closed)


def _closed(node: sympy.Expr, arguments: list[sympy.Expr]) -> sympy.Expr:
    if node.func in _OPAQUE:
        function = _OPAQUE[node.func]
        return reduce(function, arguments) if len(arguments) > 1 else function(*arguments)
    same = all(new is old for new, old in zip(arguments, node.args, strict=True))
    return node if same else node.func(*arguments)


class _Later:
    """A function that is compiled when it is first needed: of the forms of a line, a simulation needs one or two."""

    def __init__(self, compile_it: Callable[[], Function]) -> None:
        self._compile = compile_it

    @cached_property
    def function(self) -> Function:
        return self._compile()

    def __call__(self, *values: Any) -> Any:
        return self.function(*values)


def _function(arguments: Sequence[sympy.Symbol], defined: Sequence[tuple[sympy.Symbol, sympy.Expr]]) -> _Later:
    """Return one NumPy function of all definitions, each reading those before it, that returns their values."""
    return _Later(lambda: _compiled(arguments, defined))


def _loop(
    constants: Sequence[sympy.Symbol],
    outside: Sequence[sympy.Symbol],
    own: Sequence[Reference],
    symbols: Mapping[Reference, sympy.Symbol],
    members: Sequence[str],
    defined: Sequence[tuple[sympy.Symbol, sympy.Expr]],
) -> Function:
    """Write the loop through time of a group as the source of one function, and compile it."""
    # Names of our own: what a model calls its signals may mean something to Python.
    every = [*constants, *outside, *(symbols[read] for read in own), *(symbol for symbol, _ in defined)]
    names = {symbol: sympy.Symbol(f"v{k}") for k, symbol in enumerate(dict.fromkeys(every))}
    rows = {name: f"r{k}" for k, name in enumerate(members)}
    counter = sympy.numbered_symbols("c")
    fixed = {names[constant] for constant in constants}
    once, body = list[str](), [f"{names[symbols[read]]} = {rows[read[0]]}[-{read[1]}]" for read in own]
    for symbol, expression in defined:
        common, (rest,) = sympy.cse(swapped(_opaque(expression), names), counter)
        for name, part in common:
            # What parameters alone decide is computed before the loop.
            is_fixed = part.free_symbols <= fixed
            fixed |= {name} if is_fixed else set()
            (once if is_fixed else body).append(f"{name} = {_PRINTER.doprint(part)}")
        body.append(f"{names[symbol]} = {_PRINTER.doprint(rest)}")
    body += [f"{rows[name]}.append({names[symbol]})" for name, (symbol, _) in zip(members, defined, strict=True)]

    def listed(items: Sequence[Any]) -> str:
        return "".join(f"{item}, " for item in items)

    source = [
        "def loop(constants, outside, rows):",
        *([f"    {listed([names[c] for c in constants])}= constants"] if constants else []),
        f"    {listed([*rows.values()])}= rows",
        *(f"    {line}" for line in once),
        f"    for {listed([names[o] for o in outside]) if outside else '_ '}in outside:",
        *(f"        {line}" for line in body),
    ]
    scope: dict[str, Any] = dict(vars(math))
    exec("\n".join(source), scope)  # of sympy's own printing; lambdify does the same
    function: Function = scope["loop"]
    return function


def _compiled(arguments: Sequence[sympy.Symbol], defined: Sequence[tuple[sympy.Symbol, sympy.Expr]]) -> Function:
    folded = [(symbol, _opaque(expression)) for symbol, expression in defined]
    if len(folded) == 1:
        function: Function = sympy.lambdify(arguments, [folded[0][1]], _NUMPY, cse=True)
        return function
    # lambdify's hook for common subexpressions takes exactly such a sequence of definitions.
    sequence = [symbol for symbol, _ in folded]
    several: Function = sympy.lambdify(arguments, sequence, _NUMPY, cse=lambda _: (folded, sequence))
    return several
