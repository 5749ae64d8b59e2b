"""The remaining time of a study."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence

import numpy as np

from smid.study.cell import Cell
from smid.study.outcome import Outcome


def time_left(left: Sequence[Cell], done: Mapping[Cell, Outcome], elapsed: float) -> float:
    """Return an estimate of the seconds left; NaN while nothing is known.

    ``done`` are the cells of this run, and ``elapsed`` the seconds since the first of them began.
    """
    seconds = {cell: outcome.seconds for cell, outcome in done.items() if np.isfinite(outcome.seconds)}
    if not seconds or not left:
        return float("nan")
    # Times of methods and orders differ by orders of magnitude. A kind that was not run yet counts with the mean.
    kinds: dict[tuple[str, int], list[float]] = defaultdict(list)
    for cell, value in seconds.items():
        kinds[cell.method, cell.order].append(value)
    usual = float(np.mean(list(seconds.values())))
    work = sum(float(np.mean(kinds.get((cell.method, cell.order), [usual]))) for cell in left)
    at_once = max(sum(seconds.values()) / max(elapsed, 1e-9), 1e-9)
    return work / at_once
