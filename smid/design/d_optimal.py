"""D-optimal input of a family: the input with the largest determinant of the Fisher information.

The log determinant has many local maxima over a family of inputs. The search is therefore global: SciPy's
differential evolution, with a budget of evaluations and a seed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from relaxations.algebra.arrays import Array
from smid.design.family import InputFamily
from smid.design.fisher import FisherInformation
from smid.display.result import Part, Result, plain
from smid.models import ModelError

__all__ = ["Design", "d_optimal"]


SINGULAR_COST = 1e3  # cost of a singular matrix
PEOPLE = 5  # population size per number of the choice


@dataclass(frozen=True, eq=False, repr=False)
class Design(Result):
    """D-optimal input and its information.

    Parameters
    ----------
    choice
        Shape (count,). Numbers that define the input.
    input
        Shape (n,).
    evaluations
        Number of evaluated inputs.
    """

    family: InputFamily
    choice: Array
    input: Array
    information: FisherInformation
    evaluations: int

    def _content(self) -> Iterator[Part]:
        yield self.family.told(self.choice)
        yield f"log determinant {self.information.log_determinant:.2f} after {self.evaluations} evaluated inputs"
        yield self.information

    def to_dict(self) -> dict[str, Any]:
        """Return the choice, the input and its information as plain data."""
        return {
            "family": self.family.name,
            "choice": dict(zip(self.family.names, self.choice.tolist(), strict=True)),
            "input": self.input.tolist(),
            "log_determinant": plain(self.information.log_determinant),
            "information": self.information.to_dict(),
            "evaluations": self.evaluations,
        }


def d_optimal(
    family: InputFamily, information: Callable[[Array], FisherInformation], *, budget: int = 600, seed: int = 0
) -> Design:
    """Return the input of a family with the largest determinant of the information.

    Parameters
    ----------
    information
        Function from an input, shape (n,), to its information.
    budget
        Approximate number of evaluated inputs.

    Raises
    ------
    ModelError
        If the budget is below two generations, or no input makes all parameters identifiable.

    Examples
    --------
    >>> from smid.design import fisher_information
    >>> step = InputFamily("step", lambda c: np.where(np.arange(40) < 40 * c[0], 1.0, 0.0), ("share",), (0,), (1,), 1.0)
    >>> def line(u):
    ...     return fisher_information(np.stack([u, np.ones(40)], 1), ("gain", "offset"), (1.0, 1.0), 1.0)
    >>> bool(0.45 < d_optimal(step, line, budget=60).choice[0] < 0.55)
    True
    """
    generation = PEOPLE * len(family.names)
    if budget < 2 * generation:
        raise ModelError(f"a budget of {budget} is less than two generations of {generation}: raise the budget")

    # Minimise the negative log determinant.
    def cost(choice: Array) -> float:
        value = information(family.signal(choice)).log_determinant
        return -value if np.isfinite(value) else SINGULAR_COST

    found = differential_evolution(
        cost,
        Bounds(family.lower, family.upper),
        popsize=PEOPLE,
        maxiter=max(1, budget // generation - 1),
        tol=0.0,
        polish=False,
        rng=seed,
    )
    if found.fun >= SINGULAR_COST:
        raise ModelError(
            f"no input of the family {family.name!r} makes all parameters identifiable: use a richer family, or fix "
            "parameters"
        )
    u = family.signal(found.x)
    return Design(family, np.asarray(found.x), u, information(u), int(found.nfev))
