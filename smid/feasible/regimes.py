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
from relaxations.algebra.polynomial import Polynomials
from relaxations.algebra.value_ranges import value_ranges
from smid.feasible.piecewise_functions import Kind
from smid.feasible.template import Hinge, Reference, Template, Term


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
    """Enclose each polynomial of a family over a box, which may be infinite."""
    return Ranges(*value_ranges(family, lower, upper))
