"""Problems written with Python's operators.

>>> x, y = variables("x y")
>>> found = minimise(x * y + y**2, [x**2 + y**2 <= 1, x >= 0])
>>> bool(found.lower <= found.upper <= found.lower + 1e-6)
True
>>> round(found.upper, 4)
-0.2071

Coefficients are rational numbers. A float is the binary fraction that it equals, and there is no rounding before the
problem is made. Constraints on one variable become its bounds. :mod:`relaxations.formats.implied_box` derives further
bounds from the other constraints.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np

from relaxations.algebra.ball_arithmetic import Balls, concatenate, outwards
from relaxations.algebra.polynomial import Polynomials, padded
from relaxations.errors import ProblemError
from relaxations.formats.implied_box import Box, implied_box
from relaxations.problem.problem import PolynomialProblem
from relaxations.search.minimum import Minimum
from relaxations.search.minimum import minimise as minimise_problem
from relaxations.search.presolve import presolve

Names = tuple[str, ...]  # a monomial: names with repetition, sorted
Number = int | float | Fraction
HIGHEST_POWER = 500


@dataclass(frozen=True, eq=False)
class Expression:
    """A polynomial in named variables with rational coefficients, made by :func:`variables` and Python's operators.

    Parameters
    ----------
    terms
        Coefficient of each monomial, without zeros.
    """

    terms: Mapping[Names, Fraction]
    __array_ufunc__: ClassVar[None] = None  # NumPy's scalars then use the operators of this class

    @property
    def degree(self) -> int:
        """Return the largest degree of any term."""
        return max((len(m) for m in self.terms), default=0)

    @property
    def constant(self) -> Fraction | None:
        """Return the value of a constant expression; None for any other."""
        return None if self.degree else self.terms.get((), Fraction(0))

    def __add__(self, other: Expression | Number) -> Expression:
        return _collected([*self.terms.items(), *constant(other).terms.items()])

    def __neg__(self) -> Expression:
        return Expression({m: -c for m, c in self.terms.items()})

    def __sub__(self, other: Expression | Number) -> Expression:
        return self + -constant(other)

    def __rsub__(self, other: Number) -> Expression:
        return constant(other) - self

    def __mul__(self, other: Expression | Number) -> Expression:
        right = constant(other).terms.items()
        return _collected([(tuple(sorted(m + n)), a * b) for m, a in self.terms.items() for n, b in right])

    __radd__ = __add__
    __rmul__ = __mul__

    def __truediv__(self, other: Expression | Number) -> Expression:
        divisor = constant(other).constant
        if divisor is None:
            raise ProblemError(f"division by {other}, which is not a constant: multiply the constraint by it instead")
        if divisor == 0:
            raise ProblemError(f"division of {self} by zero")
        return self * (1 / divisor)

    def __rtruediv__(self, other: Number) -> Expression:
        return constant(other) / self

    def __pow__(self, exponent: Expression | Number) -> Expression:
        power = constant(exponent).constant
        if power is None or power.denominator != 1 or power < 0:
            raise ProblemError(
                f"the exponent {exponent} is not a whole number from 0 on: only polynomials are supported"
            )
        if power > HIGHEST_POWER:
            raise ProblemError(f"the exponent {exponent} is above {HIGHEST_POWER}: no relaxation reaches such degrees")
        result = constant(1)
        for _ in range(int(power)):
            result = result * self
        return result

    def __ge__(self, other: Expression | Number) -> Constraint:
        return Constraint(self - other, equality=False)

    def __le__(self, other: Expression | Number) -> Constraint:
        return Constraint(constant(other) - self, equality=False)

    def __eq__(self, other: Expression | Number) -> Constraint:  # type: ignore[override]
        return Constraint(self - other, equality=True)

    __hash__ = None  # type: ignore[assignment]

    def __str__(self) -> str:
        parts = []
        for m, c in sorted(self.terms.items(), key=lambda item: (-len(item[0]), item[0])):
            factors = [v if m.count(v) == 1 else f"{v}**{m.count(v)}" for v in dict.fromkeys(m)]
            size = [] if abs(c) == 1 and factors else [str(abs(c))]
            parts.append(("- " if c < 0 else "+ ") + "*".join(size + factors))
        text = " ".join(parts).removeprefix("+ ") or "0"
        return "-" + text[2:] if text.startswith("- ") else text

    __repr__ = __str__


@dataclass(frozen=True)
class Constraint:
    """``expression >= 0`` or ``expression == 0``, made by comparing expressions.

    Examples
    --------
    >>> x, y = variables("x y")
    >>> print(x * y <= 1)
    -x*y + 1 >= 0
    >>> (x == y).equality
    True
    """

    expression: Expression
    equality: bool

    def __bool__(self) -> bool:
        raise ProblemError(
            f"the constraint {self} is neither true nor false: write 1 <= x <= 2 as two constraints, x >= 1 and x <= 2"
        )

    def __str__(self) -> str:
        return f"{self.expression} {'==' if self.equality else '>='} 0"


def variables(names: str) -> tuple[Expression, ...]:
    """Return variables by their names, which are separated by spaces or commas.

    Raises
    ------
    ProblemError
        When a name is not an identifier, or is given twice.

    Examples
    --------
    >>> x, y = variables("x y")
    >>> (x - 2 * y) ** 2 / 4
    1/4*x**2 - x*y + y**2
    """
    found = re.split(r"[\s,]+", names.strip())
    wrong = [name for name in found if not name.isidentifier()]
    if wrong or len(set(found)) != len(found):
        raise ProblemError(f"{names!r} does not list distinct names: give letters, digits and underscores, as in 'x y'")
    return tuple(Expression({(name,): Fraction(1)}) for name in found)


def constant(value: Expression | Number) -> Expression:
    """Return a number as an expression, and an expression unchanged; ProblemError for anything else."""
    if isinstance(value, Expression):
        return value
    try:
        number = Fraction(value)
    except (TypeError, ValueError, OverflowError):
        raise ProblemError(
            f"{value!r} is not a finite real number: a polynomial consists of numbers and variables"
        ) from None
    return Expression({(): number} if number else {})


def problem_of(
    objective: Expression | Number,
    constraints: Sequence[Constraint] = (),
    names: Sequence[str] = (),
    box: Mapping[str, tuple[Number | None, Number | None]] | None = None,
) -> tuple[PolynomialProblem, Polynomials]:
    """Return the problem of an objective and constraints, with the bounds that follow from the constraints.

    Bounds that no float equals are rounded outwards. A bound is infinite if the constraints do not imply one.

    Parameters
    ----------
    objective
        To be minimised.
    constraints
        A constraint on one variable alone, such as ``x >= 0``, becomes its bound.
    names
        Order of the variables; other variables follow, sorted by name.
    box
        Further bounds; ``None`` for no bound.

    Raises
    ------
    ProblemError
        When there are no variables, a box is empty, or a number is too large for a float.

    Examples
    --------
    >>> x, y = variables("x y")
    >>> problem, objective = problem_of(x * y, [x**2 + 4 * y**2 <= 1, x >= 0])
    >>> problem.names, problem.lower, problem.upper
    (('x', 'y'), array([ 0. , -0.5]), array([1. , 0.5]))
    >>> problem.inequalities.n_rows  # x >= 0 is a bound now
    1
    """
    goal, kept, ends = _rows_and_ends(objective, constraints, names, box)
    return stated_problem(goal, kept, implied_box([(c.expression.terms, c.equality) for c in kept], ends))


def _rows_and_ends(
    objective: Expression | Number,
    constraints: Sequence[Constraint],
    names: Sequence[str] = (),
    box: Mapping[str, tuple[Number | None, Number | None]] | None = None,
) -> tuple[Expression, list[Constraint], Box]:
    """Return the objective, the constraints that are no bounds of one variable, and those bounds."""
    goal = constant(objective)
    for k, c in enumerate(constraints):
        if not isinstance(c, Constraint):
            raise ProblemError(f"constraint {k} is {c!r}: compare expressions with <=, >= or ==")
    occurring = {v for e in (goal, *(c.expression for c in constraints)) for m in e.terms for v in m}
    ordered = (*names, *sorted((occurring | set(box or {})) - set(names)))
    if not ordered:
        raise ProblemError("neither objective nor constraints hold a variable: there is nothing to optimise")
    ends: Box = {v: _exact_ends(v, (box or {}).get(v, (None, None))) for v in ordered}
    kept: list[Constraint] = []
    for c in constraints:
        if not _narrow_box(c, ends):
            kept.append(c)
    for v, (low, high) in ends.items():
        if low is not None and high is not None and low > high:
            raise ProblemError(f"the constraints leave {v} the empty box [{float(low)}, {float(high)}]: correct them")
    return goal, kept, ends


def stated_problem(
    objective: Expression, constraints: Sequence[Constraint], box: Box
) -> tuple[PolynomialProblem, Polynomials]:
    """Return a problem without deriving bounds; its variables are those of the box, in this order.

    ProblemError if a box is empty, or a coefficient is too large for a float.
    """
    return (
        PolynomialProblem(
            tuple(box),
            np.array([-np.inf if low is None else outwards(low, -1) for low, _ in box.values()]),
            np.array([np.inf if high is None else outwards(high, 1) for _, high in box.values()]),
            _polynomials([c.expression for c in constraints if c.equality], tuple(box)),
            _polynomials([c.expression for c in constraints if not c.equality], tuple(box)),
        ),
        _polynomials([objective], tuple(box)),
    )


def minimise(objective: Expression | Number, constraints: Sequence[Constraint] = (), **options: Any) -> Minimum:
    """Return proven bounds of a minimum: the lower by a certificate, the upper by a verified point.

    Parameters
    ----------
    constraints
        Together they must bound every variable.
    **options
        Those of :func:`relaxations.search.minimum.minimise`: method, order, tolerance, nodes, seconds, solver,
        progress.

    Raises
    ------
    ProblemError
        When a variable is not bounded, or the order is too low.

    Examples
    --------
    >>> x, y = variables("x y")
    >>> found = minimise(x**2 - x * y, [x >= 0, x <= 1, y >= 0, y <= 1])
    >>> found.lower <= found.upper <= found.lower + 1e-6
    True
    >>> {name: round(value, 3) for name, value in found.point.items()}
    {'x': 0.5, 'y': 1.0}
    """
    goal, kept, ends = _rows_and_ends(objective, constraints)
    stated = stated_problem(goal, kept, ends)
    presolved = presolve(stated[0])
    # Bounds that presolve does not prove are taken from the constraints here, and a certificate states them.
    provable = presolved is None or not presolved.unbounded
    return minimise_problem(*(stated if provable else problem_of(objective, constraints)), **options)


def _polynomials(expressions: Sequence[Expression], names: Sequence[str]) -> Polynomials:
    """Return expressions as polynomials; a coefficient that no float equals gets a radius."""
    place = {name: k for k, name in enumerate(names)}
    rows = [row for row, e in enumerate(expressions) for _ in e.terms]
    factors = padded([[place[v] for v in m] for e in expressions for m in e.terms])
    if not rows:
        return Polynomials.from_terms([{} for _ in expressions])
    try:
        balls = [Balls.enclose(c) for e in expressions for c in e.terms.values()]
    except OverflowError:
        raise ProblemError("a coefficient is too large for a float: scale the problem") from None
    flat = concatenate([Balls(np.atleast_1d(b.mid), np.atleast_1d(b.rad)) for b in balls])
    return Polynomials(len(expressions), np.array(rows, dtype=np.int64), factors, flat).collect()


def _collected(terms: Sequence[tuple[Names, Fraction]]) -> Expression:
    """Return the sum of terms as an expression."""
    total: dict[Names, Fraction] = {}
    for m, c in terms:
        total[m] = total.get(m, Fraction(0)) + c
    return Expression({m: c for m, c in total.items() if c})


def _exact_ends(name: str, pair: tuple[Number | None, Number | None]) -> tuple[Fraction | None, Fraction | None]:
    """Return both bounds of a variable as fractions."""
    for end in pair:
        if end is not None and not isinstance(end, Fraction) and np.isnan(end):
            raise ProblemError(f"a bound of {name} is not a number")
    low, high = pair
    return (
        None if low is None or low == -np.inf else constant(low).constant,
        None if high is None or high == np.inf else constant(high).constant,
    )


def _narrow_box(c: Constraint, ends: Box) -> bool:
    """Narrow the bounds of x by ``a x + b >= 0`` (or ``== 0``); return False for a constraint of another form."""
    own = [m for m in c.expression.terms if m]
    if len(own) != 1 or len(own[0]) != 1:
        return False
    slope = c.expression.terms[own[0]]
    root = -c.expression.terms.get((), Fraction(0)) / slope
    low, high = ends[own[0][0]]
    if c.equality or slope > 0:
        low = root if low is None else max(low, root)
    if c.equality or slope < 0:
        high = root if high is None else min(high, root)
    ends[own[0][0]] = (low, high)
    return True
