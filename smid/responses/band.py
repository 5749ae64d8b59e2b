"""Certified bands of a response: between them lies the response of every parameter vector that fits the data."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.display.from_plain import Plain, read
from smid.display.result import Part, Tabular, plain
from smid.display.table import Table
from smid.identification.estimate import Estimate, round_down, round_up

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROWS = 20  # of a printed table
_DIGITS = 5


@dataclass(frozen=True, eq=False)
class Band:
    """The range of one quantity at several times or frequencies; every array has one entry for each.

    Parameters
    ----------
    lower, upper
        Certified: for every parameter vector that fits the data, the quantity lies between them. Infinite where no
        bound could be proven.
    inner_lower, inner_upper
        Values at verified points of the feasible set: no valid band is narrower. NaN where none was found.
    centre
        Of the central model.

    Examples
    --------
    >>> one = np.ones(2)
    >>> Band("gain", "bar/V", 0.5 * one, 2 * one, 0.6 * one, 1.9 * one, one).looseness < 0.07
    True
    """

    quantity: str
    unit: str
    lower: Array
    upper: Array
    inner_lower: Array
    inner_upper: Array
    centre: Array

    @property
    def label(self) -> str:
        """Return the quantity with its unit."""
        return f"{self.quantity} [{self.unit}]" if self.unit else self.quantity

    @property
    def looseness(self) -> float:
        """Return the largest gap between certified and verified ends, by the largest width; NaN if unknown."""
        width = self.upper - self.lower
        gap = np.maximum(self.inner_lower - self.lower, self.upper - self.inner_upper)
        known = np.isfinite(width) & np.isfinite(gap)
        largest = float(np.max(width[known], initial=0.0))
        return float(np.max(gap[known])) / largest if largest > 0 else float("nan")


@dataclass(frozen=True, eq=False, repr=False)
class ResponseBand(Tabular):
    """A response with certified bands, of :func:`smid.step` or :func:`smid.bode`.

    Parameters
    ----------
    kind
        "step" or "bode".
    estimate
        The certified intervals that the bands follow from.
    input, output
        Between them lies the linear block: channels of the data; signals of the model where a curve lies in between.
    at
        Times in seconds, or frequencies in rad/s.
    bands
        The response; or gain, and phase up to whole turns.
    stable
        Whether every parameter vector that fits the data is proven to give a stable model.
    complete
        False where the time limit, or the user, ended the work: the bands are certified, and wider.
    solves
        Certified bounds of the feasible set that were computed for the bands.
    seconds
        Wall clock.
    """

    SCHEMA: ClassVar = "smid.response-band/1"

    kind: Literal["step", "bode"]
    estimate: Estimate
    input: str
    output: str
    at: Array
    bands: tuple[Band, ...]
    stable: bool
    complete: bool
    solves: int
    seconds: float

    def __getitem__(self, quantity: str) -> Band:
        for band in self.bands:
            if band.quantity == quantity:
                return band
        raise KeyError(f"no band of {quantity!r}: there is {', '.join(band.quantity for band in self.bands)}")

    @property
    def axis(self) -> str:
        """Return what `at` holds."""
        return {"step": "time", "bode": "frequency"}[self.kind]

    @property
    def axis_unit(self) -> str:
        """Return the unit of `at`."""
        return {"step": "s", "bode": "rad/s"}[self.kind]

    @property
    def title(self) -> str:
        """Return what the bands are of."""
        kind = {"step": "Step response", "bode": "Frequency response"}[self.kind]
        return f"{kind} of {self.output} to {self.input}"

    @property
    def summary(self) -> tuple[str, ...]:
        """Return in sentences what is proven, how tight it is, and what is not."""
        told = [
            "Certified: for every parameter vector that fits the data within the noise bound, the response lies "
            "between lower and upper.",
            *(
                f"Largest gap between certified and verified {b.quantity}: {b.looseness:.1%} of the largest width."
                for b in self.bands
                if b.looseness >= 0
            ),
            f"{self.solves} certified solves in {self.seconds:.3g} s.",
        ]
        for b in self.bands:
            loose = int((~np.isfinite(b.upper - b.lower)).sum())
            if loose:
                told.append(
                    f"No bound of the {b.quantity} is proven at {loose} of {len(self.at)} points: the set may hold a "
                    "pole, or a zero, on the unit circle there."
                )
        if not self.complete:
            told.append("The work was stopped early: more time makes the bands narrower.")
        if not self.stable:
            told.append(
                "Not every parameter vector that fits is proven to be stable."
                + (" Where it is not, gain and phase are those of B/A on the unit circle." * (self.kind == "bode"))
            )
        return tuple(told)

    @property
    def table(self) -> Table:
        """Return some rows; printed ends are rounded outwards."""
        count = len(self.at)
        kept = np.unique(np.linspace(0, count - 1, min(count, ROWS)).round().astype(int))
        header = [f"{self.axis} [{self.axis_unit}]"]
        for b in self.bands:
            header += [f"{b.label} lower", "upper", "centre"]
        rows = []
        for k in kept:
            row = [f"{self.at[k]:.5g}"]
            for b in self.bands:
                row += [round_down(b.lower[k], _DIGITS), round_up(b.upper[k], _DIGITS), f"{b.centre[k]:.{_DIGITS}g}"]
            rows.append(tuple(row))
        shown = "" if len(kept) == count else f", {len(kept)} of {count} points"
        return Table(f"{self.title}{shown}", tuple(header), tuple(rows), "r" * len(header))

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield from self.summary

    def _rows(self) -> Iterator[dict[str, Any]]:
        names = ("lower", "upper", "inner_lower", "inner_upper", "centre")
        for k, at in enumerate(self.at.tolist()):
            values = {f"{b.quantity}_{name}": float(getattr(b, name)[k]) for b in self.bands for name in names}
            yield {self.axis: at, **values}

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: a ``smid.response-band/1`` of docs/json.md, with None for infinite and missing numbers."""
        return {
            "schema": self.SCHEMA,
            "kind": self.kind,
            "input": self.input,
            "output": self.output,
            "axis": self.axis,
            "axis_unit": self.axis_unit,
            "at": plain(self.at),
            "bands": [plain(band) for band in self.bands],
            "stable": self.stable,
            "complete": self.complete,
            "solves": self.solves,
            "seconds": self.seconds,
            "estimate": self.estimate.to_dict(),
        }

    @staticmethod
    def from_dict(content: Mapping[str, Any], data: Dataset | None = None) -> ResponseBand:
        """Return the response that `to_dict` described."""
        return ResponseBand(
            read(content, "kind", Literal["step", "bode"]),
            Estimate.from_dict(read(content, "estimate", Plain), data),
            read(content, "input", str),
            read(content, "output", str),
            np.array(read(content, "at", tuple[float, ...])),
            tuple(_band(told) for told in read(content, "bands", tuple[Plain, ...])),
            read(content, "stable", bool),
            read(content, "complete", bool),
            read(content, "solves", int),
            read(content, "seconds", float),
        )

    def plot(self) -> Figure:
        """Return a figure of the certified bands, the verified ones and the central model's response."""
        from smid.responses.figures import band_figure

        return band_figure(self)


def _band(told: Plain) -> Band:
    """Return a band from plain data, in which an infinite or missing number is None."""
    names = ("lower", "upper", "inner_lower", "inner_upper", "centre")
    arrays = {name: np.array(read(told, name, tuple[float, ...])) for name in names}
    arrays["lower"] = np.nan_to_num(arrays["lower"], nan=-np.inf)
    arrays["upper"] = np.nan_to_num(arrays["upper"], nan=np.inf)
    return Band(read(told, "quantity", str), read(told, "unit", str), **arrays)
