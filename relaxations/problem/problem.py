"""A polynomial problem: bounds of variables, equalities and inequalities. The objective is given to each solve."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cache

import numpy as np
import sympy

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.ball_arithmetic import Balls, concatenate, outwards
from relaxations.algebra.polynomial import Polynomials
from relaxations.errors import ProblemError


@dataclass(frozen=True)
class PolynomialProblem:
    """The set ``{x : lower <= x <= upper, equalities(x) == 0, inequalities(x) >= 0}``.

    Parameters
    ----------
    names
        Names of the variables.
    lower, upper
        Shape (n,). Infinite for no bound.
    exact
        Returns the equalities with each coefficient as an almost exact sum of floats instead of a ball. In a recursion
        the radii of balls accumulate, so points are verified with these equalities.

    Raises
    ------
    ProblemError
        When lengths disagree, a bound is NaN, or a lower bound lies above its upper one.

    Examples
    --------
    >>> x = sympy.Symbol("x")
    >>> problem, objective = from_sympy(x**2 - x, [], [], [x], {x: (0, 2)})
    >>> problem.n_variables, objective.degree
    (1, 2)
    """

    names: tuple[str, ...]
    lower: Array
    upper: Array
    equalities: Polynomials
    inequalities: Polynomials
    exact: Callable[[], Polynomials] | None = None

    def __post_init__(self) -> None:
        if not len(self.names) == len(self.lower) == len(self.upper):
            raise ProblemError(
                f"{len(self.names)} names, {len(self.lower)} lower and {len(self.upper)} upper bounds: "
                "give one of each per variable"
            )
        wrong = np.flatnonzero(~(self.lower <= self.upper))
        if len(wrong):
            k = int(wrong[0])
            raise ProblemError(
                f"the box of {self.names[k]} is [{self.lower[k]}, {self.upper[k]}]: "
                "give a lower bound that is not above the upper one"
            )

    @property
    def n_variables(self) -> int:
        """Return the number of variables."""
        return len(self.names)

    @property
    def unbounded(self) -> tuple[str, ...]:
        """Return the names of the variables without two finite bounds."""
        return tuple(self.names[k] for k in np.flatnonzero(~np.isfinite(self.upper - self.lower)))

    @property
    def degree(self) -> int:
        """Return the largest degree among the constraints."""
        return max(self.equalities.degree, self.inequalities.degree)

    def with_box(self, lower: Array, upper: Array) -> PolynomialProblem:
        """Return the problem with other bounds."""
        return replace(self, lower=lower, upper=upper)

    def with_inequalities(self, more: Polynomials) -> PolynomialProblem:
        """Return the problem with further inequalities."""
        return replace(self, inequalities=Polynomials.join([self.inequalities, more]))

    def without(self, variables: Index) -> tuple[PolynomialProblem, Index]:
        """Leave out some variables with the constraints that read them; return the equalities that are kept as well."""
        left = np.setdiff1d(np.arange(self.n_variables), variables)
        numbers = np.full(self.n_variables, -1, dtype=np.int64)
        numbers[left] = np.arange(len(left))
        families = (self.equalities, self.inequalities)
        kept = [
            np.setdiff1d(np.arange(family.n_rows), family.rows[np.isin(family.factors, variables).any(axis=1)])
            for family in families
        ]
        equalities, inequalities = (
            family.take(rows).renumbered(numbers) for family, rows in zip(families, kept, strict=True)
        )
        names = tuple(self.names[k] for k in left)
        exact = self.exact and cache(lambda whole=self.exact: whole().take(kept[0]).renumbered(numbers))
        return PolynomialProblem(names, self.lower[left], self.upper[left], equalities, inequalities, exact), kept[0]

    def variable(self, index: int, sign: float = 1.0) -> Polynomials:
        """Return the objective ``sign * x[index]``."""
        return Polynomials.variables(np.array([index]), sign)


def from_sympy(
    objective: sympy.Expr | None,
    inequalities: Sequence[sympy.Expr],
    equalities: Sequence[sympy.Expr],
    variables: Sequence[sympy.Symbol],
    bounds: Mapping[sympy.Symbol, tuple[float | None, float | None]] | None = None,
) -> tuple[PolynomialProblem, Polynomials]:
    """Return a problem and an objective that are written in sympy.

    Parameters
    ----------
    objective
        To be minimised; ``None`` is the constant zero.
    inequalities, equalities
        Each expression is ``>= 0`` or ``== 0``.
    variables
        Order of the variables.
    bounds
        ``None`` for no bound; a bound that no float equals is rounded outwards.

    Raises
    ------
    ProblemError
        When there are no variables, an expression is not a polynomial in them, bounds are given for another symbol, or
        a lower bound lies above its upper one.

    Examples
    --------
    >>> x, y = sympy.symbols("x y")
    >>> problem, objective = from_sympy(x - y, [1 - x**2 - y**2], [], [x, y], {x: (0, None)})
    >>> problem.lower, problem.upper
    (array([  0., -inf]), array([inf, inf]))
    >>> problem.inequalities.evaluate(np.array([0.6, 0.5])).round(2)
    array([0.39])
    """
    bounds = bounds or {}
    stray = [str(symbol) for symbol in bounds if symbol not in variables]
    if stray:
        raise ProblemError(f"bounds are given for {', '.join(stray)}, which are not variables: list them as variables")
    pairs = [bounds.get(v, (None, None)) for v in variables]
    problem = PolynomialProblem(
        tuple(str(v) for v in variables),
        np.array([-np.inf if low is None else _outwards(low, -1) for low, _ in pairs]),
        np.array([np.inf if high is None else _outwards(high, 1) for _, high in pairs]),
        polynomials_from_sympy(equalities, variables),
        polynomials_from_sympy(inequalities, variables),
    )
    return problem, polynomials_from_sympy([sympy.S(0) if objective is None else objective], variables)


def polynomials_from_sympy(expressions: Sequence[sympy.Expr], variables: Sequence[sympy.Symbol]) -> Polynomials:
    """Return sympy expressions as polynomials; a coefficient that no float equals gets a radius.

    ProblemError if there are no variables, an expression is not a polynomial in them, or a coefficient is not a finite
    rational number or overflows.
    """
    if not variables:
        raise ProblemError("a polynomial problem needs variables: list at least one")
    members, coefficients = [], []
    for expression in expressions:
        try:
            poly = sympy.Poly(with_fractions(sympy.sympify(expression)), *variables)
        except sympy.PolynomialError as error:
            raise ProblemError(f"{expression} is not a polynomial in {variables}: {error}") from error
        terms = {}
        for exponents, value in poly.terms():
            if value.free_symbols:
                raise ProblemError(f"{expression} contains {value.free_symbols}: list them as variables")
            key = tuple(k for k, e in enumerate(exponents) for _ in range(e))
            terms[key] = _exact_ball(value)
        members.append({key: 1.0 for key in terms})
        coefficients.append(terms)
    shape = Polynomials.from_terms(members)
    if not len(shape.rows):
        return shape
    values = [
        coefficients[row][tuple(int(v) for v in factor if v >= 0)]
        for row, factor in zip(shape.rows, shape.factors, strict=True)
    ]
    flat = concatenate([Balls(np.atleast_1d(v.mid), np.atleast_1d(v.rad)) for v in values])
    return Polynomials(len(expressions), shape.rows, shape.factors, flat).collect()


def with_fractions(expression: sympy.Expr) -> sympy.Expr:
    """Return the expression with each Float as the fraction that it equals: sympy rounds products of floats."""
    floats = [f for f in expression.atoms(sympy.Float) if f.is_finite]
    return expression.xreplace({f: sympy.Rational(f) for f in floats})


def _exact_ball(value: sympy.Expr) -> Balls:
    """Return the ball around a sympy number; a Float is the binary fraction that it equals."""
    if not (value.is_Number and value.is_finite):
        raise ProblemError(f"the coefficient {value} is not a finite rational number: give a decimal or a fraction")
    try:
        return Balls.enclose(_fraction(value))
    except OverflowError:
        raise ProblemError(f"a coefficient of {len(str(value))} digits overflows: scale the problem") from None


def _fraction(value: sympy.Expr) -> Fraction:
    rational = sympy.Rational(value)
    return Fraction(int(rational.p), int(rational.q))


def _outwards(bound: float, direction: int) -> float:
    """Return a bound as a float, rounded outwards, so that no feasible point is lost."""
    number = sympy.sympify(bound)
    return outwards(_fraction(number), direction) if number.is_finite else float(number)
