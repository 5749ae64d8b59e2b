"""Certified intervals of the reactor's time constant and factor, from bounded errors of its concentration.

The law (5.11) with a known power x is linear in ``k = 1/tau`` and ``g = a/tau``,

    y' = (k - r) u - g Y,     Y = y^x,     u held between samples.

Over one interval h, ``y(1) - y(0) = h ((k - r) u - g mean(Y))``. The concentration is monotonic, so mean(Y) lies
between Y(0) and Y(1), at ``Y(0) + psi (Y(1) - Y(0))``. The rate of Y decays as ``Y'' / Y' = -L`` with

    L = g x y^(x-1) - (x - 1) y' / y,     phi(h L_least) <= psi <= phi(h L_largest),     phi(z) = 1/(1 - e^-z) - 1/z,

because phi(h L) is psi for a constant L, and a faster decay moves the mean further. For x = 1 and a known g this is
exact. The noise is an unknown of each sample, as in `smid.theses.hybrid.certified.relations`: y^x lies between its
chord and the parallel tangent over the noise, and g times the noise is linear about the middle of g.

The box of k and g bounds psi, and linear programs bound the box, by turns. A box that stays coarse is halved, and
dropped if it is proven empty. There is no step size and no start value.

Reference: hybrid thesis, (5.6), (5.10)-(5.13), table 2.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.ball_arithmetic import Balls
from relaxations.algebra.intervals import Intervals
from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem
from smid.data import DataError, Dataset
from smid.display.result import Part
from smid.display.table import Table
from smid.models import ModelError
from smid.models.errors import refuse_unknown
from smid.models.reactor import A_BOX, LEAST_TAU, REACTION_RATE
from smid.theses.hybrid.certified.constants import CertifiedConstants
from smid.theses.hybrid.certified.contraction import contracted, quotient, relaxed_problem

__all__ = ["CertifiedReactor", "certify_reactor"]

ROUNDS = 30
COARSE = 1.02  # boxes whose ends differ by less than this factor are not halved
MOST_PARTS = 60
WORTH = 0.02  # least relative reduction of a width for another round
SERIES = 1e-2  # below it phi is taken between terms of its series
UNITS = {"tau": "s", "a": ""}


@dataclass(frozen=True, eq=False, repr=False)
class CertifiedReactor(CertifiedConstants):
    """Intervals that contain the constants of every reactor that explains the concentrations.

    Parameters
    ----------
    intervals
        tau in s, and a.
    noise_bound
        In the output's unit.
    parts
        Number of boxes.
    """

    noise_bound: float
    parts: int
    seconds: float

    @property
    def table(self) -> Table:
        """Return a row for each constant."""
        rows = tuple(
            (name, f"{low:.6g}", f"{high:.6g}", f"{100 * self.relative_width(name):.3g}%", UNITS[name])
            for name, (low, high) in self.intervals.items()
        )
        caption = f"Certified intervals of the reactor, |noise| <= {self.noise_bound:g}"
        return Table(caption, ("constant", "lower", "upper", "width", "unit"), rows, "lrrrl")

    def _content(self) -> Iterator[Part]:
        yield self.table

    def _rows(self) -> Iterator[dict[str, Any]]:
        for name, (lower, upper) in self.intervals.items():
            yield {"constant": name, "lower": lower, "upper": upper, "unit": UNITS[name]}

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "noise_bound": self.noise_bound,
            "intervals": {name: list(ends) for name, ends in self.intervals.items()},
            "parts": self.parts,
            "seconds": self.seconds,
        }


def certify_reactor(
    data: Dataset,
    noise_bound: float,
    *,
    power: int = 1,
    reaction_rate: float = REACTION_RATE,
    prior: Mapping[str, tuple[float, float]] | None = None,
) -> CertifiedReactor:
    """Return certified intervals of the reactor's constants.

    Parameters
    ----------
    data
        One experiment: concentrations of inflow, held between samples, and outflow.
    noise_bound
        Largest error of a measured concentration; below the least measured one if the power is not 1.
    power
        x, at least 1.
    reaction_rate
        r in 1/s.
    prior
        Of tau and a; by default those of `Reactor`.

    Raises
    ------
    DataError
        If the record does not fit, or no reactor explains it.
    ModelError
        If power or prior are not valid.

    Examples
    --------
    >>> from smid.theses.hybrid import simulate_reactor
    >>> from smid.signals import noise, qprts
    >>> u = qprts(120, seed=1)
    >>> y = simulate_reactor("factor", u, 1.0) + noise(120, seed=2, amplitude=0.002)
    >>> data = Dataset.from_arrays(input=u, output=y, sampling_time=1.0)
    >>> certify_reactor(data, 0.002).holds({"tau": 2.0, "a": 2.0})
    True
    """
    started = time.perf_counter()
    if power < 1 or power != int(power):
        raise ModelError(f"power = {power} is refused: certified intervals need a whole number of at least 1")
    # The box of k and g from the prior.
    u, y = _series(data, noise_bound, power)
    constants = _prior(prior or {}, reaction_rate)
    tau, a = constants[0], constants[1]
    k = Intervals(np.nextafter(1 / tau.upper, 0), np.nextafter(1 / tau.lower, np.inf))
    g = a * k
    first = Intervals(np.array([k.lower, g.lower]), np.array([k.upper, g.upper]))

    def problem(box: Intervals) -> PolynomialProblem:
        return _problem(u, y, data.sampling_time, noise_bound, power, reaction_rate, box)

    left, parts = _split(problem, first)
    if not left:
        raise DataError(
            f"proven: no reactor of power {power} within the prior explains these concentrations within "
            f"{noise_bound:g}. Raise the noise bound, widen the prior, or extend the law (smid.diagnose)"
        )
    # The factor is the quotient g / k, the time constant 1 / k.
    factors = [quotient(relaxed_problem(problem(box)), 1, box[0], a.meet(_ratio(box))) for box in left]
    times = Intervals.of(
        np.nextafter(1 / max(float(box.upper[0]) for box in left), 0),
        np.nextafter(1 / min(float(box.lower[0]) for box in left), np.inf),
    ).meet(tau)
    return CertifiedReactor(
        {
            "tau": (float(times.lower), float(times.upper)),
            "a": (min(float(f.lower) for f in factors), max(float(f.upper) for f in factors)),
        },
        noise_bound,
        parts,
        time.perf_counter() - started,
    )


def _split(problem: Callable[[Intervals], PolynomialProblem], first: Intervals) -> tuple[list[Intervals], int]:
    """Contract the box, halve parts that stay coarse, the coarsest first, and drop those that are proven empty."""
    waiting, parts = [first], 0
    while waiting:
        waiting.sort(key=_coarseness)
        if _coarseness(waiting[-1]) <= COARSE or parts >= MOST_PARTS:
            break
        box = waiting.pop()
        for half in (box,) if not parts else _halves(box):
            parts += 1
            found = _contract(problem, half)
            waiting += [found] if found is not None else []
    return waiting, parts


def _contract(problem: Callable[[Intervals], PolynomialProblem], box: Intervals) -> Intervals | None:
    for _ in range(ROUNDS):
        found = contracted(relaxed_problem(problem(box)), box)
        if found.empty:
            return None
        shrunk = 1 - found.width / np.maximum(box.width, 1e-300)
        box = found
        if shrunk.max() < WORTH:
            break
    return box


def _coarseness(box: Intervals) -> float:
    """Return the largest ratio of the ends of a box; both constants are positive."""
    return float((box.upper / box.lower).max())


def _halves(box: Intervals) -> tuple[Intervals, Intervals]:
    """Return the box cut at the geometric mean of its coarser constant."""
    j = int((box.upper / box.lower).argmax())
    lower, upper = box.lower.copy(), box.upper.copy()
    lower[j] = upper[j] = np.sqrt(box.lower[j] * box.upper[j])
    return Intervals(box.lower, upper), Intervals(lower, box.upper)


def _ratio(box: Intervals) -> Intervals:
    """Return the second constant divided by the first."""
    return Intervals.of(np.nextafter(box.lower[1] / box.upper[0], 0), np.nextafter(box.upper[1] / box.lower[0], np.inf))


def _series(data: Dataset, noise_bound: float, power: int) -> tuple[Array, Array]:
    if len(data.experiments) != 1 or len(data.inputs) != 1 or len(data.outputs) != 1:
        raise DataError("give one experiment with the concentrations of inflow and outflow")
    values = data.experiments[0].values
    u, y = values[data.inputs[0]], values[data.outputs[0]]
    if not (np.isfinite(noise_bound) and noise_bound > 0):
        raise DataError(f"the noise bound is {noise_bound}: give a positive number in the output's unit")
    if len(y) < 5 or not (np.isfinite(u).all() and np.isfinite(y).all()):
        raise DataError("the record has gaps, or fewer than 5 samples: fill or crop it, or take a longer one")
    if power > 1 and y.min() <= noise_bound:
        raise DataError(
            f"a concentration of {y.min():g} cannot be told from zero with a noise bound of {noise_bound:g}: crop the "
            "record to where it is larger"
        )
    return u, y


def _prior(prior: Mapping[str, tuple[float, float]], reaction_rate: float) -> Intervals:
    usual = {"tau": (LEAST_TAU, 1 / reaction_rate), "a": A_BOX}
    refuse_unknown("constant of the reactor", prior, usual)
    pairs = np.array([prior.get(name, usual[name]) for name in usual], dtype=np.float64)
    if not (np.isfinite(pairs).all() and (pairs[:, 0] > 0).all() and (pairs[:, 0] <= pairs[:, 1]).all()):
        raise ModelError(f"the prior {dict(prior)} makes no sense: give positive finite ends in rising order")
    return Intervals(pairs[:, 0], pairs[:, 1])


def _problem(
    u: Array, y: Array, h: float, noise_bound: float, power: int, reaction_rate: float, box: Intervals
) -> PolynomialProblem:
    """Return the linear problem in k, g and the noises."""
    n = len(y)
    noise = Intervals.within(noise_bound)
    measured = Intervals.of(y)
    true = measured + noise
    # y^x = curve - slope eta, for some curve in these, |eta| within the noise
    slope = power * y ** (power - 1)
    curve = _power(measured, power).hull(_curved(y, slope, noise_bound, power))
    psi = _psi(u, true, h, power, reaction_rate, box)
    held = Intervals.of(u[:-1])
    middle = float(0.5 * (box.lower[1] + box.upper[1]))
    # h g ((1 - psi) Y(0) + psi Y(1)), Y = curve - slope eta
    ends = ((1.0 - psi.upper, 1.0 - psi.lower, 0), (psi.lower, psi.upper, 1))
    curves = Intervals.of(np.zeros(n - 1))
    noises = []
    rest = np.zeros(n - 1)
    g = box[1]
    for low, high, side in ends:
        share = Intervals(np.nextafter(low, -np.inf), np.nextafter(high, np.inf))
        part = slice(side, n - 1 + side)
        curves = curves + share * curve[part]
        weight = middle * h * 0.5 * (low + high) * slope[part]
        spread = share * g * h * slope[part]
        rest = rest + (spread - weight).magnitude * noise_bound
        noises.append(weight)
    # k (h u) - r h u - g h curves + g h (weights eta) - step + (eta(1) - eta(0)) = 0
    concentration = held * h
    step = measured[1:] - measured[:-1]
    free = step + concentration * reaction_rate
    at = np.arange(n - 1)
    eta = [noises[0] - 1.0, noises[1] + 1.0]
    slack = rest * (1 + 1e-12) + noise_bound * 1e-14 * (2 + noises[0] + noises[1])
    drain = curves * h
    above = _rows(concentration.upper, -drain.lower, eta, at, slack - free.lower, 1.0)
    below = _rows(concentration.lower, -drain.upper, eta, at, slack + free.upper, -1.0)
    sizes = np.full(n, noise_bound)
    return PolynomialProblem(
        ("k", "g", *(f"eta[{j}]" for j in range(n))),
        np.concatenate([box.lower, -sizes]),
        np.concatenate([box.upper, sizes]),
        Polynomials.empty(),
        Polynomials.join([above, below]),
    )


def _rows(inflow: Array, drain: Array, eta: list[Array], at: Index, free: Array, sign: float) -> Polynomials:
    count = len(inflow)
    columns = [np.zeros(count), np.ones(count), at + 2, at + 3, np.full(count, -1)]
    values = [sign * inflow, sign * drain, sign * eta[0], sign * eta[1], np.nextafter(free, np.inf)]
    return Polynomials(
        count,
        np.tile(np.arange(count), len(columns)),
        np.concatenate(columns).astype(np.int64)[:, None],
        Balls.exact(np.concatenate(values)),
    ).collect()


def _power(values: Intervals, power: int) -> Intervals:
    """Return powers; above the first power the numbers are positive."""
    result = Intervals.of(np.ones_like(values.lower))
    for _ in range(power):
        result = result * values
    return result


def _curved(y: Array, slope: Array, noise_bound: float, power: int) -> Intervals:
    """Return ``(y - eta)^x + slope eta`` over the noise: it is convex in eta, so an end of the noise is the maximum."""
    both = [_power(Intervals.of(y) - eta, power) + Intervals.of(slope) * eta for eta in (-noise_bound, noise_bound)]
    # The minimum is at eta = 0, up to the rounding of the slope.
    ends = both[0].hull(both[1])
    return ends + Intervals.within(1e-14 * np.abs(slope) * noise_bound)


def _psi(u: Array, true: Intervals, h: float, power: int, reaction_rate: float, box: Intervals) -> Intervals:
    """Return the place of the mean of Y between its ends, on each interval."""
    v = true[:-1].hull(true[1:])
    g = box[1]
    decay = _power(v, power - 1) * g * float(power)
    if power > 1:
        rate = (box[0] - reaction_rate) * Intervals.of(u[:-1]) - g * _power(v, power)
        reciprocal = Intervals(np.nextafter(1 / v.upper, 0), np.nextafter(1 / v.lower, np.inf))
        decay = decay - rate * reciprocal * float(power - 1)
    z = decay * h
    return Intervals(_phi(z.lower, -1), _phi(z.upper, 1))


def _phi(z: Array, direction: int) -> Array:
    """Return ``1/(1 - e^-z) - 1/z``, which rises from 0 to 1, rounded in one direction; ``phi(-z) = 1 - phi(z)``."""
    size = np.abs(z)
    large = np.maximum(size, SERIES)
    closed = -1 / np.expm1(-large) - 1 / large
    # 1/2 + z/12 - z^3/720 + ... alternates and falls: a term bounds the rest of the series.
    series = 0.5 + size / 12
    half = np.where(size < SERIES, series, closed)
    value = np.where(z >= 0, half, 1 - half)
    # The error of expm1 is a few units in the last place, and 1/z is at most 1/SERIES.
    error = np.where(size < SERIES, size**3 / 720 + 1e-15, 1e-13)
    return np.asarray(np.clip(value + direction * error, 0.0, 1.0))
