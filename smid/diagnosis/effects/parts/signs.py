"""The signs of an output that is a magnitude, guessed so that a fit can start.

First guess: the signs of a lagged input. Then a linear response of the input is fitted to the signed output, which
gives better signs, and so on; at last the model.

Reference: Gerchberg and Saxton, Optik 35 (1972) 237-246 (signs and fit in turn).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from relaxations.algebra.arrays import Array
from smid.data import DataError
from smid.data.gaps import bridged
from smid.diagnosis.effects.effect import Site
from smid.diagnosis.effects.parts.asked_for import Start
from smid.fitting.fit import fit
from smid.models import Model

__all__ = ["signed_fit"]

_POLES, _PAST = (0.5, 0.8, 0.9, 0.95, 0.98), 30
_TURNS, _ROUNDS = 50, 5  # most guesses by responses, and by the model
_RANK = 1e-8
_SETTLED = 1e-3  # of the squared error: less is no better guess


def signed_fit(model: Model, site: Site) -> Start | None:
    """Fit the model to the output with guessed signs, which the fit improves; return the values that fit best."""
    magnitudes = [run.values[site.output] for run in site.data.experiments]
    best: tuple[float, Start] | None = None
    simulated, fitted, starts = _first_guess(site), model.with_values({}), 2
    for _ in range(_ROUNDS):
        runs = [
            replace(run, values={**run.values, site.output: y * _signs(w)})
            for run, y, w in zip(site.data.experiments, magnitudes, simulated, strict=True)
        ]
        try:
            found = fit(fitted, site.data.with_experiments(runs), starts=starts)
        except DataError:
            break
        fitted, starts = found.model, 1
        simulated = [s[site.output] for s in found.simulated]
        error = sum(float(np.nansum((y - np.abs(w)) ** 2)) for y, w in zip(magnitudes, simulated, strict=True))
        if best is not None and not error < (1 - _SETTLED) * best[0]:
            break
        best = error, fitted.values
    return best and best[1]


def _first_guess(site: Site) -> list[Array]:
    """Return for each experiment a response to the input whose magnitude is near the output.

    The response is a sum of past inputs, of lags of them, and a constant. It is fitted to the output with the signs
    of the one before, until none turns. The first one is a lag of the input: of several poles the best result counts.
    """
    inputs = [bridged(run.values[site.input]) for run in site.data.experiments]
    output = np.concatenate([run.values[site.output] for run in site.data.experiments])
    there = np.isfinite(output)
    y, basis = output[there], np.concatenate([_responses(u) for u in inputs])[there]
    directions, sizes, _ = np.linalg.svd(basis, full_matrices=False)
    directions = directions[:, sizes > _RANK * sizes[0]]
    best, least = y, math.inf
    for pole in _POLES:
        w = np.concatenate([_lag(u, pole) for u in inputs])[there]
        for _ in range(_TURNS):
            before = _signs(w)
            w = directions @ (directions.T @ (y * before))
            if np.array_equal(_signs(w), before):
                break
        error = float(np.sum((y - np.abs(w)) ** 2))
        if error < least:
            best, least = w, error
    whole = np.zeros(len(output))
    whole[there] = best
    return np.split(whole, np.cumsum([len(u) for u in inputs[:-1]]))


def _responses(u: Array) -> Array:
    """Return past inputs, the responses of one and of two lags in series, and a constant, shape (n, n_responses)."""
    past = [np.concatenate([np.full(k, u[0]), u[: len(u) - k]])[: len(u)] for k in range(_PAST)]
    once = [_lag(u, pole) for pole in _POLES]
    twice = [_lag(w, pole) for w, pole in zip(once, _POLES, strict=True)]
    return np.column_stack([*past, *once, *twice, np.ones(len(u))])


def _lag(u: Array, pole: float) -> Array:
    return np.asarray(lfilter([1 - pole], [1, -pole], u, zi=[pole * u[0]])[0])


def _signs(w: Array) -> Array:
    return np.where(w < 0, -1.0, 1.0)
