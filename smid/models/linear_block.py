"""The linear part of a model as a transfer function: of the whole where all its lines are linear, else of a block.

The block ends at the measured output and begins at the input, or at the output of a curve. In a Hammerstein model it
begins behind the input curve; in a Wiener model it ends before the sensor curve. With ``q = 1/z`` the lines are linear
equations over rational functions of q, solved in exact fractions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy
from sympy.solvers.solveset import NonlinearError

from smid.models.errors import ModelError
from smid.models.model import Model
from smid.models.parts import Line
from smid.models.running import parameter_values
from smid.models.symbols import signal, t

__all__ = ["DELAY", "RATE", "LinearBlock", "exact_values", "linear_block", "response"]

DELAY, RATE = sympy.symbols("q s")


@dataclass(frozen=True)
class LinearBlock:
    """A transfer function ``(b_0 + b_1 q + ...) / (1 + a_1 q + ...)`` with q = 1/z.

    Parameters
    ----------
    input, output
        Channels of the data; signals of the model where a curve lies in between.
    numerator, denominator
        Coefficients of rising powers of q.
    constants
        Signals whose line has a constant term, which a transfer function does not contain.
    """

    input: str
    output: str
    numerator: tuple[float, ...]
    denominator: tuple[float, ...]
    constants: tuple[str, ...]


def linear_block(model: Model) -> LinearBlock:
    """Find the transfer function that ends in a model's output.

    Examples
    --------
    >>> from smid.models import Hammerstein, OutputError
    >>> linear_block(OutputError(delay=2).with_values({"a1": -0.5, "b0": 1.5})).numerator
    (0.0, 0.0, 1.5)
    >>> block = linear_block(Hammerstein(powers=(3,)).with_values({"alpha": -0.75, "gamma1": 2.0}))
    >>> block.input, block.output, block.numerator, block.denominator
    ('x', 'y', (0.0, 0.25), (1.0, -0.75))
    """
    values, _ = parameter_values(model, None)
    measured = model.outputs
    if len(measured) != 1:
        channels = ", ".join(model.output_channels)
        raise ModelError(f"{model.name!r} has the outputs {channels}: a transfer function is of one output")
    seen, numbers = measured[0], exact_values(values)
    lines = {line.signal: line for line in model.discretised().lines}
    if not _is_linear(lines[seen.signal], numbers):
        raise ModelError(
            f"the line of {seen.signal!r} in {model.name!r} is not linear, so that no transfer function leads to "
            f"{seen.channel!r}: simulate the model instead, or linearise it about an operating point"
        )
    block: dict[str, Line] = {}
    begins, waiting = set(), {seen.signal}
    while waiting:
        name = waiting.pop()
        if name in lines and _is_linear(lines[name], numbers):
            block[name] = lines[name]
            waiting |= {read for read, _ in lines[name].reads} - block.keys()
        else:
            begins.add(name)
    if len(begins) != 1:
        found = ", ".join(sorted(begins)) or "nothing"
        raise ModelError(
            f"{seen.channel!r} follows from {found} in {model.name!r}: a transfer function is of one input"
        )
    (begin,) = begins
    function, constants = response(list(block.values()), begin, seen.signal, numbers)
    parts = (sympy.Poly(part, DELAY) for part in sympy.fraction(function))
    numerator, denominator = (part.all_coeffs()[::-1] for part in parts)
    return LinearBlock(
        dict(zip(model.inputs, model.input_channels, strict=True)).get(begin, begin),
        seen.channel if seen.inverse is None else seen.signal,
        tuple(float(b / denominator[0]) for b in numerator),
        tuple(float(a / denominator[0]) for a in denominator),
        constants,
    )


def response(
    lines: Sequence[Line], begin: str, end: str, numbers: Mapping[sympy.Symbol, sympy.Expr]
) -> tuple[sympy.Expr, tuple[str, ...]]:
    """Solve linear lines for one signal over another: a delay is a factor `DELAY`, a rate `RATE` times its signal."""
    symbols = {name: sympy.Dummy(name) for name in (*(line.signal for line in lines), begin)}
    equations = []
    for line in lines:
        swap = {signal(name)[t - lag]: symbols[name] * DELAY**lag for name, lag in line.reads}
        equations.append(
            exact(line.expression.xreplace(swap), numbers) - symbols[line.signal] * (RATE if line.rate else 1)
        )
    unknown = [symbols[line.signal] for line in lines]
    matrix, constants = sympy.linear_eq_to_matrix(equations, [*unknown, symbols[begin]])
    solved = matrix[:, :-1].LUsolve(-matrix[:, -1])
    function = sympy.cancel(solved[unknown.index(symbols[end])])
    return function, tuple(line.signal for line, term in zip(lines, constants, strict=True) if term != 0)


def exact(expression: sympy.Expr, numbers: Mapping[sympy.Symbol, sympy.Expr]) -> sympy.Expr:
    """Put numbers in, and read floats as the decimals that they are written as, so that common factors cancel."""
    written = {item: sympy.Rational(repr(float(item))) for item in expression.atoms(sympy.Rational) if _is_float(item)}
    return expression.xreplace(written).xreplace(dict(numbers))


def exact_values(values: Mapping[str, float]) -> dict[sympy.Symbol, sympy.Rational]:
    """Return the symbols of parameters with their values as fractions."""
    return {sympy.Symbol(name, real=True): sympy.Rational(repr(float(value))) for name, value in values.items()}


def _is_float(value: sympy.Rational) -> bool:
    return not value.is_Integer and bool(sympy.Rational(float(value)) == value)


def _is_linear(line: Line, numbers: Mapping[sympy.Symbol, sympy.Expr]) -> bool:
    reads = {signal(name)[t - lag]: sympy.Dummy(name) for name, lag in line.reads}
    try:
        sympy.linear_eq_to_matrix([exact(line.expression.xreplace(reads), numbers)], list(reads.values()))
    except NonlinearError:
        return False
    return True
