"""The D-optimal member of a family of inputs: the one with the largest determinant of Fisher's information.

Its logarithm has many local maxima over a family (frequencies and amplitudes beat against each other), so the search is
global: SciPy's differential evolution, with a stated budget and a seed.
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


SINGULAR_COST = 1e3  # stands for a determinant of zero
PEOPLE = 5  # members of the population per number to choose


@dataclass(frozen=True, repr=False)
class Design(Result):
    """An input, and the information that it carries.

    Parameters
    ----------
    choice
        Shape (count,).
    input
        Shape (n,).
    evaluations
        Inputs looked at.
    """

    family: InputFamily
    choice: Array
    input: Array
    information: FisherInformation
    evaluations: int

    def _content(self) -> Iterator[Part]:
        yield self.family.told(self.choice)
        yield f"log det {self.information.log_determinant:.2f} after {self.evaluations} inputs"
        yield self.information

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: what was chosen, the input, and what it tells."""
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
    """Choose the member of a family with the largest determinant of its information.

    Parameters
    ----------
    information
        Gives the information of an input, shape (n,).
    budget
        About how many inputs to look at.

    Raises
    ------
    ModelError
        Where the budget is below one generation, or no member tells all parameters apart.

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
        raise ModelError(f"a budget of {budget} is less than two generations of {generation}: give more")

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
            f"no input of the family {family.name!r} tells all parameters apart: choose a richer family, or fix "
            "parameters"
        )
    u = family.signal(found.x)
    return Design(family, np.asarray(found.x), u, information(u), int(found.nfev))
