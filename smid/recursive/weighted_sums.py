"""Weighted sums of a model's equations, and bounds on their noise.

An output-error model holds for the noise-free output ``w = y - eta``, so each sample gives

    y[t] - phi[t]' theta = eta[t] + a1 eta[t-1] + ... + a_na eta[t-na],

with a noise of at most ``D (1 + sum |a_i|)``. This bound is large: successive equations count the same noise again.
A sum of the last K equations with weights l is linear in theta too. Its noise, at most ``D sum_m |g_m|``, is

    sum_k l_k (y[t-k] - phi[t-k]' theta) = sum_m g_m eta[t-m],    g_m = l_m + a1 l_(m-1) + ... + a_na l_(m-na).

With the impulse response of ``1 / A`` as weights, the bound is nearly D (the filter of Steiglitz and McBride). A is
unknown, so the weights use the centre of the set, with poles multiplied by several factors (zero: a single equation).
The noise of an input adds ``sum_m h_m zeta[t-m]`` with ``h_m = sum_j b_j l_(m-delay-j)``.

``G(theta) = sum_m |g_m|`` is convex. Over a parallelotope around the set, and for any slope beta, ``G`` is at most
``level + beta' theta``. The level is the largest ``G(theta) - beta' theta`` at the corners. Every sum thus gives two
rows, linear in theta, that the true parameters satisfy. The slope comes from the chords of each ``|g_m|``.

Parameters that change by at most delta between samples (drift) satisfy an equation of k samples before up to
``k |phi|' delta``, and the same for the factors of the noises. Every row is one of the present parameters.

References: Steiglitz and McBride, "A technique for the identification of linear systems", IEEE Trans. Automatic
Control 10 (1965); Cerone, "Feasible parameter set for linear models with bounded errors in all variables", Automatica
29 (1993), for the single equation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.signal import lfilter

from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import EPSILON, TINY
from smid.recursive.polytope import Polytope

__all__ = ["Drift", "Noise", "WeightedSums", "principal_axes"]

DRAWN = (0.5, 0.8, 1.0)
"""Factors of the poles, in addition to zero."""
RADIUS = 0.995
"""Largest radius of the poles of the weights; the poles of a centre may be unstable."""
FADED = 2e-4
"""Share of the weights that may lie beyond the longest sum."""


@dataclass(frozen=True)
class Noise:
    """A bounded noise in each equation: `own` times its present sample, and parameters times samples before.

    Parameters
    ----------
    bound
        In the unit of its channel.
    own
        Factor of the present sample: 1 for the output's noise, 0 for that of an input.
    places
        Numbers of the parameters.
    lags
        Of the samples that they multiply.
    """

    bound: float
    own: float
    places: tuple[int, ...] = ()
    lags: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class WeightedSums:
    """Weights of the equations, and the noise bounds of their sums.

    Parameters
    ----------
    weights
        Shape (f, K). Newest equation first.
    slopes
        Shape (f, n).
    levels
        Shape (f,). The noise of a sum is at most ``level + slope' theta``, in the output's unit.
    """

    weights: Array
    slopes: Array
    levels: Array

    @staticmethod
    def single(n: int, bound: float) -> WeightedSums:
        """Return the single equation as the only sum, with a noise of at most `bound`."""
        return WeightedSums(np.ones((1, 1)), np.zeros((1, n)), np.array([bound]))

    @staticmethod
    def around(
        noises: Sequence[Noise], polytope: Polytope, axes: Array, most: int, margin: Array | None = None
    ) -> WeightedSums:
        """Return sums whose noise is small over a set, of as many equations as the weights need to fade.

        `most` limits their number; for 1 the only sum is the single equation.

        The first parameters of the polytope are a. Its ends after those of the box bound ``axes @ a``; the axes, shape
        (na, na), are nearly orthogonal. The bounds hold over the set enlarged by `margin`, shape (n,).
        """
        # Two enclosures of the denominator: along the parameters and along the axes.
        na, n = len(axes), polytope.n
        wider = np.zeros(n) if margin is None else margin
        lower, upper, ends = polytope.lower - wider, polytope.upper + wider, polytope.ends[2 * n :]
        along = np.abs(axes) @ wider[:na] * (1 + (na + 2) * EPSILON)
        turned = _corners(-(ends[na:] + along), ends[:na] + along) @ axes
        # a = axes' (axes a) + rest, because the axes are not exactly orthogonal.
        size = np.maximum(np.abs(lower), np.abs(upper))
        skew = np.abs(np.eye(na) - axes.T @ axes) + (na + 4) * EPSILON * (np.abs(axes.T) @ np.abs(axes))
        rest = float((skew @ size[:na]).sum())
        # Weights: the single equation, and one impulse response for each factor.
        weights = np.ones((1, 1))
        if most > 1:
            responses = _impulse_responses(turned.mean(axis=0), most)
            weights = np.concatenate([np.eye(1, responses.shape[1]), responses])
        # The noises, one after the other.
        slopes, levels = np.zeros((len(weights), n)), np.zeros(len(weights))
        for noise in noises:
            places = list(noise.places)
            enclosures = [_corners(lower[places], upper[places])]
            if noise.own and places:
                enclosures.append(turned)
            slope, level = _affine_bound(noise, weights, enclosures, rest)
            slopes[:, places] += noise.bound * slope
            levels += noise.bound * level * (1 + 4 * EPSILON)
        return WeightedSums(weights, slopes, levels)

    def rows(
        self, windows: Array, size: Array, slip: float, ages: Array | None = None, drift: Drift | None = None
    ) -> tuple[Array, Array]:
        """Return the rows ``normals @ theta <= offsets`` that the sums give.

        `windows`, shape (w, K or more, 1 + n), holds ``y[t]`` and ``phi[t]`` of consecutive equations, newest first.
        `size` is the largest magnitude of each parameter, and `slip` the relative error of the regressors. With a
        drift, `ages`, shape (w,), are the samples since the newest equation of each window.
        """
        # Sums of the equations, and their noise bounds as linear functions of the parameters.
        (count, length), width = self.weights.shape, windows.shape[2]
        windows = windows[:, :length]
        sums = (self.weights @ windows).reshape(-1, width)
        absolute = (np.abs(self.weights) @ np.abs(windows)).reshape(sums.shape)
        tilt = np.tile(self.slopes, (len(windows), 1))
        noise = np.tile(self.levels, len(windows))
        if drift is not None and ages is not None:
            old = np.abs(self.weights) * np.arange(length)
            since = np.repeat(ages, count)
            noise = noise + (1 + (length + width + 8) * EPSILON) * (
                (old @ np.abs(windows[:, :, 1:])).reshape(-1, width - 1) @ drift.step
                + since * (np.abs(sums[:, 1:]) @ drift.step + slip * (absolute[:, 1:] @ drift.step))
                + drift.noise
                * (
                    np.tile(old.sum(axis=1), len(windows))
                    + since * np.tile(np.abs(self.weights).sum(axis=1), len(windows))
                )
            )
        # Two rows for each sum, with the offset enlarged by the rounding.
        normals = np.concatenate([sums[:, 1:] - tilt, -sums[:, 1:] - tilt])
        relative = slip + (length + 8) * EPSILON
        rounding = relative * (absolute[:, 0] + (absolute[:, 1:] + np.abs(tilt)) @ size + np.abs(noise)) + TINY
        offsets = np.concatenate([sums[:, 0] + noise, noise - sums[:, 0]]) + np.tile(2.0 * rounding, 2)
        return normals, offsets


@dataclass(frozen=True, eq=False)
class Drift:
    """How much the parameters may change from one sample to the next.

    Parameters
    ----------
    step
        Shape (n,). Largest change of each parameter.
    noise
        Largest change of the noise of an equation that follows from it: the sum of ``bound * step`` over its factors.
    """

    step: Array
    noise: float

    @staticmethod
    def of(step: Array, noises: Sequence[Noise]) -> Drift:
        """Return the drift of a model with some noises."""
        return Drift(step, sum(noise.bound * float(step[list(noise.places)].sum()) for noise in noises))


def _corners(lower: Array, upper: Array) -> Array:
    """Return the corners of a box, shape (2^p, p)."""
    return np.array(list(product(*zip(lower.tolist(), upper.tolist(), strict=True)))).reshape(
        2 ** len(lower), len(lower)
    )


def _affine_bound(noise: Noise, weights: Array, enclosures: Sequence[Array], rest: float) -> tuple[Array, Array]:
    """Return slopes, shape (f, p), and levels, shape (f,), that bound a noise of bound one over each of the enclosures.

    An enclosure is the corners of a parallelotope around its parameters, shape (c, p).
    """
    (count, length), p = weights.shape, len(noise.places)
    span = length + max(noise.lags, default=0)
    own, shifted = np.zeros((count, span)), np.zeros((p, count, span))
    own[:, :length] = noise.own * weights
    for i, lag in enumerate(noise.lags):
        shifted[i, :, lag : lag + length] = weights
    # Slopes: chords of |g_m| between its limits over all enclosures.
    gains = [own + np.tensordot(corners, shifted, 1) for corners in enclosures]
    low = np.max([gain.min(axis=0) for gain in gains], axis=0)
    high = np.min([gain.max(axis=0) for gain in gains], axis=0)
    chords = np.clip((high + low) / np.maximum(high - low, 1e-200), -1.0, 1.0)
    slopes = (shifted * chords).sum(axis=2).T
    # Levels: the smallest of the largest values at the corners, plus rounding.
    levels = np.full(count, np.inf)
    for gain, corners in zip(gains, enclosures, strict=True):
        levels = np.minimum(levels, (np.abs(gain).sum(axis=2) - corners @ slopes.T).max(axis=0))
    total = np.abs(weights).sum(axis=1)
    reach = 1.0 + max(float(np.abs(corners).sum(axis=1).max()) for corners in enclosures)
    steepest = np.abs(slopes).max(axis=1, initial=0.0)
    rounding = (length + 3 * p + 8) * EPSILON * reach * (total + steepest)
    return slopes, levels + 2.0 * rounding + rest * (total + steepest) + TINY


def _impulse_responses(a: Array, most: int) -> Array:
    """Return the first samples of ``1 / A``, one row for each factor of the poles, until the slowest has faded.

    Poles outside the unit circle are moved inside.
    """
    radius = float(np.abs(np.roots(np.append(1.0, a))).max(initial=0.0))
    start, found = np.append(1.0, np.zeros(most - 1)), []
    for drawn in DRAWN:
        factor = drawn * min(1.0, RADIUS / (drawn * radius)) if radius > 0 else drawn
        found.append(lfilter([1.0], np.append(1.0, a * factor ** np.arange(1, len(a) + 1)), start))
    left = np.abs(found[-1])[::-1].cumsum()[::-1]
    return np.array(found)[:, : int((left > FADED * left[0]).sum())]


def principal_axes(polytope: Polytope, na: int) -> tuple[Array, Array]:
    """Return the principal axes (rows, shape (na, na)) and the spread, shape (na,), of the set's vertices.

    Only the first na parameters count. An enclosure along these axes is tight even for a long, thin set.
    """
    points = polytope.vertices[:, :na]
    centred = points - points.mean(axis=0)
    axes = np.linalg.eigh(centred.T @ centred)[1].T
    return axes, np.ptp(points @ axes.T, axis=0)
