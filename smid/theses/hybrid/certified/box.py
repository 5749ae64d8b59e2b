"""The box of the arm's constants, and of the products in which its law is linear.

With theta = 1/J the law (5.7)-(5.8) is ``v' = theta c u - omega - kappa v |v|`` where the arm glides and
``v' = theta c u - sigma v / eps - kappa v |v|`` where it sticks, with

    kappa = theta b,   omega = theta Wd,   sigma = theta Ws.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.intervals import Intervals
from smid.models import ModelError
from smid.models.errors import refuse_unknown

__all__ = ["CONSTANTS", "PRIOR", "ArmBox"]

CONSTANTS = ("theta", "b", "Wd", "Ws")

DECADE = 10.0  # an interval from zero is cut at this fraction of its upper end

PRIOR: Mapping[str, tuple[float, float]] = MappingProxyType(
    {"theta": (1.0, 1000.0), "b": (0.0, 1.0), "Wd": (0.0, 10.0), "Ws": (0.0, 10.0)}
)
"""Default intervals of the search, in 1/(kg m2), Nm s2/rad2, Nm and Nm.

The upper ends are 46 (theta), 370 (b), 23 (Wd) and 8 (Ws) times the constants of the thesis's arm.
"""


@dataclass(frozen=True)
class ArmBox:
    """Intervals of the four constants, and of their products with theta.

    Parameters
    ----------
    constants
        Shape (4,). theta, b, Wd, Ws; none is negative, theta is positive.
    products
        Shape (4,). theta, kappa, omega, sigma.
    """

    constants: Intervals
    products: Intervals = field(repr=False)

    @staticmethod
    def of(prior: Mapping[str, tuple[float, float]]) -> ArmBox:
        """Return the box of a prior, completed by `PRIOR`; ModelError if it is not valid."""
        refuse_unknown("constant of the arm", prior, CONSTANTS)
        pairs = np.array([prior.get(name, PRIOR[name]) for name in CONSTANTS], dtype=np.float64)
        for name, (low, high) in zip(CONSTANTS, pairs, strict=True):
            if not (np.isfinite(high) and low <= high and (low > 0 if name == "theta" else low >= 0)):
                raise ModelError(
                    f"the prior of {name} is {low:g} to {high:g}: give finite ends in rising order, none negative "
                    "(theta positive)"
                )
        constants = Intervals(pairs[:, 0], pairs[:, 1])
        return ArmBox(constants, _products(constants))

    def with_products(self, products: Intervals) -> ArmBox:
        """Return the box intersected with intervals of its products."""
        both = self.products.meet(products)
        theta = both[:1]
        quotients = Intervals(
            np.nextafter(both.lower[1:] / theta.upper, -np.inf), np.nextafter(both.upper[1:] / theta.lower, np.inf)
        )
        found = Intervals(
            np.concatenate([theta.lower, quotients.lower]), np.concatenate([theta.upper, quotients.upper])
        )
        return ArmBox(self.constants.meet(found), both)

    def with_constants(self, constants: Intervals) -> ArmBox:
        """Return the box intersected with intervals of its constants."""
        both = self.constants.meet(constants)
        return ArmBox(both, self.products.meet(_products(both)))

    def coarseness(self) -> Array:
        """Return the ratio of the ends of each constant, at most `DECADE` if the lower one is zero."""
        low, high = self.constants.lower, self.constants.upper
        return np.asarray(high / np.maximum(np.maximum(low, high / DECADE), 1e-300))

    def halves(self, j: int) -> tuple[ArmBox, ArmBox]:
        """Return the box cut at the geometric mean of one constant, or a `DECADE` below its upper end."""
        low, high = float(self.constants.lower[j]), float(self.constants.upper[j])
        middle = float(np.sqrt(low * high)) if low > high / DECADE**2 else high / DECADE
        lower, upper = self.constants.lower.copy(), self.constants.upper.copy()
        lower[j] = upper[j] = middle
        return (
            self.with_constants(Intervals(self.constants.lower, upper)),
            self.with_constants(Intervals(lower, self.constants.upper)),
        )


def _products(constants: Intervals) -> Intervals:
    theta = constants[:1]
    rest = constants[1:] * theta
    return Intervals(
        np.concatenate([theta.lower, np.maximum(rest.lower, 0.0)]), np.concatenate([theta.upper, rest.upper])
    )
