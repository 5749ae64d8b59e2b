"""The recorded input itself is noisy (errors in variables).

The plant is driven by ``u - zeta``, the model by u, so the error of the free run contains the plant's response to zeta.
No free run can follow it, but its *spectrum* is known, |G|^2 times a constant. With I the periodogram of the residual
and P the mean periodogram of the model's response to white perturbations of its input (which serves non-linear models
too), Whittle's likelihood of

    S(w) = a + b P(w),   a, b >= 0

is compared with that of white noise (b = 0) and, so that any coloured disturbance is not taken for input noise, with
those of a first-order disturbance of free pole with white noise, and of an autoregression, which takes any shape.
Reference: Whittle, Arkiv foer Matematik 2, 1953; Soederstroem, Errors-in-Variables Methods in System Identification,
Springer 2018.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from scipy.optimize import minimize

from relaxations.algebra.arrays import Array
from smid.diagnosis.effects.effect import Detection, Effect, Site, on_the_noise
from smid.diagnosis.evidence.autoregression import LARGEST_ORDER, autoregression
from smid.diagnosis.evidence.passed_noise import passed_noise
from smid.models import Model

_LEAST_RATIO = 30.0  # twice the log of the likelihood ratio against white noise
# Twice the log-likelihood that one parameter more gains by chance in one case of six hundred (chi-squared).
_ONE_MORE = 10.0


def _periodogram(samples: Array) -> Array:
    return np.asarray(np.abs(np.fft.rfft(samples - samples.mean()))[1:] ** 2 / len(samples))


def _whittle(spectrum: Array, density: Array) -> float:
    return float(np.sum(np.log(density) + spectrum / density))


def _best(spectrum: Array, density: Callable[[Array], Array], starts: list[Array]) -> tuple[float, Array]:
    """Minimise Whittle's negative log-likelihood; the arguments of the density are logarithms where positive."""

    def likelihood(x: Any) -> float:
        return _whittle(spectrum, density(np.asarray(x)))

    found = [minimize(likelihood, s.tolist(), method="Nelder-Mead") for s in starts]
    best = min(found, key=lambda r: r.fun)
    return float(best.fun), np.asarray(best.x)


def _coloured(spectrum: Array) -> float:
    """Return Whittle's negative log-likelihood of white noise plus a first-order one of free pole."""
    turn = np.exp(-1j * np.linspace(0, np.pi, len(spectrum) + 1)[1:])

    def density(x: Array) -> Array:
        return np.asarray(np.exp(x[0]) + np.exp(x[1]) / np.abs(1 - np.tanh(x[2]) * turn) ** 2)

    level = float(np.log(spectrum.mean()))
    starts = (
        (level - 3, level - 3, 1.0),
        (level, level - 5, 1.5),
        (level - 3, level, 0.3),
        (level - 6, level - 3, 1.0),
    )
    return _best(spectrum, density, [np.array(s) for s in starts])[0]


def _untold(samples: Array) -> float:
    """Return the variance that the past of a signal leaves untold: white noise in it cannot have more.

    By least squares: the Yule-Walker equations leave more of a smooth signal.
    """
    order = min(LARGEST_ORDER, len(samples) // 10)
    windows = np.lib.stride_tricks.sliding_window_view(samples - samples.mean(), order + 1)
    weights = np.linalg.lstsq(windows[:, :-1], windows[:, -1], rcond=None)[0]
    rest = windows[:, -1] - windows[:, :-1] @ weights
    return float(rest @ rest) / max(len(rest) - order, 1)


def _detect(model: Model, site: Site) -> Detection | None:
    if any(m.channel == site.input for m in model.measurements):
        return None  # known to be noisy already
    longest = int(np.argmax([len(r) for r in site.residual]))
    spectrum = _periodogram(site.residual[longest])
    answers = passed_noise(model, site.data.experiments[longest].values, site.input, site.output)
    answer = np.mean([_periodogram(one) for one in answers], axis=0)
    if not (np.isfinite(answer).all() and answer.max() > 0 and len(spectrum) > 40):
        return None
    # A smooth density: the mean of few periodograms is rough, and a rough density is punished.
    width = max(3, len(answer) // 60)
    answer = np.convolve(np.pad(answer, width, mode="reflect"), np.ones(2 * width + 1) / (2 * width + 1), "valid")
    power = float(spectrum.mean())
    white = _whittle(spectrum, np.full_like(spectrum, power))
    floor, share = np.log(power), np.log(power / answer.mean())
    starts = [np.array([floor - 3, share]), np.array([floor, share - 2])]
    through, (log_floor, log_gain) = _best(spectrum, lambda x: np.exp(x[0]) + np.exp(x[1]) * answer, starts)

    # Any spectrum at all, as an autoregression: noise through this plant must not do worse by more than chance.
    any_shape = autoregression(site.residual[longest])
    anything = _whittle(spectrum, any_shape.spectrum(len(site.residual[longest]))[1:])
    ratio = 2 * (white - through)
    rival = 2 * (anything - through) + (LARGEST_ORDER - 1) * np.log(len(spectrum))
    first_order = 2 * (_coloured(spectrum) - through) + _ONE_MORE
    if ratio < _LEAST_RATIO or min(rival, first_order) < 0:
        return None
    deviation = float(np.exp(log_gain / 2))
    if deviation**2 > _untold(site.data.experiments[longest].values[site.input]):
        return None
    return Detection(
        model.with_input_noise(site.input),
        {"deviation": deviation, "floor": float(np.exp(log_floor / 2))},
        float(1 - np.exp(-ratio / 2) - 0.5 * np.exp(-rival / 2)),
        {"likelihood_ratio_to_white": ratio, "likelihood_ratio_to_coloured": rival},
        rival,
        power - float(np.exp(log_floor)),
    )


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say how noisy the record of the input is."""
    return f"The recorded {site.input} is itself noisy, by about {values['deviation']:.3g} {site.unit(site.input)} RMS."


EFFECT = Effect(
    "input_noise",
    "the recorded input itself is noisy",
    on_the_noise,
    describe,
    needs="an input that the model takes as exact",
    detect=_detect,
)
