"""Set membership over a sliding window: the certified intervals of `smid.identify` on the last W samples.

Every `every` samples the intervals are computed through the relaxations, which takes seconds. They are as tight as
those of a batch of W samples of any model. The outer set of `smid.recursive.set_membership` is for linear models: it
takes less than a millisecond, uses all past samples, and takes a bound on the drift. Parameters that vary within a
window may lie outside the intervals of this class.

An empty feasible set proves a change within the window. The window is then cleared, so that it fills with samples of
the changed plant only.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from relaxations.search.enclosure import Proof
from smid.data import Dataset
from smid.identification.estimate import ParameterInterval
from smid.identification.identify import EmptyFeasibleSetError, identify
from smid.models import Model, ModelError
from smid.recursive.arx import LARGEST, refusal
from smid.recursive.set_history import Change, SetHistory

__all__ = ["SlidingWindow"]


class SlidingWindow:
    """Recursive estimator of the certified parameter intervals of the last samples.

    Parameters
    ----------
    model
        With one input and one output, as `smid.identify` takes it.
    noise_bound
        Of the output, in its unit.
    window
        W, the number of samples.
    every
        Samples from one computation to the next.
    sampling_time
        In seconds; a continuous-time model needs it.

    Raises
    ------
    ModelError
        If the model has several inputs or outputs, or the window is too short for it.

    Examples
    --------
    >>> from smid import OutputError
    >>> estimator = SlidingWindow(OutputError(stable=True), 0.1, window=8, every=4)
    >>> for u, y in zip([1.0, 0, 1, 1, 0, 0, 1, 0], [0.0, 1, 0.5, 1.3, 1.6, 0.8, 0.4, 1.2]):
    ...     change = estimator.update(u, y)
    >>> a1, b0 = estimator.intervals
    >>> a1.lower < -0.5 < a1.upper and b0.lower < 1.0 < b0.upper
    True
    """

    def __init__(
        self, model: Model, noise_bound: float, *, window: int = 100, every: int = 20, sampling_time: float = 1.0
    ) -> None:
        if len(model.input_channels) != 1 or len(model.output_channels) != 1:
            raise ModelError(
                f"the model reads {', '.join(model.channels)}: a sliding window takes one input and one output"
            )
        if not (np.isfinite(noise_bound) and noise_bound > 0):
            raise ModelError(f"noise_bound = {noise_bound} is refused: give a positive number in the output's unit")
        least = model.max_lag + len(model.parameters) + 1
        if window < least or every < 1:
            raise ModelError(
                f"window = {window}, every = {every}: the model needs windows of {least} samples and every = 1 or more"
            )
        self.model, self.noise_bound, self.window, self.every = model, float(noise_bound), int(window), int(every)
        self.sampling_time = float(sampling_time)
        self._samples: deque[tuple[float, float]] = deque(maxlen=self.window)
        self._lower: list[tuple[float, ...]] = []
        self._upper: list[tuple[float, ...]] = []
        self._changes: list[Change] = []
        self._intervals = self._first_box()

    def _first_box(self) -> tuple[ParameterInterval, ...]:
        return tuple(
            ParameterInterval(p.name, p.unit, p.lower, p.upper, math.nan, math.nan, Proof.BOX, Proof.BOX)
            for p in self.model.parameters
        )

    @property
    def intervals(self) -> tuple[ParameterInterval, ...]:
        """Return the certified intervals of the last computed window; before it, the model's own box."""
        return self._intervals

    def __repr__(self) -> str:
        return f"{type(self).__name__} after {len(self._lower)} samples: {', '.join(map(str, self.intervals))}"

    @property
    def empty(self) -> int | None:
        """Return the last sample with which a window was certified empty, or None."""
        return self._changes[-1].sample if self._changes else None

    @property
    def history(self) -> SetHistory:
        """Return the intervals and changes of all samples so far."""
        names = tuple(p.name for p in self.model.parameters)
        shape = (len(self._lower), len(names))
        lower, upper = (np.array(ends, dtype=np.float64).reshape(shape) for ends in (self._lower, self._upper))
        return SetHistory(names, lower, upper, tuple(self._changes))

    def update(self, u: float, y: float) -> Change | None:
        """Return the change of the plant that this sample certifies, or None, and update the window.

        Input and output are of the same instant, in the channels' units.

        Raises
        ------
        DataError
            If the sample is not a finite number. The window does not change.
        """
        k, change = len(self._lower), None
        if not (abs(u) < LARGEST and abs(y) < LARGEST):
            raise refusal(k, (u,), y)
        self._samples.append((float(u), float(y)))
        if len(self._samples) == self.window and (k + 1) % self.every == 0:
            change = self._compute(k)
        self._lower.append(tuple(i.lower for i in self._intervals))
        self._upper.append(tuple(i.upper for i in self._intervals))
        return change

    def _compute(self, k: int) -> Change | None:
        u, y = np.array(self._samples).T
        if np.ptp(u) == 0:  # `Dataset` refuses a constant input, which has almost no information
            self._intervals = self._first_box()
            return None
        data = Dataset.from_arrays(
            input={self.model.input_channels[0]: u},
            output={self.model.output_channels[0]: y},
            sampling_time=self.sampling_time,
        )
        try:
            self._intervals = identify(self.model, data, self.noise_bound).intervals
        except EmptyFeasibleSetError:
            change = Change(k - self.window + 1 + self.model.max_lag, k)
            self._changes.append(change)
            self._samples.clear()
            self._intervals = self._first_box()
            return change
        return None
