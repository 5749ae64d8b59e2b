"""The thesis's Hammerstein model in its three phases, on records that anyone may have.

1. An enclosure of the least noise bound on a part of ``20C_ramp_a``.
2. Parameter intervals at relaxation orders 1, 2 and 3 and the central model, at 1.2 times that bound.
3. Free runs of the central model over the other ramps and the steps.

Beside these: the choice of the structure, the widths against the noise bound, the rivals by least squares on the same
records, and what the thesis prints held against what a certificate allows.

The part, 0.8 s of 10 s, is the steepest pair of ramps up to the largest current: it passes all levels, fast, rising and
falling.  The thesis identified on a part too, and does not say which.  The rivals by least squares are the same
structure and the degree 5 with all powers, both on the same part, and that degree 5 on all of ``20C_step_a``, which is
how the thesis made its HS20.

The plant of the records is no Hammerstein model: it has hysteresis and a pole that varies.  So the least noise bound
measures that model's error, several times the 0.3 bar of the sensor, and there is no true parameter to be found.

Reference: clutch thesis, section 3.2, figures 3.3 to 3.6.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from smid.data import DataError, Dataset
from smid.data.bundled import load_clutch
from smid.display.result import Heading, Part, Result
from smid.display.table import Table
from smid.fitting.binding import bind
from smid.fitting.fit import fit
from smid.fitting.validate import Validation
from smid.identification.error_bound import ErrorBound, error_bound
from smid.identification.estimate import Estimate
from smid.models import Model
from smid.theses.clutch.hammerstein.finished import finished
from smid.theses.clutch.hammerstein.free_runs import FreeRuns, free_runs
from smid.theses.clutch.hammerstein.intervals import OrderStudy, WidthStudy, order_study, width_study
from smid.theses.clutch.hammerstein.model import clutch_hammerstein
from smid.theses.clutch.hammerstein.printed import (
    PRINTED,
    PRINTED_NOISE_BOUND,
    PrintedComparison,
    compare_with_printed,
    printed_model,
    printed_step_model,
)
from smid.theses.clutch.hammerstein.structures import StructureChoice, choose_structure
from smid.theses.clutch.plant import NOISE_BOUND

__all__ = ["PART", "HammersteinStudy", "hammerstein_study"]

Progress = Callable[[str], None]

RECORD, STEPS = "20C_ramp_a", "20C_step_a"
PART = (2650, 3050)
"""Samples of `RECORD` that are identified on."""

FACTOR = 1.2
SHORTEST = 50
SMALLEST_RANGE = 10 * NOISE_BOUND  # bar
CENTRAL, ON_STEPS = "set-membership", "HS20: the same on steps"
ALL_POWERS = (5, 4, 3, 2, 1)


@dataclass(frozen=True, eq=False, repr=False)
class HammersteinStudy(Result):
    """The three phases, and what stands beside them.

    Parameters
    ----------
    part
        What was identified on.
    bound
        Phase 1.
    orders
        Phase 2.
    runs
        Phase 3, the rivals included.
    """

    part: Dataset
    bound: ErrorBound
    orders: OrderStudy
    runs: FreeRuns
    structures: StructureChoice
    widths: WidthStudy
    printed: PrintedComparison

    @property
    def estimate(self) -> Estimate:
        """The intervals at the highest order, with the central model."""
        return self.orders.estimates[-1]

    @property
    def validation(self) -> Validation:
        """The free runs of the central model."""
        return self.runs.validations[CENTRAL]

    @property
    def conclusion(self) -> str:
        """Return in a few sentences what the three phases gave."""
        unit = self.bound.unit
        told = []
        for kind in ("ramp", "step"):
            scores = [s for s in self.validation.scores if kind in s.experiment]
            if scores:
                beyond = [100 * (s.violations or 0) / s.samples for s in scores]
                told.append(
                    f"on {kind}s it errs by up to {max(s.largest for s in scores):.1f} {unit} and leaves the bound at "
                    f"{min(beyond):.0f} to {max(beyond):.0f} % of the samples"
                )
        lacking = (
            f", proven, though the sensor errs by at most {NOISE_BOUND:g} {unit}: the rest is what the structure lacks"
            if self.bound.lower > NOISE_BOUND
            else f", proven; the sensor errs by at most {NOISE_BOUND:g} {unit}"
        )
        return (
            f"No Hammerstein model of this structure explains the {self.part.n_samples} samples with noise below "
            f"{self.bound.lower:.4g} {unit}{lacking}. Identified at {FACTOR:g} times the least bound, the central "
            f"model runs freely over the records: {'; '.join(told)}."
        )

    @property
    def beside_thesis(self) -> Table:
        """Return the thesis's figures of merit beside those on our records."""
        unit = self.bound.unit
        alpha = next(p for p in PRINTED if p.name == "alpha")

        def errors(model: str, kind: str) -> str:
            found = self.runs.rmse(model)[[kind in record for record in self.runs.records]]
            return f"RMSE {found.min():.2f} to {found.max():.2f} {unit}" if found.size else "no such record"

        rows = (
            ("error bound", f"{PRINTED_NOISE_BOUND:g}", f"least {self.bound.enclosure} {unit}, used {FACTOR:g} times"),
            ("relaxation order", "2", self.orders.conclusion.split(":")[0].rstrip(".")),
            ("width of alpha's interval", f"{alpha.width:.2g}", f"{self.estimate['alpha'].width:.2g}"),
            ("central estimate of alpha", f"{alpha.central:g}", f"{self.estimate['alpha'].centre:.4f}"),
            ("on ramps", "relatively good (figure 3.3)", errors(CENTRAL, "ramp")),
            ("on steps", "not able to cope (figure 3.4)", errors(CENTRAL, "step")),
            ("HS20 on steps", "not able to track (figures 3.5, 3.6)", errors(ON_STEPS, "step")),
            ("HS20 on ramps", "not told", errors(ON_STEPS, "ramp")),
        )
        return Table(
            "Figures of merit: the thesis's, and those on our records.", ("", "thesis", "our records"), rows, "lll"
        )

    def _content(self) -> Iterator[Part]:
        phases: dict[str, tuple[Part, ...]] = {
            "Phase 1: error bound": (self.bound,),
            "Choice of the structure": (self.structures,),
            "Phase 2: parameter intervals": (self.orders,),
            "Widths against the noise bound": (self.widths,),
            "Phase 3: validation": (self.validation, self.runs),
            "What the thesis prints": (self.printed,),
            "Beside the thesis": (self.beside_thesis,),
            "Conclusion": (self.conclusion,),
        }
        for title, parts in phases.items():
            yield Heading(title)
            yield from parts

    def plot(self) -> Figure:
        """Draw the central model's free runs over all records: figures 3.3 and 3.4 of the thesis."""
        from smid.theses.clutch.hammerstein.figures import validation_figure

        return validation_figure(self.validation)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "part": {"source": self.part.source, "samples": self.part.n_samples, "checksum": self.part.checksum},
            "error_bound": self.bound.to_dict(),
            "structures": self.structures.to_dict(),
            "orders": self.orders.to_dict(),
            "widths": self.widths.to_dict(),
            "free_runs": self.runs.to_dict(),
            "thesis": self.printed.to_dict(),
            "conclusion": self.conclusion,
        }


def hammerstein_study(
    records: Dataset | None = None,
    part: tuple[int, int] = PART,
    orders: Sequence[int] = (1, 2, 3),
    *,
    progress: Progress | None = None,
) -> HammersteinStudy:
    """Run the three phases of the thesis's Hammerstein identification.

    Parameters
    ----------
    records
        With the channels ``current`` (mA) and ``pressure`` (bar), and the experiments ``20C_ramp_a`` and
        ``20C_step_a`` among others; by default all bundled records.
    part
        First sample of ``20C_ramp_a`` to identify on, and the first one not to.
    orders
        Relaxation orders; the highest one's central model is validated.
    progress
        Called with a line of text now and then.

    Raises
    ------
    DataError
        If a channel, a record or the samples of the part are missing.
    ModelError
        If an order is none.

    Examples
    --------
    All of it takes a minute or two.  A part that is too short is refused at once:

    >>> try:
    ...     hammerstein_study(part=(0, 40))
    ... except DataError as error:
    ...     print(error)
    the part 0:40 of 20C_ramp_a is refused: give at least 50 samples of its 5001, such as 2650:3050

    References
    ----------
    Clutch thesis, section 3.2.
    """
    data = replace(load_clutch() if records is None else records, inputs=("current",), outputs=("pressure",))
    record, steps = data.select(RECORD), data.select(STEPS)
    start, stop = part
    if start < 0 or stop < start + SHORTEST or stop > record.n_samples:
        raise DataError(
            f"the part {start}:{stop} of {RECORD} is refused: give at least {SHORTEST} samples of its "
            f"{record.n_samples}, such as {PART[0]}:{PART[1]}"
        )
    chosen = replace(record.crop(start, stop), source=f"{RECORD}, samples {start}:{stop} (simulated)")
    if np.ptp(chosen.values("pressure")) < SMALLEST_RANGE:
        raise _uninformative(part)
    model = clutch_hammerstein()
    bound = finished(error_bound(model, chosen, progress=progress))
    found = order_study(model, chosen, FACTOR * bound.upper, orders, progress=progress)
    if found.estimates[-1].unbounded:
        raise _uninformative(part)
    widths = width_study(model, chosen, bound, progress=progress)
    rivals = {
        CENTRAL: found.estimates[-1].model,
        "least squares": _least_squares(model, chosen),
        "least squares, all powers": _least_squares(clutch_hammerstein(powers=ALL_POWERS), chosen),
        ON_STEPS: _least_squares(clutch_hammerstein(powers=ALL_POWERS), steps),
        "thesis's model": printed_model(),
        "thesis's HS20": printed_step_model(),
    }
    return HammersteinStudy(
        chosen,
        bound,
        found,
        free_runs(rivals, data, FACTOR * bound.upper),
        choose_structure(chosen, record, progress=progress),
        widths,
        compare_with_printed(chosen, widths, progress=progress),
    )


def _uninformative(part: tuple[int, int]) -> DataError:
    return DataError(
        f"the part {part[0]}:{part[1]} of {RECORD} says too little of the model, no bounds can be proven: give samples "
        f"in which the pressure rises and falls, such as {PART[0]}:{PART[1]}"
    )


def _least_squares(model: Model, data: Dataset) -> Model:
    return fit(bind(model, data), data).model
