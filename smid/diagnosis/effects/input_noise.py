"""The recorded input itself is noisy (errors in variables).

The plant is driven by ``u - zeta``, the model by u, so the error of the free run contains the plant's response to zeta.
A part of zeta can be told from the record of u alone (:mod:`smid.data.estimates`). The free run is driven by

    u + k (v - u),   k >= 0,

with an estimate v of the input without its noise; k is zero without noise. It is at most one, and so small that
``k (v - u)`` has no more variance than the past of u leaves untold: white noise cannot have more.

The rest of zeta stays in the error, and no free run can follow it, but its *spectrum* is known, |G|^2 times a constant.
With I the periodogram of the residual and P the mean periodogram of the model's response to white perturbations of its
input (which serves non-linear models too), Whittle's likelihood of

    S(w) = a + b P(w),   a, b >= 0

is compared with that of white noise (b = 0) and, so that any coloured disturbance is not taken for input noise, with
those of a first-order disturbance of free pole with white noise, and of an autoregression, which takes any shape.
Reference: Whittle, Arkiv foer Matematik 2, 1953; Soederstroem, Errors-in-Variables Methods in System Identification,
Springer 2018.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import sympy
from scipy.optimize import minimize

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.data.estimates import in_words
from smid.diagnosis.effects.effect import Detection, Effect, Extension, Site
from smid.diagnosis.effects.parts.naming import free_name, fresh, quantity, read_channel
from smid.diagnosis.evidence.autoregression import LARGEST_ORDER, autoregression
from smid.diagnosis.evidence.passed_noise import passed_noise
from smid.models import Model, signal, t
from smid.models.symbols import rename_signals

_LEAST_RATIO = 30.0  # twice the log of the likelihood ratio against white noise
# Twice the log-likelihood that one parameter more gains by chance in one case of six hundred (chi-squared).
_ONE_MORE = 10.0


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Drive the plant by what the record alone tells of the input without its noise."""
    if model.edit and site.input in model.edit.places:
        return  # noise is in the record, before all that happens to the input
    if set(site.estimates) & set(model.input_channels):
        return  # an input is noisy once
    untold = min(_untold(run.values[site.input]) for run in site.data.experiments)
    for estimate in site.estimates:
        noise = float(np.var(site.values(site.input) - site.values(estimate)))
        most = min(1.0, np.sqrt(untold / noise)) if noise else 0.0
        if not most:
            continue
        share = fresh(model, f"{site.input}_noise_share", (0, most), "", 0.0)
        reading, name = read_channel(model, estimate)

        def corrected(u: sympy.Expr, share: sympy.Symbol = share.symbol, name: str = name) -> sympy.Expr:
            return u + share * (signal(name)[t] - u)

        true = free_name(reading, f"{site.input}_true")
        yield Extension(
            reading.insert_before(site.input, corrected, [share], new_name=true),
            ({share.name: 0.5 * most}, {share.name: 0.9 * most}),
            in_words(estimate),
            describe=partial(_describe_estimate, estimate),
        )


def in_the_record(model: Model, data: Dataset) -> Model:
    """Return the model with noise in the record of each input that it corrects by an estimate."""
    estimates = {channel.name: channel.estimate_of for channel in data.channels if channel.estimate_of}
    noisy = [estimates[name] for name in model.input_channels if name in estimates]
    added = [name for name, effect in model.origins.items() if effect == EFFECT.name]
    model = model.fix(**{p.name: 0.0 for p in model.parameters if p.name in added})
    for line in model.lines:
        if line.signal in added:
            (read, _), *_ = line.reads
            others = (other for other in model.lines if other.signal != line.signal)
            renamed = (replace(o, expression=rename_signals(o.expression, {line.signal: read})) for o in others)
            model = replace(model, lines=tuple(renamed))
    for channel in noisy:
        model = model.with_input_noise(channel)
    return model


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
    values = site.data.experiments[longest].values
    answers = passed_noise(model, values, (site.input, *site.estimates), site.output)
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
    if deviation**2 > _untold(values[site.input]):
        return None
    return Detection(
        model.with_input_noise(site.input),
        {"deviation": deviation, "floor": float(np.exp(log_floor / 2))},
        float(1 - np.exp(-ratio / 2) - 0.5 * np.exp(-rival / 2)),
        {"likelihood_ratio_to_white": ratio, "likelihood_ratio_to_coloured": rival},
        rival,
        power - float(np.exp(log_floor)),
    )


def _describe(values: Mapping[str, float], site: Site) -> str:
    """Say how noisy the record of the input is."""
    return _said("about", values["deviation"], site)


def _describe_estimate(estimate: str, values: Mapping[str, float], site: Site) -> str:
    """Say how much noise the estimate takes away."""
    (share,) = values.values()
    return _said("at least about", share * float(np.std(site.values(estimate) - site.values(site.input))), site)


def _said(how: str, deviation: float, site: Site) -> str:
    size = quantity(deviation, site.unit(site.input))
    return f"The recorded {site.input} is itself noisy, by {how} {size} RMS."


EFFECT = Effect(
    "input_noise",
    "the recorded input itself is noisy",
    extend,
    _describe,
    needs="an input that the model takes as exact",
    detect=_detect,
)
