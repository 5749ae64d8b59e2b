"""Static sensor curves given by their inverse: from channel to signal, and back by solving per sample."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import sympy

from relaxations.algebra.arrays import Array
from smid.models.errors import ModelError
from smid.models.parts import Measurement
from smid.models.symbols import VALUE

__all__ = ["channel_to_signal", "signal_to_channel"]


def _coefficients(channel: str, inverse: sympy.Expr, values: Mapping[str, Any]) -> Array:
    """Coefficients of the inverse curve, highest power first, of shape (B, degree + 1)."""
    polynomial = sympy.Poly(inverse, VALUE) if inverse.is_polynomial(VALUE) else None
    if polynomial is None:
        raise ModelError(f"the inverse sensor curve of {channel!r} is not a polynomial in VALUE: give a polynomial")
    symbols = sorted(inverse.free_symbols - {VALUE}, key=str)
    evaluated = sympy.lambdify(symbols, polynomial.all_coeffs(), "numpy")(*(values[str(s)] for s in symbols))
    columns = np.broadcast_arrays(*(np.atleast_1d(np.asarray(item, float)) for item in evaluated))
    return np.stack(columns, axis=1)


def channel_to_signal(measurement: Measurement, channel: Array, values: Mapping[str, Any]) -> Array:
    """Return the signal that a noise-free channel measures.

    Shape (n,), or (B, n) where the curve has batched parameters.

    Parameters
    ----------
    measurement
        The sensor.
    channel
        Shape (n,).
    values
        Parameter values, scalars or of shape (B,).

    Raises
    ------
    ModelError
        If the curve is not a polynomial.

    Examples
    --------
    >>> channel_to_signal(Measurement("y", "x", "eta", VALUE + VALUE**3), np.array([2.0]), {})
    array([10.])
    """
    if measurement.inverse is None:
        return channel
    rows = np.stack(
        [np.polyval(row, channel) for row in _coefficients(measurement.channel, measurement.inverse, values)]
    )
    return rows if len(rows) > 1 else np.asarray(rows[0])


def signal_to_channel(
    measurement: Measurement, values_of_signal: Array, values: Mapping[str, Any], anchor: float = 0.0
) -> Array:
    """Solve the inverse curve for the noise-free channel, on its monotone branch around `anchor`.

    Shape of the signal, or (B, n).

    Parameters
    ----------
    measurement
        The sensor.
    values_of_signal
        Shape (n,) or (B, n).
    values
        Parameter values, scalars or of shape (B,).
    anchor
        A value of the channel on the wanted branch, in the channel's unit.

    Raises
    ------
    ModelError
        If the curve is not invertible over the range of the signal.

    Examples
    --------
    >>> signal_to_channel(Measurement("y", "x", "eta", VALUE + VALUE**3), np.array([10.0]), {}).round(12)
    array([2.])
    """
    if measurement.inverse is None:
        return values_of_signal
    curves = _coefficients(measurement.channel, measurement.inverse, values)
    targets = np.atleast_2d(values_of_signal)
    count = max(len(curves), len(targets))
    solved = np.stack(
        [
            _solve(measurement.channel, curve, target, anchor)
            for curve, target in zip(
                np.broadcast_to(curves, (count, curves.shape[1])),
                np.broadcast_to(targets, (count, targets.shape[1])),
                strict=True,
            )
        ]
    )
    return solved if count > 1 or values_of_signal.ndim > 1 else np.asarray(solved[0])


def _branch(curve: Array, anchor: float) -> tuple[float, float, float]:
    """Find the ends of the monotone branch around the anchor, and +1 where it rises, -1 where it falls."""
    slope = np.polyder(curve)
    roots = np.roots(slope)
    scale = 1e-6 * (1.0 + np.abs(roots))
    real = np.sort(roots.real[np.abs(roots.imag) <= scale])
    # At an even root (v**3 at 0) the slope touches zero without a change of sign: this is not an end of a branch.
    margin = 1e-5 * (1.0 + np.abs(real))
    turns = real[np.polyval(slope, real - margin) * np.polyval(slope, real + margin) < 0]
    lower = max((float(root) for root in turns if root <= anchor), default=-np.inf)
    upper = min((float(root) for root in turns if root > anchor), default=np.inf)
    inside = np.clip(anchor, lower + 1e-5 * (1 + abs(lower)), upper) if np.isfinite(lower) else anchor
    rise = float(np.polyval(slope, inside)) or float(np.polyval(slope, inside + 1e-3))
    return lower, upper, float(np.sign(rise))


def _solve(channel: str, curve: Array, target: Array, anchor: float) -> Array:
    """Newton's method kept inside a shrinking bracket, all samples at once."""
    lower, upper, rise = _branch(curve, anchor)
    known = np.isfinite(target)
    result = np.full(target.shape, np.nan)
    if not known.any():
        return result
    wanted = rise * target[known]
    low = _reach(curve, rise, anchor, lower, wanted.min(), -1.0)
    high = _reach(curve, rise, anchor, upper, wanted.max(), 1.0)
    outside = (rise * np.polyval(curve, low) > wanted) | (rise * np.polyval(curve, high) < wanted) | (rise == 0)
    if outside.any():
        sample = int(np.flatnonzero(known)[np.argmax(outside)])
        raise ModelError(
            f"the sensor curve of {channel!r} is not invertible at sample {sample}, where the signal is "
            f"{target[sample]:.6g}: narrow its parameters so that the curve is monotone over the data"
        )
    below, above = np.full(wanted.shape, low), np.full(wanted.shape, high)
    slope = rise * np.polyder(curve)
    guess = 0.5 * (below + above)
    for _ in range(200):
        error = rise * np.polyval(curve, guess) - wanted
        below, above = np.where(error <= 0, guess, below), np.where(error >= 0, guess, above)
        steepness = np.polyval(slope, guess)
        newton = guess - np.divide(error, steepness, out=np.full(error.shape, np.inf), where=steepness > 0)
        # Newton leaves the bracket where the curve is flat; bisection then takes over.
        better = np.where((newton >= below) & (newton <= above), newton, 0.5 * (below + above))
        done = np.abs(better - guess) <= 4e-16 * (1.0 + np.abs(better))
        guess = better
        if done.all():
            break
    result[known] = guess
    return result


def _reach(curve: Array, rise: float, anchor: float, end: float, wanted: float, direction: float) -> float:
    """Go from the anchor towards an end of the branch until the curve has passed the wanted value."""
    step = 1.0
    point = anchor
    while direction * rise * np.polyval(curve, point) < direction * wanted and abs(point) < 1e150:
        point = anchor + direction * step
        if direction * point >= direction * end:
            return end
        step *= 2.0
    return point
