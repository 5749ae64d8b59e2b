r"""The delay from an input to an output, by a bank of linear models that assume more and more delay.

The output is described one step ahead by its own past and the past of the inputs (ARX, and FIR where p is zero),

.. math::  y_t = \sum_{i=1}^{p} a_i y_{t-i} + \sum_{j=d}^{m} b_j u_{t-j} + e_t .

A plant of delay d has :math:`b_0 = \dots = b_{d-1} = 0`, for every past of the output that makes e white: so the noise
may be coloured, the plant slow, the input correlated, and the loop closed. The residual sum of squares V(d) of the
model that assumes the delay d rises significantly beyond the true delay. The F test of V(d) against V(0) gives the band
that chance exceeds in 1 % of records. The delay is the largest d whose rise lies within the band. The input does not
act at all if the rise of the model without this input lies within the band too. One QR decomposition gives all V(d):
with the columns of u in the order m, ..., 0, each last one left out adds the square of one component of Q'y.

Reference: Ljung, System Identification, 2nd ed., sections 10.1 and 16.3; Björklund, A survey and comparison of
time-delay estimation methods in linear systems, Linköping 2003.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import f

from relaxations.algebra.arrays import Array
from smid.data import DataError, Dataset
from smid.data.dataset import check_dataset
from smid.display.result import Part, Tabular
from smid.display.table import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAST = 10
"""Largest number of past outputs, p."""
_COLLINEAR = 1e-9  # of a column's norm


@dataclass(frozen=True, eq=False, repr=False)
class Delay(Tabular):
    """The delay from an input to an output, and its evidence.

    Parameters
    ----------
    samples
        None if the input does not act on the output within the lags that were tested.
    rise
        Shape (m + 2,). Rise of the one-step error variance if the model assumes a delay of 0, 1, ... m samples, or does
        not have this input at all (last), as a share of the variance at delay 0.
    band
        Shape (m + 2,). The rise that chance exceeds in 1 % of records.
    """

    data: Dataset
    input: str
    output: str
    samples: int | None
    rise: Array
    band: Array

    @property
    def seconds(self) -> float | None:
        """Return the delay in seconds; None if there is none."""
        return None if self.samples is None else self.samples * self.data.sampling_time

    @property
    def longest(self) -> int:
        """Return the largest lag m that was tested, in samples."""
        return len(self.rise) - 2

    @property
    def sentence(self) -> str:
        """Return the result in one sentence."""
        if self.samples is None:
            return f"No delay found: the last {self.longest} samples of {self.input} do not act on {self.output}."
        samples = "1 sample" if self.samples == 1 else f"{self.samples} samples"
        return f"Delay from {self.input} to {self.output}: {samples} ({self.seconds:.4g} s)."

    @property
    def table(self) -> Table:
        """Return a table with one row for each assumed delay, up to the first ones beyond the band."""
        shown = min(len(self.rise), 3 + (len(self.rise) if self.samples is None else self.samples))
        rows = tuple(
            (
                str(row["delay"]) if row["delay"] is not None else "no input",
                f"{100 * row['rise']:.2f}",
                f"{100 * row['band']:.2f}",
                "yes" if row["rise"] <= row["band"] else "no",
            )
            for row in list(self._rows())[:shown]
        )
        return Table("", ("assumed delay [samples]", "rise of error [%]", "99 % band [%]", "possible"), rows, "rrrl")

    def _content(self) -> Iterator[Part]:
        yield self.sentence
        yield self.table

    def _rows(self) -> Iterator[dict[str, Any]]:
        for delay, (rise, band) in enumerate(zip(self.rise.tolist(), self.band.tolist(), strict=True)):
            yield {"delay": delay if delay <= self.longest else None, "rise": rise, "band": band}

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "input": self.input,
            "output": self.output,
            "samples": self.samples,
            "seconds": self.seconds,
            "assumed": list(self._rows()),
        }

    def plot(self) -> Figure:
        """Draw the rise of the error variance over the assumed delay, with the band of chance."""
        from smid.signals.figures import delay_figure

        return delay_figure(self)


def delay_estimate(data: Dataset, input: str | None = None, output: str | None = None, longest: int = 30) -> Delay:
    """Estimate the delay from an input to an output; `samples` is None if the input does not act on the output.

    Noise can hide a slow first response: then the estimate is larger than the delay. It is smaller than the delay in
    about 1 of 100 records. `OutputError(delay=...)` counts in the same way: a plant whose output answers one sample
    later has a delay of one sample.

    Parameters
    ----------
    input, output
        Channels; by default the only input and the only output.
    longest
        Largest lag to test, in samples.

    Raises
    ------
    DataError
        If a channel is missing or constant, or if the record is too short for this many lags.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> u = rng.standard_normal(400)
    >>> y = np.concatenate([np.zeros(4), u[:-4]]) + 0.5 * rng.standard_normal(400)
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.1)
    >>> delay_estimate(data, longest=10).sentence
    'Delay from u to y: 4 samples (0.4 s).'
    """
    check_dataset(data)
    data = data.without_gaps()
    u, y = (data.input if input is None else input), (data.output if output is None else output)
    if longest < 1:
        raise DataError(f"longest = {longest} leaves no delay to test: give at least 1 sample")
    for name in (u, y):
        data.channel(name)
        if np.ptp(data.stacked(name)) <= 1e-12 * np.abs(data.stacked(name)).max():
            raise DataError(
                f"channel {name!r} is constant: a delay needs an input that moves and an output that answers"
            )
    others = [name for name in data.inputs if name not in (u, y)]
    # Rows of all experiments that are long enough: past outputs and other inputs first, then u from lag m to lag 0.
    rows, targets = [], []
    reach = max(longest, PAST)
    for run in data.experiments:
        if run.n_samples <= reach:
            continue
        x = {name: run.values[name] - data.stacked(name).mean() for name in (u, y, *others)}
        known = [_lagged(x[y], range(1, PAST + 1), reach), np.ones((run.n_samples - reach, 1))]
        known += [_lagged(x[name], range(longest + 1), reach) for name in others]
        rows.append(np.hstack([*known, _lagged(x[u], range(longest, -1, -1), reach)]))
        targets.append(x[y][reach:])
    count = sum(map(len, targets))
    columns = PAST + 1 + (longest + 1) * (len(others) + 1)
    if count < 2 * columns:
        raise DataError(
            f"{count} samples after the first {reach} are too few for {columns} coefficients: take a longer record, or "
            "a smaller value of longest"
        )
    # V(d) from the components of the output along the columns, from the last column backwards.
    phi = np.concatenate(rows)
    q, r = np.linalg.qr(phi)
    target = np.concatenate(targets)
    along = q.T @ target
    told = np.abs(np.diag(r)) > _COLLINEAR * np.linalg.norm(phi, axis=0)
    left = float(target @ target - np.sum(along[told] ** 2))
    last = slice(-1, -longest - 2, -1)
    added = np.concatenate([[0.0], np.cumsum(np.where(told[last], along[last] ** 2, 0.0))])
    freed = np.concatenate([[0], np.cumsum(told[last])])
    free = count - int(told.sum())
    left = max(left, 1e-12 * float(target @ target))  # without noise, rounding is the error
    rise = added / left
    band = np.where(freed > 0, f.ppf(0.99, np.maximum(freed, 1), free) * freed / free, 0.0)
    possible = np.flatnonzero(rise <= band)
    samples = None if possible[-1] == longest + 1 else int(possible[-1])
    return Delay(data, u, y, samples, rise, band)


def _lagged(x: Array, lags: range, reach: int) -> Array:
    """Return x at these lags as columns, from the sample `reach` on."""
    return np.stack([x[reach - lag : x.size - lag] for lag in lags], axis=1)
