"""Regimes: the form of a template where the side of zero of each kink's argument is known.

Where x >= 0 the positive part of x is x itself; where x <= 0 it is zero. A sign is +1 or -1. With these values the
template is a polynomial without the kink. A kink whose side is not known is *open* and stays in the template as a
latent.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from fractions import Fraction

import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.ball_arithmetic import EPSILON, TINY, outwards
from relaxations.algebra.polynomial import Polynomials
from smid.feasible.piecewise_functions import Kind
from smid.feasible.template import Hinge, Reference, Template, Term

NEAR = 1e-9  # an end of a range this close to zero, of all that was added up, is computed again as a fraction


class Side(IntEnum):
    """On which side of zero an argument lies."""

    NEGATIVE = -1
    OPEN = 0
    POSITIVE = 1


@dataclass(frozen=True)
class Ranges:
    """Enclosures of many polynomials over a box: arrays of shape (n,)."""

    low: Array
    high: Array

    def sides(self, kind: Kind) -> Index:
        """Return the :class:`Side` of each argument; a sign at zero is open."""
        above, below = (self.low >= 0, self.high <= 0) if kind is Kind.POSITIVE_PART else (self.low > 0, self.high < 0)
        return np.where(above, Side.POSITIVE, np.where(below, Side.NEGATIVE, Side.OPEN)).astype(np.int64)


def readings(template: Template, hinges: Mapping[str, Hinge]) -> frozenset[Reference]:
    """Return all latents and kinks that a template reads, directly or through the arguments of its kinks.

    A kink that does not depend on time has lag zero.
    """
    found: set[Reference] = set()
    pending = [template]
    shifts = [0]
    while pending:
        part, shift = pending.pop(), shifts.pop()
        own = {(name, lag + shift) for name, lag in part.latents}
        own |= {(name, 0) for term in part.terms for name in term.parameters if name in hinges}
        for name, lag in own - found:
            if name in hinges:
                pending.append(hinges[name].argument)
                shifts.append(lag)
        found |= own
    return frozenset(found)


def resolved(template: Template, hinges: Mapping[str, Hinge], sides: Mapping[Reference, int]) -> Template:
    """Return a template with the known sides of its kinks put in.

    ``sides`` holds every kink that the template reads, directly or not.
    """
    collected: dict[tuple[tuple[str, ...], tuple[Reference, ...]], dict[tuple[tuple[str, int, int], ...], Fraction]]
    collected = {}
    pending = list(template.terms)
    while pending:
        term = pending.pop()
        known = _known_kink(term, hinges, sides)
        if known is None:
            data = collected.setdefault((tuple(sorted(term.parameters)), tuple(sorted(term.latents))), {})
            for factor, powers in term.data:
                data[powers] = data.get(powers, Fraction(0)) + factor
            continue
        name, lag = known
        rest = _without(term, name, lag, hinges[name].kink.constant)
        side = sides[known]
        if hinges[name].kink.kind is Kind.SIGN:
            pending.append(Term(rest.parameters, rest.latents, tuple((side * f, p) for f, p in rest.data)))
        elif side == Side.POSITIVE:
            pending += [_product(rest, other, lag) for other in hinges[name].argument.terms]
    terms = []
    for (parameters, latents), data in collected.items():
        kept = tuple((factor, powers) for powers, factor in data.items() if factor)
        if kept:
            terms.append(Term(parameters, latents, kept))
    return Template(template.signal, tuple(terms), template.max_lag, template.defines)


def _known_kink(term: Term, hinges: Mapping[str, Hinge], sides: Mapping[Reference, int]) -> Reference | None:
    candidates = [*term.latents, *((name, 0) for name in term.parameters)]
    return next((c for c in candidates if c[0] in hinges and sides[c] != Side.OPEN), None)


def _without(term: Term, name: str, lag: int, constant: bool) -> Term:
    parameters, latents = list(term.parameters), list(term.latents)
    if constant:
        parameters.remove(name)
    else:
        latents.remove((name, lag))
    return Term(tuple(parameters), tuple(latents), term.data)


def _product(term: Term, other: Term, shift: int) -> Term:
    """Return the product of a term and another term that is read ``shift`` samples earlier."""
    data = []
    for f, p in term.data:
        for g, q in other.data:
            powers: dict[tuple[str, int], int] = {}
            for channel, lag, power in (*p, *((c, lag + shift, e) for c, lag, e in q)):
                powers[channel, lag] = powers.get((channel, lag), 0) + power
            data.append((f * g, tuple((c, lag, e) for (c, lag), e in sorted(powers.items()))))
    latents = (*term.latents, *((name, lag + shift) for name, lag in other.latents))
    return Term((*term.parameters, *other.parameters), latents, tuple(data))


def ranges(family: Polynomials, lower: Array, upper: Array) -> Ranges:
    """Enclose each polynomial of a family over a box, in interval arithmetic rounded outwards.

    An end next to zero is computed again with fractions, so that rounding does not blur a threshold at the value of a
    sample. The box may be infinite.

    Examples
    --------
    >>> member = Polynomials.from_terms([{(0,): 1.0, (): -0.5}])
    >>> ranges(member, np.array([0.5]), np.array([2.0])).low
    array([0.])
    """
    coefficients = family.coefficients
    exact = coefficients.rad == 0
    low = np.where(exact, coefficients.mid, coefficients.lower)
    high = np.where(exact, coefficients.mid, coefficients.upper)
    for column in family.factors.T:
        real = column >= 0
        with np.errstate(invalid="ignore"):
            ends = np.stack([a * b[column] for a in (low, high) for b in (lower, upper)])
        ends = np.where(np.isnan(ends), 0.0, ends)  # zero times an infinite end: the other factor is zero
        low = np.where(real, np.nextafter(ends.min(axis=0), -np.inf), low)
        high = np.where(real, np.nextafter(ends.max(axis=0), np.inf), high)
    finite = [np.where(np.isfinite(v), np.abs(v), 0.0) for v in (low, high)]
    size = np.bincount(family.rows, np.maximum(*finite), family.n_rows)
    slack = size * EPSILON * (np.bincount(family.rows, minlength=family.n_rows) + 2)
    total = [np.bincount(family.rows, v, family.n_rows) for v in (low, high)]
    below, above = np.nextafter(total[0] - slack, -np.inf), np.nextafter(total[1] + slack, np.inf)
    close = np.maximum(NEAR * size, TINY)
    near = (np.abs(below) <= close) | (np.abs(above) <= close)
    loose = ~np.isfinite(np.where(family.factors >= 0, (upper - lower)[family.factors], 0.0)).all(axis=1)
    no_fractions = np.bincount(family.rows[loose & (coefficients.magnitude() > 0)], minlength=family.n_rows) > 0
    doubtful = np.flatnonzero(near & np.isfinite(below) & np.isfinite(above) & ~no_fractions)
    if len(doubtful):
        below[doubtful], above[doubtful] = _exact_ranges(family.take(doubtful), lower, upper)
    return Ranges(below, above)


def _exact_ranges(family: Polynomials, lower: Array, upper: Array) -> tuple[Array, Array]:
    low, high = ([Fraction(0)] * family.n_rows for _ in range(2))
    for row, mid, rad, factor in zip(
        family.rows.tolist(),
        family.coefficients.mid.tolist(),
        family.coefficients.rad.tolist(),
        family.factors.tolist(),
        strict=True,
    ):
        ends = (Fraction(mid) - Fraction(rad), Fraction(mid) + Fraction(rad))
        for v in factor:
            if v >= 0 and any(ends):
                products = [a * b for a in ends for b in (Fraction(float(lower[v])), Fraction(float(upper[v])))]
                ends = (min(products), max(products))
        low[row] += ends[0]
        high[row] += ends[1]
    return np.array([outwards(v, -1) for v in low]), np.array([outwards(v, 1) for v in high])
