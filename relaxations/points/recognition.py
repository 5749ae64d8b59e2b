"""Find the constraints of the problem from which each row and block of a relaxation was made.

A relaxation stores moments, and no record of the products that gave its rows. Here each row is recognised as a multiple
of an equality, and each block as ``g b b'`` with g a product of constraints. Two polynomials match if their terms are
equal up to a monomial and a power of two.

A wrong match cannot make a false certificate, because the check of a file multiplies all products out again. Facial
reductions need no record: the factors belong to the full block, and dropped equalities have multiplier zero.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import reduce
from itertools import combinations, combinations_with_replacement
from typing import Any

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.polynomial import Polynomials
from relaxations.errors import ProblemError
from relaxations.moments.moment import Blocks, Relaxation
from relaxations.writing import hexadecimal

Monomial = tuple[int, ...]
Terms = dict[Monomial, float]
Label = tuple[tuple[str, int], ...]  # the constraints that a product is made of


@dataclass(frozen=True)
class _Form:
    """A polynomial divided by its common monomial and by a power of two."""

    key: frozenset[tuple[Monomial, float]]
    common: Monomial
    exponent: int


def _form(terms: Mapping[Monomial, float]) -> _Form | None:
    """Return the form of a polynomial; None for zero."""
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
    """Return m / by, or None if ``by`` does not divide m."""
    if not by:
        return m
    rest = Counter(m)
    rest.subtract(by)
    return None if min(rest.values()) < 0 else tuple(sorted(rest.elements()))


def _root(m: Monomial) -> Monomial | None:
    """Return b with b * b = m, or None."""
    return m[::2] if m[::2] == m[1::2] else None


class _Table:
    """Known polynomials, found by their form."""

    def __init__(self) -> None:
        self._known: dict[frozenset[tuple[Monomial, float]], list[tuple[Any, Monomial, int]]] = {}

    def add(self, label: Any, terms: Mapping[Monomial, float]) -> None:
        """Add a polynomial under a label."""
        form = _form(terms)
        if form is not None:
            self._known.setdefault(form.key, []).append((label, form.common, form.exponent))

    def find(self, form: _Form) -> list[tuple[Any, Monomial, int]]:
        """Return (label, m, e) for each known g such that ``g * m * 2**e`` is the polynomial."""
        found = []
        for label, common, exponent in self._known.get(form.key, []):
            m = _quotient(form.common, common)
            if m is not None:
                found.append((label, m, form.exponent - exponent))
        return found


def equality_multipliers(
    relaxation: Relaxation, equalities: Polynomials, multipliers: Array
) -> list[tuple[int, list[tuple[str, Monomial]]]]:
    """Return the multiplier polynomial of each equality of the scaled problem: (equality, [(coefficient, monomial)]).

    ProblemError if a row of the relaxation is not a multiple of an equality.
    """
    monomials = _monomials(relaxation)
    table = _Table()
    for k, terms in enumerate(_terms(equalities)):
        table.add(k, terms)
    # Each row of the relaxation as a polynomial.
    rows: list[Terms] = [{} for _ in range(relaxation.n_equalities)]
    for row, moment, value in zip(
        relaxation.equality_row.tolist(),
        relaxation.equality_moment.tolist(),
        relaxation.equality_coefficient.mid.tolist(),
        strict=True,
    ):
        rows[row][monomials[moment]] = value
    # Find the equality of each row with a nonzero multiplier.
    collected: dict[int, list[tuple[str, Monomial]]] = {}
    for row, terms in enumerate(rows):
        form = _form(terms)
        if form is None or not multipliers[row]:
            continue
        found = table.find(form)
        if not found:
            raise ProblemError(
                f"equality {row} of this relaxation is not a multiple of an equality of the problem: not checkable"
            )
        k, m, exponent = found[0]
        collected.setdefault(k, []).append((_scaled(multipliers[row], exponent), m))
    return sorted(collected.items())


def product_multipliers(
    relaxation: Relaxation, inequalities: Polynomials, factors: tuple[Array, ...]
) -> list[dict[str, Any]]:
    """Return the product of constraints of each block, with its multiplier.

    The inequalities are those of the scaled problem. Each dictionary has ``of`` (kind and number of each constraint),
    ``weight``, ``basis`` and ``factor``, as in a certificate file. ProblemError if a block is not such a product.
    """
    monomials = _monomials(relaxation)
    table = _product_table(relaxation, inequalities)
    products = []
    for blocks, stack in zip(relaxation.blocks, factors, strict=True):
        for number, first in enumerate(_first_rows(blocks, monomials)):
            # The first diagonal entry g b_0^2 identifies g, and the first row the basis b.
            form = _form(first[0])
            used = stack[number].any(axis=0)
            if form is None or not used.any():
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
                            "factor": [
                                [hexadecimal(value) for value in row] for row in stack[number][:, used].tolist()
                            ],
                        }
                    )
                    break
            else:
                raise ProblemError(
                    f"a block of width {blocks.size} of this relaxation is not a product of the problem's constraints "
                    "and its box: not checkable"
                )
    return products


def _monomials(relaxation: Relaxation) -> list[Monomial]:
    """Return the monomial of each moment."""
    return [tuple(v for v in factor if v >= 0) for factor in relaxation.monomials.tolist()]


def _basis(first: list[Terms], diagonal: _Form, root: Monomial) -> list[Monomial] | None:
    """Return the basis b, from the entries ``g b_0 b_j`` of the first row."""
    basis = []
    for terms in first:
        form = _form(terms)
        # b_j = (g b_0 b_j) / (g b_0 b_0) * b_0
        lifted = None if form is None else _quotient(tuple(sorted(form.common + root)), diagonal.common)
        if form is None or form.key != diagonal.key or lifted is None:
            return None
        basis.append(lifted)
    return basis


def _first_rows(blocks: Blocks, monomials: list[Monomial]) -> list[list[Terms]]:
    """Return the polynomials in the first row of each block."""
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
    """List 1, the inequalities and the box, and the products of them that a relaxation may have as rows."""
    singles: list[tuple[Label, Terms]] = [((), {(): 1.0})]
    singles += [((("inequality", k),), terms) for k, terms in enumerate(_terms(inequalities))]
    for v in range(relaxation.n_variables):
        singles += [((part,), terms) for part, terms in _box_factors(v)]
    table = _Table()
    for label, terms in singles:
        table.add(label, terms)
        for parts, factor in _box_products(relaxation):
            table.add((*label, *parts), _times(terms, factor))
    if relaxation.order == 1 and not len(relaxation.complicating):
        linear = [(label, terms) for label, terms in singles if max(map(len, terms), default=0) == 1]
        for (one, left), (other, right) in combinations(linear, 2):
            table.add((*one, *other), _times(left, right))
    return table


def _box_products(relaxation: Relaxation) -> list[tuple[Label, Terms]]:
    """Return the products of box factors of complicating variables by which an inequality can be multiplied."""
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
    """Return ``1 + x``, ``1 - x`` and ``1 - x^2``."""
    return [
        (("above", v), {(): 1.0, (v,): 1.0}),
        (("below", v), {(): 1.0, (v,): -1.0}),
        (("inside", v), {(): 1.0, (v, v): -1.0}),
    ]


def _times(terms: Terms, factor: Terms) -> Terms:
    # Both are linear, or one of them is a factor of the box: at most two terms have the same monomial, so these sums
    # are rounded as in the relaxation.
    total: Terms = {}
    for m, c in terms.items():
        for n, sign in factor.items():
            key = tuple(sorted(m + n))
            total[key] = total.get(key, 0.0) + sign * c
    return total


def _terms(polynomials: Polynomials) -> list[Terms]:
    """Return the terms of each polynomial as a dictionary."""
    return [{tuple(factor): mid for mid, _, factor in row} for row in polynomials.terms()]


def _scaled(value: float, exponent: int) -> str:
    """Return ``value * 2**exponent`` exactly, as a hexadecimal float or a fraction."""
    exact = Fraction(float(value)) * Fraction(2) ** exponent
    try:
        nearest = float(exact)
    except OverflowError:
        return str(exact)
    return hexadecimal(nearest) if Fraction(nearest) == exact else str(exact)
