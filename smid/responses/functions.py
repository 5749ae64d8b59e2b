"""Step response, gain and phase of a transfer function as functions of its parameters, enclosed by Taylor models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import mpmath
import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.ball_arithmetic import EPSILON
from smid.responses.coefficients import Coefficients
from smid.responses.taylor import Taylor, joined

_BITS = 200  # precision of the elementary functions, of which 53 bits are kept


class Functions(Protocol):
    """Real functions of the parameters."""

    def __call__(self, point: Sequence[Taylor], n: int) -> Taylor:
        """Return all functions along the last axis, for parameters that are models of n variables."""


@dataclass(frozen=True)
class Step:
    """The response to a unit step, from rest, at some samples counted from 0.

    With z the last responses of 1/A and the step itself, ``z[t+1] = M z[t]``. Each power of M is a product of two of
    about half its height: errors grow exponentially along a recursion, even where the response decays.
    """

    block: Coefficients
    samples: Index

    def __call__(self, point: Sequence[Taylor], n: int) -> Taylor:
        """Return the response."""
        last = int(self.samples.max())
        numerator, denominator = self.block.at(point, n)
        poles = -denominator[1:] / denominator[:1]
        size = len(poles.value) + 1
        fixed = np.zeros((size, size))
        fixed[0, -1] = fixed[-1, -1] = 1.0
        fixed[1:-1, :-2] = np.eye(max(size - 2, 0))
        first = joined([poles, Taylor.linear(np.zeros(1), np.zeros((n, 1)))])[None, :]
        below = Taylor.linear(np.zeros((size - 1, size)), np.zeros((n, size - 1, size)))
        power = (joined([first, below], -2) + Taylor.linear(fixed, np.zeros((n, size, size))))[None]
        powers = power
        while len(powers.value) <= last:
            powers = joined([powers, _matrix_product(power, powers)], -3)
            power = _matrix_product(power, power)
        alone = powers[: last + 1, 0, size - 1]  # the response of 1/A with leading coefficient one
        factors = numerator / denominator[:1]
        parts = [_delayed(alone * factors[k : k + 1], k) for k in range(min(len(factors.value), last + 1))]
        return joined([part[None] for part in parts], -2).sum(-2)[self.samples]


def _matrix_product(left: Taylor, right: Taylor) -> Taylor:
    return (left[..., :, :, None] * right[..., None, :, :]).sum(-2)


def _delayed(response: Taylor, lag: int) -> Taylor:
    return joined([response[:lag].scaled(np.zeros(1)), response[: len(response.value) - lag]])


@dataclass(frozen=True)
class Circle:
    """The powers of q = exp(-jwT) at some frequencies w.

    Parameters
    ----------
    cosines, sines
        Shape (n_powers, n_frequencies). Real and imaginary parts, each rounded once.
    """

    cosines: Array
    sines: Array

    @staticmethod
    def of(frequencies: Array, sampling_time: float, n_powers: int) -> Circle:
        """Return the powers at frequencies in rad/s."""
        with mpmath.workprec(_BITS):
            step = [mpmath.mpf(w) * mpmath.mpf(sampling_time) for w in frequencies.tolist()]
            parts = (
                [[float(part(-k * x)) for x in step] for k in range(n_powers)] for part in (mpmath.cos, mpmath.sin)
            )
            return Circle(*(np.array(part).reshape(n_powers, len(step)) for part in parts))

    def polynomial(self, coefficients: Taylor) -> tuple[Taylor, Taylor]:
        """Return real and imaginary part of a polynomial in q; the last axis counts the frequencies."""
        count = len(coefficients.value)
        parts = (coefficients[:, None].scaled(part[:count], EPSILON).sum(-2) for part in (self.cosines, self.sines))
        real, imaginary = parts
        return real, imaginary


@dataclass(frozen=True)
class SquaredGain:
    """``|B|^2 / |A|^2``."""

    block: Coefficients
    circle: Circle

    def __call__(self, point: Sequence[Taylor], n: int) -> Taylor:
        """Return the squares."""
        above, below = (self.circle.polynomial(part) for part in self.block.at(point, n))
        return (above[0] * above[0] + above[1] * above[1]) / (below[0] * below[0] + below[1] * below[1])


@dataclass(frozen=True)
class Phase:
    """``arg B - arg A`` in rad, up to turns: next to the phase of a reference.

    Parameters
    ----------
    reference
        Any values of B and A but zero, shape (2, n_frequencies).
    turns
        Shape (n_frequencies,). Turns to add.
    """

    block: Coefficients
    circle: Circle
    reference: Array
    turns: Array

    def __call__(self, point: Sequence[Taylor], n: int) -> Taylor:
        """Return the phases."""
        parts = [
            _argument(*self.circle.polynomial(part), known)
            for part, known in zip(self.block.at(point, n), self.reference, strict=True)
        ]
        with mpmath.workprec(_BITS):
            known = [
                float(mpmath.arg(mpmath.mpc(b)) - mpmath.arg(mpmath.mpc(a)) + 2 * mpmath.pi * k)
                for b, a, k in zip(*self.reference.tolist(), self.turns.tolist(), strict=True)
            ]
        start = np.array(known)
        return parts[0] - parts[1] + Taylor.linear(start, np.zeros((n, len(start))), EPSILON * np.abs(start))


def _argument(real: Taylor, imaginary: Taylor, reference: Array) -> Taylor:
    """Return the argument of a complex number over a reference, in rad: infinite errors where it may be zero."""
    # z = z_0 (1 + u), and arg (1 + u) = Im (u - u^2 / 2) up to |u|^3 / 3 / (1 - |u|)
    x, y = real.value, imaginary.value
    square = np.where((x == 0) & (y == 0), 1.0, x * x + y * y)
    u = (
        (real.scaled(x) + imaginary.scaled(y)).scaled(1 / square, 4 * EPSILON),
        (imaginary.scaled(x) - real.scaled(y)).scaled(1 / square, 4 * EPSILON),
    )
    one = Taylor.linear(np.ones_like(x), np.zeros_like(real.slopes))
    u = (u[0] - one, u[1])
    reach = np.hypot(u[0].size, u[1].size) * (1 + 4 * EPSILON)
    reach = np.where((x == 0) & (y == 0), np.inf, reach)
    rest = np.where(reach < 1, reach**3 / np.where(reach < 1, 3 * (1 - reach), 1.0), np.inf)
    found = u[1] - u[0] * u[1]
    start = _angle(x, y, reference)
    error = found.error + rest * (1 + 16 * EPSILON) + EPSILON * (np.abs(start) + 4 * reach)
    return Taylor(start + found.value, found.slopes, found.curvature, error)


def _angle(x: Array, y: Array, reference: Array) -> Array:
    """Return the angles from the references to the numbers, between -pi and pi, rounded once."""
    with mpmath.workprec(_BITS):
        numbers = zip(x.tolist(), y.tolist(), reference.tolist(), strict=True)
        return np.array([float(mpmath.arg(mpmath.mpc(a, b) * mpmath.mpc(c).conjugate())) for a, b, c in numbers])


@dataclass(frozen=True)
class Reflections:
    """The reflection coefficients of A: all roots are inside the unit circle exactly when each is between -1 and 1.

    Schur and Cohn's test: k = a_n / a_0 is one, and the others are those of ``(A - k A*) / z``, of degree n - 1.
    """

    block: Coefficients

    def __call__(self, point: Sequence[Taylor], n: int) -> Taylor:
        """Return the coefficients, one for each root."""
        rest = self.block.at(point, n)[1]
        found = []
        while len(rest.value) > 1:
            last = rest[-1:] / rest[:1]
            found.append(last)
            rest = (rest - rest[::-1] * last)[:-1]
        return joined(found)
