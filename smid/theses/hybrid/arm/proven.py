"""Certified intervals of the arm's constants from its angle, by `identify`, without a start value.

The model is the arm with friction and drag, its differential equation enclosed. Assumptions: the law itself, its torque
per volt c and its eps, an input held between samples, and Ws >= Wd.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

from smid.data import Dataset
from smid.identification.estimate import Estimate, ParameterInterval
from smid.identification.identify import identify
from smid.models import Model, RotatingArm

__all__ = ["CONSTANTS", "PRIOR", "is_told", "prove_arm", "white_law"]

CONSTANTS = ("theta", "b", "Wd", "Ws")

PRIOR: Mapping[str, tuple[float, float]] = MappingProxyType(
    {"theta": (1.0, 1000.0), "b": (0.0, 1.0), "Wd": (0.0, 10.0), "Ws": (0.0, 10.0)}
)
"""Default intervals of the search, in 1/(kg m2), Nm s2/rad2, Nm and Nm.

The upper ends are 46 (theta), 370 (b), 23 (Wd) and 8 (Ws) times the constants of the thesis's arm.
"""

_STEPS = 2  # of the integration, between two samples
_TOLERANCE = 0.5
_BOXES = 1  # more of them seldom narrow an interval, and take most of the time


def white_law(prior: Mapping[str, tuple[float, float]] | None = None) -> Model:
    """Return the arm with its friction and drag, with constants in a box: that of `PRIOR`, or as is said otherwise."""
    arm = RotatingArm(None, friction=True, drag=True, scheme="enclosed", substeps=_STEPS)
    sticking, gliding = (arm.parameter(name).symbol for name in ("Ws", "Wd"))
    return replace(arm.bound(**dict(PRIOR) | dict(prior or {})), constraints=(sticking - gliding,))


def prove_arm(
    data: Dataset,
    noise_bound: float,
    *,
    prior: Mapping[str, tuple[float, float]] | None = None,
    seconds: float = 120.0,
    certificate: str | Path | None = None,
) -> Estimate:
    """Return certified intervals of the arm's constants.

    Parameters
    ----------
    data
        The motor voltage in V, held between samples, and the angle in rad.
    noise_bound
        Largest error of a measured angle, in rad.
    prior
        Intervals that replace those of `PRIOR`.
    seconds
        Time limit; what is proven until then is returned. The time to write a certificate is not counted.
    certificate
        File for the proof; see `identify`.

    Raises
    ------
    ModelError
        If the prior is not valid.
    EmptyFeasibleSetError
        If no arm explains the angles.

    Examples
    --------
    >>> import numpy as np
    >>> from smid.theses.hybrid import simulate_arm
    >>> from smid.signals import TABLE_F1
    >>> u = TABLE_F1["six_unequal"].signal(100, 0.02)
    >>> y = simulate_arm(u, 0.02) + 0.001 * np.sin(np.arange(100))
    >>> data = Dataset.from_arrays(input=u, output=y, sampling_time=0.02)
    >>> found = prove_arm(data, 0.001, prior={"theta": (10, 50)})["theta"]
    >>> 21 < found.lower < 21.7391 < found.upper < 23
    True
    """
    return identify(
        white_law(prior),
        data,
        noise_bound,
        tolerance=_TOLERANCE,
        nodes=_BOXES,
        seconds=seconds,
        certificate=certificate,
    )


def is_told(interval: ParameterInterval) -> bool:
    """Return whether a constant is proven within a factor of two.

    The intervals are outer ones: the data may determine a constant better than is proven.

    Examples
    --------
    >>> from math import nan
    >>> from relaxations.search.enclosure import Proof
    >>> is_told(ParameterInterval("Ws", "Nm", 0.9, 10.0, nan, nan, Proof.PROVEN, Proof.BOX))
    False
    """
    return interval.lower > 0 and interval.upper <= 2 * interval.lower
