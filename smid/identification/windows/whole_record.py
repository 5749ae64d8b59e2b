"""Verify that parameters fit every sample of a record, in one pass over it.

Given noises solve the model's equations up to rounding. With the parameters and the noises of the inputs as they are,
the exact noises of an output differ from the given ones by ``d``, where ``C d = -r``: r is what the equations leave,
enclosed in ball arithmetic, and C is the model's own recursion. For any finite sequence G with ``G C = I + E`` and the
norm of E below 1, each noise differs by at most ``sum |G| max |r| / (1 - |E|)``: the inverse of ``I + E`` is a Neumann
series. Nothing else is asked of G, so it is computed in floats, for the middle of coefficients that vary with the data
(linear parameter-varying models); how far they are from it counts in E.

Reference: Rump, Verification methods: rigorous results using floating-point arithmetic, Acta Numerica 19 (2010).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
import sympy

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.ball_arithmetic import Balls
from smid.data import Dataset
from smid.feasible.piecewise_functions import Kind
from smid.feasible.template import Template, Templates, Term

_LONGEST = 200_000  # samples of an impulse response
_FADED = 1e-20
_LARGEST = 0.99  # norm of the defect of an inverse
_UP = 1.0 + 1e-9  # covers the rounding of a sum of floats, and of what is done with it


Noises = Mapping[str, Array]
"""Of each noisy channel, shape (n,): measurement minus truth. Where an output is missing, minus the truth."""


@dataclass(frozen=True, eq=False)
class Equations:
    """The equations of one output from a sample on, with the coefficients of their terms.

    Parameters
    ----------
    own
        The output's noise, and its terms; ``known`` are the others.
    """

    template: Template
    own: str
    first: int
    recursive: tuple[tuple[Term, Balls], ...]
    known: tuple[tuple[Term, Balls], ...]

    def recursion(self, values: Mapping[str, float]) -> dict[int, Balls]:
        """Return the coefficient of the output's own noise at each lag: a number, or one for each sample."""
        found: dict[int, Balls] = {}
        for term, coefficient in self.recursive:
            lag, factor = dict(term.latents)[self.own], product(term, values) * coefficient
            found[lag] = found[lag] + factor if lag in found else factor
        return found

    def at(self, values: Mapping[str, float]) -> tuple[Array, dict[tuple[str, int], Array]]:
        """Return the equations at some parameters in floats: their constants, and the factors of each noise and lag."""
        constant, factors = (
            np.zeros(()),
            {(self.own, lag): np.asarray(factor.mid) for lag, factor in self.recursion(values).items()},
        )
        for term, coefficients in self.known:
            part = float(product(term, values).mid) * coefficients.mid
            if term.latents:
                factors[term.latents[0]] = factors.get(term.latents[0], np.zeros(())) + part
            else:
                constant = constant + part
        return constant, factors


@dataclass(frozen=True, eq=False)
class _Kink:
    """A kink of data and parameters, from a sample on: its argument as terms with their coefficients."""

    name: str
    sign: bool
    first: int
    argument: tuple[tuple[Term, Balls], ...]


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
        self._channels = {m.noise: m.channel for m in self._noises.values()}
        self.equations = [self._of(run.values) for run in data.experiments]
        self._kinks = [self._kinks_of(run.values) for run in data.experiments]

    def noises(self, simulated: Sequence[Mapping[str, Array]]) -> list[dict[str, Array]]:
        """Return the noises with which the outputs are those of a simulation, per experiment."""
        outputs = [self._noises[line.signal].channel for line in self.templates.lines]
        return [
            {channel: np.nan_to_num(run.values[channel]) - found[channel] for channel in outputs}
            for run, found in zip(self.data.experiments, simulated, strict=True)
        ]

    def holds(self, values: Mapping[str, float], noises: Sequence[Noises], bounds: Mapping[str, float]) -> bool:
        """Return whether parameters are proven to fit all samples within noise bounds, given noises with them."""
        reached = self.least_bounds(values, noises)
        return all(reached[channel] <= bound for channel, bound in bounds.items())

    def least_bounds(self, values: Mapping[str, float], noises: Sequence[Noises]) -> dict[str, float]:
        """Return noise bounds of the channels with which parameters are proven to fit all samples.

        They are infinite where nothing is proven, or where a prior does not hold.

        Parameters
        ----------
        values
            Of every parameter.
        noises
            Per experiment. They solve the equations up to rounding.
        """
        fits = _fits_priors(self.templates, values)
        reached = dict.fromkeys(self._channels.values(), 0.0 if fits else np.inf)
        for run, found, equations, kinks in zip(
            self.data.experiments, noises, self.equations, self._kinks, strict=True
        ):
            known = _values_of(kinks, values, run.n_samples)
            reaches = {self._noises[e.template.signal].channel: self._reach(e, values, found, known) for e in equations}
            for channel, noise in found.items():
                largest = float(np.abs(noise[~np.isnan(run.values[channel])]).max(initial=0.0))
                beyond = reaches.get(channel)
                least = largest if beyond is None else float(np.nextafter(largest + beyond, np.inf))
                reached[channel] = max(reached[channel], least)
        return reached

    def _of(self, samples: Mapping[str, Array]) -> list[Equations]:
        values = {name: np.nan_to_num(column) for name, column in samples.items()}
        n, found = len(next(iter(values.values()))), []
        for template in self.templates.lines:
            times, own = np.arange(template.max_lag, n), self._noises[template.signal].noise
            assert own is not None
            terms = [(term, own in dict(term.latents)) for term in template.terms]
            recursive = [(term, _coefficients(term, values, times)) for term, is_own in terms if is_own]
            known = [(term, term.coefficients(values, times)) for term, is_own in terms if not is_own]
            found.append(Equations(template, own, template.max_lag, tuple(recursive), tuple(known)))
        return found

    def _kinks_of(self, samples: Mapping[str, Array]) -> list[_Kink]:
        values, found = {name: np.nan_to_num(column) for name, column in samples.items()}, []
        for name, hinge in self.templates.hinges.items():
            first = hinge.argument.max_lag
            times = np.arange(first, len(next(iter(values.values()))))
            terms = tuple((term, term.coefficients(values, times)) for term in hinge.argument.terms)
            found.append(_Kink(name, hinge.kink.kind is Kind.SIGN, first, terms))
        return found

    def _reach(self, e: Equations, values: Mapping[str, float], noises: Noises, kinks: Mapping[str, Balls]) -> float:
        """Return how far an output's exact noises lie from given ones at most; infinite where nothing is proven."""
        own = self._noises[e.template.signal]
        recursion = e.recursion(values)
        # What the equations leave.
        noise = noises[own.channel]
        n = len(noise) - e.first

        def at(channel: str, lag: int) -> Balls:
            return Balls.exact(noises[channel][e.first - lag : e.first - lag + n])

        left = Balls.exact(np.zeros(n))
        for term, coefficients in e.known:
            part = product(term, values) * coefficients
            for latent, lag in term.latents:
                part = part * (
                    _from(kinks[latent], e.first - lag, n) if latent in kinks else at(self._channels[latent], lag)
                )
            left = left + part
        for lag, coefficient in recursion.items():
            left = left + coefficient * at(own.channel, lag)
        # An approximate inverse of the recursion with coefficients in the middle of theirs, and how good it is.
        middle = {lag: 0.5 * float(c.mid.min()) + 0.5 * float(c.mid.max()) for lag, c in recursion.items()}
        impulse = _impulse_response(middle)
        if impulse is None:
            return np.inf
        padded = np.concatenate([impulse, np.zeros(max(recursion) + 1)])
        defect = Balls.exact(-np.eye(1, len(padded))[0])
        varies = np.zeros(())
        for lag, coefficient in recursion.items():
            shifted = np.concatenate([np.zeros(lag), padded[: len(padded) - lag]])
            defect = defect + Balls.exact(middle[lag]) * Balls.exact(shifted)
            varies = varies + (coefficient - Balls.exact(middle[lag])).magnitude()
        gain = float(np.sum(np.abs(impulse)))
        size = (float(np.sum(defect.magnitude())) + gain * float(np.max(varies))) * _UP
        if not size < _LARGEST:
            return np.inf
        return float(gain * np.max(left.magnitude(), initial=0.0) / (1 - size)) * _UP


def suits(templates: Templates) -> bool:
    """Return whether every line is a recursion of its own output's noise, whose coefficients may vary with the data.

    The noises of inputs may enter linearly. Where no input is noisy, kinks of data and parameters may enter.
    """
    noises = {m.signal: m.noise for m in templates.model.measurements if m.noise is not None}
    outputs = {line.signal for line in templates.lines}
    inputs = {noise for name, noise in noises.items() if name not in outputs}
    kinks = templates.hinges
    arguments = [term for hinge in kinks.values() for term in hinge.argument.terms]
    return (
        outputs <= noises.keys()
        and not (kinks and inputs)
        and not any(hinge.kink.constant for hinge in kinks.values())
        and all(latent in kinks for term in arguments for latent, _ in term.latents)
        and all(
            all(latent in kinks for latent, _ in term.latents)
            or (len(term.latents) == 1 and term.latents[0][0] in {*inputs, noises[line.signal]})
            for line in templates.lines
            for term in line.terms
        )
    )


def _values_of(kinks: Sequence[_Kink], values: Mapping[str, float], n: int) -> dict[str, Balls]:
    """Return the value of each kink at each sample; zero before its first one."""
    found: dict[str, Balls] = {}
    for kink in kinks:
        count = n - kink.first
        argument = Balls.exact(np.zeros(count))
        for term, coefficients in kink.argument:
            part = product(term, values) * coefficients
            for latent, lag in term.latents:
                part = part * _from(found[latent], kink.first - lag, count)
            argument = argument + part
        own, before = argument.sign() if kink.sign else argument.positive_part(), np.zeros(kink.first)
        found[kink.name] = Balls(np.concatenate([before, own.mid]), np.concatenate([before, own.rad]))
    return found


def _from(samples: Balls, first: int, count: int) -> Balls:
    return Balls(samples.mid[first : first + count], samples.rad[first : first + count])


def _coefficients(term: Term, values: Mapping[str, Array], times: Index) -> Balls:
    """Return the coefficient at each of some times; a single number for a term that reads no data."""
    if any(powers for _, powers in term.data):
        return term.coefficients(values, times)
    return Balls.enclose(sum((factor for factor, _ in term.data), start=Fraction(0)))


def _fits_priors(templates: Templates, values: Mapping[str, float]) -> bool:
    """Return whether parameters lie in their boxes and fulfil the constraints, in exact arithmetic."""
    exact = {p.symbol: sympy.Rational(Fraction(values[p.name])) for p in templates.model.parameters}
    return all(p.lower <= values[p.name] <= p.upper for p in templates.model.parameters) and all(
        bool(constraint.xreplace(exact) >= 0) for constraint in templates.model.constraints
    )


def product(term: Term, values: Mapping[str, float]) -> Balls:
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
