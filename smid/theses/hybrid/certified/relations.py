r"""Linear inequalities for the arm's constants from the measured angles.

With the hat function phi over two neighbouring intervals (a linear spline, zero at both ends and one in the middle)
integration by parts gives, exactly for any motion between the samples,

    (angle(k-1) - 2 angle(k) + angle(k+1)) / h = \int phi v' dt
                                               = theta c \int phi u - omega S - sigma Z - kappa Q,

    S = \int phi sign(v) [glides],     Z = \int phi (v / eps) [sticks],     Q = \int phi v |v|.

This is the shortest spline-type modulating function of the thesis's appendix I; it needs only the measured angles.
Every longer spline is a sum of hats with positive weights, so no others are needed.

The angle is measurement minus noise. The noises eta stay unknowns, shared by the relations of neighbouring samples. If
the speed has one sign s, with the mean speed m over an interval, a difference of angles, and r = v - m,

    \int phi v |v| = s (m^2 h/2  +- 2 m \tilde a h^2/12  +  \int phi r^2),

with m^2 between its chord and the parallel tangent over the interval of m, \tilde a some mean of the acceleration, and
\int r^2 between the least and the largest a^2 h^3/12: the nonlinear part is small. The product kappa eta is linear
about the middle of kappa's interval, and the rest is bounded. If the sign is not known, S, Z, Q are intervals. No
constant is negative, so a relation with interval coefficients is equivalent to two inequalities.

Where the arm sticks, the law is integrated between changes of the torque (v/eps is linear in the angle):

    v(j) - v(i) = theta c \int u - (sigma / eps) (angle(j) - angle(i)) - kappa \int v |v|.

References: hybrid thesis, (5.7)-(5.9), appendix I; Maletinsky, "On-line parameter estimation of continuous processes"
(1975).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array, Index, Mask
from relaxations.algebra.ball_arithmetic import Balls
from relaxations.algebra.intervals import Intervals
from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem
from smid.theses.hybrid.certified.speeds import ArmRecord, accelerations, between

__all__ = ["arm_problem"]

PRODUCTS = ("theta", "kappa", "omega", "sigma")
MOST_CUTS = 16  # most samples of one stretch of sticking between which the law is integrated


def arm_problem(record: ArmRecord, products: Intervals, speeds: Intervals) -> PolynomialProblem:
    """Return the linear problem of all constants and noises that explain the angles.

    Its variables are the four products, the noise of each sample, and the lag of each interval.

    Parameters
    ----------
    products
        Shape (4,). Box of theta, kappa, omega, sigma.
    speeds
        Shape (n,). At the samples, from `enclose_speeds`.
    """
    n = record.n_samples
    noise = np.full(n, record.noise_bound)
    halves = _integrals(record, products, speeds)
    parts = [
        _hats(record, products, halves),
        *_stuck(record, products, speeds),
        Polynomials.from_terms([{(3,): 1.0, (2,): -1.0}]),  # sticking holds at least as firmly as gliding
    ]
    return PolynomialProblem(
        (*PRODUCTS, *(f"eta[{k}]" for k in range(n)), *(f"lag[{k}]" for k in range(n - 1))),
        np.concatenate([products.lower, -noise, halves.lag.lower]),
        np.concatenate([products.upper, noise, halves.lag.upper]),
        Polynomials.empty(),
        Polynomials.join(parts),
    )


@dataclass(frozen=True)
class _Integrals:
    """Integrals over each interval with half a hat, shape (n - 1,); of Q, the part linear in the angles is apart.

    The lag is kappa times the odd part of Q. It has opposite signs in the relations of the two samples of an interval.
    It is an unknown that both share, so that its error cancels along the record.
    """

    gliding: Intervals
    sticking: Intervals
    drag: Intervals
    slope: Array  # of Q in the increment of the angle
    lag: Intervals


def _hats(record: ArmRecord, products: Intervals, halves: _Integrals) -> Polynomials:
    n, h = record.n_samples, record.sampling_time
    first, last = slice(None, -1), slice(1, None)
    angles = Intervals.of(record.angle)
    increments = angles[1:] - angles[:-1]
    left, right = halves.slope[first], halves.slope[last]
    gliding = (halves.gliding[first] + halves.gliding[last]) * h
    sticking = (halves.sticking[first] + halves.sticking[last]) * h
    drag = (halves.drag[first] + halves.drag[last] + increments[first] * left + increments[last] * right) * h
    torque = (record.torque[first] + record.torque[last]) * (0.5 * h) * h
    second = increments[last] - increments[first]
    # kappa slope eta about the middle of kappa
    middle = float(0.5 * (products.lower[1] + products.upper[1]))
    exact = [(Intervals.of(products.lower[1], products.upper[1]) * w) * h for w in (left, -left, right, -right)]
    weights = [middle * h * w for w in (left, -left, right, -right)]
    rest = sum(((e - w).magnitude for e, w in zip(exact, weights, strict=True)), start=np.zeros(n - 2))
    # eta(k-1), eta(k), eta(k), eta(k+1) in theta U - omega S - sigma Z - kappa Q - second + second difference of eta;
    # an increment of angles is one of measurements minus one of noises.
    at = np.arange(n - 2)
    noises = [(at, 1.0 - weights[0]), (at + 1, -2.0 - weights[1] - weights[2]), (at + 2, 1.0 - weights[3])]
    noises += [(n + at, np.full(n - 2, -h)), (n + at + 1, np.full(n - 2, h))]
    # A bound on the rounding of the summed weights.
    rounding = 1e-14 * (2.0 + np.abs(np.stack(weights)).sum(axis=0))
    slack = record.noise_bound * (rest + rounding) * (1 + 1e-12)
    most = [torque.upper, -drag.lower, -gliding.lower, -sticking.lower]
    least = [torque.lower, -drag.upper, -gliding.upper, -sticking.upper]
    above = _rows(most, noises, np.nextafter(slack - second.lower, np.inf), 1.0)
    below = _rows(least, noises, np.nextafter(slack + second.upper, np.inf), -1.0)
    return Polynomials.join([above, below])


def _rows(constants: list[Array], noises: list[tuple[Index, Array]], free: Array, sign: float) -> Polynomials:
    """Return ``sign (constants' products + noises) + free >= 0``, without the rows that are not finite."""
    kept = np.flatnonzero(np.isfinite(np.stack([*constants, free])).all(axis=0))
    own = np.arange(len(kept))
    columns = [np.full(len(kept), k) for k in range(len(constants))] + [at[kept] + 4 for at, _ in noises]
    values = [sign * c[kept] for c in constants] + [sign * w[kept] for _, w in noises]
    columns.append(np.full(len(kept), -1))
    values.append(free[kept])
    return Polynomials(
        len(kept),
        np.tile(own, len(columns)),
        np.concatenate(columns).astype(np.int64)[:, None],
        Balls.exact(np.concatenate(values)),
    ).collect()


def _integrals(record: ArmRecord, products: Intervals, speeds: Intervals) -> _Integrals:
    """Return the integrals over each interval; those with both halves of a hat differ only by the lag."""
    h, eps = record.sampling_time, record.eps
    v = between(speeds)
    a = accelerations(record, products, v)
    forwards, backwards = v.lower >= eps, v.upper <= -eps
    sure = (forwards | backwards) & np.isfinite(v.width)
    sign = np.where(backwards, -1.0, 1.0)
    mean = _mean_speeds(record, products, speeds, a, sure)
    gliding = Intervals(
        np.where(forwards, 1.0, np.where(v.lower > -eps, 0.0, -1.0)),
        np.where(backwards, -1.0, np.where(v.upper < eps, 0.0, 1.0)),
    )
    creeping = Intervals(np.clip(v.lower, -eps, eps), np.clip(v.upper, -eps, eps)) / eps
    # A speed that may be outside the sticking range contributes zero there.
    sticking = Intervals(
        np.where(sure, 0.0, np.where(v.upper >= eps, np.minimum(creeping.lower, 0.0), creeping.lower)),
        np.where(sure, 0.0, np.where(v.lower <= -eps, np.maximum(creeping.upper, 0.0), creeping.upper)),
    )
    # m^2 = slope m + chord, exactly for some chord in these
    slope = np.where(sure, mean.lower + mean.upper, 0.0)
    low, high = Intervals.of(mean.lower), Intervals.of(mean.upper)
    ends = (low.square() - low * slope).hull(high.square() - high * slope)
    chord = Intervals(-Intervals.of(slope / 2).square().upper, ends.upper)
    side = Intervals.of(sign)
    weight = 0.5 * h
    drag = ((chord * weight + _ripple(a, h)) * side).where(sure, v.signed_square() * weight)
    lag = mean * a * side * h * h / 6.0 * products[1:2]
    none = Intervals.of(np.zeros(len(sure)))
    return _Integrals(gliding * weight, sticking * weight, drag, sign * slope / 2, lag.where(sure, none))


def _mean_speeds(record: ArmRecord, products: Intervals, speeds: Intervals, a: Intervals, sure: Mask) -> Intervals:
    """Return the mean speed over each interval: from the angles and, where no event occurs, the trapezoid."""
    h = record.sampling_time
    v = between(speeds)
    mean = v.meet(record.turned[1] / h)
    with np.errstate(invalid="ignore"):  # where nothing is known yet
        bend = 2 * products.upper[1] * v.magnitude * a.magnitude  # of the speed: |v''| = 2 kappa |v a|
    trapezoid = (speeds[:-1] + speeds[1:]) * 0.5 + Intervals.within(bend * h * h / 12 * (1 + 1e-12))
    return mean.meet(trapezoid).where(sure, mean)


def _ripple(a: Intervals, h: float) -> Intervals:
    """Return the integral of half a hat times r^2, with r the speed minus its mean and its slope a."""
    spread = a.square() * h * h * h / 24.0
    half_width = Intervals.within(a.width * 0.5)
    odd = Intervals.within(a.magnitude) * half_width + half_width * half_width
    both = spread + odd * h * h * h / 8.0
    return Intervals(np.maximum(both.lower, 0.0), both.upper)


def _stuck(record: ArmRecord, products: Intervals, speeds: Intervals) -> list[Polynomials]:
    """Return the law integrated over stretches of certain sticking.

    Between changes of the torque, the noise widens the coefficient of sigma. From the beginning to every sample, the
    noise is shared, and sigma times it is linear about the middle. The first suits a wide interval of sigma, the second
    a narrow one.
    """
    v = between(speeds)
    inside = np.concatenate([[False], (v.lower >= -record.eps) & (v.upper <= record.eps), [False]])
    starts, ends = np.flatnonzero(inside[1:] & ~inside[:-1]), np.flatnonzero(~inside[1:] & inside[:-1])
    stretches = list(zip(starts.tolist(), ends.tolist(), strict=True))
    pairs = [pair for start, end in stretches for pair in _pairs(record, start, end)]
    if not pairs:
        return []
    rays = [(start, k) for start, end in stretches for k in range(start + 1, end + 1)]
    noise = Intervals.within(2 * record.noise_bound)
    i, j = np.array(pairs).T
    blurred = _creep_rows(record, speeds, i, j, noise, [], np.zeros(len(i)))
    i, j = np.array(rays).T
    middle = float(0.5 * (products.lower[3] + products.upper[3])) / record.eps
    rest = (Intervals.of(products.lower[3], products.upper[3]) * _reciprocal(record.eps) - middle).magnitude
    slack = np.full(len(i), 2 * record.noise_bound * float(rest) * (1 + 1e-12))
    weight = np.full(len(i), middle)
    return [blurred, _creep_rows(record, speeds, i, j, Intervals.of(0.0), [(i, -weight), (j, weight)], slack)]


def _creep_rows(
    record: ArmRecord,
    speeds: Intervals,
    i: Index,
    j: Index,
    noise: Intervals,
    noises: list[tuple[Index, Array]],
    slack: Array,
) -> Polynomials:
    """Return ``theta c int u - (sigma / eps) turned - kappa int v |v| + noises = v(j) - v(i)``, both ways."""
    h, eps = record.sampling_time, record.eps
    samples = np.arange(record.n_samples - 1)
    impulse = _dot((samples >= i[:, None]) & (samples < j[:, None]), record.torque) * h
    turned = Intervals.of(record.angle[j]) - record.angle[i] + noise
    creep = turned * _reciprocal(eps)
    change = speeds[j] - speeds[i]
    drag = Intervals.within((j - i) * h * eps * eps * (1 + 1e-12))
    nothing = np.zeros(len(i))
    most = [impulse.upper, -drag.lower, nothing, -creep.lower]
    least = [impulse.lower, -drag.upper, nothing, -creep.upper]
    return Polynomials.join(
        [
            _rows(most, noises, np.nextafter(slack - change.lower, np.inf), 1.0),
            _rows(least, noises, np.nextafter(slack + change.upper, np.inf), -1.0),
        ]
    )


def _reciprocal(value: float) -> Intervals:
    return Intervals.of(np.nextafter(1 / value, 0), np.nextafter(1 / value, np.inf))


def _pairs(record: ArmRecord, start: int, end: int) -> list[tuple[int, int]]:
    """Return pairs of samples of a stretch: its ends and changes of the torque, or evenly spaced samples."""
    torque = record.torque.lower
    cuts = [start, *(k for k in range(start + 1, end) if torque[k] != torque[k - 1]), end]
    if len(cuts) > MOST_CUTS:
        cuts = sorted(set(np.linspace(start, end, MOST_CUTS).round().astype(int).tolist()))
    return [(a, b) for a in cuts for b in cuts if a < b]


def _dot(spans: Mask, values: Intervals) -> Intervals:
    """Return sums over spans, with a bound on the rounding of a sum of n terms."""
    weights = spans.astype(np.float64)
    rounding = len(values.lower) * 2.0**-51 * (weights @ values.magnitude)
    return Intervals(weights @ values.lower - rounding, weights @ values.upper + rounding)
