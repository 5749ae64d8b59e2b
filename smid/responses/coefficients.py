"""The coefficients of a model's linear block as polynomials of its parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import sympy

from relaxations.algebra.polynomial import Polynomials
from relaxations.errors import ProblemError
from relaxations.problem.problem import polynomials_from_sympy
from smid.models import Model, ModelError
from smid.models.linear_block import DELAY, linear_block, response
from smid.responses.taylor import Taylor, evaluate


@dataclass(frozen=True)
class Coefficients:
    """A transfer function ``(b_0 + b_1 q + ...) / (a_0 + a_1 q + ...)`` with q = 1/z, for all parameters.

    Parameters
    ----------
    input, output
        Channels of the data; signals of the model where a curve lies in between.
    parameters
        Those that the block depends on, in the order of the polynomials' variables.
    numerator, denominator
        One row for each power of q.

    Examples
    --------
    >>> from smid.models import Hammerstein
    >>> block = Coefficients.of(Hammerstein(powers=(3,)))
    >>> block.input, block.output, block.parameters, block.numerator.n_rows, block.denominator.n_rows
    ('x', 'y', ('alpha',), 2, 2)
    """

    input: str
    output: str
    parameters: tuple[str, ...]
    numerator: Polynomials
    denominator: Polynomials

    @staticmethod
    def of(model: Model) -> Coefficients:
        """Return the coefficients; ModelError where a model has no linear block with one input and one output."""
        # Other numbers than the central model's, of which one may be zero and make a curve linear.
        loose = {p.name: 0.5 + k / 97 for k, p in enumerate(model.parameters) if p.lower < p.upper}
        block = linear_block(model.with_values(loose))
        begin = {c: s for s, c in zip(model.inputs, model.input_channels, strict=True)}.get(block.input, block.input)
        end = next(m.signal for m in model.measurements if m.channel in model.output_channels)
        lines = {line.signal: line for line in model.discretised().lines}
        found, waiting = {}, {end}
        while waiting:
            name = waiting.pop()
            found[name] = lines[name]
            waiting |= {read for read, _ in lines[name].reads} - found.keys() - {begin}
        function, _ = response(list(found.values()), begin, end, {})
        above, below = (sympy.Poly(part, DELAY).all_coeffs()[::-1] for part in sympy.fraction(function))
        symbols = [p.symbol for p in model.parameters if any(p.symbol in c.free_symbols for c in (*above, *below))]
        try:
            parts = [polynomials_from_sympy(part, symbols or [sympy.Dummy()]) for part in (above, below)]
        except ProblemError:
            raise ModelError(
                f"the transfer function of {model.name!r} is no quotient of polynomials in the parameters: "
                "simulate the model instead"
            ) from None
        return Coefficients(block.input, block.output, tuple(s.name for s in symbols), *parts)

    def at(self, point: Sequence[Taylor], n: int) -> tuple[Taylor, Taylor]:
        """Return numerator and denominator for parameters that are models of n variables."""
        return evaluate(self.numerator, point, n), evaluate(self.denominator, point, n)
