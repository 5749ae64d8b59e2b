"""Recursive set-membership estimation: a certified outer set of the parameters at every sample.

    equation error        y[t] = phi[t]' theta + e[t],               |e[t]| <= D
    output error          w[t] = the same with w for y in phi[t],    y[t] = w[t] + eta[t],   |eta[t]| <= D
    errors in variables   besides, u[t] = the true input + zeta[t],                          |zeta[t]| <= Du
    drift                 |theta[t] - theta[t-1]| <= delta for each parameter; the set is that of theta[t]

At every sample:

1. With a drift, the set grows by delta.
2. The sample's equation is stored.
3. Weighted sums of the last equations, with low noise, give two rows each (`smid.recursive.weighted_sums`). With an
   equation error, the equation itself gives them.
4. Without drift, sums that end at a few older equations give rows too: their noise improves when the set shrinks.
5. The rows cut the set (`smid.recursive.polytope`). Without drift the set only shrinks.

On request, all stored equations tighten the set (`smid.recursive.refinement`). A refinement takes tenths of a second,
and an update less than a millisecond.

An empty set proves that no parameters in the first box, constant or within the drift, explain the samples since the set
was started. The plant has changed, or a noise exceeds its bound, or the box is too small. The set then restarts from
its first box.

Safeguard: rows include the rounding of their coefficients, and each certified bound includes the rounding of its proof.

References: Fogel and Huang, "On the value of information in system identification: bounded noise case", Automatica 18
(1982) (ellipsoids); Bravo, Alamo and Camacho, "Bounded error identification of systems with time-varying parameters",
IEEE Trans. Automatic Control 51 (2006) (zonotopes); both compared in ``benchmarks/recursive_sets``; Milanese and
Vicino, "Optimal estimation theory for dynamic systems with set membership uncertainty: an overview", Automatica 27
(1991); clutch thesis, section 6.2.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import EPSILON
from relaxations.search.enclosure import Proof
from smid.identification.estimate import ParameterInterval
from smid.models import ModelError
from smid.recursive.arx import LARGEST, Arx, refusal
from smid.recursive.first_set import Range, first_set, noises_of, steps_of, widened
from smid.recursive.refinement import Equations, Windows, refined
from smid.recursive.set_history import Change, SetHistory
from smid.recursive.weighted_sums import Drift, WeightedSums, principal_axes

__all__ = ["RecursiveSet"]

SHRUNK = 0.8
"""New weights when a width of the set falls below this share of its value at the last weights."""
GROWN = 1.5
"""New weights when the number of stored equations exceeds that at the last weights by this factor."""
PATIENCE = 20
"""Samples between two checks of the axes of the enclosure; weights of a set that drifts hold for as many."""
TIGHTER = 0.7
"""The axes are turned if the estimated volume of the enclosure falls below this share."""
OLDER = 3
"""Number of older equations that are used again at each sample. With a drift they tell little of the present."""
SMALLEST_MEMORY = 20
_ROOM = 1024


class RecursiveSet:
    """Recursive estimator of certified parameter intervals.

    Parameters
    ----------
    noise_bound
        D, in the output's unit.
    bounds
        First box of each parameter, finite; a wide box costs little. For a stable plant (``arx.stable``) the bounds of
        the whole denominator may be omitted: the set then starts with the smallest simplex of all stable denominators.
    error
        Where the noise enters: "output" (after the dynamics) or "equation".
    memory
        Number of stored equations. Sums are half as long, which should cover several time constants of the plant.
    input_noise_bound
        Du, in the unit of the inputs: one number, or one for each input. The powers must then be (1,).
    drift
        delta, the largest change of a parameter from one sample to the next, in its unit: one number for all, or one
        by name (zero for the others). Every interval is one of the present parameter.

    Attributes
    ----------
    refined_at
        The last sample after which `refine` was called, or None.

    Raises
    ------
    ModelError
        If a bound is missing, unknown, not finite or out of order, or a setting is out of range.

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
    >>> estimator.refine() is None and estimator.intervals[0].width <= a1.width
    True
    >>> estimator.state
    'all 30 samples; refined with sample 29'
    """

    def __init__(
        self,
        arx: Arx,
        noise_bound: float,
        bounds: Mapping[str, Range],
        *,
        error: Literal["output", "equation"] = "output",
        memory: int = 400,
        input_noise_bound: float | Sequence[float] = 0.0,
        drift: float | Mapping[str, float] = 0.0,
    ) -> None:
        if not (np.isfinite(noise_bound) and noise_bound > 0):
            raise ModelError(f"noise_bound = {noise_bound} is refused: give a positive number in the output's unit")
        if error not in ("output", "equation"):
            raise ModelError(f"error = {error!r} is neither 'output' nor 'equation': say where the noise enters")
        if memory < SMALLEST_MEMORY:
            raise ModelError(f"memory = {memory} equations are too few: give at least {SMALLEST_MEMORY}")
        self.arx, self.noise_bound, self.error, self.memory = arx, float(noise_bound), error, int(memory)
        self.bounds, self.input_noise_bound, self.drift = dict(bounds), input_noise_bound, drift
        # The noises, the first set, and the first sums.
        self._noises = noises_of(arx, self.noise_bound, error, input_noise_bound)
        step = steps_of(arx, drift)
        self._drift = Drift.of(step, self._noises) if step.any() else None
        self._combine = error == "output" and arx.na > 0
        self._summed = any(noise.places for noise in self._noises)
        self._prior, axes = first_set(arx, bounds), np.eye(arx.na)
        self._first = WeightedSums.single(self._prior.n, self.noise_bound)
        if self._summed:
            self._prior = self._prior.along(widened(axes, self._prior.n))
            self._first = WeightedSums.around(self._noises, self._prior, axes, 1)
        # The regressors have rounding errors only if the input is scaled or raised to a power.
        exact = arx.powers == (1,) and arx.input_scale == 1.0
        self._slip = 0.0 if exact else (max(arx.powers) + 3) * EPSILON
        self._count = 0
        self._ends = np.empty((_ROOM, 2 * self._prior.n))
        self._changes: list[Change] = []
        self._wait()
        self._begin(arx.max_lag)

    def _wait(self) -> None:
        """Wait for as many samples as the model looks back."""
        self._outputs: list[float] = []  # newest first
        self._inputs: list[list[float]] = [[] for _ in range(self.arx.inputs)]
        self._ready = self._count + self.arx.max_lag
        # Newest equation first. The start moves down; equations are copied back once every `memory` samples.
        self._equations = np.zeros((2 * self.memory, 1 + self._prior.n))
        self._place, self._filled, self._turn = 2 * self.memory, 0, 0
        self._sums, self._most = self._first, 1

    def _begin(self, sample: int) -> None:
        """Restart from the first box, without equations; the next equation is that of `sample`."""
        self._set, self._since = self._prior, sample
        self._sums, self._most, self._axes = self._first, 1, np.eye(self.arx.na)
        self._widths, self._made = self._set.widths, math.inf  # sums for the first box hold for ever
        self._filled, self._turn = 0, 0
        self._held: tuple[Windows, ...] = ()
        self.refined_at: int | None = None

    def anew(self) -> RecursiveSet:
        """Return an estimator with the same settings and no data."""
        return RecursiveSet(
            self.arx,
            self.noise_bound,
            self.bounds,
            error=self.error,
            memory=self.memory,
            input_noise_bound=self.input_noise_bound,
            drift=self.drift,
        )

    @property
    def lower(self) -> Array:
        """Return the certified lower bounds of the parameters, shape (n,)."""
        return self._set.lower

    @property
    def upper(self) -> Array:
        """Return the certified upper bounds of the parameters, shape (n,)."""
        return self._set.upper

    @property
    def intervals(self) -> tuple[ParameterInterval, ...]:
        """Return the certified intervals of the parameters, as in an `smid.Estimate`, without inner bounds."""
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
    def state(self) -> str:
        """Return in words what the set holds."""
        since = self._since - self.arx.max_lag
        samples = f"all {self._count} samples" if since <= 0 else f"samples {since} to {self._count - 1}"
        refinement = "not refined" if self.refined_at is None else f"refined with sample {self.refined_at}"
        return f"{samples}; {refinement}"

    def __repr__(self) -> str:
        return f"{type(self).__name__} after {self._count} samples: {', '.join(map(str, self.intervals))}"

    @property
    def empty(self) -> int | None:
        """Return the last sample with which a set became empty, or None."""
        return self._changes[-1].sample if self._changes else None

    @property
    def changes(self) -> tuple[Change, ...]:
        """Return the certified changes of the plant so far."""
        return tuple(self._changes)

    @property
    def history(self) -> SetHistory:
        """Return the intervals and changes of all samples so far."""
        n, ends = self._set.n, self._ends[: self._count]
        return SetHistory(self.arx.names, -ends[:, n:], ends[:, :n].copy(), self.changes)

    def update(self, u: float | Sequence[float], y: float) -> Change | None:
        """Return the change of the plant that this sample certifies, or None, and update the set.

        Input and output are of the same instant, in the channels' units; several inputs are a sequence.

        Raises
        ------
        DataError
            If the sample is not a finite number, or the number of inputs is another one. The set does not change.
        """
        arx, change = self.arx, None
        values = u if isinstance(u, Sequence | np.ndarray) else (u,)
        # The comparisons are false for NaN.
        if len(values) != arx.inputs or not (
            abs(y) < LARGEST and all(abs(value) < arx.largest_input for value in values)
        ):
            raise refusal(self._count, values, y, arx.inputs)
        reach = arx.delay + arx.nb
        inputs = [[arx.input_scale * v, *own[:reach]] for v, own in zip(values, self._inputs, strict=True)]
        # Cut the set by the new equation; restart if the set is empty.
        if self._drift is not None:
            self._set = self._set.drifted(self._drift.step, self._prior)
        if self._count >= self._ready:
            self._keep([y, *arx.row(self._outputs, *inputs)])
            self._cut()
            if self._set.empty:
                change = self._changed(self._count + 1)
        # Store the sample and the bounds.
        self._inputs, self._outputs = inputs, [y, *self._outputs][: arx.na]
        if self._count == len(self._ends):
            self._ends = np.concatenate([self._ends, np.empty_like(self._ends)])
        self._ends[self._count] = self._set.ends[: 2 * self._set.n]
        self._count += 1
        return change

    def skip(self, samples: int = 1) -> None:
        """Say that so many samples are missing: the set stays (with a drift it grows), the equations start anew.

        Raises
        ------
        ModelError
            If the number is not positive.
        """
        if samples < 1:
            raise ModelError(f"samples = {samples} is refused: give the number of missing samples, 1 or more")
        for _ in range(samples):
            if self._drift is not None:
                self._set = self._set.drifted(self._drift.step, self._prior)
            if self._count == len(self._ends):
                self._ends = np.concatenate([self._ends, np.empty_like(self._ends)])
            self._ends[self._count] = self._set.ends[: 2 * self._set.n]
            self._count += 1
        self._wait()

    def refine(self, pieces: int = 64) -> Change | None:
        """Tighten the set with all stored equations, and return the change of the plant that is certified, or None.

        Equations that carry an end are kept for later refinements, however old they are. The time is about 5 to 15 ms
        for each piece.

        Parameters
        ----------
        pieces
            Largest number of pieces that the set is cut into.

        Raises
        ------
        ModelError
            If the number of pieces is not positive.
        """
        if pieces < 1:
            raise ModelError(f"pieces = {pieces} is refused: give 1 or more; 64 are the default")
        if not self._filled and not self._held:
            return None
        stored = self._equations[self._place : self._place + self._filled]
        passed = 0 if self.refined_at is None else self._count - 1 - self.refined_at
        held = tuple(own.before(self._filled, passed) for own in self._held)
        equations = Equations(stored, held, self._noises, self._slip, self._drift, self._combine)
        found = refined(self._set, self._axes, equations, pieces)
        self.refined_at = self._count - 1
        if found is not None:
            ends, self._held = found
            self._set = self._set.cut(self._set.directions[: 2 * self._set.n], ends)
        change = self._changed(self._count) if found is None or self._set.empty else None
        self._ends[self._count - 1] = self._set.ends[: 2 * self._set.n]
        return change

    def _changed(self, following: int) -> Change:
        """Record that the set is empty, and restart it; the next equation is that of sample `following`."""
        change = Change(self._since, following - 1)
        self._changes.append(change)
        self._begin(following)
        return change

    def _keep(self, equation: list[float]) -> None:
        if self._place == 0:
            self._equations[self.memory :] = self._equations[: self.memory]
            self._place = self.memory
        self._place -= 1
        self._equations[self._place] = equation
        self._filled = min(self._filled + 1, self.memory)

    def _cut(self) -> None:
        """Cut the set by the sums that end at the newest equation and at some older ones."""
        drifts = self._drift is not None
        if self._summed and self._prepare() and drifts:
            return  # both in one sample would take too long: the next sample cuts by this equation
        length = self._sums.weights.shape[1]
        older, back = self._filled - length, [0]
        if drifts:
            back += [1] if older > 0 else []
        elif self._combine:
            for _ in range(min(OLDER, older)):
                self._turn = self._turn % older + 1
                back.append(self._turn)
        ages = np.array(back)
        windows = self._equations[self._place + ages[:, None] + np.arange(length)]
        size = np.maximum(np.abs(self.lower), np.abs(self.upper))
        self._set = self._set.cut(*self._sums.rows(windows, size, self._slip, ages, self._drift))

    def _prepare(self) -> bool:
        """Update the axes of the enclosure, or the weights if the set has shrunk or they are too old for its drift.

        Return whether either was done.
        """
        most = min(self._filled, self.memory // 2) if self._combine else 1
        shrunk = bool((self._set.widths < SHRUNK * self._widths).any())
        old = self._drift is not None and self._count >= self._made + PATIENCE
        if not old and (self._count - self._since) % PATIENCE == 0 and self._turn_axes():
            self._widths = np.array(np.inf)
            return True
        if old or shrunk or most >= GROWN * self._most:
            margin = None if self._drift is None else PATIENCE * self._drift.step
            self._sums = WeightedSums.around(self._noises, self._set, self._axes, most, margin)
            self._widths, self._made, self._most = self._set.widths, self._count, most
            return True
        return False

    def _turn_axes(self) -> bool:
        """Return whether the enclosure was turned to the set's principal axes, which must be much tighter."""
        axes, spread = principal_axes(self._set, self.arx.na)
        if not len(axes) or spread.prod() >= TIGHTER * self._set.widths[self._set.n :].prod():
            return False
        self._axes, self._set = axes, self._set.along(widened(axes, self._set.n))
        return True
