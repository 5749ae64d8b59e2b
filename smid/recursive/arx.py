"""ARX models, and Hammerstein models that are linear in their parameters.

    y[t] = -a1 y[t-1] - ... - a_na y[t-na] + sum_p sum_j b_j,p v[t-delay-j]^p + offset + e[t],   v = K u
         = phi[t]' theta + e[t]

One pole, one input term and power 1 give the thesis's model (3.24), ``phi[t] = [-y[t-1], u[t-1]]`` (3.28).
Several powers give its Hammerstein model (3.1)-(3.5), where ``b = (1 + alpha) gamma``.

Reference: clutch thesis, sections 3.2 and 3.3; Ljung, System Identification, 2nd ed., section 4.2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from smid.data import DataError
from smid.models import ModelError
from smid.models.transfer import check_count, names

__all__ = ["LARGEST", "Arx", "refusal"]

LARGEST = 1e100
"""Larger numbers are refused, because their squares would overflow."""


@dataclass(frozen=True)
class Arx:
    """The structure of a model whose next output is linear in the parameters.

    Parameters
    ----------
    na
        Number of poles.
    nb
        Degree of the numerator: nb + 1 coefficients for each power, as in `smid.models.OutputError`.
    delay
        Samples from input to output.
    powers
        Powers of the scaled input, at least 1.
    input_scale
        K of (3.4), in one per input unit.
    offset
        Whether a constant is estimated too, in the output's unit.
    stable
        Whether an estimator moves poles on or outside the unit circle back inside, section 3.3.2.1.
    inputs
        Number of inputs; each has its own numerator of the same degree, powers and delay.

    Raises
    ------
    ModelError
        If an order, a power, the scale or the number of inputs is out of range.

    Examples
    --------
    >>> Arx(na=2, nb=1).names
    ('a1', 'a2', 'b0', 'b1')
    >>> Arx(powers=(5, 4, 3), input_scale=0.01).names
    ('a1', 'b0_v5', 'b0_v4', 'b0_v3')
    >>> Arx(inputs=2).names
    ('a1', 'b0_u1', 'b0_u2')
    """

    na: int = 1
    nb: int = 0
    delay: int = 1
    powers: tuple[int, ...] = (1,)
    input_scale: float = 1.0
    offset: bool = False
    stable: bool = True
    inputs: int = 1

    def __post_init__(self) -> None:
        check_count("na", self.na, 0)
        check_count("nb", self.nb, 0)
        check_count("delay", self.delay, 0)
        check_count("inputs", self.inputs, 1)
        object.__setattr__(self, "powers", tuple(self.powers))
        for power in self.powers:
            check_count("a power", power, 1)
        if not self.powers or len(set(self.powers)) < len(self.powers):
            raise ModelError(f"powers = {self.powers} must be distinct and at least one: list each power once")
        if not (np.isfinite(self.input_scale) and self.input_scale != 0):
            raise ModelError(f"input_scale = {self.input_scale} is refused: give a finite number, not zero")

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the parameters, in the order of the regressors."""
        numerator = names("b", self.nb + 1, 0)
        if self.powers != (1,):
            numerator = tuple(f"{name}_v{power}" for power in self.powers for name in numerator)
        if self.inputs > 1:
            numerator = tuple(f"{name}_u{k}" for k in range(1, self.inputs + 1) for name in numerator)
        return (*names("a", self.na, 1), *numerator, *(("offset",) if self.offset else ()))

    @property
    def max_lag(self) -> int:
        """Return the number of past samples used, which is also the first sample that can be predicted."""
        return max(self.na, self.delay + self.nb)

    @property
    def largest_input(self) -> float:
        """Return the largest input whose powers stay below `LARGEST`, in the input's unit."""
        return float(LARGEST ** (1 / max(self.powers)) / abs(self.input_scale))

    def row(self, outputs: Sequence[float], *inputs: Sequence[float]) -> list[float]:
        """Return the regressors of one sample, in the order of `names`.

        `outputs` are ``y[t-1], ..., y[t-na]``; each of `inputs` is a scaled input ``v[t], v[t-1], ..., v[t-delay-nb]``.

        Examples
        --------
        >>> Arx(powers=(2, 1)).row([5.0], [1.0, 3.0])
        [-5.0, 9.0, 3.0]
        """
        terms = [-y for y in outputs]
        for values in inputs:
            terms += [v**power for power in self.powers for v in values[self.delay :]]
        if self.offset:
            terms.append(1.0)
        return terms

    def matrix(self, input: ArrayLike, output: ArrayLike) -> Array:
        """Return the regressors of a record, one row for each sample from number `max_lag` on.

        The output has shape (N,), the input too; several inputs have shape (N, inputs).

        Raises
        ------
        DataError
            If the series differ in length, are too short, or contain values that are not finite or too large.

        Examples
        --------
        >>> Arx().matrix([1, 2, 3], [4, 5, 6])
        array([[-4.,  1.],
               [-5.,  2.]])
        """
        # Refuse data that the regressors cannot hold.
        u, y = np.asarray(input, dtype=np.float64), np.asarray(output, dtype=np.float64)
        if y.ndim != 1 or u.shape != (y.shape if self.inputs == 1 else (*y.shape, self.inputs)):
            raise DataError(
                f"input and output have shapes {u.shape} and {y.shape}: give series of equal length, one per input"
            )
        if not (np.abs(u) < self.largest_input).all() or not (np.abs(y) < LARGEST).all():
            raise DataError("a sample is not finite or too large: fill gaps and scale the input before")
        # Only samples with a complete history have a row.
        start, n = self.max_lag, y.size
        if n <= start:
            raise DataError(f"{n} samples are too few: the model looks back {start}, give at least {start + 1}")
        # One column for each parameter, in the order of the names.
        v = self.input_scale * u.reshape(n, self.inputs)
        columns = [-y[start - lag : n - lag] for lag in range(1, self.na + 1)]
        lags = range(self.delay, self.delay + self.nb + 1)
        columns += [own[start - lag : n - lag] ** power for own in v.T for power in self.powers for lag in lags]
        if self.offset:
            columns.append(np.ones(n - start))
        return np.stack(columns, axis=1)

    def __str__(self) -> str:
        orders = f"na {self.na}, nb {self.nb}, delay {self.delay}{', offset' if self.offset else ''}"
        orders += f", {self.inputs} inputs" if self.inputs > 1 else ""
        if self.powers == (1,):
            return f"ARX ({orders})"
        return f"Hammerstein {', '.join(f'v^{power}' for power in self.powers)} ({orders})"


def refusal(number: int, inputs: Sequence[float], y: float, expected: int = 1) -> DataError:
    """Return the error for a sample that a recursive estimator cannot use."""
    if len(inputs) != expected:
        return DataError(f"sample {number} has {len(inputs)} inputs and the model {expected}: give one value for each")
    for name, value in (*(("input", u) for u in inputs), ("output", y)):
        if not (isinstance(value, Real) and math.isfinite(value)):
            return DataError(f"sample {number}: the {name} is {value}: leave the sample out, or fill the gap before")
    given = ", ".join(f"{u:g}" for u in inputs)
    return DataError(f"sample {number}: input {given} or output {y:g} is too large: scale the data before")
