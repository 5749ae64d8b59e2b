"""Parameter intervals over the relaxation order.

A higher order is useful until every certified end meets its witness. Then no order gives other intervals, and the
estimate of the next order is the same.

Reference: clutch thesis, section 3.2.3; (2.15)-(2.17) and (3.18).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from relaxations.deadline import Progress
from relaxations.search.enclosure import Reason
from smid.data import Dataset
from smid.display.result import Part, Tabular
from smid.display.table import Table
from smid.identification.estimate import Estimate, round_down, round_up, shown_digits
from smid.identification.identify import identify
from smid.models import Model, ModelError
from smid.study.finished import finished

__all__ = ["OrderStudy", "order_study"]


@dataclass(frozen=True, eq=False, repr=False)
class OrderStudy(Tabular):
    """Intervals at several relaxation orders.

    Parameters
    ----------
    orders
        Rising.
    estimates
        One per order; the same one again if the order below left no gap.
    """

    orders: tuple[int, ...]
    estimates: tuple[Estimate, ...]

    @property
    def table(self) -> Table:
        """Return a row per order and parameter."""
        rows = []
        for order, estimate in zip(self.orders, self.estimates, strict=True):
            for i in estimate.intervals:
                digits = shown_digits(i)
                ends = (round_down(i.lower, digits), round_up(i.upper, digits))
                rows.append((str(order), i.name, *ends, f"{i.centre:.{digits}g}", f"{i.gap / i.width:.0e}"))
        header = ("order", "parameter", "lower", "upper", "centre", "gap / width")
        first = self.estimates[0]
        bounds = ", ".join(f"{b:.4g} {first.data.channel(c).unit}" for c, b in first.noise_bound.items())
        caption = (
            f"Certified intervals on {first.data.n_samples} samples, noise of at most {bounds}. The gap is "
            "between an end and its witness."
        )
        return Table(caption, header, tuple(rows), "rlrrrr")

    @property
    def conclusion(self) -> str:
        """Return in a sentence which order suffices."""
        for order, estimate in zip(self.orders, self.estimates, strict=True):
            if estimate.reason is Reason.TIGHT:
                return f"Order {order} suffices: every certified end meets a verified point within the tolerance."
        return f"Order {self.orders[-1]} leaves gaps: a higher order, or branching, may narrow the intervals."

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield self.conclusion

    def _rows(self) -> Iterator[dict[str, Any]]:
        for order, estimate in zip(self.orders, self.estimates, strict=True):
            yield from ({"order": order, **i.row} for i in estimate.intervals)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        pairs = zip(self.orders, self.estimates, strict=True)
        return {
            "estimates": [{"order": order, "estimate": estimate.to_dict()} for order, estimate in pairs],
            "conclusion": self.conclusion,
        }


def order_study(
    model: Model,
    data: Dataset,
    noise_bound: float,
    orders: Sequence[int] = (1, 2, 3),
    *,
    progress: Progress | None = None,
) -> OrderStudy:
    """Identify at several relaxation orders; ModelError unless these are positive whole numbers."""
    for order in orders:
        if isinstance(order, bool) or not isinstance(order, int) or order < 1:
            raise ModelError(f"order = {order!r} is no relaxation order: give whole numbers of at least 1")
    if not orders:
        raise ModelError("there is no relaxation order to try: give at least one, such as 2")
    estimates: list[Estimate] = []
    rising = tuple(sorted(set(orders)))
    for order in rising:
        if estimates and estimates[-1].reason is Reason.TIGHT:
            estimates.append(estimates[-1])
        else:
            estimates.append(finished(identify(model, data, noise_bound, order=order, progress=progress)))
    return OrderStudy(rising, tuple(estimates))
