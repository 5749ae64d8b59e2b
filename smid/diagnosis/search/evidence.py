r"""The merit of a set of effects: the log evidence of the record, every sample predicted by a fit that may not see it.

    merit(S) = sum over samples of log p(sample | fit without its block)
               - 1/2 log det(I + D H D)            (Occam's factor)
               - log(number of sets of that size)  - log(number of variants)

The first line is the predictive density of the blocks of `Record.folds`; samples that are never left out count by the
fit of all.  A fit without a block is a step of Gauss and Newton from the fit of all samples.  H is the information of
the record about the fitted numbers and D their deviations before the record was seen: those of the box for an effect's
parameters, the information of one sample for all other numbers.  All sets share one noise model.

References: MacKay, Neural Computation 4 (1992) 415-447 (evidence, Occam's factor); Kass and Wasserman, Journal of the
American Statistical Association 90 (1995) 928-934 (the information of one sample as prior); Geisser and Eddy, ibid. 74
(1979) 153-160 (predictive density of what was left out).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from relaxations.algebra.arrays import Array, Mask
from smid.diagnosis.search.noise_model import NoiseModel, log_density, noise_model, weights
from smid.diagnosis.search.record import FOLDS, Record
from smid.fitting.fit import Errors, Fit, Fitting

_POLISHING = 4
_WORTH = 0.1  # nats
_SHORTEST = 1 / 16


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
        Shape (n_free,). The fitted numbers, likeliest under the noise model, and their deviations.
    """

    value: float
    occam: float
    vector: Array
    deviation: Array


@dataclass(frozen=True, eq=False)
class _Whitened:
    """Innovations with their derivatives, and the block of each."""

    innovations: Array
    slopes: Array
    folds: Array
    scale: float  # log of the derivative of all innovations by the errors


def _whitened(record: Record, noise: NoiseModel, errors: Errors) -> _Whitened:
    counted = record.counted(noise.past)
    innovations, slopes, folds, scale = [], [], [], 0.0
    for e, channel, error, slope in errors:
        kept = counted[e][: len(error)]
        innovations.append(noise.innovations(channel, error)[kept])
        slopes.append(noise.innovations(channel, slope)[kept])
        folds.append(record.folds[e][: len(error)][kept])
        scale += float(kept.sum() * np.log(noise.taps[channel][0]))
    return _Whitened(np.concatenate(innovations), np.concatenate(slopes), np.concatenate(folds), scale)


def bound_of_evidence(record: Record, noise: NoiseModel, errors: Errors, boxes: Mapping[int, float]) -> float:
    """Return the log evidence with no block left out: all but an upper bound of `evidence`, without a simulation.

    Parameters
    ----------
    boxes
        Width of the box of each number that belongs to an effect, by its place among the fitted numbers.
    """
    seen = _whitened(record, noise, errors)
    if not (np.isfinite(seen.innovations).all() and np.isfinite(seen.slopes).all()):
        return -np.inf
    before, information = _information(seen, boxes)
    return seen.scale + float(np.sum(log_density(seen.innovations))) - _occam(_updated(information, before))


def _updated(information: Array, before: Array) -> Array:
    """Return the information of prior and record, in units of the deviations before the record was seen."""
    return np.asarray(np.eye(len(before)) + before[:, None] * information * before)


def _occam(updated: Array) -> float:
    return 0.5 * float(np.linalg.slogdet(updated)[1])


def _information(seen: _Whitened, boxes: Mapping[int, float]) -> tuple[Array, Array]:
    """Return the deviations before the record was seen, and the information of the record."""
    weighted = weights(seen.innovations)[:, None] * seen.slopes
    information = np.asarray(seen.slopes.T @ weighted)
    diagonal = np.diag(information)
    one_sample = np.sqrt(np.divide(len(seen.innovations), diagonal, out=np.zeros_like(diagonal), where=diagonal > 0))
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
    for left in reversed(range(_POLISHING)):
        seen = _whitened(record, noise, tuple(problem.errors(vector, True)))
        if not (np.isfinite(seen.innovations).all() and np.isfinite(seen.slopes).all()):
            return Evidence(-np.inf, np.inf, vector, np.full(len(vector), np.inf))
        before, information = _information(seen, places)
        if not left:
            break
        everything = np.ones(len(seen.innovations), bool)
        reached, innovations = _step(record, noise, problem, vector, seen, everything, before)
        if np.sum(log_density(innovations)) - np.sum(log_density(seen.innovations)) < _WORTH:
            break
        vector = reached
    likelihood = log_density(seen.innovations)
    for fold in range(FOLDS):
        left_out = seen.folds == fold
        if left_out.any():
            _, innovations = _step(record, noise, problem, vector, seen, ~left_out, before)
            likelihood[left_out] = log_density(innovations[left_out])
    updated = _updated(information, before)
    deviation = before * np.sqrt(np.maximum(np.diag(np.linalg.inv(updated)), 0.0))
    return Evidence(seen.scale + float(np.sum(likelihood)) - _occam(updated), _occam(updated), vector, deviation)


def _step(
    record: Record, noise: NoiseModel, problem: Fitting, vector: Array, seen: _Whitened, kept: Mask, before: Array
) -> tuple[Array, Array]:
    """Return what a step of Gauss and Newton over the kept innovations reaches, with all innovations there.

    The step is halved until the kept innovations are no less likely.
    """
    lower, upper = problem.box
    slopes = seen.slopes[kept] * before
    weighted = weights(seen.innovations[kept])[:, None] * slopes
    normal = slopes.T @ weighted + np.eye(len(before))
    step = -before * np.linalg.solve(normal, weighted.T @ seen.innovations[kept])
    least, share = float(np.sum(log_density(seen.innovations[kept]))), 1.0
    while share > _SHORTEST:
        tried = np.clip(vector + share * step, lower, upper)
        found = _whitened(record, noise, tuple(problem.errors(tried, False))).innovations
        if np.isfinite(found).all() and float(np.sum(log_density(found[kept]))) >= least:
            return tried, found
        share /= 2
    return vector, seen.innovations


def evidence_with_noise_effect(
    record: Record, base: Errors, fit: Fit, errors: Errors, boxes: Mapping[str, float], score_drop: float
) -> Evidence:
    """Return the evidence of a model whose noise has an effect, which takes the place of the noise model.

    Parameters
    ----------
    score_drop
        See `smid.diagnosis.effects.effect.Detection`.
    """
    plain = evidence(record, noise_model(errors, record.used, base), fit, boxes)
    return replace(plain, value=plain.value + score_drop / 2)
