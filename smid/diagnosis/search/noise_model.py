r"""One model of the output noise, under which all sets of effects are compared.

The noise belongs to the record, not to the candidate: with a noise model of its own, what a candidate fails to explain
would pass as coloured noise.  It is an autoregression :math:`A(q) v_t = \sigma e_t` for each output channel, with
innovations e of a Student distribution of ten degrees of freedom, so that no single sample decides
(Lange, Little and Taylor, Journal of the American Statistical Association 84, 1989).

A law is right to a few per cent only. What it leaves of an effect is no noise, and no sign of another effect either. So
the noise has a second part, the *discrepancy*: it has the autocovariance of the base model's error, times
`DISCREPANCY` squared, or less where the best set leaves less (Kennedy and O'Hagan, Journal of the Royal Statistical
Society B 63, 2001).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from relaxations.algebra.arrays import Array, Mask
from smid.diagnosis.evidence.autoregression import LARGEST_ORDER, autocovariance, levinson
from smid.diagnosis.search.record import bridged
from smid.diagnosis.search.student import weights
from smid.diagnosis.search.within_bound import WithinBound
from smid.fitting.problem import Errors

DISCREPANCY = 0.1
"""What laws that are only nearly right may leave of the error of the base model, as a share of it."""

_ITERATIONS = 20
_LEAST = 1e-9  # deviation of the innovations, as a share of the largest residual


@dataclass(frozen=True, eq=False)
class NoiseModel:
    """The noise of each output channel.

    Parameters
    ----------
    taps
        Per channel, A divided by the deviation: applied to a residual, they give innovations of deviation one.
    price
        Nats that its coefficients cost, by Schwarz's criterion, and its errors beyond a noise bound.
    within
        Per channel with a noise bound.
    """

    taps: Mapping[str, Array]
    price: float = 0.0
    within: Mapping[str, WithinBound] = field(default_factory=dict)

    def innovations(self, channel: str, errors: Array) -> Array:
        """Return the innovations of errors from the first one on, shape (n, ...), in the channel's unit."""
        *first, taps = _predictors(self.taps[channel])
        result = np.zeros_like(errors)
        for lag, tap in enumerate(taps):
            result[lag:] += tap * errors[: len(errors) - lag]
        for k, few in enumerate(first[: len(errors)]):
            result[k] = np.tensordot(few, errors[k::-1], 1)
        return result

    def deviations(self, channel: str, n: int) -> Array:
        """Return the deviation of each of the first n errors from what those before it tell, shape (n,)."""
        *first, taps = (1.0 / few[0] for few in _predictors(self.taps[channel]))
        return np.asarray([*first, *[taps] * n])[:n]


def noise_model(errors: Errors, used: Sequence[Mask], base: Errors = ()) -> NoiseModel:
    """Return the noise model that errors of free runs tell.

    Parameters
    ----------
    errors
        Of the fit that explains most, see `smid.fitting.problem.Fitting.errors`.
    used
        Shape (n,). Per experiment, the samples that count; the others are bridged.
    base
        Errors of the base model, a share of which is the discrepancy; without them there is none.
    """
    left, missed = _bridged(errors, used), _bridged(base, used)
    taps = {channel: _taps(parts, missed.get(channel, [])) for channel, parts in left.items()}
    price = sum(0.5 * len(taps[c]) * np.log(sum(int(m.sum()) for _, m in parts)) for c, parts in left.items())
    return NoiseModel(taps, float(price))


def _predictors(taps: Array) -> list[Array]:
    """Return the taps for the first errors, of which few are known before, and for all others.

    Levinson's recursion backwards: those of each smaller order, in the same units.
    """
    found = [taps]
    while len(found[0]) > 1:
        coefficients, deviation = found[0] / found[0][0], 1.0 / found[0][0]
        reflection = coefficients[-1]
        left = 1.0 - reflection**2
        fewer = (coefficients - reflection * coefficients[::-1])[:-1] / left
        found.insert(0, fewer / (deviation / np.sqrt(left)))
    return found


_Bridged = list[tuple[Array, Mask]]


def _bridged(errors: Errors, used: Sequence[Mask]) -> dict[str, _Bridged]:
    """Return the errors of each channel, with lines across the samples that do not count, and which count."""
    parts: dict[str, _Bridged] = {}
    for e, channel, error, _ in errors:
        mask = used[e][: len(error)]
        parts.setdefault(channel, []).append((bridged(error, mask), mask))
    return parts


def _taps(left: _Bridged, missed: _Bridged) -> Array:
    n = sum(error.size for error, _ in left)
    noise = levinson(own := _autocovariance(left), n)
    whole = levinson(own + _discrepancy(own, missed), n) if missed else noise
    past = noise.coefficients.size - 1
    innovations = np.concatenate([noise.whiten(error)[mask[past:]] for error, mask in left])
    least = _LEAST * max(float(np.abs(error).max()) for error, _ in left) or 1.0
    # Likeliest deviation of the Student distribution, by reweighting.
    deviation = max(float(np.sqrt(np.mean(innovations**2))), least)
    for _ in range(_ITERATIONS):
        deviation = max(float(np.sqrt(np.mean(weights(innovations / deviation) * innovations**2))), least)
    grown = np.sqrt(whole.innovation / noise.innovation) if noise.innovation > 0 else 1.0
    return np.asarray(whole.coefficients / (deviation * grown))


def _discrepancy(own: Array, missed: _Bridged) -> Array:
    """Return the autocovariance of what laws may leave, which is no more than the best set leaves."""
    base = _autocovariance(missed)
    return np.asarray(base * min(DISCREPANCY**2, own[0] / base[0])) if base[0] > 0 else 0 * base


def _autocovariance(parts: _Bridged) -> Array:
    """Return the autocovariance of errors whose mean ought to be zero."""
    n, lags = sum(e.size for e, _ in parts), min(LARGEST_ORDER, min(e.size for e, _ in parts) // 10)
    return sum((autocovariance(e, lags, 0.0) * (e.size / n) for e, _ in parts), np.zeros(lags + 1))
