"""The coefficients of a model's linear block as polynomials of its parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import sympy

from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import polynomials_from_sympy
from smid.models import Model
from smid.models.linear_block import DELAY, linear_block, response
from smid.responses.taylor import Taylor, evaluate


@dataclass(frozen=True)
class Coefficients:
    """A transfer function ``(b_0 + b_1 q + ...) / (a_0 + a_1 q + ...)`` with q = 1/z, for all parameters.

    Parameters
    ----------
    input, output
        Channels of the data; signals of the model where a curve lies in between.
    names
        The parameters that the block depends on, in the order of the polynomials' variables.
    numerator, denominator
        One row for each power of q.
    known
        Parameters whose interval is a point, with their values.

    Examples
    --------
    >>> from smid.models import Hammerstein
    >>> block = Coefficients.of(Hammerstein(powers=(3,)))
    >>> block.input, block.output, block.names, block.numerator.n_rows, block.denominator.n_rows
    ('x', 'y', ('alpha',), 2, 2)
    """

    input: str
    output: str
    names: tuple[str, ...]
    numerator: Polynomials
    denominator: Polynomials
    known: Mapping[str, float]

    @staticmethod
    def of(model: Model, known: Mapping[str, float] = {}) -> Coefficients:
        """Return the coefficients; ModelError where a model has no linear block with one input and one output."""
        # Other numbers than the central model's, of which one may be zero and make a curve linear.
        loose = {p.name: 0.5 + k / 97 for k, p in enumerate(model.parameters) if p.lower < p.upper}
        block = linear_block(model.with_values(loose))
        begin = {c: s for s, c in zip(model.inputs, model.input_channels, strict=True)}.get(block.input, block.input)
        end = model.outputs[0].signal
        lines = {line.signal: line for line in model.discretised().lines}
        found, waiting = {}, {end}
        while waiting:
            name = waiting.pop()
            found[name] = lines[name]
            waiting |= {read for read, _ in lines[name].reads} - found.keys() - {begin}
        function, _ = response(list(found.values()), begin, end, {})
        above, below = (sympy.Poly(part, DELAY).all_coeffs()[::-1] for part in sympy.fraction(function))
        symbols = [p.symbol for p in model.parameters if any(p.symbol in c.free_symbols for c in (*above, *below))]
        numerator, denominator = (polynomials_from_sympy(part, symbols or [sympy.Dummy()]) for part in (above, below))
        names = tuple(s.name for s in symbols)
        own = {name: value for name, value in known.items() if name in names}
        return Coefficients(block.input, block.output, names, numerator, denominator, own)

    @property
    def free(self) -> tuple[str, ...]:
        """Return the parameters that are not known."""
        return tuple(name for name in self.names if name not in self.known)

    def at(self, point: Sequence[Taylor], n: int) -> tuple[Taylor, Taylor]:
        """Return numerator and denominator where the free parameters are models of n variables."""
        fixed = {name: Taylor.linear(value, np.zeros(n)) for name, value in self.known.items()}
        every = {**dict(zip(self.free, point, strict=True)), **fixed}
        values = [every[name] for name in self.names]
        return evaluate(self.numerator, values, n), evaluate(self.denominator, values, n)
