"""Error of a hybrid model as a least-squares problem for the methods of `smid.networks`.

    E(theta) = mean of r(units theta)^2  +  sum of penalty theta^2

r is simulated minus measured output in standard deviations, in a free run or one step ahead. The units are such that a
step of one changes the outputs by about one standard deviation: so neither the units of the channels nor those of the
parameters matter. Parameters stay in their boxes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from relaxations.algebra.arrays import Array
from smid.fitting.problem import Fitting
from smid.hybrid.hybrid_model import HybridModel
from smid.models import ModelError
from smid.networks import NormalEquations, sum_normal_equations

__all__ = ["HybridError", "hybrid_error"]

_INSENSITIVE = 1e-8  # smallest slope to scale by, in standard deviations of the output
_LARGEST = 1e100  # slopes beyond are of a run that diverges, and count as zero: their squares would overflow


@dataclass(frozen=True, eq=False)
class HybridError:
    """The least-squares problem of a hybrid model.

    Parameters
    ----------
    units
        Shape (p,). The fitted numbers are ``units * theta``.
    penalty
        Shape (p,). Of each squared theta.
    """

    fitting: Fitting
    units: Array
    penalty: Array

    @property
    def box(self) -> tuple[Array, Array]:
        """Return the lower and the upper ends of theta, shape (p,) each."""
        lower, upper = self.fitting.box
        return lower / self.units, upper / self.units

    @cached_property
    def count(self) -> int:
        """Return the number of residuals."""
        there = zip(self.fitting.used, self.fitting.there, strict=True)
        return sum(int((mask & seen).sum()) for mask, mine in there for seen in mine.values())

    def vector(self, theta: Array) -> Array:
        """Return the fitted numbers."""
        return np.asarray(np.clip(self.units * theta, *self.fitting.box))

    def theta(self, values: Mapping[str, float]) -> Array:
        """Return theta at parameter values, and known or guessed initial states."""
        return np.asarray(self.fitting.start(values) / self.units)

    def values(self, theta: Array) -> dict[str, float]:
        """Return the parameter values."""
        return dict(zip(self.fitting.run.parameters, self.vector(theta).tolist(), strict=False))

    def error(self, theta: Array) -> float:
        """Return the error; infinite where the run diverges."""
        with np.errstate(all="ignore"):  # a run may diverge
            residual = self.fitting.residual(self.vector(theta))
            return float(np.mean(residual**2) + self.penalty @ theta**2)

    def normal_equations(self, theta: Array) -> NormalEquations:
        """Return the normal equations."""
        vector = self.vector(theta)
        with np.errstate(all="ignore"):  # slopes of a run that is about to diverge
            slopes = self.fitting.jacobian(vector) * self.units
        jacobian = np.where(np.abs(slopes) < _LARGEST, slopes, 0.0)
        plain = sum_normal_equations([(self.fitting.residual(vector), jacobian)])
        return replace(
            plain,
            error=plain.error + float(self.penalty @ theta**2),
            gradient=plain.gradient + self.penalty * theta,
            gram=plain.gram + np.diag(self.penalty),
        )


def hybrid_error(fitting: Fitting, hybrid: HybridModel, at: Mapping[str, float]) -> HybridError:
    """Return the problem, without a penalty, with the units that belong to the slopes at parameter values.

    Hidden weights have the unit 1, because the inputs of a network are scaled.

    Raises
    ------
    ModelError
        If the simulation there diverges.
    """
    start = fitting.start(at)
    slopes = output_slopes(fitting, start)
    if slopes is None:
        raise ModelError(
            f"the simulation of {hybrid.white.name!r} diverges on these data: start from other parameter values"
        )
    unit = np.where(slopes > _INSENSITIVE, 1.0 / np.maximum(slopes, _INSENSITIVE), np.maximum(np.abs(start), 1.0))
    for placed in hybrid.networks:
        hidden = len(placed.term.parameters) - len(placed.term.output_weights)
        unit[_places(fitting, (parameter.name for parameter in placed.term.parameters[:hidden]))] = 1.0
    return HybridError(fitting, unit, np.zeros(unit.size))


def output_slopes(fitting: Fitting, vector: Array) -> Array | None:
    """Return the root mean square of each column of the Jacobian, shape (n_free,); None where the run diverges."""
    with np.errstate(all="ignore"):
        slopes = np.sqrt(np.mean(fitting.jacobian(vector) ** 2, axis=0))
        finite = np.isfinite(fitting.residual(vector)).all() and np.isfinite(slopes).all()
    return slopes if finite else None


def _places(fitting: Fitting, names: Iterable[str]) -> list[int]:
    """Return the places of parameters that are free."""
    return [fitting.run.parameters.index(name) for name in names if name in fitting.run.parameters]
