"""Certified ranges of a sensor: what it can say at all, for inputs in the trained range and any past in it.

Each step of the program is enclosed in interval arithmetic over the whole range of its inputs and of its memory. Curves
are split into cells.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from smid.display.result import Part, Result
from smid.display.table import Table
from smid.sensors.bounded import BoundedSensor
from smid.sensors.ranges import Range
from smid.sensors.sensor import VirtualSensor, trained
from smid.sensors.trained_on import Signal

__all__ = ["TrainedRange", "trained_range"]

CELLS = 4096


@dataclass(frozen=True, eq=False, repr=False)
class TrainedRange(Result):
    """What a sensor says over the trained range, certified.

    Parameters
    ----------
    lower, upper
        Of the computed output, in its unit.
    half_width
        Least and largest half width of the interval; None for a sensor without error bound.
    """

    inputs: tuple[Signal, ...]
    output: Signal
    lower: float
    upper: float
    half_width: tuple[float, float] | None

    @property
    def table(self) -> Table:
        """Return the ranges as text."""
        unit = self.output.unit
        rows = [(s.name, s.unit, f"{s.lower:.4g}", f"{s.upper:.4g}") for s in self.inputs]
        rows.append((f"{self.output.name}, computed", unit, f"{self.lower:.4g}", f"{self.upper:.4g}"))
        if self.half_width is not None:
            rows.append(("half width", unit, f"{self.half_width[0]:.3g}", f"{self.half_width[1]:.3g}"))
        caption = "Certified: for inputs in the trained range and any past in it, the sensor stays within these bounds."
        return Table(caption, ("", "unit", "lower", "upper"), tuple(rows), "llrr")

    def _content(self) -> Iterator[Part]:
        yield self.table


def trained_range(sensor: VirtualSensor | BoundedSensor) -> TrainedRange:
    """Return certified bounds of what a sensor says over the trained range of its inputs.

    Raises
    ------
    ModelError
        If the sensor is not trained, or a step has no enclosure.

    Examples
    --------
    >>> from smid.data.bundled import load_clutch
    >>> from smid.sensors import CFPX
    >>> data = load_clutch("20C_step_a")
    >>> sensor = CFPX(5).fit(data, seed=1)
    >>> found, said = trained_range(sensor), sensor.predict(data).position[0]
    >>> bool(found.lower <= said.min() < said.max() <= found.upper < said.max() + 0.1)
    True
    """
    told, program = trained(sensor.trained_on, sensor), sensor.program()
    program.require_causal()
    inputs = {s.name: Range(np.asarray(s.lower), np.asarray(s.upper)) for s in told.inputs}
    signals, _ = program.enclose(inputs, cells=CELLS)
    found = signals[program.output]
    half = None if program.half_width is None else signals[program.half_width]
    return TrainedRange(
        told.inputs,
        told.output,
        float(found.lower),
        float(found.upper),
        None if half is None else (float(half.lower), float(half.upper)),
    )
