r"""What a noise bound adds to the likelihood of an error.

The error is noise v that keeps the bound b, and a Gaussian rest r that fitted numbers and laws are off by. Where the
past tells a mean m and a deviation s of the error e, its density is

.. math:: p(e) \propto t((e - m) / s)\, P(|e - r| \le b),\qquad r \sim N(0, \beta^2),

divided by the probability that an error of deviation :math:`(s^2 + \beta^2)^{1/2}` keeps the bound, which is all but
its integral over e. The *blur* :math:`\beta` belongs to the record, as the noise model does: the best set predicts best
with it. It is no less than what fitted numbers are off by, `OFF` of the bound, and the discrepancy of laws
(`smid.diagnosis.search.noise_model`). A larger one has a price, because laws are off by a few per cent of what they
explain: a blur as large as the base model's error costs 50 nats.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import log_ndtr

from relaxations.algebra.arrays import Array
from smid.diagnosis.search.student import log_probability

OFF = 0.1
"""What fitted numbers are off by, as a share of the noise bound."""

_LOG_ROOT = 0.5 * float(np.log(2 * np.pi))


@dataclass(frozen=True, eq=False)
class WithinBound:
    """A noise bound, and the deviation of what fits and laws are off by, of all or each, in the channel's unit."""

    bound: float
    blur: float | Array

    def log_density(self, errors: Array, expected: Array, deviations: Array) -> Array:
        """Return what the bound adds to the log density of each error, shape (n,).

        Parameters
        ----------
        errors, expected, deviations
            Shape (n,). The errors, what their past tells of them, and their deviations from that.
        """
        size, spread = np.abs(expected), np.hypot(self.blur, deviations)
        possible = log_probability((-self.bound - size) / spread, (self.bound - size) / spread)
        return _log_probability(errors, self.bound, self.blur) - possible

    def slopes(self, errors: Array) -> tuple[Array, Array]:
        """Return the first two derivatives of minus the log probability that the noise keeps the bound, shapes (n,)."""
        above, below = (self.bound - errors) / self.blur, (-self.bound - errors) / self.blur
        kept = _log_probability(errors, self.bound, self.blur)
        up, down = (np.exp(-0.5 * edge**2 - _LOG_ROOT - kept) for edge in (above, below))
        first = (up - down) / self.blur
        return first, first**2 + (above * up - below * down) / self.blur**2


def _log_probability(mean: Array, bound: float, deviation: float | Array) -> Array:
    """Return the log probability that a normal number lies within the bound."""
    near, far = (log_ndtr((edge - np.abs(mean)) / deviation) for edge in (bound, -bound))
    return np.asarray(near + np.log1p(-np.exp(far - near)))
