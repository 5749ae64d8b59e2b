r"""One model of the output noise, under which all sets of effects are compared.

The noise belongs to the record, not to the candidate: with a noise model of its own, what a candidate fails to explain
would pass as coloured noise.  It is an autoregression :math:`A(q) v_t = \sigma e_t` for each output channel, with
innovations e of a Student distribution of ten degrees of freedom, so that no single sample decides
(Lange, Little and Taylor, Journal of the American Statistical Association 84, 1989).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array, Mask
from smid.diagnosis.evidence.autoregression import autoregression_of
from smid.fitting.fit import Errors

TAIL = 10.0
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
        Nats that its coefficients cost, by Schwarz's criterion.
    """

    taps: Mapping[str, Array]
    price: float = 0.0

    @property
    def past(self) -> int:
        """Samples before the present one that the innovations need."""
        return max(len(taps) for taps in self.taps.values()) - 1

    def innovations(self, channel: str, errors: Array) -> Array:
        """Return the innovations of errors, shape (n, ...), in the channel's unit."""
        result = np.zeros_like(errors)
        for lag, tap in enumerate(self.taps[channel]):
            result[lag:] += tap * errors[: len(errors) - lag]
        return result


def noise_model(errors: Errors, used: Sequence[Mask]) -> NoiseModel:
    """Return the noise model that errors of free runs tell.

    Parameters
    ----------
    errors
        Of a fit, see `smid.fitting.fit.Fitting.errors`.
    used
        Shape (n,). Per experiment, the samples that count; the others are bridged.
    """
    parts: dict[str, list[tuple[Array, Mask]]] = {}
    for e, channel, error, _ in errors:
        parts.setdefault(channel, []).append((error, used[e][: len(error)]))
    taps = {channel: _taps(pairs) for channel, pairs in parts.items()}
    price = sum(0.5 * len(taps[c]) * np.log(sum(int(m.sum()) for _, m in pairs)) for c, pairs in parts.items())
    return NoiseModel(taps, float(price))


def _taps(pairs: Sequence[tuple[Array, Mask]]) -> Array:
    bridged = [np.interp(np.arange(e.size), np.flatnonzero(m), e[m]) for e, m in pairs]
    noise = autoregression_of(bridged)
    past = noise.coefficients.size - 1
    innovations = np.concatenate([noise.whiten(b)[m[past:]] for b, (_, m) in zip(bridged, pairs, strict=True)])
    least = _LEAST * max(float(np.abs(b).max()) for b in bridged) or 1.0
    # Likeliest deviation of the Student distribution, by reweighting.
    deviation = max(float(np.sqrt(np.mean(innovations**2))), least)
    for _ in range(_ITERATIONS):
        deviation = max(float(np.sqrt(np.mean(weights(innovations / deviation) * innovations**2))), least)
    return noise.coefficients / deviation


def weights(innovations: Array) -> Array:
    """Return the weights by which least squares becomes the likelihood of the Student distribution."""
    return (TAIL + 1) / (TAIL + innovations**2)


def log_density(innovations: Array) -> Array:
    """Return the log density of each innovation, up to a constant."""
    return -0.5 * (TAIL + 1) * np.log1p(innovations**2 / TAIL)
