"""What a recursive set starts with: its first box or simplex, the noises of an equation, and the drift."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from relaxations.algebra.arrays import Array
from smid.models import ModelError
from smid.models.errors import refuse_unknown
from smid.recursive.arx import Arx
from smid.recursive.polytope import Polytope
from smid.recursive.weighted_sums import Noise

__all__ = ["Range", "first_set", "noises_of", "steps_of", "widened"]

Range = tuple[float, float]


def noises_of(
    arx: Arx, noise_bound: float, error: str, input_noise_bound: float | Sequence[float]
) -> tuple[Noise, ...]:
    """Return the noises of an equation; raise `ModelError` if a bound of an input is not valid."""
    past = arx.na if error == "output" else 0
    found = [Noise(noise_bound, 1.0, tuple(range(past)), tuple(range(1, past + 1)))]
    stated = np.atleast_1d(np.asarray(input_noise_bound, dtype=np.float64))
    if stated.shape not in ((1,), (arx.inputs,)) or not (np.isfinite(stated) & (stated >= 0)).all():
        raise ModelError(
            f"input_noise_bound = {input_noise_bound} is refused: give a number that is not negative, "
            "or one for each input"
        )
    if stated.any() and arx.powers != (1,):
        raise ModelError(f"powers = {arx.powers} of a noisy input have no bounded rows: leave out input_noise_bound")
    lags = tuple(range(arx.delay, arx.delay + arx.nb + 1))
    for k, bound in enumerate(np.broadcast_to(stated, arx.inputs).tolist()):
        if bound:
            first = arx.na + k * len(lags)
            scaled = float(np.nextafter(abs(arx.input_scale) * bound, np.inf))
            found.append(Noise(scaled, 0.0, tuple(range(first, first + len(lags))), lags))
    return tuple(found)


def steps_of(arx: Arx, drift: float | Mapping[str, float]) -> Array:
    """Return the largest change of each parameter from sample to sample; raise `ModelError` if one is not valid."""
    named = drift if isinstance(drift, Mapping) else dict.fromkeys(arx.names, drift)
    refuse_unknown("parameter", named, arx.names)
    step = np.array([named.get(name, 0.0) for name in arx.names], dtype=np.float64)
    if not (np.isfinite(step) & (step >= 0)).all():
        raise ModelError(f"drift = {drift} is refused: give the largest change of a parameter per sample, 0 or more")
    return step


def widened(axes: Array, n: int) -> Array:
    """Return directions of the denominator's coefficients as directions of all parameters."""
    return np.concatenate([axes, np.zeros((len(axes), n - axes.shape[1]))], axis=1)


def first_set(arx: Arx, bounds: Mapping[str, Range]) -> Polytope:
    """Return the set of the first bounds, and of all stable denominators where these have none."""
    refuse_unknown("parameter", bounds, arx.names)
    stable = arx.stable and not any(name in bounds for name in arx.names[: arx.na])
    ends = dict(bounds)
    for i, name in enumerate(arx.names[: arx.na] if stable else (), start=1):
        ends[name] = (-float(math.comb(arx.na, i)), float(math.comb(arx.na, i)))
    for name in arx.names:
        if name not in ends:
            raise ModelError(f"{name!r} has no bounds: give a first interval, as in bounds={{{name!r}: (-10, 10)}}")
        low, high = ends[name]
        if not (np.isfinite(low) and np.isfinite(high) and low <= high):
            raise ModelError(f"the bounds of {name!r} are {low} and {high}: give finite ends, the lower one first")
    lower, upper = (np.array([ends[name][side] for name in arx.names], dtype=np.float64) for side in (0, 1))
    # The capacity holds the bases of all ends and the rows of one sample.
    n = len(lower)
    box = Polytope.box(lower, upper, 2 * (n + arx.na) * n + 64)
    if not stable:
        return box
    simplex = _stable_simplex(arx.na)
    return box.cut(widened(-simplex[:, 1:], n), simplex[:, 0])


def _stable_simplex(na: int) -> Array:
    """Return rows that are nonnegative on ``[1, a1, ..., a_na]`` of every stable denominator.

    The stable denominators lie in the simplex of the ``(z - 1)^k (z + 1)^(na - k)``. Up to a factor, the
    coordinates in it are the coefficients of ``sum_i a_i (s + 1)^(na - i) (s - 1)^i``: integer combinations of the a_i.

    Reference: Fam, Meditch, "A canonical parameter space for linear systems design", IEEE Trans. Automatic Control 23
    (1978).
    """
    plus, minus = np.poly1d([1.0, 1.0]), np.poly1d([1.0, -1.0])
    columns = [((plus ** (na - i)) * (minus**i)).coeffs for i in range(na + 1)]
    return np.stack(columns, axis=1)
