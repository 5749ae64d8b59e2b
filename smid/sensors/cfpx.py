"""CFPX: the position from the pressure of the same instant, by a polynomial.

    x_t = sum_j c_j T_j((P_t - centre) / half_range),    j = 0..order

The thesis has powers of P. Powers of 30 bar up to order 100 lose all digits, so Chebyshev polynomials over the range of
the records are used: they span the same functions and stay within [-1, 1]. Beyond that range the polynomial is held at
its end value.

Reference: clutch thesis, (5.11) and table 5.3; Trefethen, "Approximation Theory and Approximation Practice", chapter 3.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.polynomial import chebyshev

from relaxations.algebra.arrays import Array
from smid.data import DataError, Dataset
from smid.models import ModelError
from smid.networks import ProgressCallback
from smid.sensors.sensor import Run, Samples, VirtualSensor, require_training_data, trained

__all__ = ["CFPX", "scale_pressure"]


@dataclass(frozen=True, eq=False)
class CFPX(VirtualSensor):
    """Pressure to position by a polynomial.

    Parameters
    ----------
    pressure_range
        Lowest and highest pressure of the training records, in bar.
    coefficients
        Shape (order + 1,). Of the Chebyshev polynomials on that range, in mm; None before training.
    sampling_time
        Of the training records, in seconds.

    Raises
    ------
    ModelError
        If the order is negative.

    Examples
    --------
    >>> from smid.data.bundled import load_clutch
    >>> data = load_clutch("20C_step_a")
    >>> errors = [CFPX(order).fit(data, seed=1).predict(data).mse(data) for order in (5, 20, 100)]
    >>> sorted(errors, reverse=True) == errors
    True
    """

    order: int = 20
    pressure_range: tuple[float, float] | None = None
    coefficients: Array | None = None
    sampling_time: float | None = None

    def __post_init__(self) -> None:
        if self.order < 0:
            raise ModelError(f"order = {self.order}: give the order of a polynomial, 0 or more")

    @property
    def channels(self) -> tuple[str, ...]:
        """The pressure."""
        return ("pressure",)

    @property
    def n_parameters(self) -> int:
        """Number of coefficients."""
        return self.order + 1

    def fit(
        self,
        data: Dataset,
        *,
        seed: int | np.random.Generator,  # noqa: ARG002
        starts: int = 1,  # noqa: ARG002
        progress: ProgressCallback | None = None,  # noqa: ARG002
    ) -> Self:
        """Return this sensor, fitted by linear least squares; see `VirtualSensor.fit`."""
        require_training_data(data, self.channels)
        pressure = data.stacked("pressure")
        if self.n_parameters > pressure.size:
            raise DataError(
                f"{self.n_parameters} coefficients but {pressure.size} samples: give more samples, or a lower order"
            )
        pressure_range = float(pressure.min()), float(pressure.max())
        basis = chebyshev.chebvander(scale_pressure(pressure, pressure_range), self.order)
        coefficients = np.asarray(np.linalg.lstsq(basis, data.stacked("position"), rcond=None)[0], dtype=np.float64)
        return replace(
            self,
            pressure_range=pressure_range,
            coefficients=coefficients,
            sampling_time=data.sampling_time,
        )

    def run(self) -> Run:
        """Return the sensor; see `VirtualSensor.run`."""
        return _Run(trained(self.pressure_range, self), trained(self.coefficients, self))


@dataclass(frozen=True, eq=False)
class _Run:
    pressure_range: tuple[float, float]
    coefficients: Array

    def advance(self, samples: Samples) -> Array:
        scaled = scale_pressure(samples["pressure"], self.pressure_range)
        return np.asarray(chebyshev.chebval(scaled, self.coefficients))


def scale_pressure(pressure: Array, pressure_range: tuple[float, float]) -> Array:
    """Return a pressure scaled to [-1, 1] and held at the ends of the range."""
    low, high = pressure_range
    return np.asarray((np.clip(pressure, low, high) - 0.5 * (low + high)) / (0.5 * (high - low)))
