r"""Certified intervals of the arm's speed at every sample, from the angles and the box of its constants.

Between samples the input is held, so the speed obeys a scalar law that does not depend on time, v' = f(v). It is
monotonic and stays between its values at both ends. An enclosure of the speeds at the samples therefore gives one of
the accelerations a between them, which in turn bounds the speeds. Over m intervals of h, T = m h,

    angle(k+m) - angle(k) = v(k) T + \int a(s) (t(k+m) - s) ds,                                    (windows)
    v(k+1) - v(k) = \int a(s) ds,                                                                  (steps)

and the same backwards. Four facts help while a is not known:

- growth: friction and drag only brake, so |v| grows by at most theta c |u| per second;
- sticking: the arm sticks while the torque is below Ws, theta c |u| <= sigma, and creeps at the end;
- escape: an arm that glides while the torque exceeds Wd and drag accelerates, which the angles would show;
- terminal speed: above its terminal speed the arm slows down during an interval, so it ends below that speed or below
  the interval's mean. It began below the mean if all speeds up to the mean increase.

Everything is computed for the upper ends. The lower ends are those of the mirrored record.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.intervals import Intervals

__all__ = ["ArmRecord", "accelerations", "between", "enclose_speeds"]

LONGEST = 1.0  # s, of a window; in longer ones unknown accelerations exceed the noise
PASSES = 3


@dataclass(frozen=True)
class ArmRecord:
    """The measured angles, and the known constants.

    Parameters
    ----------
    angle
        Shape (n,). In rad, with errors of at most `noise_bound`.
    torque
        Shape (n - 1,). Of the motor over each interval, c u, in Nm.
    noise_bound
        In rad.
    sampling_time
        In s.
    eps
        Speed below which the arm sticks, in rad/s.
    """

    angle: Array
    torque: Intervals
    noise_bound: float
    sampling_time: float
    eps: float

    def mirrored(self) -> ArmRecord:
        """Return the record with all signs changed."""
        return ArmRecord(-self.angle, -self.torque, self.noise_bound, self.sampling_time, self.eps)

    @property
    def n_samples(self) -> int:
        """Return the number of samples."""
        return len(self.angle)

    @cached_property
    def turned(self) -> dict[int, Intervals]:
        """Return the angles turned over windows of 1, 2, 3, 4, 6, 8, 12, ... intervals from each sample."""
        longest = max(1, min(round(LONGEST / self.sampling_time), self.n_samples - 1))
        lengths = sorted({1} | {k * 2**j for k in (2, 3) for j in range(20) if k * 2**j <= longest})
        noise = Intervals.within(2 * self.noise_bound)
        return {m: Intervals.of(self.angle[m:]) - self.angle[:-m] + noise for m in lengths}


def between(speeds: Intervals) -> Intervals:
    """Return the speeds on each interval, from those at the samples, shape (n - 1,)."""
    return speeds[:-1].hull(speeds[1:])


def accelerations(record: ArmRecord, products: Intervals, speeds: Intervals) -> Intervals:
    """Return the acceleration in rad/s2 on each interval, for products (4,) and speeds (n - 1,) between samples."""
    friction = Intervals(
        -_largest_friction(record.eps, products, -speeds), _largest_friction(record.eps, products, speeds)
    )
    return record.torque * products[:1] - friction - speeds.signed_square() * products[1:2]


def _largest_friction(eps: float, products: Intervals, speeds: Intervals) -> Array:
    """Return the largest friction times theta over intervals of speeds; at +-eps both regimes count."""
    low, high = speeds.lower, speeds.upper
    (omega_low, omega_high), (sigma_low, sigma_high) = zip(products.lower[2:], products.upper[2:], strict=True)
    largest = np.full(low.shape, -np.inf)
    creeping = sigma_high * (np.minimum(high, eps) / eps) * (1 + 1e-15)
    largest = np.where((high > 0) & (low <= eps), creeping, largest)
    largest = np.where(high >= eps, np.maximum(largest, omega_high), largest)
    receding = sigma_low * (np.clip(high, -eps, 0.0) / eps) * (1 - 1e-15)
    largest = np.where((high <= 0) & (high >= -eps), np.maximum(largest, receding), largest)
    return np.where(low <= -eps, np.maximum(largest, -omega_low), largest)


def enclose_speeds(record: ArmRecord, products: Intervals, known: Intervals) -> Intervals:
    """Return the speeds at every sample in rad/s, shape (n,); empty if no constants in the box explain the angles.

    Parameters
    ----------
    products
        Shape (4,). theta, kappa, omega, sigma.
    known
        Shape (n,). Known intervals of the speeds.
    """
    mirror = record.mirrored()
    speeds = known
    for _ in range(PASSES):
        a = accelerations(record, products, between(speeds))
        upper = _upper_ends(record, products, speeds, a)
        lower = -_upper_ends(mirror, products, -speeds, -a)
        speeds = speeds.meet(Intervals(lower, upper))
        if speeds.empty:
            break
        speeds = _stepped(record, products, speeds)
    return speeds


def _upper_ends(record: ArmRecord, products: Intervals, speeds: Intervals, a: Intervals) -> Array:
    """Return upper ends from windows, growth and escape."""
    h, eps = record.sampling_time, record.eps
    upper = speeds.upper.copy()
    # Terminal speed.
    mean = (record.turned[1] / h).upper
    upper[1:] = np.minimum(upper[1:], np.maximum(mean, _terminal_speed(record, products)))
    rising = -_terminal_speed(record.mirrored(), products)
    upper[:-1] = np.where(rising > mean, np.minimum(upper[:-1], mean), upper[:-1])
    # Rates of growth and escape, then all windows.
    growth = Intervals.of((record.torque * products[:1]).magnitude)
    drag = Intervals.of(0.0, np.maximum(between(speeds).signed_square().upper, 0.0)) * products[1:2]
    escaping = (record.torque * products[:1] - products[2:3] - drag).lower
    unknown = Intervals.within(np.inf)
    runaway = Intervals.of(escaping).where(escaping >= 0, unknown)
    windows = zip(*(_windows(rates, h, record.turned) for rates in (a, growth, runaway)), strict=True)
    for (m, turned), (ahead, grown, run) in zip(record.turned.items(), windows, strict=True):
        span = Intervals.of(h) * m
        # v(k) T = turned - the contribution of later accelerations
        upper[:-m] = np.minimum(upper[:-m], _quotient((turned - ahead.later).upper, span))
        # v(k+m) T = turned + the contribution of earlier accelerations
        upper[m:] = np.minimum(upper[m:], _quotient((turned + ahead.earlier).upper, span))
        # With any braking, v(k+m) is below its whole growth, or was nearly as large before.
        before = _quotient((turned + grown.earlier).upper, span)
        upper[m:] = np.minimum(upper[m:], np.maximum(grown.total.upper, before))
        falling = _quotient((turned + grown.later).upper, span)
        upper[:-m] = np.where(falling < 0, np.minimum(upper[:-m], falling), upper[:-m])
        would_turn = (run.later + span * eps).lower
        upper[:-m] = np.where(turned.upper < would_turn, np.minimum(upper[:-m], eps), upper[:-m])
    return upper


def _terminal_speed(record: ArmRecord, products: Intervals) -> Array:
    """Return speeds above which the arm certainly slows down on each interval, shape (n - 1,)."""
    eps = record.eps
    kappa, omega, sigma = products[1], products[2], products[3]
    drive = record.torque * products[:1]
    forwards = np.maximum((drive - omega).upper, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        fastest = np.where(forwards > 0, np.sqrt(forwards / kappa.lower), 0.0)
        # Driven backwards beyond all friction, the terminal speed is negative.
        backwards = -(drive + omega).upper
        slowest = np.sqrt(np.maximum(backwards, 0.0) / kappa.upper)
    known = (drive.upper < -max(float(sigma.upper), float(omega.upper))) & np.isfinite(slowest)
    return np.where(known, -slowest * (1 - 1e-15), np.maximum(fastest * (1 + 1e-15), eps))


def _quotient(values: Array, span: Intervals) -> Array:
    """Return an upper bound of values divided by a positive span."""
    return np.nextafter(values / np.where(values >= 0, span.lower, span.upper), np.inf)


@dataclass(frozen=True)
class _Window:
    """Integrals of rates over all windows of one length: plain, weighted by the time left, and by the time passed."""

    total: Intervals
    later: Intervals
    earlier: Intervals


def _windows(rates: Intervals, h: float, lengths: Iterable[int]) -> Iterator[_Window]:
    """Yield the windows of each length in the order of `ArmRecord.turned`, each joined from two shorter ones."""
    half = rates * h * h * 0.5
    made = {1: _Window(rates * h, half, half)}
    for m in lengths:
        if m not in made:
            first = 1 << (m - 1).bit_length() - 1
            made[m] = _joined(made[first], first, made[m - first], m - first, h)
        yield made[m]


def _joined(left: _Window, m: int, right: _Window, n: int, h: float) -> _Window:
    """Return windows of m + n intervals: m of them, then n."""
    count = len(right.total.lower) - m
    a = _Window(*(part[:count] for part in (left.total, left.later, left.earlier)))
    b = _Window(*(part[m:] for part in (right.total, right.later, right.earlier)))
    return _Window(a.total + b.total, a.later + a.total * h * n + b.later, a.earlier + b.earlier + b.total * h * m)


def _creep(drive: Intervals, sigma: Intervals, eps: float) -> Intervals:
    """Return the speeds at which a sticking arm stops accelerating, within eps."""
    with np.errstate(divide="ignore", invalid="ignore"):
        upper = drive.upper / np.where(drive.upper >= 0, sigma.lower, sigma.upper) * eps
        lower = drive.lower / np.where(drive.lower >= 0, sigma.upper, sigma.lower) * eps
    upper = np.where(np.isfinite(upper), upper + 1e-14 * np.abs(upper), eps)
    lower = np.where(np.isfinite(lower), lower - 1e-14 * np.abs(lower), -eps)
    return Intervals(np.clip(lower, -eps, eps), np.clip(upper, -eps, eps))


def _stepped(record: ArmRecord, products: Intervals, speeds: Intervals) -> Intervals:
    """Bound the speeds forwards from sample to sample, with sticking, then backwards."""
    h, eps = record.sampling_time, record.eps
    rates = accelerations(record, products, between(speeds))
    rise = (rates * h).upper.tolist()
    fall = (rates * h).lower.tolist()
    # Bounds of the speed while the arm sticks.
    drive = record.torque * products[:1]
    brake = float(products.lower[2])
    up_step = ((drive - brake) * h).upper.tolist()
    down_step = ((drive + brake) * h).lower.tolist()
    holds_up = (drive.upper <= products.lower[3]).tolist()
    holds_down = (drive.lower >= -products.lower[3]).tolist()
    # A creeping speed nears drive eps / sigma like exp(-sigma t / eps) <= 1 / (1 + sigma t / eps).
    slower = float((products[3] * h).lower) / eps * (1 - 1e-15) + 1.0
    creep_up = _creep(drive + products[1] * (eps * eps), products[3], eps).upper.tolist()
    creep_down = _creep(drive - products[1] * (eps * eps), products[3], eps).lower.tolist()
    low, high = speeds.lower.tolist(), speeds.upper.tolist()
    # Forwards.
    for k in range(len(rise)):
        top = math.nextafter(high[k] + rise[k], math.inf)
        if holds_up[k]:
            if high[k] <= eps:
                top = min(top, creep_up[k] + max(high[k] - creep_up[k], 0.0) / slower * (1 + 1e-14))
            else:
                top = min(top, max(eps, math.nextafter(high[k] + up_step[k], math.inf)))
        bottom = math.nextafter(low[k] + fall[k], -math.inf)
        if holds_down[k]:
            if low[k] >= -eps:
                bottom = max(bottom, creep_down[k] + min(low[k] - creep_down[k], 0.0) / slower * (1 + 1e-14))
            else:
                bottom = max(bottom, min(-eps, math.nextafter(low[k] + down_step[k], -math.inf)))
        high[k + 1], low[k + 1] = min(high[k + 1], top), max(low[k + 1], bottom)
    # Backwards.
    for k in range(len(rise) - 1, -1, -1):
        high[k] = min(high[k], math.nextafter(high[k + 1] - fall[k], math.inf))
        low[k] = max(low[k], math.nextafter(low[k + 1] - rise[k], -math.inf))
    return Intervals.of(low, high)
