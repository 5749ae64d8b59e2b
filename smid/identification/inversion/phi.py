r"""The functions \phi_1(z) = (exp(z) - 1) / z and \phi_{k+1}(z) = (\phi_k(z) - 1/k!) / z, of numbers and of forms."""

from __future__ import annotations

import math

from relaxations.algebra.affine_arithmetic import HIGH, LOW, between, linear, nothing_known
from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import EPSILON, TINY
from relaxations.algebra.compiled import compiled

UP = 1.0 + 128.0 * EPSILON
r"""Covers the rounding of a few products, and of \phi."""

STEEPEST = 50.0
r"""Beyond, \phi is unbounded."""


@compiled
def phi(z: float, k: int) -> float:
    r"""Return \phi_k, within half of `UP`."""
    if z == -math.inf:
        return 0.0
    if abs(z) < 4.0:
        # Sums of positive terms only: of z^j / (j + k)!, or of exp(z) (-z)^j / (j! (j + k) (k - 1)!).
        factorial = 1.0
        for n in range(2, k + 1):
            factorial *= n
        total, term, j = 0.0, 1.0 / factorial, 0
        if z >= 0.0:
            while term > 1e-18 * total:
                total += term
                j += 1
                term *= z / (j + k)
            return total
        term *= k
        while term > 1e-18 * total:
            total += term / (j + k)
            j += 1
            term *= -z / j
        return total * math.exp(z)
    value = math.expm1(z)
    if k == 1:
        return value / z
    return (value - z) / (z * z) if k == 2 else (value - z - 0.5 * z * z) / (z * z * z)


@compiled
def phi_of(w: Array, to: int, a: int, k: int) -> None:
    r"""Write \phi_k of a form: its tangent, within half of its largest second derivative times the square."""
    low, high = w[a, LOW], w[a, HIGH]
    if not high <= STEEPEST:
        nothing_known(w, to)
        w[to, LOW] = 0.0
        return
    bottom, top = phi(low, k) * (2.0 - UP), phi(high, k) * UP
    error = math.inf
    if math.isfinite(low):
        middle = 0.5 * low + 0.5 * high
        half = max(high - middle, middle - low)
        value = phi(middle, k)
        slope = value - k * phi(middle, k + 1) if k < 3 else 0.0
        # The second derivative is the integral of (1 - s)^2 exp(z (1 - s)) s^(k - 1) / (k - 1)! from 0 to 1.
        bend = (1.0 / 3.0 if k == 1 else 1.0 / 12.0) * math.exp(max(high, 0.0))
        if high < -1.0:
            bend = min(bend, -2.0 / (high * high * high))
        error = (0.5 * bend * half * half + 256.0 * EPSILON * (value * (1.0 + abs(middle) + half))) * UP + TINY
    if k < 3 and error < 0.5 * (top - bottom):
        linear(w, to, a, slope, value - slope * middle, error)
        w[to, LOW], w[to, HIGH] = max(w[to, LOW], bottom), min(w[to, HIGH], top)
    else:
        between(w, to, bottom, top)
