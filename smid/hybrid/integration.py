"""Error of the integration of a trained model: how far its free run moves with twice as many steps a sample.

A network is trained through the integration, so it can learn to undo the error of long steps. Its free run fits the
record then, and its law is wrong. Of a method of order p the difference to half the step is 1 - 2^-p of the error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from relaxations.algebra.arrays import Mask
from smid.data import Dataset
from smid.fitting.problem import Fit, Fitting

__all__ = ["integration_error"]


def integration_error(fit: Fit, data: Dataset, used: Sequence[Mask]) -> dict[str, float]:
    """Return the RMS change of the free run with half the step, on the fitted samples, by output channel, in its unit.

    It is infinite if that run diverges, and empty for a model without a rate.
    """
    if not fit.model.continuous:
        return {}
    finer = Fitting(replace(fit.model, substeps=2 * fit.model.substeps), data, used)
    with np.errstate(over="ignore", invalid="ignore"):  # the run may diverge
        runs = finer.simulate(finer.at(fit.model.values, fit.initial))
        found = {}
        for channel in fit.model.output_channels:
            each = zip(runs, fit.simulated, used, strict=True)
            changes = np.concatenate([(run[channel] - before[channel])[mask] for run, before, mask in each])
            found[channel] = float(np.nan_to_num(np.sqrt(np.mean(changes**2)), nan=np.inf))
    return found
