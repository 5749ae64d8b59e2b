"""Recursive set-membership estimation on the clutch: the thesis's first wish for future work.

Three questions and their experiments:

- Do the sets contain the true parameters, and how much wider are they than batch intervals of the same samples? The
  thesis's central Hammerstein model (section 3.2.3) is run over the current of ``20C_step_b``, with the sensor's noise.
- Is a change of the plant proven, and when? The same, with another pole from the middle of the record on.
- Can constant parameters fit the actuator? The bundled records are used, at the sensor's noise bound of 0.3 bar and at
  larger ones. An empty set proves that no constant Hammerstein model explains the samples since the set was started.

The larger bounds cover the linear interpolation of irregular samples to 2 ms. On ramps it adds some tenths of a bar to
the error of the pressure. At a step of the current it adds a sample between the levels, and the pressure of some
samples has an error of up to a few bar.

The model is the Hammerstein model as a difference equation, ``w[t] = -a1 w[t-1] + sum_k b0_vk v[t-1]^k``; with unit DC
gain ``b0_vk = (1 + alpha) gamma_k``. Only the noise enters at the output.

Reference: clutch thesis, sections 3.2.4 and 6.2.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import Progress
from smid.data import DataError, Dataset
from smid.data.bundled import CLUTCH_RECORDS, load_clutch
from smid.display.result import Part, Result
from smid.display.table import Table
from smid.identification.estimate import Estimate, round_down, round_up
from smid.identification.identify import identify
from smid.models import Hammerstein
from smid.recursive.arx import Arx
from smid.recursive.locate_change import locate_change
from smid.recursive.set_history import Change, SetHistory
from smid.recursive.set_membership import RecursiveSet
from smid.study.finished import finished
from smid.theses.clutch.hammerstein.printed import printed_central_model
from smid.theses.clutch.plant import INPUT_SCALE, NOISE_BOUND

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["RecordChanges", "SetStudy", "set_study"]

POWERS = (5, 4, 3)
ARX = Arx(powers=POWERS, input_scale=INPUT_SCALE)
BOUNDS = dict.fromkeys(ARX.names[1:], (-1.0, 1.0))
"""Of the coefficients, in bar: over a hundred times the thesis's. The pole is bounded by its stability."""

CURRENT = "20C_step_b"
OTHER_POLE = 0.8
BATCH = 400
"""Samples on which the batch intervals are computed."""
NOISE_BOUNDS = (NOISE_BOUND, 1.0, 3.0)
"""In bar, for the bundled records: the sensor's bound, and bounds that cover the interpolation on ramps and steps."""


@dataclass(frozen=True)
class RecordChanges:
    """The proven changes of a record, by noise bound in bar."""

    record: str
    changes: Mapping[float, tuple[Change, ...]]


@dataclass(frozen=True, eq=False, repr=False)
class SetStudy(Result):
    """Recursive sets on known plants and on the bundled records.

    Parameters
    ----------
    sampling_time
        In seconds.
    noise_bound
        In bar.
    truth
        Parameters of the known plant, in the order of the names of its history.
    known
        Sets of the known plant, by sample.
    batch
        Certified batch intervals of the known plant's first samples.
    hidden
        First sample of the changed plant.
    changed
        Sets of the plant that changes.
    located
        The first proven change, on the shortest stretch of samples found; None if none was proven.
    """

    sampling_time: float
    noise_bound: float
    truth: tuple[float, ...]
    known: SetHistory
    batch: Estimate
    hidden: int
    changed: SetHistory
    located: Change | None
    records: tuple[RecordChanges, ...]

    @property
    def never_left(self) -> bool:
        """Tell whether the true parameters of the known plant lie in its set at every sample."""
        return bool(((self.known.lower <= self.truth) & (self.truth <= self.known.upper)).all())

    @property
    def against_batch(self) -> Table:
        """Return recursive and batch intervals of the same samples, a row per parameter."""
        n = self.batch.data.n_samples
        rows = []
        for k, (name, truth, batch) in enumerate(zip(self.known.names, self.truth, self.batch.intervals, strict=True)):
            low, high = (float(ends[n - 1, k]) for ends in (self.known.lower, self.known.upper))
            wider = f"{(high - low) / batch.width:.2f}"
            rows.append((name, f"{truth:.5g}", _interval(batch.lower, batch.upper), _interval(low, high), wider))
        header = ("parameter", "truth", "batch", "recursive", "times wider")
        caption = (
            f"The thesis's central model, noise of at most {self.noise_bound:g} bar: certified intervals after {n} "
            "samples."
        )
        return Table(caption, header, tuple(rows), "lrrrr")

    @property
    def at_end(self) -> Table:
        """Return the last interval of the known plant, a row per parameter."""
        lower, upper = self.known.lower[-1].tolist(), self.known.upper[-1].tolist()
        rows = tuple(
            (name, f"{truth:.6g}", _interval(low, high), f"{high - low:.2g}")
            for name, truth, low, high in zip(self.known.names, self.truth, lower, upper, strict=True)
        )
        header = ("parameter", "truth", "recursive", "width")
        return Table(f"The same after all {len(self.known.lower)} samples.", header, rows, "lrrr")

    @property
    def of_records(self) -> Table:
        """Return the proven changes, a row per record."""
        rows = []
        for found in self.records:
            first, *_ = found.changes.values()
            when = f"{first[0].sample * self.sampling_time:.3f}" if first else "-"
            rows.append((found.record, *(str(len(changes)) for changes in found.changes.values()), when))
        bounds = [f"{bound:g} bar" for bound in self.records[0].changes]
        caption = (
            "The bundled records: how often it is proven, at each noise bound, that no constant Hammerstein model "
            "explains the samples since the last proof."
        )
        header = ("record", *bounds, f"first at {bounds[0]} [s]")
        return Table(caption, header, tuple(rows), "l" + "r" * (len(bounds) + 1))

    @property
    def change(self) -> str:
        """Return the proof of the hidden change in a sentence or two."""
        begin = f"The pole was changed from {-self.truth[0]:g} to {OTHER_POLE:g} at sample {self.hidden}."
        early = sum(change.sample < self.hidden for change in self.changed.changes)
        if self.located is None:
            return f"{begin} No change was proven."
        late = self.located.sample - self.hidden
        return (
            f"{begin} With sample {self.located.sample}, {late} samples or {1e3 * late * self.sampling_time:g} ms "
            f"later, a change after sample {self.located.after} is proven. Proofs before the change: {early}."
        )

    @property
    def conclusion(self) -> str:
        """Return the results of the study in a few sentences."""
        left = "never left" if self.never_left else "LEFT"
        proven = [
            f"{bound:g} bar on {sum(bool(found.changes[bound]) for found in self.records)}"
            for bound in self.records[0].changes
        ]
        return (
            f"The true parameters {left} the set in {len(self.known.lower)} samples. {self.change} It is proven that "
            f"no constant Hammerstein model fits the actuator, for noise of {', '.join(proven)} of {len(self.records)} "
            "bundled records."
        )

    def _content(self) -> Iterator[Part]:
        yield self.conclusion
        yield self.against_batch
        yield self.at_end
        yield self.of_records

    def plot(self) -> Figure:
        """Draw the intervals over time of the plant that changes, with the true parameters."""
        truth = np.tile(self.truth, (len(self.changed.lower), 1))
        truth[self.hidden :] = changed_parameters(self.truth)
        return self.changed.plot(truth, self.sampling_time)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""

        def plain(change: Change | None) -> dict[str, int] | None:
            return None if change is None else {"after": change.after, "sample": change.sample}

        return {
            "noise_bound": self.noise_bound,
            "truth": dict(zip(self.known.names, self.truth, strict=True)),
            "never_left": self.never_left,
            "intervals": {
                name: {"lower": float(low), "upper": float(high)}
                for name, low, high in zip(self.known.names, self.known.lower[-1], self.known.upper[-1], strict=True)
            },
            "batch": self.batch.to_dict(),
            "hidden": self.hidden,
            "located": plain(self.located),
            "records": [
                {
                    "record": found.record,
                    "proofs": [
                        {"noise_bound": bound, "changes": [plain(change) for change in changes]}
                        for bound, changes in found.changes.items()
                    ],
                }
                for found in self.records
            ],
        }


def _interval(low: float, high: float) -> str:
    """Return an interval with a few digits of its width, rounded outwards."""
    digits = 2 + max(1, math.ceil(math.log10(max(abs(low), abs(high)) / (high - low)))) if high > low else 7
    return f"{round_down(low, digits)} to {round_up(high, digits)}"


def changed_parameters(truth: Sequence[float]) -> Array:
    """Return the parameters with the other pole and a DC gain of one."""
    share = (1.0 - OTHER_POLE) / (1.0 + truth[0])
    return np.array([-OTHER_POLE, *(share * b for b in truth[1:])])


def set_study(
    records: Dataset | None = None,
    *,
    batch: int = BATCH,
    seed: int = 1,
    progress: Progress | None = None,
) -> SetStudy:
    """Run recursive set-membership estimation on known plants and on records.

    Parameters
    ----------
    records
        With the channels ``current`` (mA) and ``pressure`` (bar), and the record ``20C_step_b`` among them, whose
        current drives the known plants; by default all records of the actuator.
    batch
        Samples of the comparison with batch intervals.
    seed
        Of the noise.

    Raises
    ------
    DataError
        If a channel or the record is missing, or the record has too few samples.

    Examples
    --------
    >>> study = set_study(load_clutch("20C_step_b").crop(0, 300), batch=150)
    >>> study.never_left, study.known.names
    (True, ('a1', 'b0_v5', 'b0_v4', 'b0_v3'))
    """
    data = load_clutch(CLUTCH_RECORDS) if records is None else records
    current = data.select(CURRENT).values("current")
    n = current.size
    if not 50 <= batch <= n:
        raise DataError(f"batch = {batch} samples of {n} in {CURRENT}: give at least 50, and no more than there are")
    # The known plant, and the one whose pole changes half way.
    values = printed_central_model().values
    gain = 1.0 + values["alpha"]
    truth = (values["alpha"], *(gain * values[f"gamma{k}"] for k in range(1, len(POWERS) + 1)))
    generator = np.random.default_rng(seed)
    hidden = n // 2
    constant = np.tile(truth, (n, 1))
    varying = constant.copy()
    varying[hidden:] = changed_parameters(truth)
    runs = [_simulate(current, p) + generator.uniform(-NOISE_BOUND, NOISE_BOUND, n) for p in (constant, varying)]
    # Batch intervals and recursive sets of both plants.
    intervals = _batch(current[:batch], runs[0][:batch], data.sampling_time, progress)
    if intervals.unbounded:
        raise DataError(f"the first {batch} samples of {CURRENT} say too little for batch intervals: give more")
    known, changed = (_follow(current, run) for run in runs)
    first = changed.history.changes[0] if changed.history.changes else None
    # Recursive sets of the records, at every noise bound.
    found = []
    for run in data.experiments:
        if progress is not None:
            progress(f"recursive set on {run.name}")
        samples = (run.values["current"], run.values["pressure"])
        changes = {bound: _follow(*samples, bound).history.changes for bound in NOISE_BOUNDS}
        found.append(RecordChanges(run.name, changes))
    return SetStudy(
        data.sampling_time,
        NOISE_BOUND,
        truth,
        known.history,
        intervals,
        hidden,
        changed.history,
        None if first is None else locate_change(changed, first, current, runs[1]),
        tuple(found),
    )


def _simulate(current: Array, parameters: Array) -> Array:
    v = INPUT_SCALE * current
    regressors = np.stack([v**power for power in POWERS], axis=1)
    result = np.zeros(current.size)
    for t in range(1, current.size):
        result[t] = -parameters[t, 0] * result[t - 1] + regressors[t - 1] @ parameters[t, 1:]
    return result


def _follow(current: Array, pressure: Array, noise_bound: float = NOISE_BOUND) -> RecursiveSet:
    estimator = RecursiveSet(ARX, noise_bound, BOUNDS)
    for sample in zip(current.tolist(), pressure.tolist(), strict=True):
        estimator.update(*sample)
    return estimator


def _batch(current: Array, pressure: Array, sampling_time: float, progress: Progress | None) -> Estimate:
    # A free gain of the linear part, so that the coefficients are those of the difference equation.
    model = Hammerstein(powers=POWERS, input_scale=INPUT_SCALE, unit_dc_gain=False, fixed={"beta": 1.0}, stable=True)
    data = Dataset.from_arrays(input={"u": current}, output={"y": pressure}, sampling_time=sampling_time)
    return finished(identify(model, data, NOISE_BOUND, tolerance=1e-2, progress=progress))
