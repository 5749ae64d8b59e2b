"""The smallest model that explains the data; each smaller one is proven not to."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from smid.data.given import Given, as_dataset
from smid.display.progress import Shows, spoken, with_bar
from smid.display.result import Part, Tabular
from smid.display.table import Table
from smid.feasible.feasible_set import check_noise_bound
from smid.fitting.binding import bind
from smid.identification.estimate import Estimate, round_down
from smid.identification.identify import EmptyFeasibleSetError, identify
from smid.models import Model, ModelError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class OrderStep:
    """The verdict on one candidate: proven empty, feasible (a point is verified), or undecided.

    ``reason`` is the proof of emptiness in words, or how the intervals were computed. ``least_bound`` is the certified
    lower end of the least noise bound that the candidate needs; None where it was not computed.
    """

    model: Model
    empty: bool
    feasible: bool
    reason: str
    least_bound: float | None

    @property
    def size(self) -> str:
        """Return how many parameters the candidate has, in words."""
        count = len(self.model.parameters)
        return f"{count} parameter{'s' if count > 1 else ''}"

    @property
    def verdict(self) -> str:
        """Return the verdict in two words."""
        return "proven empty" if self.empty else "feasible" if self.feasible else "undecided"


@dataclass(frozen=True, repr=False)
class LowestOrder(Tabular):
    """The candidates tried, and the estimate of the first one that is not proven infeasible (None where all are).

    ``noise_bound`` is the bound that was allowed for the noise of the output ``channel``.
    """

    steps: tuple[OrderStep, ...]
    estimate: Estimate | None
    channel: str
    unit: str
    noise_bound: float

    @property
    def table(self) -> Table:
        """Return a row for each candidate; least bounds are rounded down, because they are proven."""
        needs = ("" if s.least_bound is None else f">= {round_down(s.least_bound, 4)}" for s in self.steps)
        rows = tuple(
            (s.model.name, str(len(s.model.parameters)), s.verdict, need)
            for s, need in zip(self.steps, needs, strict=True)
        )
        unit = f" [{self.unit}]" if self.unit else ""
        caption = f"Candidates for noise of {self.channel} of at most {self.noise_bound:g} {self.unit}".rstrip()
        return Table(caption, ("model", "parameters", "feasible set", f"least noise bound{unit}"), rows, "lrlr")

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield from (f"{s.model.name}, {s.size}: {s.reason}" for s in self.steps)

    def _rows(self) -> Iterator[dict[str, Any]]:
        for s in self.steps:
            yield {
                "model": s.model.name,
                "parameters": len(s.model.parameters),
                "verdict": s.verdict,
                "least_bound": s.least_bound,
                "reason": s.reason,
            }

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: the verdicts, and the estimate."""
        return {
            "channel": self.channel,
            "noise_bound": self.noise_bound,
            "steps": list(self._rows()),
            "estimate": None if self.estimate is None else self.estimate.to_dict(),
        }

    def plot(self) -> Figure:
        """Return a figure of the least noise bound of each candidate, with the bound that was allowed."""
        from smid.identification.figures import lowest_order_figure

        return lowest_order_figure(self)


@with_bar
def lowest_order(
    candidates: Sequence[Model],
    data: Given,
    noise_bound: float | Mapping[str, float],
    *,
    progress: Shows = None,
    **settings: object,
) -> LowestOrder:
    """Return the first of some models that is not proven infeasible, with the verdicts on those before it.

    Parameters
    ----------
    candidates
        In the order to be tried, with the same channels.
    data
        As for :func:`smid.identify`.
    **settings
        Passed to :func:`smid.identify`.

    Raises
    ------
    ModelError, DataError
        Where a candidate does not fit the data, or there is none.

    Examples
    --------
    >>> from smid import Dataset
    >>> from smid.models import OutputError
    >>> y = [0.0, 1, 0.5, 1.25, 1.625, 0.8125, 0.40625, 1.203]
    >>> data = Dataset.from_arrays(input={"u": [1.0, 0, 1, 1, 0, 0, 1, 0]}, output={"y": y}, sampling_time=1.0)
    >>> found = lowest_order([OutputError(na=0), OutputError(na=1, stable=True)], data, 0.05)
    >>> [step.empty for step in found.steps]
    [True, False]
    """
    if not candidates:
        raise ModelError("there is no model to try: give at least one")
    say = spoken(progress)
    data = as_dataset(data, candidates[0])
    steps, found = [], None
    for model in candidates:
        if say:
            say(f"trying {model.name}")
        try:
            found = identify(model, data, noise_bound, progress=say, **settings)  # type: ignore[arg-type]
        except EmptyFeasibleSetError as proof:
            steps.append(OrderStep(model, True, False, str(proof), proof.least_bound))
            continue
        witnessed = found.enclosure is not None and len(found.enclosure.witnesses) > 0
        steps.append(OrderStep(model, False, witnessed, found.summary, None))
        break
    last = bind(model, data)
    bounds = check_noise_bound(last, noise_bound, None)
    channel = next(c for c in last.output_channels if c in bounds)
    return LowestOrder(tuple(steps), found, channel, data.channel(channel).unit, bounds[channel])
