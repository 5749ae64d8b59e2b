r"""Faults of a sensor from its record, without a model: resolution, glitches, and intervals of equal samples.

**Resolution.**  The values that occur lie on a grid, :math:`y = y_0 + k q`.  The grid is found by walking up the sorted
values: the smallest gap (or a half, a third, a quarter of it) gives a first q; each further value refines offset and
step by least squares, so that the error of q does not add up.  It is a grid where the values lie within a few per cent
of q of it; values that are not on a grid lie uniformly, at a deviation of :math:`q/\sqrt{12}`.

**Glitches.**  A glitch of one or two samples survives no running median of five; monotone stretches, and so steps and
ramps, survive it unchanged.  A sample is a glitch where the difference is far beyond the others *and* the record jumps
there and back.  A heavy tail is no glitch: between the glitches and the crowd there must be a gap.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import median_filter

from relaxations.algebra.arrays import Array
from smid.data import DataError

_ON_GRID = 0.06
_FEWEST_LEVELS = 3
_FAR, _CROWD = 8.0, 5.0
_MOST_GLITCHES = 0.06


def quantisation_step(values: ArrayLike) -> float | None:
    """Find the step of a record that takes few, equidistant values.

    None where the values lie on no grid, or on one with more levels than there are samples.

    Parameters
    ----------
    values
        Shape (N,).

    Examples
    --------
    >>> y = np.sin(0.05 * np.arange(300))
    >>> round(quantisation_step(0.2 * np.round(y / 0.2)), 6)
    0.2
    >>> quantisation_step(y) is None
    True
    """
    y = _vector(values)
    levels = np.unique(y)
    if levels.size < _FEWEST_LEVELS:
        return None
    # Levels that differ by rounding only are one.
    levels = levels[np.append(True, np.diff(levels) > 1e-9 * (levels[-1] - levels[0]))]
    # Few levels lie on some grid by chance; then enough samples must repeat them.
    if levels.size < _FEWEST_LEVELS or (levels.size < 12 and y.size < 10 * levels.size):
        return None
    gap = float(np.diff(levels).min())
    for division in (1, 2, 3, 4):
        if _grid(levels[:100], gap / division) is None:
            continue  # most records lie on no grid, and the first levels show it
        step = _grid(levels, gap / division)
        if step is not None:
            return step if levels[-1] - levels[0] <= step * y.size else None
    return None


def _grid(levels: Array, step: float) -> float | None:
    """Return the step of a grid through sorted levels near a first guess, None where there is none."""
    k = np.zeros(levels.size)
    mean_k, mean_y, spread, common = 0.0, levels[0], 0.0, 0.0
    for i in range(1, levels.size):
        jump = (levels[i] - levels[i - 1]) / step
        k[i] = k[i - 1] + round(jump)
        # The straight line through the levels so far, one more at a time.
        off_k, off_y = k[i] - mean_k, levels[i] - mean_y
        mean_k, mean_y = mean_k + off_k / (i + 1), mean_y + off_y / (i + 1)
        spread, common = spread + off_k * (k[i] - mean_k), common + off_k * (levels[i] - mean_y)
        if spread > 0:
            step = common / spread
    deviation = levels - (mean_y + step * (k - mean_k))
    on_grid = step > 0 and np.all(np.diff(k) > 0) and float(np.sqrt(np.mean(deviation**2))) < _ON_GRID * step
    return float(step) if on_grid else None


def outlier_mask(values: ArrayLike) -> NDArray[np.bool_]:
    """Mark isolated glitches of a record or of a residual.

    Shape (N,), true at glitches of one or two samples. Steps, ramps, longer peaks and heavy-tailed noise are no
    glitches.

    Parameters
    ----------
    values
        Shape (N,).

    Examples
    --------
    >>> y = np.sin(0.05 * np.arange(300)) + 0.01 * np.random.default_rng(0).standard_normal(300)
    >>> y[[70, 200]] += [1.0, -0.5]
    >>> np.flatnonzero(outlier_mask(y))
    array([ 70, 200])
    """
    y = _vector(values)
    none = np.zeros(y.size, dtype=bool)
    if y.size < 20 or np.ptp(y) == 0:
        return none
    difference = y - median_filter(y, size=5, mode="reflect")
    size = np.abs(difference)
    far = size > _FAR * _noise(y, size)
    # The median beside a glitch is shifted: its neighbours do not count.
    beside = np.convolve(far, np.ones(5), mode="same") > 0
    between = (size > _CROWD * _noise(y, size)) & ~beside
    if not far.any() or far.sum() > max(2, _MOST_GLITCHES * y.size) or between.sum() > 0.5 * far.sum():
        return none
    for run in np.split(np.flatnonzero(far), np.flatnonzero(np.diff(np.flatnonzero(far)) > 1) + 1):
        first, last = int(run[0]), int(run[-1])
        if run.size > 2 or first < 2 or last > y.size - 3:
            continue  # at the ends the return of the record is not seen
        sign = np.sign(difference[first])
        there, back = sign * (y[first] - y[first - 1]), sign * (y[last] - y[last + 1])
        # The corner of a triangle jumps no further than the record moves anyway, other glitches nearby left out.
        beyond = ((first - 1, first - 2), (last + 1, last + 2))
        usual = max((abs(y[near] - y[next_]) for near, next_ in beyond if not far[next_]), default=0.0)
        if there > max(0.6 * size[first], 2 * usual) and back > max(0.6 * size[last], 2 * usual):
            none[run] = True
    return none


def _noise(y: Array, size: Array) -> float:
    """Return the noise level that a glitch must exceed.

    On a steep part the running median returns the samples unchanged, with their noise. There the distance from the
    chord of the neighbours gives the noise (1.21 is 1.4826 / sqrt(1.5)). In a record at rest both are zero for most
    samples; then the quieter nine tenths (0.79 deviations of normal noise) and a small part of the range count.
    """
    chord = np.abs(y[1:-1] - (y[:-2] + y[2:]) / 2)
    calm = np.sort(size)[: int(0.9 * size.size)]
    levels = (
        1.4826 * float(np.median(size)),
        1.21 * float(np.median(chord)),
        float(np.sqrt(np.mean(calm**2))) / 0.79,
        1e-3 * float(y.std()),
    )
    return max(levels)


def runs_of_equal(y: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the starts and the lengths of the stretches of equal samples.

    Examples
    --------
    >>> [x.tolist() for x in runs_of_equal(np.array([1.0, 1.0, 2.0, 2.0, 2.0]))]
    [[0, 2], [2, 3]]
    """
    starts = np.flatnonzero(np.append(True, np.diff(y) != 0)).astype(np.int64)
    return starts, np.diff(np.append(starts, y.size)).astype(np.int64)


def _vector(values: ArrayLike) -> Array:
    y = np.asarray(values, dtype=np.float64)
    if y.ndim != 1 or not y.size or not np.all(np.isfinite(y)):
        raise DataError("the values are no vector of finite numbers; give the samples of one channel")
    return y
