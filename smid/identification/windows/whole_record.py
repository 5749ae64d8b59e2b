"""Verify that parameters fit every sample of a record, in one pass over it.

The noises of a simulated run solve the model's equations up to rounding. With the parameters as they are, the exact
noises differ from them by ``d``, where ``C d = -r``: r is what the equations leave, enclosed in ball arithmetic, and C
is the model's own recursion, with constant coefficients. For any finite sequence G with ``C G = I + E`` and the norm of
E below 1, each noise differs by at most ``sum |G| max |r| / (1 - |E|)``: the inverse of ``I + E`` is a Neumann series.
Nothing else is asked of G, so it is computed in floats.

Reference: Rump, Verification methods: rigorous results using floating-point arithmetic, Acta Numerica 19 (2010).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import sympy

from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import Balls
from smid.data import Dataset
from smid.feasible.template import Template, Templates, Term

_LONGEST = 200_000  # samples of an impulse response
_FADED = 1e-20
_UP = 1.0 + 1e-9  # covers the rounding of a sum of floats, and of what is done with it


@dataclass(frozen=True, eq=False)
class _Equations:
    """The equations of one signal from a sample on, and the coefficients of their terms without noise."""

    template: Template
    first: int
    known: tuple[tuple[Term, Balls], ...]


class WholeRecord:
    """Verifies runs of a model over a record. The coefficients of the equations are computed once.

    Parameters
    ----------
    templates
        With :func:`suits`.
    """

    def __init__(self, templates: Templates, data: Dataset) -> None:
        self.templates, self.data = templates, data
        self._noises = {m.signal: m for m in templates.model.measurements if m.noise is not None}
        self._equations = [self._of(run.values) for run in data.experiments]

    def holds(
        self, values: Mapping[str, float], simulated: Sequence[Mapping[str, Array]], bounds: Mapping[str, float]
    ) -> bool:
        """Return whether parameters are proven to fit all samples within noise bounds, given a run with them."""
        reached = self.least_bounds(values, simulated)
        return all(reached[channel] <= bound for channel, bound in bounds.items())

    def least_bounds(self, values: Mapping[str, float], simulated: Sequence[Mapping[str, Array]]) -> dict[str, float]:
        """Return noise bounds of the output channels with which parameters are proven to fit all samples.

        They are infinite where nothing is proven, or where a prior does not hold.

        Parameters
        ----------
        values
            Of every parameter.
        simulated
            Shape (n,). Per experiment, the output channels of the run.
        """
        reached = {m.channel: 0.0 if _fits_priors(self.templates, values) else np.inf for m in self._noises.values()}
        for run, found, equations in zip(self.data.experiments, simulated, self._equations, strict=True):
            for e in equations:
                channel = self._noises[e.template.signal].channel
                missing = np.isnan(run.values[channel])
                noise = np.where(missing, 0.0, run.values[channel]) - found[channel]
                largest = float(np.abs(noise[~missing]).max(initial=0.0))
                reached[channel] = max(
                    reached[channel], float(np.nextafter(largest + _reach(e, values, noise), np.inf))
                )
        return reached

    def _of(self, samples: Mapping[str, Array]) -> list[_Equations]:
        values = {name: np.where(np.isnan(column), 0.0, column) for name, column in samples.items()}
        n, found = len(next(iter(values.values()))), []
        for template in self.templates.lines:
            times = np.arange(template.max_lag, n)
            known = [(term, term.coefficients(values, times)) for term in template.terms if not term.latents]
            found.append(_Equations(template, template.max_lag, tuple(known)))
        return found


def suits(templates: Templates) -> bool:
    """Return whether every line is a recursion of its own output's noise, with coefficients that do not vary."""
    noises = {m.signal: m.noise for m in templates.model.measurements if m.noise is not None}
    return (
        not templates.hinges
        and len(templates.lines) == len(noises)
        and all(
            line.signal in noises
            and all(
                len(term.latents) <= 1
                and all(latent == noises[line.signal] and _is_constant(term) for latent, _ in term.latents)
                for term in line.terms
            )
            for line in templates.lines
        )
    )


def _is_constant(term: Term) -> bool:
    return all(not powers for _, powers in term.data)


def _fits_priors(templates: Templates, values: Mapping[str, float]) -> bool:
    """Return whether parameters lie in their boxes and fulfil the constraints, in exact arithmetic."""
    exact = {p.symbol: sympy.Rational(Fraction(values[p.name])) for p in templates.model.parameters}
    return all(p.lower <= values[p.name] <= p.upper for p in templates.model.parameters) and all(
        bool(constraint.xreplace(exact) >= 0) for constraint in templates.model.constraints
    )


def _reach(e: _Equations, values: Mapping[str, float], noise: Array) -> float:
    """Return how far exact noises lie from given ones at most; infinite where nothing is proven."""
    recursion: dict[int, Balls] = {}
    for term in e.template.terms:
        for _, lag in term.latents:
            constant = sum((factor for factor, _ in term.data), start=Fraction(0))
            own = _product(term, values) * Balls.enclose(constant)
            recursion[lag] = recursion[lag] + own if lag in recursion else own
    # What the equations leave.
    n = len(noise) - e.first
    left = Balls.exact(np.zeros(n))
    for term, coefficients in e.known:
        left = left + _product(term, values) * coefficients
    for lag, coefficient in recursion.items():
        left = left + coefficient * Balls.exact(noise[e.first - lag : len(noise) - lag])
    # An approximate inverse of the recursion, and how good it is.
    impulse = _impulse_response({lag: float(c.mid) for lag, c in recursion.items()})
    if impulse is None:
        return np.inf
    padded = np.concatenate([impulse, np.zeros(max(recursion) + 1)])
    defect = Balls.exact(-np.eye(1, len(padded))[0])
    for lag, coefficient in recursion.items():
        shifted = np.concatenate([np.zeros(lag), padded[: len(padded) - lag]])
        defect = defect + coefficient * Balls.exact(shifted)
    size = float(np.sum(defect.magnitude())) * _UP
    if not size < 0.5:
        return np.inf
    return float(np.sum(np.abs(impulse)) * np.max(left.magnitude(), initial=0.0) / (1 - size)) * _UP


def _product(term: Term, values: Mapping[str, float]) -> Balls:
    """Return the product of a term's parameters."""
    product = Balls.exact(1.0)
    for name in term.parameters:
        product = product * Balls.exact(values[name])
    return product


def _impulse_response(recursion: Mapping[int, float]) -> Array | None:
    """Return the first samples of one over a recursion, until they have faded; None where they do not."""
    depth, found = max(recursion), [0.0]
    if not recursion.get(0):
        return None
    past = [-recursion.get(lag, 0.0) / recursion[0] for lag in range(1, depth + 1)]
    found = [1.0 / recursion[0]]
    recent = [found[0], *[0.0] * (depth - 1)][:depth]
    while len(found) < _LONGEST:
        if not max(map(abs, recent), default=0.0) > _FADED * abs(found[0]):
            return np.array(found)
        new = sum(a * b for a, b in zip(past, recent, strict=True))
        found.append(new)
        recent = [new, *recent[:-1]]
    return None
