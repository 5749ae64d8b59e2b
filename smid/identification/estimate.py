"""The result of identification: certified parameter intervals, inner ends at verified points, and a central model."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from relaxations.search.enclosure import Enclosure, Interval, Proof, Reason
from smid.data import Dataset
from smid.data.listing import missing_notes
from smid.data.reference import identity, referred
from smid.data.window import Window, cut_all
from smid.display.from_plain import Plain, fields_from_plain, read
from smid.display.result import Part, Result, Tabular, optional, plain
from smid.display.table import Table, figure
from smid.models import Model, ModelError, Parameter
from smid.models.linear_block import linear_block

if TYPE_CHECKING:
    from control import TransferFunction
    from matplotlib.figure import Figure

_HEADER = ("parameter", "lower", "upper", "width %", "gap", "centre", "unit", "ends")


class CentreStatus(Enum):
    """Whether the interval midpoints, taken together, fit the data.

    Examples
    --------
    >>> print(CentreStatus.FEASIBLE.value)
    the interval midpoints, taken together, fit the data (verified)
    """

    FEASIBLE = "the interval midpoints, taken together, fit the data (verified)"
    INFEASIBLE = "the interval midpoints, taken together, do not fit the data (proven); see the nearest point"
    UNDECIDED = "it is not known whether the interval midpoints, taken together, fit the data"


@dataclass(frozen=True, eq=False, repr=False)
class ParameterInterval(Result):
    """The parameter uncertainty interval (PUI) of one parameter, (2.15)-(2.17).

    Parameters
    ----------
    lower, upper
        Certified: every parameter that fits the data lies between them.
    inner_lower, inner_upper
        Values at verified feasible points; NaN where none was found.
    proof_lower, proof_upper
        ``BOX`` where the end is the prior box's own.

    Examples
    --------
    >>> a1 = ParameterInterval("a1", "", -0.6, -0.4, -0.59, -0.41, Proof.PROVEN, Proof.PROVEN)
    >>> round(a1.width, 6), round(a1.centre, 6), round(a1.gap, 6)
    (0.2, -0.5, 0.01)
    >>> a1
    a1 in [-0.6000, -0.4000] (proven / proven)
    """

    name: str
    unit: str
    lower: float
    upper: float
    inner_lower: float
    inner_upper: float
    proof_lower: Proof
    proof_upper: Proof

    @property
    def width(self) -> float:
        """Return the certified width."""
        return self.upper - self.lower

    @property
    def centre(self) -> float:
        """Return the central estimate (3.18)."""
        return 0.5 * self.lower + 0.5 * self.upper

    @property
    def width_percent(self) -> float:
        """Return the certified width in percent of the centre's magnitude; NaN where it is infinite or the centre 0."""
        return 100 * self.width / abs(self.centre) if np.isfinite(self.width) and self.centre else np.nan

    @property
    def gap(self) -> float:
        """Return the larger distance from an outer end to its inner one; NaN without witness."""
        return float(np.maximum(self.inner_lower - self.lower, self.upper - self.inner_upper))

    @staticmethod
    def of(interval: Interval, parameter: Parameter) -> ParameterInterval:
        """Return an interval of :mod:`relaxations` with labels: an end at or beyond the prior's is the prior's own."""
        priors = (interval.lower <= parameter.lower, interval.upper >= parameter.upper)
        proofs = [Proof.BOX if prior else Proof.PROVEN for prior in priors]
        return ParameterInterval(
            interval.name,
            parameter.unit,
            interval.lower,
            interval.upper,
            interval.inner_lower,
            interval.inner_upper,
            proofs[0],
            proofs[1],
        )

    def to_dict(self) -> dict[str, Any]:
        """Return plain data; infinite and missing numbers become None."""
        content: dict[str, Any] = plain(self.row)
        return content

    @staticmethod
    def from_dict(content: Mapping[str, Any]) -> ParameterInterval:
        """Return the interval that `to_dict` described."""
        ends = {"lower": -np.inf, "upper": np.inf}
        found = {name: open_end(content, name, end) for name, end in ends.items()}
        interval: ParameterInterval = fields_from_plain(ParameterInterval, content, **found)
        return interval

    @property
    def row(self) -> dict[str, Any]:
        """Return the numbers by name, with all digits."""
        numbers = ("lower", "upper", "inner_lower", "inner_upper", "width", "centre", "gap")
        return {
            "name": self.name,
            "unit": self.unit,
            **{name: float(getattr(self, name)) for name in numbers},
            "proof_lower": self.proof_lower.name.lower(),
            "proof_upper": self.proof_upper.name.lower(),
        }

    @property
    def cells(self) -> tuple[str, ...]:
        """Return the row of a table: ends rounded outwards, to three figures of the width."""
        digits = shown_digits(self)
        ends = " / ".join("proven" if p is Proof.PROVEN else "prior box" for p in (self.proof_lower, self.proof_upper))
        return (
            self.name,
            round_down(self.lower, digits),
            round_up(self.upper, digits),
            figure(self.width_percent),
            f"{self.gap:.1e}" if np.isfinite(self.gap) else "unknown",
            f"{self.centre:.{digits}g}" if np.isfinite(self.centre) else "unknown",
            self.unit,
            ends,
        )

    def __str__(self) -> str:
        _, lower, upper, *_, ends = self.cells
        return f"{self.name} in [{lower}, {upper}] {self.unit}".rstrip() + f" ({ends})"

    def _content(self) -> Iterator[Part]:
        yield interval_table("", (self,))


def interval_table(caption: str, intervals: tuple[ParameterInterval, ...]) -> Table:
    """Return a row for each interval."""
    return Table(caption, _HEADER, tuple(i.cells for i in intervals), "r" * len(_HEADER))


@dataclass(frozen=True, eq=False, repr=False)
class Estimate(Tabular):
    """Parameter uncertainty intervals of a model on data.

    Parameters
    ----------
    model
        The central model: its ``values`` are :attr:`parameters`.
    nearest
        A verified feasible point near the centres, where the centres are not themselves shown feasible.
    derived
        Parameters without prior bounds whose box was proven from the data.
    unbounded
        Parameters and hidden signals for which no box could be proven; then nothing else is certified either.
    reason
        Why the computation stopped.
    enclosure
        How the bounds were computed; None where the computation ended before them.
    windows
        The parts of the record that they are proven on; empty for the whole record.
    outliers
        So many samples of each output may break the noise bound.
    """

    SCHEMA: ClassVar = "smid.estimate/1"

    model: Model
    data: Dataset
    noise_bound: Mapping[str, float]
    intervals: tuple[ParameterInterval, ...]
    centre_status: CentreStatus
    nearest: Mapping[str, float] | None
    derived: tuple[str, ...]
    unbounded: tuple[str, ...]
    reason: Reason
    enclosure: Enclosure | None
    windows: tuple[Window, ...] = ()
    outliers: int = 0

    @property
    def proven_on(self) -> Dataset:
        """Return the samples that carry the proof: the windows, each an experiment of its own, or the whole record.

        Raises
        ------
        ModelError
            If outliers are allowed: then no samples are known to be within the noise bound.
        """
        if self.outliers:
            raise ModelError(
                "the intervals allow outliers, and no samples are known to be free of them: identify without outliers, "
                "on the samples that you trust"
            )
        return cut_all(self.data, self.windows) if self.windows else self.data

    @property
    def parameters(self) -> dict[str, float]:
        """Return the parameters of the central model: the centres, or the nearest feasible point found."""
        return dict(self.nearest) if self.nearest is not None else self.centre

    @property
    def centre(self) -> dict[str, float]:
        """Return the centres of the intervals (3.18)."""
        return {i.name: i.centre for i in self.intervals}

    def __len__(self) -> int:
        return len(self.intervals)

    def __iter__(self) -> Iterator[ParameterInterval]:
        return iter(self.intervals)

    def __contains__(self, name: object) -> bool:
        return any(interval.name == name or interval is name for interval in self.intervals)

    def __getitem__(self, name: str) -> ParameterInterval:
        for interval in self.intervals:
            if interval.name == name:
                return interval
        raise KeyError(f"no parameter {name!r}: the model has {', '.join(i.name for i in self.intervals)}")

    @property
    def summary(self) -> str:
        """Return in one sentence how the intervals were obtained and why the computation stopped."""
        if self.enclosure is None:
            if self.reason is Reason.UNBOUNDED:
                parameters = {p.name for p in self.model.parameters}
                hidden = [name for name in self.unbounded if name not in parameters]
                told = f"No box could be proven for {', '.join(self.unbounded)}: "
                them = "it" if len(hidden) == 1 else "each"
                if not hidden:
                    return f"{told}give it bounds, or richer data."
                return (
                    f"{told}no channel measures {', '.join(hidden)}. Measure {them}, or give bounds that hold at all "
                    f"samples, as in model.bound({hidden[0]}=(lower, upper))."
                )
            return f"{self.reason.value[0].upper()}{self.reason.value[1:]}."
        e = self.enclosure
        part = f" on {self.proven_part}" if self.windows else ""
        return f"{e.how}{part}, {e.work} in {e.seconds:.3g} s; {e.reason.value}."

    @property
    def proven_part(self) -> str:
        """Return in words which part of the record carries the proof."""
        held = sum(map(len, self.windows)) or self.data.n_samples
        return f"{held} of {self.data.n_samples} samples" + (f", {len(self.windows)} windows" if self.windows else "")

    @property
    def table(self) -> Table:
        """Return a row for each parameter; printed ends are rounded outwards."""
        units = {c: self.data.channel(c).unit for c in self.noise_bound}
        bounds = ", ".join(f"|noise of {c}| <= {b:g} {units[c]}".rstrip() for c, b in self.noise_bound.items())
        but = f" in all but {self.outliers} samples of each output" if self.outliers else ""
        return interval_table(f"{self.model.name} on {self.data.n_samples} samples, {bounds}{but}", self.intervals)

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield from missing_notes(self.data)
        yield self.summary
        yield self.centre_text

    def _rows(self) -> Iterator[dict[str, Any]]:
        return (i.row for i in self.intervals)

    @property
    def centre_text(self) -> str:
        """Return the sentence about the centres."""
        return f"{self.centre_status.value[0].upper()}{self.centre_status.value[1:]}."

    def to_dict(self) -> dict[str, Any]:
        """Return plain data: the ``estimate`` of the versioned JSON schema in docs/json.md."""
        e = self.enclosure
        return {
            "schema": self.SCHEMA,
            "model": self.model.to_dict(),
            "noise_bound": dict(self.noise_bound),
            "parameters": [i.to_dict() for i in self.intervals],
            "centre": plain(self.centre),
            "centre_status": self.centre_status.name.lower(),
            "nearest_feasible": None if self.nearest is None else dict(self.nearest),
            "derived_boxes": list(self.derived),
            "unbounded": list(self.unbounded),
            "stopped": self.reason.name.lower(),
            "relaxation": None
            if e is None
            else {
                "method": e.method,
                "order": e.order,
                "complicating": list(e.complicating),
                "moments": e.n_moments,
                "largest_block": e.largest_block,
                "rounds": e.rounds,
                "solves": e.solves,
                "seconds": e.seconds,
                "after_cuts": e.after_cuts,
            },
            "windows": [window.to_dict() for window in self.windows],
            "outliers": self.outliers,
            "data": identity(self.data),
        }

    @staticmethod
    def from_dict(content: Mapping[str, Any], data: Dataset | None = None) -> Estimate:
        """Return the estimate that `to_dict` described, without the verified points; see `smid.load`."""
        reason = read(content, "stopped", Reason)
        told = read(content, "relaxation", Plain | None)
        return Estimate(
            read(content, "model", Model),
            referred(read(content, "data", Plain), data),
            read(content, "noise_bound", Mapping[str, float]),
            read(content, "parameters", tuple[ParameterInterval, ...]),
            read(content, "centre_status", CentreStatus),
            read(content, "nearest_feasible", Mapping[str, float] | None),
            read(content, "derived_boxes", tuple[str, ...]),
            read(content, "unbounded", tuple[str, ...]),
            reason,
            None if told is None else _enclosure(told, reason),
            read(content, "windows", tuple[Window, ...]),
            read(content, "outliers", int),
        )

    def to_control(self) -> TransferFunction:
        """Return the central model as a transfer function in z of python-control, with the sampling time of the data.

        A model with a curve gives its linear block: that of a Hammerstein model begins behind the curve, at its signal
        ``x``, that of a Wiener model ends before the sensor's curve. The transfer function names its input and output.
        The initial state of an experiment is no part of it.

        Warns
        -----
        UserWarning
            Where a line has a constant, an offset say: it is left out, and the response is that of changes.

        Raises
        ------
        ImportError
            Where python-control is not installed.
        ModelError
            Where there is no central model, or no linear block with one input and one output.

        Examples
        --------
        >>> from smid import OutputError, identify
        >>> u, y = [1.0, 0, 1, 1, 0, 0, 1, 0], [0.0, 1, 0.5, 1.3, 1.6, 0.8, 0.4, 1.2]
        >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.1)
        >>> system = identify(OutputError(stable=True), data, noise_bound=0.1).to_control()
        >>> system.dt, system.input_labels, system.output_labels, bool(abs(system.poles()[0] - 0.5) < 0.05)
        (0.1, ['u'], ['y'], True)
        """
        control = optional("control", "to_control")
        if self.unbounded:
            raise ModelError(f"there is no central model. {self.summary}")
        block = linear_block(self.model)
        if block.constants:
            warnings.warn(
                f"the constant in the line of {', '.join(block.constants)} is no part of a transfer function: its "
                "response is that of changes about an operating point",
                stacklevel=2,
            )
        count = max(len(block.numerator), len(block.denominator))
        # Powers of 1/z, padded to the same number, are those of z from the highest down.
        parts = (np.pad(part, (0, count - len(part))) for part in (block.numerator, block.denominator))
        return control.TransferFunction(*parts, self.data.sampling_time, inputs=[block.input], outputs=[block.output])

    def plot(self) -> Figure:
        """Return a figure of the intervals: outer, inner and centre of each parameter."""
        from smid.identification.figures import intervals_figure

        return intervals_figure(self)


def _enclosure(told: Mapping[str, Any], reason: Reason) -> Enclosure:
    """Return how the bounds were computed, without the verified points."""
    known = {"intervals": (), "witnesses": (), "empty": None, "reason": reason, "n_moments": read(told, "moments", int)}
    enclosure: Enclosure = fields_from_plain(Enclosure, told, **known)
    return enclosure


def open_end(content: Mapping[str, Any], name: str, end: float) -> float:
    """Return a bound of plain data, where None stands for an infinite one."""
    value = read(content, name, float | None)
    return end if value is None else float(value)


def shown_digits(interval: ParameterInterval) -> int:
    """Return how many significant digits show the interval's width to three figures."""
    largest = max(abs(interval.lower), abs(interval.upper))
    if not np.isfinite(interval.width) or interval.width <= 0 or largest == 0:
        return 7
    return int(np.clip(np.ceil(np.log10(largest / interval.width)) + 3, 4, 16))


def round_down(value: float, digits: int) -> str:
    """Return a lower end as text, rounded down: the printed interval must be proven too."""
    return _rounded(value, digits, -1)


def round_up(value: float, digits: int) -> str:
    """Return an upper end as text, rounded up."""
    return _rounded(value, digits, 1)


def _rounded(value: float, digits: int, direction: int) -> str:
    if not np.isfinite(value) or value == 0:
        return f"{value:g}"
    from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal

    context = Context(prec=digits, rounding=ROUND_FLOOR if direction < 0 else ROUND_CEILING)
    return str(context.create_decimal(Decimal(value)))
