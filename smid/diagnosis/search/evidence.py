r"""The merit of a set of effects: the log evidence of the record, every sample predicted by a fit that may not see it.

    merit(S) = sum over samples of log p(sample | fit without its block)
               - 1/2 log det(I + D H D)            (Occam's factor)
               - log(number of sets of that size)  - log(number of variants)

The first line is the predictive density of the blocks of `Record.folds`; samples that are never left out count by the
fit of all.  A fit without a block is a step of Gauss and Newton from the fit of all samples.  H is the information of
the record about the fitted numbers and D their deviations before the record was seen: those of the box for an effect's
parameters, the information of one sample for all other numbers.  All sets share one noise model, of which a noise bound
is a part (`smid.diagnosis.search.within_bound`).

References: MacKay, Neural Computation 4 (1992) 415-447 (evidence, Occam's factor); Kass and Wasserman, Journal of the
American Statistical Association 90 (1995) 928-934 (the information of one sample as prior); Geisser and Eddy, ibid. 74
(1979) 153-160 (predictive density of what was left out).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from relaxations.algebra.arrays import Array, Mask
from smid.diagnosis.search.compare import rms
from smid.diagnosis.search.noise_model import DISCREPANCY, NoiseModel, noise_model
from smid.diagnosis.search.record import FOLDS, Record
from smid.diagnosis.search.student import log_density, weights
from smid.diagnosis.search.within_bound import OFF, WithinBound
from smid.fitting.problem import Errors, Fit, Fitting

_POLISHING = 4
_WORTH = 0.1  # nats
_BLURS = 8  # each twice the one before
_DAMPING = (0.0, 0.1, 1.0, 10.0, 100.0)  # shares of the information


@dataclass(frozen=True, eq=False)
class Evidence:
    """What the record says about a fitted model.

    Parameters
    ----------
    value
        Log evidence in nats, up to a constant that all models share.
    occam
        Occam's factor in it, in nats.
    vector, deviation
        Shape (n_free,). The fitted numbers, likeliest under the noise model, and their deviations without noise bound.
    """

    value: float
    occam: float
    vector: Array
    deviation: Array


@dataclass(frozen=True, eq=False)
class _Part:
    """The errors of an experiment and channel that count, under a noise model."""

    errors: Array
    innovations: Array
    raw: Array  # derivatives of the errors by the fitted numbers, shape (n, n_free)
    slopes: Array  # the same of the innovations
    folds: Array
    deviations: Array  # of the innovations, in the channel's unit
    within: WithinBound | None

    @cached_property
    def likelihood(self) -> Array:
        """Log density of each error, shape (n,)."""
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # a step may lead to a run that diverges
            plain = log_density(self.innovations) - np.log(self.deviations)
            if self.within is None:
                return np.asarray(plain)
            expected = self.errors - self.deviations * self.innovations
            return np.asarray(plain + self.within.log_density(self.errors, expected, self.deviations))

    def normal(self, kept: Mask) -> tuple[Array, Array]:
        """Return gradient and information of minus the log likelihood of the kept errors, by Gauss and Newton."""
        weighted = weights(self.innovations[kept])[:, None] * self.slopes[kept]
        gradient, information = weighted.T @ self.innovations[kept], weighted.T @ self.slopes[kept]
        if self.within is not None:
            raw, (first, second) = self.raw[kept], self.within.slopes(self.errors[kept])
            gradient, information = gradient + raw.T @ first, information + raw.T @ (second[:, None] * raw)
        return gradient, information


@dataclass(frozen=True, eq=False)
class _Seen:
    """All errors that count, under a noise model."""

    parts: tuple[_Part, ...]

    @property
    def is_finite(self) -> bool:
        return all(np.isfinite(p.likelihood).all() and np.isfinite(p.slopes).all() for p in self.parts)

    @property
    def count(self) -> int:
        """How many errors there are."""
        return sum(len(p.errors) for p in self.parts)

    def moved(self, step: Array) -> _Seen:
        """Return what is seen after a step of the fitted numbers, in the linear approximation."""
        return _Seen(
            tuple(
                replace(p, errors=p.errors + p.raw @ step, innovations=p.innovations + p.slopes @ step)
                for p in self.parts
            )
        )

    def without_bound(self) -> _Seen:
        """Return what is seen where nothing is known of a noise bound."""
        return _Seen(tuple(replace(p, within=None) for p in self.parts))

    def likelihood(self, without: int | None = None) -> float:
        """Return the log density of all errors, or of those without a block."""
        return float(sum(np.sum(p.likelihood[p.folds != without]) for p in self.parts))

    def of_block(self, fold: int) -> float:
        """Return the log density of the errors in a block."""
        return self.likelihood() - self.likelihood(fold)

    def normal(self, without: int | None = None) -> tuple[Array, Array]:
        """See `_Part.normal`: of all errors, or of those without a block."""
        gradients, informations = zip(*(p.normal(p.folds != without) for p in self.parts), strict=True)
        return np.asarray(sum(gradients)), np.asarray(sum(informations))


def _seen(record: Record, noise: NoiseModel, errors: Errors) -> _Seen:
    parts = []
    for e, channel, error, slope in errors:
        kept, latest = (np.flatnonzero(record.used[e][: len(error)]), record.latest[e][: len(error)])
        if not kept.size:
            continue
        places = kept - kept[0]
        with np.errstate(over="ignore", invalid="ignore"):  # a run may diverge
            innovations, slopes = (noise.innovations(channel, x[latest[kept[0] :]])[places] for x in (error, slope))
        folds, deviations = record.folds[e][kept], noise.deviations(channel, len(error))[places]
        within = noise.within.get(channel)
        parts.append(_Part(error[kept], innovations, slope[kept], slopes, folds, deviations, within))
    return _Seen(tuple(parts))


def bound_of_evidence(record: Record, noise: NoiseModel, errors: Errors, boxes: Mapping[int, float]) -> float:
    """Return the log evidence with no block left out: all but an upper bound of `evidence`, without a simulation.

    Parameters
    ----------
    boxes
        Width of the box of each number that belongs to an effect, by its place among the fitted numbers.
    """
    seen = _seen(record, noise, errors)
    if not seen.is_finite:
        return -np.inf
    before, information = _information(seen, boxes)
    best = seen
    # A fit by least squares may miss the noise bound by little.
    for _ in range(_POLISHING if noise.within else 0):
        last, (_, best) = best, _step(best, best.moved, before)
        if best.likelihood() - last.likelihood() < _WORTH:
            break
    return best.likelihood() - _occam(_updated(information, before))


def _updated(information: Array, before: Array) -> Array:
    """Return the information of prior and record, in units of the deviations before the record was seen."""
    return np.asarray(np.eye(len(before)) + before[:, None] * information * before)


def _occam(updated: Array) -> float:
    return 0.5 * float(np.linalg.slogdet(updated)[1])


def _information(seen: _Seen, boxes: Mapping[int, float]) -> tuple[Array, Array]:
    """Return the deviations before the record was seen, and the information of the record."""
    _, information = seen.normal()
    diagonal = np.diag(information)
    told = diagonal > seen.count * np.finfo(np.float64).tiny  # of less the deviation would overflow
    one_sample = np.sqrt(np.divide(seen.count, diagonal, out=np.zeros_like(diagonal), where=told))
    before = one_sample.copy()
    for place, width in boxes.items():
        if np.isfinite(width):
            before[place] = width / np.sqrt(12.0)
    return before, information


def evidence(record: Record, noise: NoiseModel, fit: Fit, boxes: Mapping[str, float]) -> Evidence:
    """Return the evidence of a fitted model.

    Parameters
    ----------
    boxes
        Width of the box of each parameter that belongs to an effect.
    """
    problem = Fitting(fit.model, record.data, record.used, fit.initial)
    places = {problem.run.parameters.index(name): width for name, width in boxes.items()}
    vector = problem.start(fit.model.values)

    def moved(step: Array) -> Array:
        return np.clip(vector + step, *problem.box)

    def after(step: Array) -> _Seen:
        return _seen(record, noise, tuple(problem.errors(moved(step), False)))

    for left in reversed(range(_POLISHING)):
        seen = _seen(record, noise, tuple(problem.errors(vector, True)))
        if not seen.is_finite:
            return Evidence(-np.inf, np.inf, vector, np.full(len(vector), np.inf))
        before, information = _information(seen, places)
        if not left:
            break
        step, reached = _step(seen, after, before)
        if reached.likelihood() - seen.likelihood() < _WORTH:
            break
        vector = moved(step)
    value = seen.likelihood()
    for fold in range(FOLDS):
        _, reached = _step(seen, after, before, fold)
        value += _blurred(reached, seen, before, fold).of_block(fold) - seen.of_block(fold)
    occam = _occam(_updated(information, before))
    # Laws that are nearly right put the edges of a noise bound in a wrong place: intervals do not rest on them.
    _, plain = seen.without_bound().normal()
    deviation = before * np.sqrt(np.maximum(np.diag(np.linalg.inv(_updated(plain, before))), 0.0))
    return Evidence(value - occam, occam, vector, deviation)


def _blurred(reached: _Seen, seen: _Seen, before: Array, without: int) -> _Seen:
    """Return what is seen where a noise bound is blurred by what numbers that are fitted without a block are off by."""
    if all(p.within is None for p in seen.parts):
        return reached
    _, information = seen.normal(without)
    covariance = before[:, None] * np.linalg.inv(_updated(information, before)) * before
    spreads = [np.sqrt(np.maximum(np.sum(p.raw @ covariance * p.raw, axis=1), 0.0)) for p in seen.parts]
    return _Seen(
        tuple(
            replace(p, within=p.within and replace(p.within, blur=np.hypot(p.within.blur, spread)))
            for p, spread in zip(reached.parts, spreads, strict=True)
        )
    )


def _step(
    seen: _Seen, after: Callable[[Array], _Seen], before: Array, without: int | None = None
) -> tuple[Array, _Seen]:
    """Return a damped step of Gauss and Newton, over all errors or those without a block, and what is seen after it.

    The damping grows until these errors are no less likely (Levenberg, Quarterly of Applied Mathematics 2, 1944).
    """
    gradient, information = seen.normal(without)
    updated, least = _updated(information, before), seen.likelihood(without)
    for damping in _DAMPING:
        step = -before * np.linalg.solve(updated + damping * np.diag(np.diag(updated)), before * gradient)
        reached = after(step)
        if reached.likelihood(without) >= least:
            return step, reached
    return np.zeros_like(step), seen


def noise_of(record: Record, base: Errors, fit: Fit, errors: Errors, boxes: Mapping[str, float]) -> NoiseModel:
    """Return the noise model that the errors of a fit tell, with the blur of the noise bound that predicts best.

    Parameters
    ----------
    base
        Errors of the base model.
    """
    noise, bound = noise_model(errors, record.used, base), record.noise_bound
    if bound is None:
        return noise
    left, missed = (
        rms([error[record.used[e][: len(error)]] for e, channel, error, _ in some if channel == record.output])
        for some in (errors, base)
    )
    discrepancy = DISCREPANCY * missed
    least, usual = (float(np.hypot(OFF * bound, off)) for off in (min(discrepancy, left), discrepancy))
    choices = [
        replace(
            noise,
            within={record.output: WithinBound(bound, blur)},
            price=noise.price + 0.5 * (blur / usual) ** 2,
        )
        for blur in (least * 2.0**k for k in range(_BLURS))
    ]
    return max(choices, key=lambda one: evidence(record, one, fit, boxes).value - one.price)


def evidence_with_noise_effect(
    record: Record, base: Errors, fit: Fit, errors: Errors, boxes: Mapping[str, float], score_drop: float
) -> Evidence:
    """Return the evidence of a model whose noise has an effect, which takes the place of the noise model.

    Parameters
    ----------
    score_drop
        See `smid.diagnosis.effects.effect.Detection`.
    """
    plain = evidence(record, noise_of(record, base, fit, errors, boxes), fit, boxes)
    return replace(plain, value=plain.value + score_drop / 2)
