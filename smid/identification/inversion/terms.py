"""Rates as sums of products: a coefficient of parameters alone, times a function of the states and the inputs.

A rate is linear in its coefficients, however large the box of the parameters is. The functions and their derivatives in
the states are written as one list of operations, which is evaluated over boxes of the states.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np
import sympy

from relaxations.algebra.affine_arithmetic import HIGH, LOW, NO_PRODUCTS, SLOPES, between
from relaxations.algebra.arrays import Array, Index, Mask
from relaxations.algebra.compiled import compiling
from relaxations.algebra.intervals import Intervals
from smid.identification.inversion import operations, stages
from smid.identification.inversion.operations import operate
from smid.identification.inversion.rates import Rates, slope
from smid.identification.inversion.stages import evaluate, signs_among
from smid.identification.inversion.tape import Writer
from smid.models import Model
from smid.models.symbols import references

__all__ = ["Program", "Term", "Terms"]

compiled = compiling(operations.__file__, stages.__file__)


@dataclass(frozen=True, eq=False)
class Program:
    """Functions of parameters, states and inputs as operations.

    Parameters
    ----------
    channels
        The inputs that are read.
    once, inner
        Operations on parameters alone, and the others, shape (n, 4) each.
    numbers
        Shape (n_once + n_inner, 2).
    places
        Form of each function.
    """

    channels: tuple[str, ...]
    once: Index
    inner: Index
    numbers: Array
    places: Index

    @staticmethod
    def of(functions: list[sympy.Expr], parameters: tuple[str, ...], stages: tuple[sympy.Symbol, ...]) -> Program:
        """Write the operations of some functions, those of the first functions first."""
        writer = Writer(parameters, ())
        writer.stages = {stage: k for k, stage in enumerate(stages)}
        forms = [writer.write(function) for function in functions]
        (once, each, inner), numbers, place = writer.ordered()
        return Program(
            tuple(writer.channels),
            once,
            np.concatenate([each, inner]),
            numbers,
            np.array([place[k] for k in forms], dtype=np.int64),
        )

    def until(self, count: int) -> int:
        """Return how many operations the first functions need."""
        return max(int(self.places[:count].max()) - len(self.once) + 1, 0)

    def over(self, box: Array, states: Array, now: Index, data: Array, count: int) -> tuple[Intervals, Mask]:
        """Return the first functions over boxes of the states, shape (n, count), and whether each may jump there.

        Parameters
        ----------
        box
            Of the parameters, shape (parameters, 2).
        states
            Shape (n, states, 2).
        now
            Shape (n,). The sample at the end of the interval of each box: what is read one sample before is held.
        data
            Of the channels, shape (channels, samples).
        """
        found, jumps = np.empty((len(states), count, 2)), np.empty((len(states), count), dtype=bool)
        program = self.once, self.inner, self.numbers, self.until(count)
        _over(program, self.places[:count], box, states, now, data, found, jumps)
        return Intervals(found[:, :, 0], found[:, :, 1]), jumps

    def affine(self, box: Array) -> Array:
        """Return the forms of functions of parameters alone over a box, shape (functions, SLOPES + parameters)."""
        forms = np.zeros((len(self.numbers), SLOPES + len(box)))
        _alone(self.once, self.numbers, box, forms)
        return forms[self.places]


@compiled
def _alone(once: Index, numbers: Array, box: Array, forms: Array) -> None:
    """Write the operations on parameters alone over a box; a symbol is its parameter's deviation from the middle."""
    start, nothing = np.zeros((box.shape[0], forms.shape[1])), np.zeros((0, 0))
    past = np.zeros((0, 0, forms.shape[1]))
    for k in range(box.shape[0]):
        between(start, k, box[k, 0], box[k, 1])
        if forms.shape[1] > SLOPES:
            start[k, SLOPES + k], start[k, 1] = start[k, 1], 0.0
    for k in range(once.shape[0]):
        operate(
            once[k], numbers[k], k, forms, start, past, nothing, nothing, nothing[0:0].ravel(), 0, False, NO_PRODUCTS
        )


@compiled
def _over(
    program: tuple[Index, Index, Array, int],
    places: Index,
    box: Array,
    states: Array,
    now: Index,
    data: Array,
    found: Array,
    jumped: Mask,
) -> None:
    """Write the ends of functions over boxes, and whether they jump."""
    once, inner, numbers, until = program
    n, signs, base = states.shape[1], signs_among(inner), once.shape[0]
    width = SLOPES + signs
    forms, start, stage = np.zeros((numbers.shape[0], width)), np.zeros((box.shape[0], width)), np.zeros((n, width))
    jumps, noise = np.zeros(numbers.shape[0], dtype=np.bool_), np.zeros(data.shape[0])
    past = np.zeros((0, 0, width))
    for k in range(box.shape[0]):
        between(start, k, box[k, 0], box[k, 1])
    for k in range(base):
        operate(once[k], numbers[k], k, forms, start, past, stage, data, noise, 0, False, NO_PRODUCTS)
    for b in range(states.shape[0]):
        for i in range(n):
            between(stage, i, states[b, i, 0], states[b, i, 1])
        known = (start, past, data, noise, now[b], False)
        evaluate((inner, numbers, base, SLOPES), until, forms, jumps, stage, known)
        for k in range(places.shape[0]):
            found[b, k, 0], found[b, k, 1] = forms[places[k], LOW], forms[places[k], HIGH]
            jumped[b, k] = jumps[places[k]]


@dataclass(frozen=True)
class Term:
    """A product in a rate: places of the coefficient, of the function, and of its derivatives.

    Parameters
    ----------
    slopes
        For each state that the function reads, the first derivative.
    bends
        For each pair of states, the second derivative.
    """

    coefficient: int
    function: int
    slopes: tuple[tuple[int, int], ...]
    bends: tuple[tuple[int, int, int], ...]


@dataclass(frozen=True, eq=False)
class Terms:
    """The rates of a model.

    Parameters
    ----------
    states
        Their names.
    rate
        For each state, the state that is its rate; -1: none.
    integral
        For each state, one whose rate it is; -1: none.
    alone
        Whether the rate of each state reads no other state.
    rates
        The terms of each rate; none where it is a state.
    coefficients
        In the parameters.
    values, functions
        The coefficients, and the functions with their derivatives behind them.
    count
        Number of the functions themselves.
    """

    states: tuple[str, ...]
    rate: tuple[int, ...]
    integral: tuple[int, ...]
    alone: tuple[bool, ...]
    rates: tuple[tuple[Term, ...], ...]
    coefficients: tuple[sympy.Expr, ...]
    values: Program
    functions: Program
    count: int

    @staticmethod
    def of(model: Model) -> Terms | None:
        """Return the rates of a model; None where they read more than states, exact inputs and parameters."""
        rates = Rates.of(model.lines)
        others = {line.signal for line in model.lines} | {m.signal for m in model.measurements}
        if not rates.states or any(name in others for rate in rates.rates for name, _ in references(rate)):
            return None
        stages = rates.stages
        is_state = [stages.index(rate) if rate in stages else -1 for rate in rates.rates]
        parts = [[] if k >= 0 else list(_products(rate)) for k, rate in zip(is_state, rates.rates, strict=True)]
        coefficients = list(dict.fromkeys(coefficient for own in parts for coefficient, _ in own))
        written = list(dict.fromkeys(function for own in parts for _, function in own))
        count = len(written)

        def place(function: sympy.Expr) -> int:
            if function not in written:
                written.append(function)
            return written.index(function)

        def term(coefficient: sympy.Expr, function: sympy.Expr) -> Term:
            first = {k: own for k, stage in enumerate(stages) if (own := slope(function, stage)) != 0}
            second = {
                (j, m): own
                for j, m in combinations_with_replacement(first, 2)
                if (own := slope(first[j], stages[m])) != 0
            }
            return Term(
                coefficients.index(coefficient),
                place(function),
                tuple((k, place(own)) for k, own in first.items()),
                tuple((j, m, place(own)) for (j, m), own in second.items()),
            )

        terms = tuple(tuple(term(*part) for part in own) for own in parts)
        parameters = tuple(p.name for p in model.parameters)
        return Terms(
            rates.states,
            tuple(is_state),
            tuple(is_state.index(k) if k in is_state else -1 for k in range(len(stages))),
            tuple(not rate.free_symbols & set(stages) - {own} for own, rate in zip(stages, rates.rates, strict=True)),
            terms,
            tuple(coefficients),
            Program.of(coefficients, parameters, ()),
            Program.of(written, parameters, stages),
            count,
        )


def _products(rate: sympy.Expr) -> Iterator[tuple[sympy.Expr, sympy.Expr]]:
    """Yield the coefficient and the function of each product in a rate; those of one coefficient are one."""
    found = dict[sympy.Expr, sympy.Expr]()
    for product in sympy.Add.make_args(rate):
        coefficient, function = sympy.Integer(1), sympy.Integer(1)
        for factor in sympy.Mul.make_args(product):
            alone = factor.free_symbols and not references(factor) and not factor.atoms(sympy.Dummy)
            coefficient, function = (coefficient * factor, function) if alone else (coefficient, function * factor)
        found[coefficient] = found.get(coefficient, sympy.Integer(0)) + function
    yield from found.items()
