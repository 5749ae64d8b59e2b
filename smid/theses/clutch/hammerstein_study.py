"""The thesis's Hammerstein model in its three phases, on the bundled records.

The phases are those of `smid.study.phases`, which takes any record: the least noise bound on a part of ``20C_ramp_a``,
intervals and the central model at 1.2 times that bound, free runs over the other ramps and the steps.

The study also compares relaxation orders, structures, least-squares models on the same records, and the thesis's
printed intervals with certified ones.

The part, 0.8 s of 10 s, is the steepest pair of ramps up to the largest current. It passes all levels, rising and
falling. The thesis identified on another part, which it does not state. HS20 is, as in the thesis, a least-squares fit
of degree 5 with all powers to steps, here to ``20C_step_a``.

The plant of the records is not a Hammerstein model: it has hysteresis and a pole that varies. The least noise bound
therefore measures the model's error, several times the 0.3 bar of the sensor, and there are no true parameters.

Reference: clutch thesis, section 3.2, figures 3.3 to 3.6.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from relaxations.deadline import Progress
from smid.data import DataError, Dataset
from smid.data.bundled import load_clutch
from smid.display.table import Table
from smid.fitting.binding import bind
from smid.fitting.fit import fit
from smid.identification.error_bound import ErrorBound
from smid.identification.estimate import Estimate
from smid.models import Model
from smid.reports.page import is_simulated
from smid.study.phases import FACTOR, Phases, phases
from smid.study.widths import WidthStudy
from smid.theses.chapter import Chapter, Drawing, Topic
from smid.theses.clutch.hammerstein.free_runs import FreeRuns, free_runs
from smid.theses.clutch.hammerstein.intervals import OrderStudy, order_study
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
from smid.validation.scores import Validation

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["PART", "HammersteinStudy", "hammerstein_study"]

RECORD, STEPS = "20C_ramp_a", "20C_step_a"
PART = (2650, 3050)
"""Samples of `RECORD` that are identified on."""

SHORTEST = 50
SMALLEST_RANGE = 10 * NOISE_BOUND  # bar
CENTRAL, ON_STEPS = "set-membership", "HS20: the same on steps"
ALL_POWERS = (5, 4, 3, 2, 1)


@dataclass(frozen=True, eq=False, repr=False)
class HammersteinStudy(Chapter):
    """The three phases, and the comparisons with other models and with the thesis.

    Parameters
    ----------
    part
        The samples that were identified on.
    phases
        Error bound, intervals and validation, as `smid phases` finds them.
    orders
        The intervals at several relaxation orders.
    runs
        Free runs of the central model and of others.
    """

    title = "Clutch, section 3.2: the Hammerstein model in three phases"
    command = "clutch hammerstein"
    not_compared = (
        "The thesis's records are confidential and its figures are normalised. Ours are simulated by a plant with "
        "hysteresis and a pole that varies, whose shapes and sizes are assumptions. Parameters, errors and noise "
        "bounds of the two cannot be compared as numbers, only in kind.",
        "The thesis identified on a part of 20C_ramp_a that it does not state. Our part is another one.",
        "The unit of its error bound is not printed. We take the unit of the pressure.",
        "For its validations the thesis shows figures and states no error in numbers.",
        "The thesis does not state the settings of SparsePOP (boxes, tolerances, solver). The printed intervals cannot "
        "be reproduced. They can only be checked against each other, and against certified intervals for the "
        "thesis's own model and noise bound.",
    )

    part: Dataset
    phases: Phases
    orders: OrderStudy
    runs: FreeRuns
    structures: StructureChoice
    printed: PrintedComparison

    @property
    def bound(self) -> ErrorBound:
        """Return the least noise bound."""
        return self.phases.bound

    @property
    def widths(self) -> WidthStudy:
        """Return the widths at several noise bounds."""
        return self.phases.widths

    @property
    def estimate(self) -> Estimate:
        """Return the intervals, with the central model."""
        return self.phases.estimate

    @property
    def validation(self) -> Validation:
        """Return the free runs of the central model."""
        return self.phases.validations[0]

    @property
    def conclusion(self) -> str:
        """Return the results of the three phases in a few sentences."""
        unit = self.bound.unit
        errors = []
        for kind in ("ramp", "step"):
            scores = [s for s in self.validation.scores if kind in s.experiment]
            if scores:
                beyond = [100 * (s.violations or 0) / s.samples for s in scores]
                errors.append(
                    f"on {kind}s the largest error is {max(s.largest for s in scores):.1f} {unit}, and "
                    f"{min(beyond):.0f} to {max(beyond):.0f} % of the samples exceed the noise bound"
                )
        larger = self.bound.lower > NOISE_BOUND
        return (
            f"No Hammerstein model of this structure explains the {self.part.n_samples} samples with noise below "
            f"{self.bound.lower:.4g} {unit}, proven; the sensor errs by at most {NOISE_BOUND:g} {unit}. "
            f"{'The difference is the error of the structure. ' if larger else ''}"
            f"The central model was identified at {FACTOR:g} times the least bound. In free runs over the records: "
            f"{'; '.join(errors)}."
        )

    @property
    def beside_thesis(self) -> Table:
        """Return the thesis's figures of merit and those on our records."""
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
            ("HS20 on ramps", "not stated", errors(ON_STEPS, "ramp")),
        )
        return Table("Figures of merit of the thesis and of this study.", ("", "thesis", "our records"), rows, "lll")

    def records(self) -> Dataset:
        """Return the records of the free runs."""
        return self.validation.data

    def topics(self) -> Iterator[Topic]:
        """Return the comparison with the thesis, the three phases, and the other comparisons."""
        yield Topic("Comparison with the thesis", self.beside_thesis)
        yield Topic(
            "Phase 1: error bound",
            f"Identified on {self.part.source.removesuffix(' (simulated)')}. The least noise bound with which the "
            f"model explains these samples lies in {self.bound.enclosure} {self.bound.unit}. Below the lower end no "
            "parameters explain them (certified). With the upper end some parameters do (witnessed).",
        )
        yield Topic("Choice of the structure", self.structures)
        yield Topic(
            "Phase 2: parameter intervals",
            self.orders,
            Drawing(
                self._intervals_figure,
                f"Intervals at {FACTOR:g} times the least noise bound, in percent of the centres.",
            ),
        )
        yield Topic(
            "Widths against the noise bound",
            "At the least noise bound the feasible set shrinks to a point, whatever the true parameters are.",
            self.widths,
            Drawing(self.widths.plot, "Widths of the certified intervals over the noise bound."),
        )
        yield Topic(
            "Phase 3: validation",
            "Free runs of the central model over all records, as in figures 3.3 and 3.4 of the thesis.",
            self.validation,
            Drawing(self.plot, "Pressure, measured and in free run, and the error with the noise bound."),
        )
        yield Topic(
            "Other models on the same records",
            "Least squares fits the free run to the same part, with the same structure and with all powers up to 5. "
            "HS20 is the fit with all powers to 20C_step_a, as in the thesis. The thesis's model and its HS20 are run "
            "with the printed parameters.",
            self.runs,
            Drawing(self.runs.plot, "RMSE of the free runs, by model and record."),
            Drawing(self._steps_figure, "HS20 on all records; on steps as in figures 3.5 and 3.6 of the thesis."),
        )
        yield Topic(
            "What the thesis prints, and certified intervals",
            self.printed,
            Drawing(
                self.printed.plot,
                "Intervals on data of the thesis's central model with its noise bound, and the printed intervals.",
            ),
        )

    def _intervals_figure(self) -> Figure:
        from smid.identification.figures import intervals_figure

        return intervals_figure(self.estimate)

    def _steps_figure(self) -> Figure:
        from smid.theses.clutch.hammerstein.figures import validation_figure

        return validation_figure(self.runs.validations[ON_STEPS])

    def plot(self) -> Figure:
        """Draw the central model's free runs over all records: figures 3.3 and 3.4 of the thesis."""
        from smid.theses.clutch.hammerstein.figures import validation_figure

        return validation_figure(self.validation)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "part": {"source": self.part.source, "samples": self.part.n_samples, "checksum": self.part.checksum},
            "phases": self.phases.to_dict(),
            "structures": self.structures.to_dict(),
            "orders": self.orders.to_dict(),
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
    """Run the three phases of the thesis's Hammerstein identification; it takes a minute or two.

    Parameters
    ----------
    records
        With the channels ``current`` (mA) and ``pressure`` (bar), and the experiments ``20C_ramp_a`` and
        ``20C_step_a`` among others; by default all records of the actuator.
    part
        First sample of ``20C_ramp_a`` to identify on, and the first one not to.
    orders
        Relaxation orders to compare.

    Raises
    ------
    DataError
        If a channel, a record or the samples of the part are missing.
    ModelError
        If an order is not a positive whole number.

    Examples
    --------
    >>> try:
    ...     hammerstein_study(part=(0, 40))
    ... except DataError as error:
    ...     print(error)
    the part 0:40 of 20C_ramp_a is refused: give at least 50 samples of its 5001, such as 2650:3050
    """
    # Check the part before any long work.
    data = replace(load_clutch() if records is None else records, inputs=("current",), outputs=("pressure",))
    record, steps = data.select(RECORD), data.select(STEPS)
    start, stop = part
    if start < 0 or stop < start + SHORTEST or stop > record.n_samples:
        raise DataError(
            f"the part {start}:{stop} of {RECORD} is refused: give at least {SHORTEST} samples of its "
            f"{record.n_samples}, such as {PART[0]}:{PART[1]}"
        )
    simulated = " (simulated)" if is_simulated([data.source]) else ""
    chosen = replace(record.crop(start, stop), source=f"{RECORD}, samples {start}:{stop}{simulated}")
    if np.ptp(chosen.values("pressure")) < SMALLEST_RANGE:
        raise DataError(
            f"the part {part[0]}:{part[1]} of {RECORD} says too little of the model, no bounds can be proven: give "
            f"samples in which the pressure rises and falls, such as {PART[0]}:{PART[1]}"
        )
    model = clutch_hammerstein()
    found = phases(model, chosen, [data], factor=FACTOR, progress=progress)
    # The models that the central one is compared with.
    noise_bound = FACTOR * found.bound.upper
    models = {
        CENTRAL: found.estimate.model,
        "least squares": _least_squares(model, chosen),
        "least squares, all powers": _least_squares(clutch_hammerstein(powers=ALL_POWERS), chosen),
        ON_STEPS: _least_squares(clutch_hammerstein(powers=ALL_POWERS), steps),
        "thesis's model": printed_model(),
        "thesis's HS20": printed_step_model(),
    }
    return HammersteinStudy(
        chosen,
        found,
        order_study(model, chosen, noise_bound, orders, progress=progress),
        free_runs(models, data, noise_bound),
        choose_structure(chosen, record, progress=progress),
        compare_with_printed(chosen, found.widths, progress=progress),
    )


def _least_squares(model: Model, data: Dataset) -> Model:
    return fit(bind(model, data), data).model
