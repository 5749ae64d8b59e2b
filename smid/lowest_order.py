"""The smallest model that explains the data, each smaller one proven not to."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from smid.data import Dataset
from smid.estimate import Estimate
from smid.identify import EmptyFeasibleSetError, identify
from smid.models import Model


@dataclass(frozen=True)
class OrderStep:
    """The verdict on one candidate.

    Parameters
    ----------
    model : Model
    empty : bool
        Its feasible set is certified empty.
    feasible : bool
        A feasible point is verified. Where neither holds, the candidate is undecided.
    reason : str
        The proof of emptiness in words, or how the intervals came about.
    """

    model: Model
    empty: bool
    feasible: bool
    reason: str


@dataclass(frozen=True)
class LowestOrder:
    """The candidates tried, and the estimate of the first one that is not proven wrong.

    Parameters
    ----------
    steps : tuple of OrderStep
    estimate : Estimate or None
        None where every candidate is proven wrong.
    """

    steps: tuple[OrderStep, ...]
    estimate: Estimate | None

    def __str__(self) -> str:
        words = {(True, False): "proven empty", (False, True): "feasible", (False, False): "undecided"}
        return "\n".join(f"{s.model.name}: {words[s.empty, s.feasible]}. {s.reason}" for s in self.steps)


def lowest_order(
    candidates: Sequence[Model],
    data: Dataset,
    noise_bound: float | Mapping[str, float],
    *,
    progress: Callable[[str], None] | None = None,
    **settings: object,
) -> LowestOrder:
    """Go through models of growing order until one is not proven empty.

    Parameters
    ----------
    candidates : sequence of Model
        In the order to be tried.
    data : Dataset
    noise_bound : float or mapping channel -> float
    progress : callable, optional
    **settings
        Passed to :func:`smid.identify`.

    Returns
    -------
    LowestOrder

    Raises
    ------
    ModelError, DataError
        Where a candidate does not fit the data.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> y = [0.0, 1, 0.5, 1.25, 1.625, 0.8125, 0.40625, 1.203]
    >>> data = Dataset.from_arrays(input={"u": [1.0, 0, 1, 1, 0, 0, 1, 0]}, output={"y": y}, sampling_time=1.0)
    >>> found = lowest_order([OutputError(na=0), OutputError(na=1, stable=True)], data, 0.05)
    >>> [step.empty for step in found.steps]
    [True, False]
    """
    steps = []
    for model in candidates:
        if progress:
            progress(f"trying {model.name}")
        try:
            estimate = identify(model, data, noise_bound, progress=progress, **settings)  # type: ignore[arg-type]
        except EmptyFeasibleSetError as proof:
            steps.append(OrderStep(model, True, False, str(proof)))
            continue
        witnessed = estimate.enclosure is not None and len(estimate.enclosure.witnesses) > 0
        steps.append(OrderStep(model, False, witnessed, estimate.summary))
        return LowestOrder(tuple(steps), estimate)
    return LowestOrder(tuple(steps), None)
