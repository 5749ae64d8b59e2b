"""The result of a study: the outcome of every cell, as a table, a figure, plain data or a pandas frame."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from smid.data import DataError, Dataset
from smid.data.reference import identity, referred
from smid.display.from_plain import Plain, read
from smid.display.result import Part, Tabular
from smid.display.table import Table, figure
from smid.identification.estimate import ParameterInterval, round_down, round_up, shown_digits
from smid.models import Model
from smid.study.answer import answer
from smid.study.cell import Cell, Settings
from smid.study.outcome import Outcome, Status

if TYPE_CHECKING:
    from matplotlib.figure import Figure


_FACTORS = (
    ("record", "l", lambda cell: cell.record),
    ("N", "r", lambda cell: str(cell.samples)),
    ("bound", "r", lambda cell: cell.bound_text),
    ("method", "l", lambda cell: cell.method),
    ("order", "r", lambda cell: str(cell.order)),
)


@dataclass(frozen=True, eq=False, repr=False)
class Study(Tabular):
    """The outcomes of a grid of cells.

    Parameters
    ----------
    cells
        All cells, records first, orders last.
    outcomes
        One for each cell; None if the study stopped before it.
    interrupted
        Whether Ctrl-C stopped the study.
    """

    SCHEMA: ClassVar = "smid.study/1"

    model: Model
    records: Mapping[str, Dataset]
    settings: Settings
    cells: tuple[Cell, ...]
    outcomes: tuple[Outcome | None, ...]
    interrupted: bool

    @property
    def done(self) -> tuple[tuple[Cell, Outcome], ...]:
        """Return the cells that have an outcome, with it."""
        pairs = zip(self.cells, self.outcomes, strict=True)
        return tuple((cell, outcome) for cell, outcome in pairs if outcome is not None)

    @property
    def answer(self) -> str:
        """Return in one sentence how the widths of the intervals depend on what varies; empty if nothing does."""
        return answer(self.done)

    @property
    def conclusion(self) -> str:
        """Return in one sentence how the cells ended."""
        counts = Counter(outcome.status for _, outcome in self.done)
        parts = [f"{counts[status]} {status.value}" for status in Status if counts[status]]
        missing = len(self.cells) - len(self.done)
        parts += [f"{missing} not run"] if missing else []
        if counts[Status.CERTIFIED] == len(self.cells) > 1:
            return f"All {len(self.cells)} runs have certified intervals."
        return f"{len(self.cells)} run{'s' if len(self.cells) > 1 else ''}: {', '.join(parts)}."

    @property
    def table(self) -> Table:
        """Return a row for each cell that is done; the caption holds the factors that do not vary."""
        varying, fixed = self._factors()
        names = [p.name for p in self.model.parameters]
        header = (*(name for name, _, _ in varying), *names, "gap", "time [s]", "memory [MB]", "ended")
        rows = tuple(
            (
                *(text(cell) for _, _, text in varying),
                *_interval_texts(outcome, len(names)),
                figure(outcome.gap),
                figure(outcome.seconds),
                f"{outcome.peak_memory:.0f}" if np.isfinite(outcome.peak_memory) else "-",
                outcome.status.value,
            )
            for cell, outcome in self.done
        )
        align = "".join(side for _, side, _ in varying) + "r" * (len(names) + 3) + "l"
        same = f"; {', '.join(f'{name} {value}' for name, value in fixed)}" if fixed else ""
        caption = f"{self.model.name}{same}. Bounds are rounded outwards; the gap is a share of the width."
        return Table(caption, header, rows, align)

    @property
    def messages(self) -> tuple[str, ...]:
        """Return why cells have no intervals: each message once, with its cells."""
        about: dict[str, list[str]] = {}
        for cell, outcome in self.done:
            if outcome.status is not Status.CERTIFIED:
                about.setdefault(outcome.message, []).append(str(cell))
        return tuple(
            f"{cells[0]}{f' and {len(cells) - 1} more' if len(cells) > 1 else ''}: {message}"
            for message, cells in about.items()
        )

    def _factors(self) -> tuple[list[Any], list[tuple[str, str]]]:
        """Return the factors that vary, and the others with their value."""
        seen = {name: {text(cell) for cell in self.cells} for name, _, text in _FACTORS}
        varying = [factor for factor in _FACTORS if len(seen[factor[0]]) > 1]
        return varying, [(name, next(iter(seen[name]))) for name, _, _ in _FACTORS if len(seen[name]) == 1]

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield from self.messages
        yield f"{self.answer} {self.conclusion}".lstrip()

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: the fields of ``smid.study/1`` in docs/json.md."""
        return {
            "model": self.model.to_dict(),
            "records": {name: identity(record) for name, record in self.records.items()},
            "settings": dict(vars(self.settings)),
            "cells": [{**cell.to_dict(), **outcome.to_dict()} for cell, outcome in self.done],
            "missing": len(self.cells) - len(self.done),
            "missing_cells": [
                cell.to_dict() for cell, one in zip(self.cells, self.outcomes, strict=True) if one is None
            ],
            "interrupted": self.interrupted,
        }

    @staticmethod
    def from_dict(content: Mapping[str, Any], data: Dataset | Mapping[str, Dataset] | None = None) -> Study:
        """Return the study that `to_dict` described; runs that were not done come last."""
        told = read(content, "records", Mapping[str, Plain])
        given = data if isinstance(data, Mapping) else dict.fromkeys(told, data)
        done, left = read(content, "cells", tuple[Plain, ...]), read(content, "missing_cells", tuple[Cell, ...])
        return Study(
            read(content, "model", Model),
            {name: referred(one, given.get(name)) for name, one in told.items()},
            read(content, "settings", Settings),
            (*map(Cell.from_dict, done), *left),
            (*map(Outcome.from_dict, done), *(None for _ in left)),
            read(content, "interrupted", bool),
        )

    def _rows(self) -> Iterator[dict[str, Any]]:
        """Return a row for each cell and parameter; a cell without intervals has one row."""
        for cell, outcome in self.done:
            about = {
                "record": cell.record,
                "samples": cell.samples,
                **{f"bound of {channel}": bound for channel, bound in cell.noise_bound},
                "method": cell.method,
                "order": cell.order,
                "status": outcome.status.value,
                "seconds": outcome.seconds,
                "peak_memory": outcome.peak_memory,
                "solves": outcome.solves,
            }
            for interval in outcome.intervals:
                yield {**about, "parameter": interval.name, **_ends(interval)}
            if not outcome.intervals:
                yield about

    def plot(self, record: str | None = None) -> Figure:
        """Draw bounds against order, width against noise bound and samples, and time against samples, if they vary.

        Raises
        ------
        DataError
            For a record that is not in the study; the default is the first record.
        """
        if record is not None and record not in self.records:
            raise DataError(f"no record {record!r} in this study: there are {', '.join(self.records)}")
        from smid.study.figures import study_figure

        return study_figure(self, record or next(iter(self.records)))


def _ends(interval: ParameterInterval) -> dict[str, Any]:
    names = ("unit", "lower", "upper", "inner_lower", "inner_upper", "width", "gap")
    return {name: getattr(interval, name) for name in names}


def _interval_texts(outcome: Outcome, count: int) -> tuple[str, ...]:
    return tuple(_interval_text(i) for i in outcome.intervals) or ("-",) * count


def _interval_text(interval: ParameterInterval) -> str:
    digits = shown_digits(interval)
    return f"[{round_down(interval.lower, digits)}, {round_up(interval.upper, digits)}]"
