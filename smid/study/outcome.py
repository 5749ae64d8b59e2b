"""The outcome of a cell: intervals, a proof that there are none, or the reason why there is neither."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from smid.display.from_plain import fields_from_plain, read
from smid.display.result import plain
from smid.identification.estimate import ParameterInterval


class Status(Enum):
    """How a cell ended.

    Examples
    --------
    >>> Outcome(Status.EMPTY, "no parameters explain the data").to_dict()["status"]
    'empty'
    """

    CERTIFIED = "certified"
    EMPTY = "proven empty"
    REFUSED = "does not apply"
    FAILED = "failed"


@dataclass(frozen=True)
class Outcome:
    """The result of a cell.

    Parameters
    ----------
    status
        ``CERTIFIED``: the intervals are proven. ``EMPTY``: proven that no parameters explain the data. ``REFUSED``:
        method, order or data do not fit together; nothing was solved. ``FAILED``: an error, or the worker died each
        time.
    message
        Why the computation stopped, or the error.
    intervals
        Empty unless the cell is certified.
    method
        The method that "auto" chose.
    complicating
        Variables that the lift lifted.
    solves
        Number of certified solves.
    moments, largest_block
        Size of the last relaxation.
    seconds
        Wall-clock time.
    peak_memory
        Largest resident memory of the process while it ran the cell, in MB; NaN if unknown.

    Examples
    --------
    >>> from relaxations.search.enclosure import Proof
    >>> from smid.identification.estimate import ParameterInterval
    >>> found = ParameterInterval("gain", "bar/mA", 1.0, 3.0, 1.5, 2.9, Proof.PROVEN, Proof.PROVEN)
    >>> Outcome(Status.CERTIFIED, "every end meets a verified point", (found,)).gap  # 0.5 of a width of 2
    0.25
    """

    status: Status
    message: str
    intervals: tuple[ParameterInterval, ...] = ()
    method: str = ""
    complicating: tuple[str, ...] = ()
    solves: int = 0
    moments: int = 0
    largest_block: int = 0
    seconds: float = float("nan")
    peak_memory: float = float("nan")

    @property
    def gap(self) -> float:
        """Return the largest gap as a share of its interval's width; NaN if a bound has no witness."""
        shares = [i.gap / i.width if i.width > 0 else 0.0 for i in self.intervals]
        return float(np.max(shares)) if shares else float("nan")

    def to_dict(self) -> dict[str, Any]:
        """Return plain data; missing numbers become None."""
        names = {"intervals": "parameters", "method": "relaxation"}
        return {names.get(name, name): value for name, value in plain(vars(self)).items()}

    @staticmethod
    def from_dict(content: Mapping[str, Any]) -> Outcome:
        """Return the outcome that :meth:`to_dict` wrote."""
        intervals = read(content, "parameters", tuple[ParameterInterval, ...])
        found: Outcome = fields_from_plain(
            Outcome, content, intervals=intervals, method=read(content, "relaxation", str)
        )
        return found
