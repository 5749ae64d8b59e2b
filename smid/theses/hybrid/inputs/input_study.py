"""Excitation, Fisher's information and certified intervals for every input of the arm."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from relaxations.deadline import Progress
from smid.data import Dataset, excitation
from smid.design.fisher import FisherInformation
from smid.design.shrinking import shrinking_input
from smid.display.result import Tabular, plain
from smid.display.table import Table
from smid.identification.estimate import ParameterInterval
from smid.models import ModelError
from smid.signals import TABLE_F1, plot_spread
from smid.theses.chapter import Chapter, Drawing, Topic
from smid.theses.hybrid.arm.exact_motion import ARM, exact_motion
from smid.theses.hybrid.arm.proven import CONSTANTS, is_told, prove_arm
from smid.theses.hybrid.inputs.arm_experiments import arm_information, arm_tailored, arm_widths

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["NARROW", "TAILORED", "InputRow", "InputStudy", "arm_inputs", "input_study"]


SAMPLING_TIME = 0.02  # s, every tenth of the thesis's 2 ms
SAMPLES = 600  # 12 s, as in figure F.2
NOISE_BOUND = 0.002  # rad: an encoder of 1571 lines
MOST_ORDER = 40

NARROW: Mapping[str, tuple[float, float]] = {
    "theta": (10.0, 50.0),
    "b": (0.0, 0.01),
    "Wd": (0.0, 2.0),
    "Ws": (0.0, 5.0),
}
"""Prior of the search for an input. The arm is known, and a narrow prior gives the same intervals in less time."""

TAILORED = (0.5, 1.5, 0.1, 0.05, 0.5, 1 / 3, 1 / 3)
"""Choice by hand, as in section 7.4: a low constant, so that braking is short, and switching below Ws / c = 0.075 V."""

TITLES = {"theta": "1/J", "b": "b", "Wd": "Wd", "Ws": "Ws"}


@dataclass(frozen=True)
class InputRow:
    """One experiment on the arm.

    Parameters
    ----------
    input, angle
        Shape (n,). Voltage in V, measured angle in rad.
    order
        Order of persistent excitation, at most `MOST_ORDER`. Such finely sampled sines are nearly dependent, so
        fewer than two orders per sine are found in floating point.
    information
        For noise as large as that of the record.
    arm
        The interval of each constant.
    """

    name: str
    input: Array
    angle: Array
    order: int
    information: FisherInformation
    arm: Mapping[str, ParameterInterval]

    @property
    def holds(self) -> bool:
        """Return whether the arm that made the data lies inside all intervals."""
        return all(own.lower <= ARM[name] <= own.upper for name, own in self.arm.items())


@dataclass(frozen=True, eq=False, repr=False)
class InputStudy(Chapter, Tabular):
    """The experiments under every input.

    Parameters
    ----------
    sampling_time
        In seconds.
    noise_bound
        In rad.
    """

    title = "Inputs of the rotating arm"
    command = "hybrid inputs"
    not_compared = (
        "The thesis states single values from single starts, no intervals. Its white model found 1/J, b and Wd. Ws "
        "stayed at its start value of 1.6 (table F.2).",
        "Table F.1 is read from a scan. Where it prints a fraction at every sine, the sum is multiplied by the 0.5 V "
        "of listing K.13.",
        "The arm is simulated exactly, sampled every 0.02 s with the voltage held. The thesis holds it for 0.002 s.",
    )

    rows: tuple[InputRow, ...]
    sampling_time: float
    noise_bound: float

    @property
    def table(self) -> Table:
        """Return relative widths and least deviations of all constants under every input."""
        header = (
            *("input", "max |u| [V]", "order"),
            *(f"{TITLES[k]} width" for k in CONSTANTS),
            "Ws interval [Nm]",
            *(f"{TITLES[k]} dev." for k in CONSTANTS),
        )
        return Table(
            f"Relative widths of certified intervals, |noise| <= {self.noise_bound:g} rad, and least deviations "
            "(Cramer-Rao)",
            header,
            tuple(self._cells(row) for row in self.rows),
            "l" + "r" * (len(header) - 1),
        )

    def _cells(self, row: InputRow) -> tuple[str, ...]:
        sticking = row.arm["Ws"]
        return (
            row.name,
            f"{np.abs(row.input).max():.2f}",
            f">= {row.order}" if row.order == MOST_ORDER else f"{row.order}",
            *(f"{row.arm[k].width_percent:.3g}%" for k in CONSTANTS),
            f"{sticking.lower:.3g} to {sticking.upper:.3g}",
            *(f"{100 * share:.2g}%" for share in row.information.relative_deviations),
        )

    @property
    def conclusion(self) -> str:
        """Return in a few sentences which constants the inputs determine."""
        open_ = [row.name for row in self.rows if not is_told(row.arm["Ws"])]
        determined = [row.name for row in self.rows if is_told(row.arm["Ws"])]
        inside = sum(row.holds for row in self.rows)
        return (
            f"The arm that made the data lies inside all four intervals for {inside} of {len(self.rows)} inputs. "
            f"Ws is proven within a factor of two under {', '.join(determined) or 'none'}, and not under "
            f"{', '.join(open_) or 'none'}. The intervals are outer bounds. The least deviations are those of the "
            "best possible estimator."
        )

    def records(self) -> Dataset:
        """Return the record of every input."""
        from smid.reports.chapter import together

        step = self.sampling_time
        made = {
            row.name: Dataset.from_arrays(input={"u": row.input}, output={"angle": row.angle}, sampling_time=step)
            for row in self.rows
        }
        return replace(together(made), source="rotating arm (simulated)")

    def topics(self) -> Iterator[Topic]:
        """Return the certified intervals, and the excitation."""
        yield Topic(
            "Certified intervals",
            "No start value is used: the constants are sought over orders of magnitude, and each bound is proven.",
            "Sticking is proven where the arm creeps. A signal that passes zero speed fast does not determine Ws by "
            "these bounds. The least deviations show the information in its first instants.",
            self.table,
            Drawing(self.plot_intervals, "Intervals; orange: not within a factor of two. Line: the true value."),
        )
        yield Topic(
            "Excitation and spread",
            "The order of excitation counts frequencies. It does not show which states of a nonlinear plant are "
            "reached.",
            Drawing(self.plot_spread, "Inputs, input-output pairs, and autocovariances."),
        )

    def _rows(self) -> Iterator[dict[str, Any]]:
        """Return a row for each input and constant."""
        for row in self.rows:
            deviations = dict(zip(CONSTANTS, row.information.relative_deviations.tolist(), strict=True))
            for name, told in _intervals(row).items():
                yield {"input": row.name, "constant": name, **told, "relative_deviation": deviations[name]}

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "sampling_time": self.sampling_time,
            "noise_bound": self.noise_bound,
            "inputs": [
                {
                    "name": row.name,
                    "order": row.order,
                    "deviations": dict(zip(CONSTANTS, plain(row.information.relative_deviations), strict=True)),
                    "intervals": _intervals(row),
                    "holds": row.holds,
                }
                for row in self.rows
            ],
            "conclusion": self.conclusion,
        }

    def plot_intervals(self) -> Figure:
        """Draw the intervals of each constant relative to the true value, one line per input."""
        from smid.theses.hybrid.inputs.figures import intervals_figure

        return intervals_figure(self)

    def plot_spread(self) -> Figure:
        """Draw every input with its spread over the angle and its autocovariance."""
        records = {row.name: (row.input, row.angle) for row in self.rows}
        return plot_spread(records, self.sampling_time, input_label="voltage [V]", output_label="angle [rad]")


def arm_inputs(samples: int = SAMPLES, sampling_time: float = SAMPLING_TIME) -> dict[str, Array]:
    """Return the sums of sines of table F.1 and the tailored signal, in V, by name.

    Parameters
    ----------
    sampling_time
        In seconds.

    Examples
    --------
    >>> list(arm_inputs(100))[-1]
    'tailored'
    """
    inputs = {name: sines.signal(samples, sampling_time) for name, sines in TABLE_F1.items()}
    return inputs | {"tailored": arm_tailored(samples, sampling_time).signal(TAILORED)}


def input_study(
    inputs: Mapping[str, ArrayLike] | None = None,
    *,
    samples: int = SAMPLES,
    noise_bound: float = NOISE_BOUND,
    budget: int = 12,
    seed: int = 0,
    progress: Progress | None = None,
) -> InputStudy:
    """Compare inputs of the arm.

    Parameters
    ----------
    inputs
        Shape (n,). Voltages in V, held for 0.02 s each; by default `arm_inputs`.
    samples
        Of the default inputs.
    noise_bound
        Of the uniform noise, in rad.
    budget
        Number of inputs in the search for the narrowest intervals; 0 for no search.
    seed
        Of noise and search.

    Raises
    ------
    ModelError
        If there are too few samples.

    Examples
    --------
    >>> voltage = np.repeat([6.0, -6.0, 3.0, -3.0], 25)
    >>> study = input_study({"steps": voltage}, samples=100, budget=0)
    >>> [row.name for row in study.rows]
    ['steps']
    """
    if samples < 100:
        raise ModelError(f"samples = {samples} are too few for the slowest sine: give at least 100")
    signals = {name: np.asarray(u, dtype=np.float64) for name, u in (inputs or arm_inputs(samples)).items()}
    # Search the tailored signal with the narrowest intervals.
    if budget:
        if progress:
            progress(f"searching {budget} tailored signals")
        widths = partial(
            arm_widths, sampling_time=SAMPLING_TIME, noise_bound=noise_bound, seed=seed + 1, prior=dict(NARROW)
        )
        family = arm_tailored(samples, SAMPLING_TIME)
        signals["optimised"] = shrinking_input(family, widths, budget=budget, starts=[TAILORED], seed=seed).input
    rows = []
    for name, u in signals.items():
        if progress:
            progress(f"certifying under {name}")
        rows.append(_row(name, u, noise_bound, seed))
    return InputStudy(tuple(rows), SAMPLING_TIME, noise_bound)


def _row(name: str, u: Array, noise_bound: float, seed: int) -> InputRow:
    noise = np.random.default_rng(seed).uniform(-noise_bound, noise_bound, len(u))
    angle = exact_motion(u, SAMPLING_TIME)[:, 0] + noise
    data = Dataset.from_arrays(input=u, output=angle, sampling_time=SAMPLING_TIME)
    information = arm_information(u, SAMPLING_TIME, noise_bound / np.sqrt(3))
    found = prove_arm(data, noise_bound)
    order = excitation(u, max_order=MOST_ORDER).order
    return InputRow(name, u, angle, order, information, {constant: found[constant] for constant in CONSTANTS})


def _intervals(row: InputRow) -> dict[str, dict[str, Any]]:
    """Return the intervals as plain data."""
    return {
        name: {"lower": own.lower, "upper": own.upper, "unit": own.unit, "told": is_told(own)}
        for name, own in row.arm.items()
    }
