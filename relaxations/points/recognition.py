"""Find out where the rows of a relaxation came from.

A relaxation keeps moments, and not how its rows were made. Here every row is recognised as a multiple of an equality,
and every block as ``g b b'`` with g a product of constraints: up to a monomial and a power of two, its terms are those
of g. Nothing rests on the recognition, for the check of a file multiplies everything out again, from the problem as
stated. A facial reduction needs no proof either: the factors of the multipliers belong to the whole block, and dropped
multiples of equalities have multiplier zero.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import reduce
from itertools import combinations_with_replacement
from typing import Any

import numpy as np

from relaxations.algebra.ball_arithmetic import Array
from relaxations.algebra.polynomial import Polynomials
from relaxations.errors import ProblemError
from relaxations.moments.moment import Blocks, Relaxation

Monomial = tuple[int, ...]
Terms = dict[Monomial, float]
Label = tuple[tuple[str, int], ...]  # the constraints that a product is made of


@dataclass(frozen=True)
class _Form:
    """A polynomial without its common monomial and its power of two."""

    key: frozenset[tuple[Monomial, float]]
    common: Monomial
    exponent: int


def _form(terms: Mapping[Monomial, float]) -> _Form | None:
    """Return the form; None for the polynomial zero."""
    terms = {m: c for m, c in terms.items() if c}
    if not terms:
        return None
    common: Monomial = ()
    if () not in terms:
        shared = Counter(next(iter(terms)))
        for m in terms:
            shared &= Counter(m)
        common = tuple(sorted(shared.elements()))
    exponent = math.frexp(max(abs(c) for c in terms.values()))[1]
    key = frozenset((_quotient(m, common) or (), math.ldexp(c, -exponent)) for m, c in terms.items())
    return _Form(key, common, exponent)


def _quotient(m: Monomial, by: Monomial) -> Monomial | None:
    """Return m / by, or None where it is no monomial."""
    if not by:
        return m
    rest = Counter(m)
    rest.subtract(by)
    return None if min(rest.values()) < 0 else tuple(sorted(rest.elements()))


def _root(m: Monomial) -> Monomial | None:
    """Return b with b * b = m, or None."""
    return m[::2] if m[::2] == m[1::2] else None


class _Table:
    """Known polynomials by their form."""

    def __init__(self) -> None:
        self._known: dict[frozenset[tuple[Monomial, float]], list[tuple[Any, Monomial, int]]] = {}

    def add(self, label: Any, terms: Mapping[Monomial, float]) -> None:
        form = _form(terms)
        if form is not None:
            self._known.setdefault(form.key, []).append((label, form.common, form.exponent))

    def find(self, form: _Form) -> list[tuple[Any, Monomial, int]]:
        """Return (label, m, e) for all known g with ``g * m * 2**e`` equal to the polynomial."""
        found = []
        for label, common, exponent in self._known.get(form.key, []):
            m = _quotient(form.common, common)
            if m is not None:
                found.append((label, m, form.exponent - exponent))
        return found


def equality_multipliers(
    relaxation: Relaxation, equalities: Polynomials, multipliers: Array
) -> list[tuple[int, list[tuple[str, Monomial]]]]:
    """Return the polynomial that each equality of a problem is multiplied by.

    Parameters
    ----------
    equalities
        Of the scaled problem.
    multipliers
        Shape (n_equalities of the relaxation,).

    Returns
    -------
    list of (int, list of (str, monomial))
        Equality, and the terms of its multiplier, numbers in hexadecimal or as fractions.

    Raises
    ------
    ProblemError
        Where a row of the relaxation is no multiple of an equality.

    Examples
    --------
    >>> from relaxations.proof.bounding import relax
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> x, y = variables("x y")
    >>> problem, _ = problem_of(x, [x * y == 0.5, x >= -1, x <= 1, y >= -1, y <= 1])
    >>> relaxed = relax(problem, "lift", 1)  # the equality, and its multiple with x
    >>> equality_multipliers(relaxed.relaxation, relaxed.scaled.equalities, np.array([2.0, 0.0]))
    [(0, [('0x1.0000000000000p+1', ())])]
    """
    monomials = _monomials(relaxation)
    table = _Table()
    for k, terms in enumerate(_terms(equalities)):
        table.add(k, terms)
    rows: list[Terms] = [{} for _ in range(relaxation.n_equalities)]
    for row, moment, value in zip(
        relaxation.equality_row.tolist(),
        relaxation.equality_moment.tolist(),
        relaxation.equality_coefficient.mid.tolist(),
        strict=True,
    ):
        rows[row][monomials[moment]] = value
    collected: dict[int, list[tuple[str, Monomial]]] = {}
    for row, terms in enumerate(rows):
        form = _form(terms)
        if form is None or not multipliers[row]:
            continue
        found = table.find(form)
        if not found:
            raise ProblemError(
                f"equality {row} of this relaxation is no multiple of one of the problem's: not checkable"
            )
        k, m, exponent = found[0]
        collected.setdefault(k, []).append((_scaled(multipliers[row], exponent), m))
    return sorted(collected.items())


def product_multipliers(
    relaxation: Relaxation, inequalities: Polynomials, factors: tuple[Array, ...]
) -> list[dict[str, Any]]:
    """Return the products of constraints that blocks stand for, with their multipliers.

    Parameters
    ----------
    inequalities
        Of the scaled problem.
    factors
        Each of shape (count, size, rank). Of the multipliers (:class:`relaxations.moments.conic.Multipliers`).

    Returns
    -------
    list of dict
        ``of`` (kind and number of each constraint), ``weight``, ``basis`` and ``factor``, as in a certificate file.

    Raises
    ------
    ProblemError
        Where a block is no such product.

    Examples
    --------
    >>> from relaxations.proof.bounding import relax
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> (x,) = variables("x")
    >>> problem, _ = problem_of(x, [x >= -1, x <= 1])
    >>> relaxation = relax(problem, "dense", 1).relaxation
    >>> [(b.count, b.size) for b in relaxation.blocks]  # the moment matrix, and 1 - x^2
    [(1, 2), (1, 1)]
    >>> found = product_multipliers(relaxation, problem.inequalities, (np.zeros((1, 2, 1)), np.ones((1, 1, 1))))
    >>> [(product["of"], product["basis"]) for product in found]
    [([('inside', 0)], [()])]
    """
    monomials = _monomials(relaxation)
    table = _product_table(relaxation, inequalities)
    products = []
    for blocks, stack in zip(relaxation.blocks, factors, strict=True):
        for number, first in enumerate(_first_rows(blocks, monomials)):
            form = _form(first[0])
            if form is None or not stack[number].any():
                continue
            for label, square, exponent in table.find(form):
                root = _root(square)
                basis = None if root is None else _basis(first, form, root)
                if basis is not None:
                    products.append(
                        {
                            "of": list(label),
                            "weight": _scaled(1.0, exponent),
                            "basis": basis,
                            "factor": [[value.hex() for value in row] for row in stack[number].tolist()],
                        }
                    )
                    break
            else:
                raise ProblemError(
                    f"a block of width {blocks.size} of this relaxation is no product of the problem's constraints and "
                    "its box: not checkable"
                )
    return products


def _monomials(relaxation: Relaxation) -> list[Monomial]:
    return [tuple(v for v in factor if v >= 0) for factor in relaxation.monomials.tolist()]


def _basis(first: list[Terms], diagonal: _Form, root: Monomial) -> list[Monomial] | None:
    """Read the basis b off the entries ``g b_0 b_j`` of the first row."""
    basis = []
    for terms in first:
        form = _form(terms)
        # g b_0 b_j over g b_0 b_0, times b_0.
        lifted = None if form is None else _quotient(tuple(sorted(form.common + root)), diagonal.common)
        if form is None or form.key != diagonal.key or lifted is None:
            return None
        basis.append(lifted)
    return basis


def _first_rows(blocks: Blocks, monomials: list[Monomial]) -> list[list[Terms]]:
    """Return the polynomials in the first row of every block."""
    first: list[list[Terms]] = [[{} for _ in range(blocks.size)] for _ in range(blocks.count)]
    top = np.flatnonzero(blocks.i == 0)
    for block, j, moment, value in zip(
        blocks.block[top].tolist(),
        blocks.j[top].tolist(),
        blocks.moment[top].tolist(),
        blocks.coefficient.mid[top].tolist(),
        strict=True,
    ):
        first[block][j][monomials[moment]] = value
    return first


def _product_table(relaxation: Relaxation, inequalities: Polynomials) -> _Table:
    """List 1, the inequalities and the box, and their products with the box of the complicating variables."""
    singles: list[tuple[Label, Terms]] = [((), {(): 1.0})]
    singles += [((("inequality", k),), terms) for k, terms in enumerate(_terms(inequalities))]
    for v in range(relaxation.n_variables):
        singles += [((part,), terms) for part, terms in _box_factors(v)]
    table = _Table()
    for label, terms in singles:
        table.add(label, terms)
        for parts, factor in _box_products(relaxation):
            table.add((*label, *parts), _times(terms, factor))
    return table


def _box_products(relaxation: Relaxation) -> list[tuple[Label, Terms]]:
    """Return the products of box factors of complicating variables that an inequality may be multiplied by."""
    single = [(part, factor) for p in relaxation.complicating.tolist() for part, factor in _box_factors(p)]
    if relaxation.method != "rlt":
        return [((part,), factor) for part, factor in single]
    ends = [(part, factor) for part, factor in single if part[0] != "inside"]
    found = []
    for degree in range(1, 2 * relaxation.order + 1):
        for chosen in combinations_with_replacement(ends, degree):
            product: Terms = reduce(_times, (factor for _, factor in chosen))
            found.append((tuple(part for part, _ in chosen), product))
    return found


def _box_factors(v: int) -> list[tuple[tuple[str, int], Terms]]:
    return [
        (("above", v), {(): 1.0, (v,): 1.0}),
        (("below", v), {(): 1.0, (v,): -1.0}),
        (("inside", v), {(): 1.0, (v, v): -1.0}),
    ]


def _times(terms: Terms, factor: Terms) -> Terms:
    # Two terms at most meet in one monomial, so that these sums are rounded as those of the relaxation are.
    total: Terms = {}
    for m, c in terms.items():
        for n, sign in factor.items():
            key = tuple(sorted(m + n))
            total[key] = total.get(key, 0.0) + sign * c
    return total


def _terms(polynomials: Polynomials) -> list[Terms]:
    rows: list[Terms] = [{} for _ in range(polynomials.n_rows)]
    for row, factor, value in zip(
        polynomials.rows.tolist(), polynomials.factors.tolist(), polynomials.coefficients.mid.tolist(), strict=True
    ):
        rows[row][tuple(v for v in factor if v >= 0)] = value
    return rows


def _scaled(value: float, exponent: int) -> str:
    """Return ``value * 2**exponent`` exactly."""
    exact = Fraction(float(value)) * Fraction(2) ** exponent
    try:
        nearest = float(exact)
    except OverflowError:
        return str(exact)
    return nearest.hex() if Fraction(nearest) == exact else str(exact)
