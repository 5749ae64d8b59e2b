"""What a study was run for: by how much each factor that varies changes the widths of the intervals.

Two runs are compared if they differ in one factor only: that with its first value and that with its last. The answer is
the median ratio of the widths over all such pairs and parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from statistics import median

import numpy as np

from smid.study.cell import Cell
from smid.study.outcome import Outcome

_FACTORS: tuple[tuple[str, Callable[[Cell], Hashable], Callable[[Cell], str]], ...] = (
    ("samples", lambda cell: cell.samples, lambda cell: f"{cell.samples} samples"),
    ("noise_bound", lambda cell: cell.noise_bound, lambda cell: f"noise bound {cell.bound_text}"),
    ("method", lambda cell: cell.method, lambda cell: f"method {cell.method}"),
    ("order", lambda cell: cell.order, lambda cell: f"order {cell.order}"),
)
_SAME = 0.01  # a smaller change of a width is none


def answer(done: Iterable[tuple[Cell, Outcome]]) -> str:
    """Return in one sentence how the widths depend on what varies; the empty string if no two runs can be compared.

    Examples
    --------
    >>> answer([])
    ''
    """
    found = [(cell, outcome) for cell, outcome in done if outcome.intervals]
    parts = [part for factor in _FACTORS if (part := _change(found, *factor))]
    return f"Widths of the intervals, median: {'; '.join(parts)}." if parts else ""


def _numbers(pair: tuple[Cell, Outcome]) -> tuple[int, float, int]:
    cell, _ = pair
    return cell.samples, sum(bound for _, bound in cell.noise_bound), cell.order


def _change(
    found: list[tuple[Cell, Outcome]], name: str, value: Callable[[Cell], Hashable], text: Callable[[Cell], str]
) -> str:
    """Return what one factor changes, in words."""
    # Numbers from the least to the largest, methods as they were given.
    values = list(dict.fromkeys(value(cell) for cell, _ in sorted(found, key=_numbers)))
    if len(values) < 2:
        return ""
    groups: dict[Hashable, dict[Hashable, tuple[Cell, Outcome]]] = {}
    for cell, outcome in found:
        rest = tuple(part for other, part in vars(cell).items() if other != name)
        groups.setdefault(rest, {})[value(cell)] = (cell, outcome)
    ends = values[0], values[-1]
    pairs = [(group[ends[0]], group[ends[1]]) for group in groups.values() if ends[0] in group and ends[1] in group]
    ratios = [
        after.width / before.width
        for (_, first), (_, last) in pairs
        for before, after in zip(first.intervals, last.intervals, strict=True)
        if 0 < before.width < np.inf and 0 < after.width < np.inf
    ]
    if not ratios:
        return ""
    (one, _), (other, _) = pairs[0]
    ratio = median(ratios)
    if abs(ratio - 1) < _SAME:
        return f"the same with {text(other)} as with {text(one)}"
    change = f"{ratio:.3g} times wider" if ratio > 1 else f"{1 / ratio:.3g} times narrower"
    return f"{change} with {text(other)} than with {text(one)}"
