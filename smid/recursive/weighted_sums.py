"""Weighted sums of a model's equations, and the largest noise that each may carry.

An output-error model holds for the noise-free output ``w = y - eta``, so that each sample gives

    y[t] - phi[t]' theta = eta[t] + a1 eta[t-1] + ... + a_na eta[t-na].

Taken alone it bounds the left-hand side by ``D (1 + sum |a_i|)``: much, and the next equations count the same noise
again.  A sum of the last K equations with weights l is linear in theta too, and its noise is

    sum_k l_k (y[t-k] - phi[t-k]' theta) = sum_m g_m eta[t-m],    g_m = l_m + a1 l_(m-1) + ... + a_na l_(m-na),

at most ``D sum_m |g_m|``.  Weights that are the impulse response of ``1 / A`` make that nearly D, with the filtered
regressors of Steiglitz and McBride.  A is not known: the weights are taken for the centre of the set, its poles
multiplied by several factors; factor zero is the single equation.

``G(a) = sum_m |g_m(a)|`` is convex.  Over a parallelotope around the set's a, and with any slope beta, ``G(a)`` is at
most ``level + beta' a``, the level being the largest of ``G(a) - beta' a`` at the corners.  So every sum gives two
rows, linear in theta, that the true parameters satisfy.  The slope is that of the chords of the single ``|g_m|``.

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
"""What the poles are multiplied by, beside zero."""
RADIUS = 0.995
"""Poles of the weights lie within: those of a centre need not be stable."""


@dataclass(frozen=True, eq=False)
class WeightedSums:
    """Weights, and the noise of the sums.

    Parameters
    ----------
    weights
        Shape (f, K). The newest equation's first.
    slopes
        Shape (f, na).
    levels
        Shape (f,). The noise of a sum is at most the bound D times ``level + slope' a``.
    """

    weights: Array
    slopes: Array
    levels: Array

    @staticmethod
    def single(na: int) -> WeightedSums:
        """Return each equation for itself, with a noise that is in the equation: at most D."""
        return WeightedSums(np.ones((1, 1)), np.zeros((1, na)), np.ones(1))

    @staticmethod
    def around(polytope: Polytope, axes: Array, length: int) -> WeightedSums:
        """Return sums whose noise is small over a set.

        Parameters
        ----------
        polytope
            Its first parameters are a; the ends beyond those of the box bound ``axes @ a``.
        axes
            Shape (na, na). Nearly orthogonal.
        length
            K.
        """
        na, n = len(axes), polytope.n
        lower, upper = polytope.lower[:na], polytope.upper[:na]
        ends = polytope.ends[2 * n :]
        box = np.array(list(product(*zip(lower, upper, strict=True))))
        turned = np.array(list(product(*zip(-ends[na:], ends[:na], strict=True)))) @ axes
        # a = axes' (axes a) + rest, for axes that are not quite orthogonal.
        size = np.maximum(np.abs(lower), np.abs(upper))
        skew = np.abs(np.eye(na) - axes.T @ axes) + (na + 4) * EPSILON * (np.abs(axes.T) @ np.abs(axes))
        rest = float((skew @ size).sum())

        weights = np.zeros((len(DRAWN) + 1, length))
        weights[0, 0] = 1.0
        for f, drawn in enumerate(DRAWN, start=1):
            weights[f] = _impulse_response(turned.mean(axis=0), drawn, length)
        shifted = np.zeros((na + 1, len(weights), length + na))
        for i in range(na + 1):
            shifted[i, :, i : i + length] = weights
        gains = [shifted[0] + np.tensordot(corners, shifted[1:], 1) for corners in (box, turned)]
        low = np.maximum(gains[0].min(axis=0), gains[1].min(axis=0))
        high = np.minimum(gains[0].max(axis=0), gains[1].max(axis=0))
        chords = np.clip((high + low) / np.maximum(high - low, 1e-200), -1.0, 1.0)
        slopes = (shifted[1:] * chords).sum(axis=2).T

        levels = np.full(len(weights), np.inf)
        for gain, corners in zip(gains, (box, turned), strict=True):
            levels = np.minimum(levels, (np.abs(gain).sum(axis=2) - corners @ slopes.T).max(axis=0))
        total = np.abs(weights).sum(axis=1)
        reach = 1.0 + max(float(np.abs(corners).sum(axis=1).max()) for corners in (box, turned))
        rounding = (length + 3 * na + 8) * EPSILON * reach * (total + np.abs(slopes).max(axis=1))
        levels = levels + 2.0 * rounding + rest * (total + np.abs(slopes).max(axis=1)) + TINY
        return WeightedSums(weights, slopes, levels)

    def rows(self, windows: Array, noise_bound: float, size: Array, slip: float) -> tuple[Array, Array]:
        """Return the rows ``normals @ theta <= offsets`` of equations.

        Parameters
        ----------
        windows
            Shape (w, K, 1 + n). ``y[t]`` and ``phi[t]`` of consecutive equations, the newest first.
        noise_bound
            D.
        size
            Shape (n,). Largest magnitude of each parameter.
        slip
            Relative error of the regressors.
        """
        sums = (self.weights @ windows).reshape(-1, windows.shape[2])
        absolute = (np.abs(self.weights) @ np.abs(windows)).reshape(sums.shape)
        repeated = len(windows)
        tilt = np.zeros((len(sums), windows.shape[2] - 1))
        tilt[:, : self.slopes.shape[1]] = noise_bound * np.tile(self.slopes, (repeated, 1))
        noise = noise_bound * np.tile(self.levels, repeated)
        normals = np.concatenate([sums[:, 1:] - tilt, -sums[:, 1:] - tilt])
        relative = slip + (self.weights.shape[1] + 8) * EPSILON
        rounding = relative * (absolute[:, 0] + (absolute[:, 1:] + np.abs(tilt)) @ size + np.abs(noise)) + TINY
        offsets = np.concatenate([sums[:, 0] + noise, noise - sums[:, 0]]) + np.tile(2.0 * rounding, 2)
        return normals, offsets


def _impulse_response(a: Array, drawn: float, length: int) -> Array:
    """Return the first samples of ``1 / A``, its poles multiplied by a factor and held inside the unit circle."""
    radius = drawn * float(np.abs(np.roots(np.append(1.0, a))).max(initial=0.0))
    factor = drawn * min(1.0, RADIUS / radius) if radius > 0 else drawn
    denominator = np.append(1.0, a * factor ** np.arange(1, len(a) + 1))
    return np.asarray(lfilter([1.0], denominator, np.append(1.0, np.zeros(length - 1))))


def principal_axes(polytope: Polytope, na: int) -> tuple[Array, Array]:
    """Return the principal axes of the points where the ends of a set are attained, and their spread.

    Parameters
    ----------
    na
        Its first parameters count.

    Returns
    -------
    axes : ndarray, shape (na, na)
        One axis a row.  A set is often long and thin; its enclosure along these axes is thin too.
    spread : ndarray, shape (na,)
        Of the points along each.
    """
    points = polytope.vertices[:, :na]
    centred = points - points.mean(axis=0)
    axes = np.linalg.eigh(centred.T @ centred)[1].T
    return axes, np.ptp(points @ axes.T, axis=0)
