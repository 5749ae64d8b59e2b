"""The noise grows with the level: ``var e = a^2 + (b w)^2``, as in a flow meter whose error is a share of the reading.

No free run can follow it. The Gaussian likelihood of the residual, whitened by its autoregression, with this variance
is compared with that of a constant one and, so that another error is not taken for noise of the output, with those of
a variance that grows with the speed of the output, with time, and as the model passes on white noise at its input. b is
zero without the effect.
Reference: Davidian and Carroll, Journal of the American Statistical Association 82 (1987) 1079-1091.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.optimize import minimize_scalar

from relaxations.algebra.arrays import Array
from smid.diagnosis.effects.effect import Detection, Effect, Site, on_the_noise
from smid.diagnosis.effects.parts.naming import quantity
from smid.diagnosis.evidence.autoregression import autoregression
from smid.diagnosis.evidence.passed_noise import passed_noise
from smid.models import Model

_LEAST_RATIO = 30.0  # twice the log of the likelihood ratio against a constant variance
_ONE_MORE = 10.0  # and by how much it must exceed that of another cause of growth
_RANGE = 8.0  # of the log of the share of the variance that grows


def _detect(model: Model, site: Site) -> Detection | None:
    longest = int(np.argmax([len(r) for r in site.residual]))
    residual = site.residual[longest]
    run = site.data.experiments[longest]
    level = run.values[site.output] - residual
    described = autoregression(residual)
    error = described.whiten(residual - residual.mean())
    if not (error.size and np.isfinite(level).all() and described.innovation > 0):
        return None
    level, time = level[-error.size :], np.arange(error.size) / error.size
    ratio, constant, share = _grown(error, level)
    passed = np.std(passed_noise(model, run.values, (site.input, *site.estimates), site.output), axis=0)[-error.size :]
    rivals = [_grown(error, x)[0] for x in (np.gradient(level), time, 1 - time, passed)]
    if ratio < max(_LEAST_RATIO, *(rival + _ONE_MORE for rival in rivals)):
        return None
    # Of the residual itself, in the output's unit.
    colour = float(np.sqrt(described.variance / described.innovation))
    return Detection(
        model,
        {"share": share * colour, "floor": constant * colour},
        float(1 - np.exp(-ratio / 2)),
        {"likelihood_ratio_to_constant": ratio, "likelihood_ratio_to_another_growth": ratio - max(rivals)},
    )


def _grown(error: Array, x: Array) -> tuple[float, float, float]:
    """Return twice the gain in log-likelihood by ``var = a^2 + (b x)^2`` against a constant variance, a and b."""
    power = float(np.mean(x**2))
    if not power:
        return 0.0, float(np.std(error)), 0.0
    relative = x**2 / power

    def variance(log_share: float) -> tuple[float, Array]:
        shape = 1 + np.exp(log_share) * relative
        return float(np.mean(error**2 / shape)), shape

    def cost(log_share: float) -> float:
        size, shape = variance(log_share)
        return float(len(error) * np.log(size) + np.sum(np.log(shape)))

    found = minimize_scalar(cost, bounds=(-_RANGE, _RANGE), method="bounded")
    size, _ = variance(found.x)
    gain = len(error) * np.log(np.mean(error**2)) - found.fun
    return float(gain), float(np.sqrt(size)), float(np.sqrt(size * np.exp(found.x) / power))


def _describe(values: Mapping[str, float], site: Site) -> str:
    floor = quantity(values["floor"], site.unit(site.output))
    return (
        f"The noise of {site.output} grows with the level: {floor} RMS at zero, and {values['share']:.2g} of the level."
    )


EFFECT = Effect(
    "multiplicative_noise",
    "the noise grows with the level",
    on_the_noise,
    _describe,
    needs="an output that takes several levels",
    detect=_detect,
)
