r"""Persistence of excitation: whether the input is rich enough for the order of the model.

A signal u is persistently exciting of order n (Godfrey, Perturbation Signals for System Identification, 1993;
Ljung, System Identification, 1987) when

1. its mean exists,  :math:`\bar u = \lim \frac1N \sum_r u_r`,
2. its autocovariance exists,  :math:`C_{uu}(k) = \lim \frac1N \sum_r (u_r - \bar u)(u_{r+k} - \bar u)`,
3. the n x n matrix with elements :math:`C_{uu}(i - j)` is positive definite.

A record is finite, so each limit needs a test that a record can fail:

1. the means of its two halves differ by at most one standard deviation (a ramp and a single step fail);
2. the variances of its two halves differ by at most a factor of four (a growing amplitude fails);
3. the Hankel matrix of the windows :math:`(u_t, \ldots, u_{t+n-1})`, with the mean of each column removed, has full
   column rank: sigma_min > tolerance * sigma_max.

The biased estimate of :math:`C_{uu}` cannot serve for the third test: its Toeplitz matrix is positive definite for
*every* nonzero record. The unbiased estimate may be indefinite. The covariance method has neither fault: k sines have
rank 2k for any length of the record, and a constant has rank 0. The Gram matrix of the windows is never formed, because
that would square the condition number.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from smid.data.dataset import Dataset
from smid.data.errors import DataError
from smid.display.result import Part, Result
from smid.display.table import Table

LARGEST_DRIFT = 1.0
LARGEST_VARIANCE_RATIO = 4.0


@dataclass(frozen=True, eq=False, repr=False)
class Excitation(Result):
    """How rich an input is.

    Parameters
    ----------
    mean
        In the input's unit.
    drift
        Largest difference between the means of the two halves of a record, in standard deviations.
    variance_ratio
        Largest ratio of the larger to the smaller variance of the two halves of a record.
    autocovariance
        Shape (max_order,). Biased estimate at the lags 0, 1, ..., in the unit squared.
    order
        Largest n up to `max_order` for which the covariance matrix is positive definite.
    max_order
        Largest order that was tested; N samples allow at most N // 2.
    tolerance
        Relative tolerance of the singular values.

    Examples
    --------
    >>> excitation(np.sin(0.3 * np.arange(200))).conditions
    (True, True, True)
    """

    mean: float
    drift: float
    variance_ratio: float
    autocovariance: NDArray[np.float64]
    order: int
    max_order: int
    tolerance: float

    @property
    def conditions(self) -> tuple[bool, bool, bool]:
        """Tell whether the mean and the autocovariance exist, and the matrix is positive definite at order 1."""
        return self.drift <= LARGEST_DRIFT, self.variance_ratio <= LARGEST_VARIANCE_RATIO, self.order > 0

    def _content(self) -> Iterator[Part]:
        least = "at least " if self.order == self.max_order else ""
        found = (
            ("1. mean exists", f"mean {self.mean:.4g}, drift {self.drift:.2g} std"),
            ("2. autocovariance exists", f"variance ratio of halves {self.variance_ratio:.3g}"),
            ("3. positive definite", f"up to order {self.order} of {self.max_order} tested"),
        )
        rows = tuple(
            (condition, "yes" if holds else "no", why)
            for (condition, why), holds in zip(found, self.conditions, strict=True)
        )
        caption = f"Persistence of excitation: order {least}{self.order}"
        yield Table(caption, ("condition", "holds", "found"), rows, "lll")


def _is_constant(records: list[NDArray[np.float64]]) -> bool:
    joined = np.concatenate(records)
    # The rounding of a mean gives a constant a range of some ulps.
    return bool(np.ptp(joined) <= 1e-12 * np.max(np.abs(joined)))


def _order(records: list[NDArray[np.float64]], max_order: int, tolerance: float) -> int:
    windows = np.concatenate([np.lib.stride_tricks.sliding_window_view(u, max_order) for u in records])
    # One QR serves all orders: the first n columns of R and of the windows have the same singular values.
    r = np.asarray(np.linalg.qr(windows - windows.mean(axis=0), mode="r"), dtype=np.float64)
    for n in range(1, max_order + 1):
        sigma = np.linalg.svd(r[:, :n], compute_uv=False)
        if sigma[-1] <= tolerance * sigma[0]:
            return n - 1
    return max_order


def _halves(u: NDArray[np.float64]) -> tuple[float, float]:
    """Return the drift of the mean in standard deviations, and the ratio of the variances, between two halves."""
    first, second = u[: u.size // 2], u[u.size // 2 :]
    drift = abs(float(second.mean() - first.mean())) / float(u.std())
    low, high = sorted((float(first.var()), float(second.var())))
    # The two halves of a single step have no variance: the drift shows the step, and the ratio is left at 1.
    ratio = 1.0 if high <= 1e-24 * float(np.max(u**2)) else high / low if low > 0 else np.inf
    return drift, ratio


def excitation(*inputs: ArrayLike, max_order: int = 50, tolerance: float = 1e-8) -> Excitation:
    """Measure the persistence of excitation of an input.

    Parameters
    ----------
    *inputs
        Shape (N,). The input in one experiment or in several, which are taken together.
    max_order
        Largest order to test.
    tolerance
        Singular values below this share of the largest count as zero. The default suits computed signals. For a
        measured input give its relative noise or resolution; otherwise its noise counts as excitation.

    Raises
    ------
    DataError
        If an input is not a finite vector or no experiment has two samples.

    Examples
    --------
    >>> t = np.arange(400)
    >>> excitation(np.sin(0.3 * t) + np.sin(1.1 * t)).order
    4
    >>> excitation(np.ones(400)).order
    0
    """
    records = [np.asarray(u, dtype=np.float64) for u in inputs]
    if any(u.ndim != 1 or not np.all(np.isfinite(u)) for u in records):
        raise DataError("an input is not a vector of finite numbers; give one vector per experiment")
    records = [u for u in records if u.size >= 2]
    if not records:
        raise DataError("no experiment has two samples of the input; give a longer record")
    if max_order < 1:
        raise DataError(f"max_order = {max_order} leaves no order to test; give at least 1")
    # A record allows orders up to half its length.
    longest = max(u.size for u in records)
    tried = min(max_order, longest // 2)
    long_enough = [u for u in records if u.size >= tried]
    # A constant input excites nothing.
    joined = np.concatenate(records)
    mean = float(joined.mean())
    if _is_constant(records):
        return Excitation(mean, 0.0, 1.0, np.zeros(tried), 0, tried, tolerance)
    # Autocovariance, and the stationarity of mean and variance over the halves.
    covariance = np.array(
        [sum(float((u[k:] - mean) @ (u[: u.size - k] - mean)) for u in long_enough) / joined.size for k in range(tried)]
    )
    halves = [_halves(u) for u in records if not _is_constant([u])]
    return Excitation(
        mean=mean,
        drift=max((drift for drift, _ in halves), default=0.0),
        variance_ratio=max((ratio for _, ratio in halves), default=1.0),
        autocovariance=covariance,
        order=_order(long_enough, tried, tolerance),
        max_order=tried,
        tolerance=tolerance,
    )


def require_excitation(dataset: Dataset, order: int, tolerance: float = 1e-8) -> None:
    """Refuse a data set whose inputs do not excite a model of the given order.

    Each input is tested on its own; whether several inputs vary independently is not tested.

    Parameters
    ----------
    order
        For a linear model, the number of its coefficients.
    tolerance
        See `excitation`.

    Raises
    ------
    DataError
        If an input does not excite this order.

    Examples
    --------
    >>> data = Dataset.from_arrays(input=np.ones(50), output=np.ones(50), sampling_time=1.0)
    >>> require_excitation(data, 2)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    smid.data.errors.DataError: the input 'input' excites order 0 but the model needs order 2; ...
    """
    for name in dataset.inputs:
        records = [run.values[name] for run in dataset.experiments]
        found = excitation(*records, max_order=order, tolerance=tolerance).order
        if found < order:
            raise DataError(
                f"the input {name!r} excites order {found} but the model needs order {order}; "
                "measure with a richer input (PRBS, multisine of more lines), or choose a smaller model"
            )
