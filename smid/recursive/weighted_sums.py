"""Weighted sums of a model's equations, and bounds on their noise.

An output-error model holds for the noise-free output ``w = y - eta``, so each sample gives

    y[t] - phi[t]' theta = eta[t] + a1 eta[t-1] + ... + a_na eta[t-na],

with a noise of at most ``D (1 + sum |a_i|)``. This bound is large: successive equations count the same noise again.
A sum of the last K equations with weights l is linear in theta too. Its noise, at most ``D sum_m |g_m|``, is

    sum_k l_k (y[t-k] - phi[t-k]' theta) = sum_m g_m eta[t-m],    g_m = l_m + a1 l_(m-1) + ... + a_na l_(m-na).

With the impulse response of ``1 / A`` as weights, the bound is nearly D (the filter of Steiglitz and McBride). A is
unknown, so the weights use the centre of the set, with poles multiplied by several factors (zero: a single equation).

``G(a) = sum_m |g_m(a)|`` is convex. Over a parallelotope around the set's a, and for any slope beta, ``G(a)`` is at
most ``level + beta' a``. The level is the largest ``G(a) - beta' a`` at the corners. Every sum thus gives two rows,
linear in theta, that the true parameters satisfy. The slope comes from the chords of each ``|g_m|``.

References: Steiglitz and McBride, "A technique for the identification of linear systems", IEEE Trans. Automatic
Control 10 (1965); Cerone, "Feasible parameter set for linear models with bounded errors in all variables", Automatica
29 (1993), for the single equation.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.signal import lfilter

from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import EPSILON, TINY
from smid.recursive.polytope import Polytope

__all__ = ["WeightedSums", "principal_axes"]

DRAWN = (0.5, 0.8, 1.0)
"""Factors of the poles, in addition to zero."""
RADIUS = 0.995
"""Largest radius of the poles of the weights; the poles of a centre may be unstable."""


@dataclass(frozen=True, eq=False)
class WeightedSums:
    """Weights of the equations, and the noise bounds of their sums.

    Parameters
    ----------
    weights
        Shape (f, K). Newest equation first.
    slopes
        Shape (f, na).
    levels
        Shape (f,). The noise of a sum is at most ``D (level + slope' a)``.
    """

    weights: Array
    slopes: Array
    levels: Array

    @staticmethod
    def single(na: int) -> WeightedSums:
        """Return the single equation as the only sum, with a noise of at most D."""
        return WeightedSums(np.ones((1, 1)), np.zeros((1, na)), np.ones(1))

    @staticmethod
    def around(polytope: Polytope, axes: Array, length: int) -> WeightedSums:
        """Return sums of `length` equations whose noise is small over a set.

        The first parameters of the polytope are a. Its ends after those of the box bound ``axes @ a``; the axes, shape
        (na, na), are nearly orthogonal.
        """
        # Corners of two enclosures: along the parameters and along the axes.
        na, n = len(axes), polytope.n
        lower, upper = polytope.lower[:na], polytope.upper[:na]
        ends = polytope.ends[2 * n :]
        box = np.array(list(product(*zip(lower, upper, strict=True))))
        turned = np.array(list(product(*zip(-ends[na:], ends[:na], strict=True)))) @ axes
        # a = axes' (axes a) + rest, because the axes are not exactly orthogonal.
        size = np.maximum(np.abs(lower), np.abs(upper))
        skew = np.abs(np.eye(na) - axes.T @ axes) + (na + 4) * EPSILON * (np.abs(axes.T) @ np.abs(axes))
        rest = float((skew @ size).sum())
        # Weights: the single equation, and one impulse response for each factor.
        weights = np.zeros((len(DRAWN) + 1, length))
        weights[0, 0] = 1.0
        for f, drawn in enumerate(DRAWN, start=1):
            weights[f] = _impulse_response(turned.mean(axis=0), drawn, length)
        # Slopes: chords of |g_m| between its limits over both enclosures.
        shifted = np.zeros((na + 1, len(weights), length + na))
        for i in range(na + 1):
            shifted[i, :, i : i + length] = weights
        gains = [shifted[0] + np.tensordot(corners, shifted[1:], 1) for corners in (box, turned)]
        low = np.maximum(gains[0].min(axis=0), gains[1].min(axis=0))
        high = np.minimum(gains[0].max(axis=0), gains[1].max(axis=0))
        chords = np.clip((high + low) / np.maximum(high - low, 1e-200), -1.0, 1.0)
        slopes = (shifted[1:] * chords).sum(axis=2).T
        # Levels: the smaller of the two largest values at the corners, plus rounding.
        levels = np.full(len(weights), np.inf)
        for gain, corners in zip(gains, (box, turned), strict=True):
            levels = np.minimum(levels, (np.abs(gain).sum(axis=2) - corners @ slopes.T).max(axis=0))
        total = np.abs(weights).sum(axis=1)
        reach = 1.0 + max(float(np.abs(corners).sum(axis=1).max()) for corners in (box, turned))
        rounding = (length + 3 * na + 8) * EPSILON * reach * (total + np.abs(slopes).max(axis=1))
        levels = levels + 2.0 * rounding + rest * (total + np.abs(slopes).max(axis=1)) + TINY
        return WeightedSums(weights, slopes, levels)

    def rows(self, windows: Array, noise_bound: float, size: Array, slip: float) -> tuple[Array, Array]:
        """Return the rows ``normals @ theta <= offsets`` that the sums give.

        `windows`, shape (w, K, 1 + n), holds ``y[t]`` and ``phi[t]`` of consecutive equations, newest first. `size` is
        the largest magnitude of each parameter, and `slip` the relative error of the regressors.
        """
        # Sums of the equations, and their noise bounds as linear functions of a.
        sums = (self.weights @ windows).reshape(-1, windows.shape[2])
        absolute = (np.abs(self.weights) @ np.abs(windows)).reshape(sums.shape)
        repeated = len(windows)
        tilt = np.zeros((len(sums), windows.shape[2] - 1))
        tilt[:, : self.slopes.shape[1]] = noise_bound * np.tile(self.slopes, (repeated, 1))
        noise = noise_bound * np.tile(self.levels, repeated)
        # Two rows for each sum, with the offset enlarged by the rounding.
        normals = np.concatenate([sums[:, 1:] - tilt, -sums[:, 1:] - tilt])
        relative = slip + (self.weights.shape[1] + 8) * EPSILON
        rounding = relative * (absolute[:, 0] + (absolute[:, 1:] + np.abs(tilt)) @ size + np.abs(noise)) + TINY
        offsets = np.concatenate([sums[:, 0] + noise, noise - sums[:, 0]]) + np.tile(2.0 * rounding, 2)
        return normals, offsets


def _impulse_response(a: Array, drawn: float, length: int) -> Array:
    """Return the first samples of ``1 / A``, with poles multiplied by a factor and moved inside the unit circle."""
    radius = drawn * float(np.abs(np.roots(np.append(1.0, a))).max(initial=0.0))
    factor = drawn * min(1.0, RADIUS / radius) if radius > 0 else drawn
    denominator = np.append(1.0, a * factor ** np.arange(1, len(a) + 1))
    return np.asarray(lfilter([1.0], denominator, np.append(1.0, np.zeros(length - 1))))


def principal_axes(polytope: Polytope, na: int) -> tuple[Array, Array]:
    """Return the principal axes (rows, shape (na, na)) and the spread, shape (na,), of the set's vertices.

    Only the first na parameters count. An enclosure along these axes is tight even for a long, thin set.
    """
    points = polytope.vertices[:, :na]
    centred = points - points.mean(axis=0)
    axes = np.linalg.eigh(centred.T @ centred)[1].T
    return axes, np.ptp(points @ axes.T, axis=0)
