"""Write certificates to files that :mod:`relaxations.check` proves again, with arithmetic and code of its own.

A relaxation keeps moments, and not where its rows came from. Here every row is recognised as a multiple of an equality,
and every block as ``g b b'`` with g a product of constraints: up to a monomial and a power of two, its terms are those
of g. Nothing rests on the recognition, for the check multiplies everything out again, from the problem as stated.
A facial reduction needs no proof either: the factors of the multipliers belong to the whole block, and dropped
multiples of equalities have multiplier zero. A row that is no such multiple is refused: what it rests on could not be
checked.
"""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from relaxations import check
from relaxations.balls import Array
from relaxations.bounding import Relaxed
from relaxations.certificate import Certificate
from relaxations.errors import ProblemError
from relaxations.formats.as_json import listed, statement
from relaxations.moment import Blocks, Relaxation
from relaxations.polynomial import Polynomials
from relaxations.problem import PolynomialProblem

Monomial = tuple[int, ...]
Terms = dict[Monomial, float]
Label = tuple[tuple[str, int], ...]  # the constraints that a product is made of


@dataclass(frozen=True)
class Step:
    """One certificate with what it is about: see :func:`write_certificate`.

    Parameters
    ----------
    relaxed : Relaxed
        The relaxation on which the bound was found.
    objective : Polynomials
        One row, in the problem's own variables.
    certificate : Certificate

    Examples
    --------
    A bound of x contracts the box; the minimum on the smaller box rests on it, and the file holds both.

    >>> import tempfile
    >>> from relaxations.bounding import relax
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> x, y = variables("x y")
    >>> problem, objective = problem_of(y, [x * y == 1, 1 <= y, y <= 4, 0 <= x, x <= 9])
    >>> relaxed = relax(problem, "lift", 1)
    >>> most = problem.variable(0, -1.0)  # minimise -x
    >>> proof = relaxed.bound(most).certificate
    >>> smaller = relax(problem.with_box(problem.lower, np.array([-proof.bound, 4.0])), "lift", 1)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "certificate.json"
    ...     last = smaller.bound(objective).certificate
    ...     write_certificate(file, smaller, objective, last, [Step(relaxed, most, proof)])
    ...     theorems = check.check(check.read(file))
    >>> [round(float(theorem.bound), 4) for theorem in theorems]
    [-1.0, 1.0]
    """

    relaxed: Relaxed
    objective: Polynomials
    certificate: Certificate


def write_certificate(
    path: str | Path,
    relaxed: Relaxed,
    objective: Polynomials,
    certificate: Certificate,
    earlier: Sequence[Step] = (),
) -> None:
    """Write a certificate, once :mod:`relaxations.check` has accepted it.

    Parameters
    ----------
    path : str or Path
    relaxed : Relaxed
        The relaxation on which the bound was found.
    objective : Polynomials
        One row, in the problem's own variables. For a proof of emptiness (an outcome with an infinite bound) the
        constant zero, ``Polynomials.from_terms([{}])``.
    certificate : Certificate
    earlier : sequence of Step
        Where the box of ``relaxed`` was contracted: the bounds of single variables that prove it, the first of them
        on the box of the problem as it is stated in the file.

    Raises
    ------
    ProblemError
        When the certificate does not prove its bound for this objective, the box does not follow from earlier steps,
        or a row of the relaxation is no product of constraints.

    Examples
    --------
    >>> import sympy, tempfile
    >>> from relaxations.bounding import relax
    >>> from relaxations.problem import from_sympy
    >>> x = sympy.Symbol("x")
    >>> problem, objective = from_sympy(x**2 - x, [], [], [x], {x: (0, 2)})
    >>> relaxed = relax(problem, "dense", 1)
    >>> file = Path(tempfile.mkdtemp()) / "certificate.json"
    >>> write_certificate(file, relaxed, objective, relaxed.bound(objective).certificate)
    >>> from relaxations import check
    >>> theorem = check.check(check.read(file))[0]
    >>> -0.25 - 1e-6 < theorem.bound <= -0.25
    True
    """
    steps = [*earlier, Step(relaxed, objective, certificate)]
    stated = steps[0].relaxed.problem
    for step in steps:
        if not np.isfinite(step.certificate.bound):
            raise ProblemError(f"the certificate's bound is {step.certificate.bound}: it proves nothing to be written")
        if not _same_constraints(step.relaxed.problem, stated):
            raise ProblemError("an earlier step has other variables or constraints: give steps of one problem")
    document = {
        "format": check.FORMAT,
        "version": check.VERSION,
        **statement(stated),
        "steps": [_step(step) for step in steps],
    }
    try:
        check.check(document)
    except check.Refused as refusal:
        raise ProblemError(
            f"the certificate does not prove its bound ({refusal}): give the objective that it was made for (zero for "
            "an empty set), and the steps that contracted the box"
        ) from None
    Path(path).write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def _same_constraints(one: PolynomialProblem, two: PolynomialProblem) -> bool:
    def same(p: Polynomials, q: Polynomials) -> bool:
        pairs = ((p.rows, q.rows), (p.factors, q.factors), (p.coefficients.mid, q.coefficients.mid))
        return p is q or all(np.array_equal(a, b) for a, b in (*pairs, (p.coefficients.rad, q.coefficients.rad)))

    return one.names == two.names and same(one.equalities, two.equalities) and same(one.inequalities, two.inequalities)


def _step(step: Step) -> dict[str, Any]:
    relaxed, relaxation = step.relaxed, step.relaxed.relaxation
    scaled = {
        name: relaxed.scaling.polynomials(family)
        for name, family in (("equality", relaxed.problem.equalities), ("inequality", relaxed.problem.inequalities))
    }
    factors = relaxation.monomials.tolist()
    monomials = [tuple(v for v in factor if v >= 0) for factor in factors]
    return {
        "objective": listed(step.objective)[0],
        "bound": float(step.certificate.bound).hex(),
        "centre": [float(v).hex() for v in relaxed.scaling.centre],
        "scale": [float(v).hex() for v in relaxed.scaling.scale],
        "equalities": _equalities(relaxation, monomials, scaled["equality"], step.certificate.multipliers.equalities),
        "products": _products(relaxation, monomials, scaled["inequality"], step.certificate.multipliers.factors),
    }


# ---------------------------------------------------------------- recognition


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


def _equalities(
    relaxation: Relaxation, monomials: list[Monomial], equalities: Polynomials, multipliers: Array
) -> list[list[Any]]:
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
    collected: dict[int, list[list[Any]]] = {}
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
        collected.setdefault(k, []).append([_scaled(multipliers[row], exponent), list(m)])
    return [[k, terms] for k, terms in sorted(collected.items())]


def _products(
    relaxation: Relaxation, monomials: list[Monomial], inequalities: Polynomials, factors: tuple[Array, ...]
) -> list[dict[str, Any]]:
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
                            "of": [list(part) for part in label],
                            "weight": _scaled(1.0, exponent),
                            "basis": [list(b) for b in basis],
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
        for p in relaxation.complicating.tolist():
            for part, factor in _box_factors(p):
                table.add((*label, part), _times(terms, factor))
    return table


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


# ---------------------------------------------------------------- numbers and terms as they are written


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
