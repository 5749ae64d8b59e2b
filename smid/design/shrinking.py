"""Input with the narrowest certified intervals: the set-membership counterpart of D-optimal design.

The cost is ``sum_j log min(width_j / |p_j|, 1)``. The limit 1 keeps parameters that no input identifies from dominating
the cost. The intervals come from a simulated record with seeded noise.

One evaluation needs a whole certification, so the search uses few: given and random inputs first, then normal steps
around the best input. The step becomes shorter after each failure.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from smid.design.family import InputFamily
from smid.display.result import Part, Result, plain
from smid.models import ModelError

__all__ = ["Shrinking", "shrinking_input"]


FIRST_STEP, SHORTER = 0.15, 0.8  # step as a share of the box, and its factor after a failed step
LEAST_WIDTH = 1e-12


@dataclass(frozen=True, eq=False, repr=False)
class Shrinking(Result):
    """Input and the widths of its certified intervals.

    Parameters
    ----------
    choice
        Shape (count,). Numbers that define the input.
    input
        Shape (n,).
    widths
        Relative widths of the certified intervals.
    costs
        Shape (evaluations,). Costs of all evaluated inputs, in order.
    """

    family: InputFamily
    choice: Array
    input: Array
    widths: Mapping[str, float]
    costs: Array

    def _content(self) -> Iterator[Part]:
        yield self.family.told(self.choice)
        yield "relative widths: " + ", ".join(f"{name} {100 * w:.3g}%" for name, w in self.widths.items())
        yield f"after {len(self.costs)} evaluated inputs"

    def to_dict(self) -> dict[str, Any]:
        """Return the choice, the input and the interval widths as plain data."""
        return {
            "family": self.family.name,
            "choice": dict(zip(self.family.names, self.choice.tolist(), strict=True)),
            "input": self.input.tolist(),
            "widths": plain(self.widths),
            "costs": plain(self.costs),
        }


def shrinking_input(
    family: InputFamily,
    widths: Callable[[Array], Mapping[str, float]],
    *,
    budget: int = 24,
    starts: Sequence[ArrayLike] = (),
    seed: int = 0,
) -> Shrinking:
    """Return the input of a family with the narrowest certified intervals.

    Parameters
    ----------
    widths
        Function from an input, shape (n,), to the relative width of each parameter's interval.
    budget
        Number of evaluated inputs.
    starts
        Shape (count,) each. Choices to evaluate first, for example the D-optimal one.

    Raises
    ------
    ModelError
        If the budget is not above the number of starts.

    Examples
    --------
    >>> family = InputFamily("level", lambda c: np.full(5, c[0]), ("level",), (0,), (1,), 1.0)
    >>> found = shrinking_input(family, lambda u: {"gain": 0.1 + (u[0] - 0.3) ** 2}, budget=30)
    >>> bool(abs(found.choice[0] - 0.3) < 0.1)
    True
    """
    if budget <= len(starts):
        raise ModelError(f"a budget of {budget} is not above the {len(starts)} starts: raise the budget")
    # First the given choices, then random ones.
    random = np.random.default_rng(seed)
    waiting = [np.clip(np.asarray(s, dtype=np.float64), family.lower, family.upper) for s in starts]
    waiting += [family.draw(random) for _ in range(max(1, (budget - len(starts)) // 3))]
    best: tuple[float, Array, Mapping[str, float]] | None = None
    costs = []
    # Then steps around the best choice.
    step = FIRST_STEP
    for k in range(budget):
        drawn = k < len(waiting)
        choice = waiting[k] if drawn or best is None else family.near(best[1], step, random)
        found = widths(family.signal(choice))
        cost = sum(float(np.log(np.clip(w, LEAST_WIDTH, 1.0))) for w in found.values())
        costs.append(cost)
        if best is None or cost < best[0]:
            best = (cost, choice, found)
        elif not drawn:
            step *= SHORTER
    assert best is not None
    return Shrinking(family, best[1], family.signal(best[1]), best[2], np.array(costs))
