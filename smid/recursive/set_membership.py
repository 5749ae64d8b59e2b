"""Recursive set-membership estimation: at every sample a certified outer set of the parameters.

    equation error    y[t] = phi[t]' theta + e[t],               |e[t]| <= D
    output error      w[t] = the same with w for y in phi[t],    y[t] = w[t] + eta[t],   |eta[t]| <= D

Every sample adds its equation to a memory.  Sums of the last equations, weighted so that they carry little noise
(`smid.recursive.weighted_sums`; the equation alone where the noise is in the equation), cut the set by two rows each
(`smid.recursive.polytope`).  So do the sums that end at a few older equations, in turn: their noise is bounded better
once the set is smaller.  What is certified stays certified: the set only shrinks.

An empty set proves that no constant parameters within the first box explain the samples since the set was begun: the
plant has changed (or the noise was larger than its bound, or the box too small).  The set is then begun anew, from its
first box and the equations that follow, so that what comes next speaks of the changed plant alone.

Rounding: the rows carry a bound on the rounding of their own coefficients, and an end is what its multipliers prove,
with the rounding of the proof added.  Nothing that was rounded goes into the next step without such a bound.

References: Fogel and Huang, "On the value of information in system identification: bounded noise case", Automatica 18
(1982), and Bravo, Alamo and Camacho, "Bounded error identification of systems with time-varying parameters", IEEE
Trans. Automatic Control 51 (2006), for recursive outer sets, there ellipsoids and zonotopes, the rivals in
``benchmarks/recursive_sets.py``; Milanese and Vicino, "Optimal estimation theory for dynamic systems with set
membership uncertainty: an overview", Automatica 27 (1991); clutch thesis, section 6.2.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Literal

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import EPSILON
from relaxations.search.hierarchy import Proof
from smid.identification.estimate import ParameterInterval
from smid.models import ModelError
from smid.models.errors import refuse_unknown
from smid.recursive.arx import LARGEST, Arx, refusal
from smid.recursive.polytope import Polytope
from smid.recursive.set_history import Change, SetHistory
from smid.recursive.weighted_sums import WeightedSums, principal_axes

__all__ = ["RecursiveSet"]

Range = tuple[float, float]

SHRUNK = 0.8
"""New weights once a width of the set is below this share of what it was for the present ones."""
GROWN = 1.5
"""New weights once there are that many times more equations than they are long."""
PATIENCE = 20
"""Samples from one look at the axes along which the set is enclosed to the next."""
TIGHTER = 0.7
"""They are turned where the enclosure's volume looks smaller by that factor."""
OLDER = 3
"""So many older equations are taken up again at each sample."""
SMALLEST_MEMORY = 20
_ROOM = 1024


class RecursiveSet:
    """Certify, anew at each sample, intervals that hold the parameters.

    Parameters
    ----------
    arx
        Structure of the model.
    noise_bound
        D, in the output's unit.
    bounds
        First box of each parameter, finite; a wide one costs little.  The whole denominator may be left out for a
        stable plant (``arx.stable``): then the set begins with the smallest simplex of all stable ones.  With three
        poles or more, begin with the intervals of `smid.identify` on a first stretch: the set may stay wide else.
    error
        One of {"output", "equation"}.
        Where the noise enters: at the output, after the dynamics, or into the difference equation.
    memory
        Equations that are kept; sums are half as long.  Several time constants of the plant, twice.

    Raises
    ------
    ModelError
        If a bound is missing, unknown, not finite or out of order, or a setting makes no sense.

    Examples
    --------
    >>> estimator = RecursiveSet(Arx(), 0.05, {"b0": (-10.0, 10.0)})
    >>> w = 0.0
    >>> for u, noise in zip([1.0, -1.0, -1.0, 1.0, 1.0, -1.0] * 5, [0.04, -0.02, 0.03, -0.04, 0.01] * 6):
    ...     change = estimator.update(u, w + noise)
    ...     w = 0.8 * w + 0.2 * u
    >>> a1, b0 = estimator.intervals
    >>> a1.lower < -0.8 < a1.upper and b0.lower < 0.2 < b0.upper, a1.width < 0.5
    (True, True)
    >>> estimator.empty is None
    True

    References
    ----------
    See `smid.recursive.set_membership`, `smid.recursive.weighted_sums` and `smid.recursive.polytope`.
    """

    def __init__(
        self,
        arx: Arx,
        noise_bound: float,
        bounds: Mapping[str, Range],
        *,
        error: Literal["output", "equation"] = "output",
        memory: int = 400,
    ) -> None:
        if not (np.isfinite(noise_bound) and noise_bound > 0):
            raise ModelError(f"noise_bound = {noise_bound} is refused: give a positive number in the output's unit")
        if error not in ("output", "equation"):
            raise ModelError(f"error = {error!r} is neither 'output' nor 'equation': say where the noise enters")
        if memory < SMALLEST_MEMORY:
            raise ModelError(f"memory = {memory} equations are too few: give at least {SMALLEST_MEMORY}")
        self.arx, self.noise_bound, self.error, self.memory = arx, float(noise_bound), error, int(memory)
        self.bounds = dict(bounds)
        self._summed = error == "output" and arx.na > 0
        self._prior, self._first = _first_set(arx, bounds), WeightedSums.single(arx.na)
        if self._summed:
            axes = np.eye(arx.na)
            self._prior = self._prior.along(_widened(axes, self._prior.n))
            self._first = WeightedSums.around(self._prior, axes, 1)
        exact = arx.powers == (1,) and arx.input_scale == 1.0
        self._slip = 0.0 if exact else (max(arx.powers) + 3) * EPSILON
        self._outputs: list[float] = []  # the newest first
        self._inputs: list[float] = []
        self._count = 0
        self._ends = np.empty((_ROOM, 2 * self._prior.n))
        self._changes: list[Change] = []
        self._begin(arx.max_lag)

    def _begin(self, sample: int) -> None:
        """Forget all equations; the next one is that of a sample."""
        self._set, self._since = self._prior, sample
        self._sums, self._axes = self._first, np.eye(self.arx.na)
        self._widths = self._set.widths
        # The newest equation first, at a place that moves down; the copy back is made once in a memory's time.
        self._equations = np.zeros((2 * self.memory, 1 + self._set.n))
        self._place, self._filled, self._turn = 2 * self.memory, 0, 0

    def anew(self) -> RecursiveSet:
        """Return an estimator of the same settings that has seen nothing."""
        return RecursiveSet(self.arx, self.noise_bound, self.bounds, error=self.error, memory=self.memory)

    @property
    def lower(self) -> Array:
        """Certified lower ends of the parameters, shape (n,)."""
        return self._set.lower

    @property
    def upper(self) -> Array:
        """Certified upper ends of the parameters, shape (n,)."""
        return self._set.upper

    @property
    def intervals(self) -> tuple[ParameterInterval, ...]:
        """Certified intervals of the parameters, as those of an `smid.Estimate`, without inner ends."""
        ends = zip(self.arx.names, self.lower, self.upper, self._prior.lower, self._prior.upper, strict=True)
        return tuple(
            ParameterInterval(
                name,
                "",
                float(low),
                float(high),
                math.nan,
                math.nan,
                Proof.BOX if low == first else Proof.PROVEN,
                Proof.BOX if high == last else Proof.PROVEN,
            )
            for name, low, high, first, last in ends
        )

    @property
    def empty(self) -> int | None:
        """Number of the sample with which a set became empty last; None where none did."""
        return self._changes[-1].sample if self._changes else None

    @property
    def history(self) -> SetHistory:
        """What was found so far."""
        n, ends = self._set.n, self._ends[: self._count]
        return SetHistory(self.arx.names, -ends[:, n:], ends[:, :n].copy(), tuple(self._changes))

    def update(self, u: float, y: float) -> Change | None:
        """Take one sample.

        Parameters
        ----------
        u, y
            Input and output at the same instant, in the channels' units.

        Returns
        -------
        Change or None
            A change of the plant that this sample certifies.

        Raises
        ------
        DataError
            If the sample is not a finite number; the set stays as it was.
        """
        arx, change = self.arx, None
        # NaN fails the comparison too.
        if not (abs(u) < arx.largest_input and abs(y) < LARGEST):
            raise refusal(self._count, u, y)
        inputs = [arx.input_scale * u, *self._inputs[: arx.delay + arx.nb]]
        if self._count >= arx.max_lag:
            self._keep([y, *arx.row(self._outputs, inputs)])
            self._cut()
            if self._set.empty:
                change = Change(self._since, self._count)
                self._changes.append(change)
                self._begin(self._count + 1)
        self._inputs, self._outputs = inputs, [y, *self._outputs][: arx.na]
        if self._count == len(self._ends):
            self._ends = np.concatenate([self._ends, np.empty_like(self._ends)])
        self._ends[self._count] = self._set.ends[: 2 * self._set.n]
        self._count += 1
        return change

    def _keep(self, equation: list[float]) -> None:
        if self._place == 0:
            self._equations[self.memory :] = self._equations[: self.memory]
            self._place = self.memory
        self._place -= 1
        self._equations[self._place] = equation
        self._filled = min(self._filled + 1, self.memory)

    def _cut(self) -> None:
        """Cut the set with the sums that end at the newest equation and at some older ones."""
        if self._summed:
            self._prepare()
        length = self._sums.weights.shape[1]
        older = self._filled - length if self._summed else 0
        back = [0]
        for _ in range(min(OLDER, older)):
            self._turn = self._turn % older + 1
            back.append(self._turn)
        places = self._place + np.array(back)[:, None] + np.arange(length)
        size = np.maximum(np.abs(self.lower), np.abs(self.upper))
        self._set = self._set.cut(*self._sums.rows(self._equations[places], self.noise_bound, size, self._slip))

    def _prepare(self) -> None:
        """Fit the weights to the set where it has shrunk, or its axes first: one of the two at a sample."""
        length = min(self._filled, self.memory // 2)
        shrunk = bool((self._set.widths < SHRUNK * self._widths).any())
        if (self._count - self._since) % PATIENCE == 0 and self._turn_axes():
            self._widths = np.array(np.inf)
        elif shrunk or length >= GROWN * self._sums.weights.shape[1]:
            self._sums = WeightedSums.around(self._set, self._axes, length)
            self._widths = self._set.widths

    def _turn_axes(self) -> bool:
        """Enclose the set along its principal axes, where that looks much tighter."""
        axes, spread = principal_axes(self._set, self.arx.na)
        if spread.prod() >= TIGHTER * self._set.widths[self._set.n :].prod():
            return False
        self._axes, self._set = axes, self._set.along(_widened(axes, self._set.n))
        return True


def _widened(axes: Array, n: int) -> Array:
    """Return directions of the denominator's coefficients as directions of all parameters."""
    return np.concatenate([axes, np.zeros((len(axes), n - axes.shape[1]))], axis=1)


def _first_set(arx: Arx, bounds: Mapping[str, Range]) -> Polytope:
    refuse_unknown("parameter", bounds, arx.names)
    stable = arx.stable and not any(name in bounds for name in arx.names[: arx.na])
    ends = dict(bounds)
    for i, name in enumerate(arx.names[: arx.na] if stable else (), start=1):
        ends[name] = (-float(math.comb(arx.na, i)), float(math.comb(arx.na, i)))
    for name in arx.names:
        if name not in ends:
            raise ModelError(f"{name!r} has no bounds: a set begins with a box, as in bounds={{{name!r}: (-10, 10)}}")
        low, high = ends[name]
        if not (np.isfinite(low) and np.isfinite(high) and low <= high):
            raise ModelError(f"the bounds of {name!r} are {low} and {high}: give finite ends, the lower one first")
    lower, upper = (np.array([ends[name][side] for name in arx.names], dtype=np.float64) for side in (0, 1))
    # Room for the bases of all ends, and for the rows of one sample.
    n = len(lower)
    box = Polytope.box(lower, upper, 2 * (n + arx.na) * n + 64)
    if not stable:
        return box
    simplex = _stable_simplex(arx.na)
    return box.cut(_widened(-simplex[:, 1:], n), simplex[:, 0])


def _stable_simplex(na: int) -> Array:
    """Return rows that are nonnegative on ``[1, a1, ..., a_na]`` of every stable denominator.

    The stable denominators lie in the simplex of the ``(z - 1)^k (z + 1)^(na - k)``.  The coordinates in it are, up to
    a factor, the coefficients of ``sum_i a_i (s + 1)^(na - i) (s - 1)^i``, which are whole numbers of the a.

    Reference: Fam, Meditch, "A canonical parameter space for linear systems design", IEEE Trans. Automatic Control 23
    (1978).
    """
    plus, minus = np.poly1d([1.0, 1.0]), np.poly1d([1.0, -1.0])
    columns = [((plus ** (na - i)) * (minus**i)).coeffs for i in range(na + 1)]
    return np.stack(columns, axis=1)
