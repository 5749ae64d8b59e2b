"""Section 6.3 of the hybrid thesis on the simulated arm, compared with its numbers.

- white: all four constants, by Euler's method as in table F.2 and by the exact motion;
- alternating: 1/J and the network by turns, from random weights (section 6.3.4);
- input error: 1/J, and the three shapes of the network (section 6.3.5, figure 6.11);
- embedded: table 8.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import Progress
from smid.data import Dataset
from smid.display.result import Part, Tabular
from smid.display.table import Table, figure
from smid.networks import TanhNetwork, weight_count
from smid.signals import TABLE_F1, ModulatingFilter
from smid.theses.chapter import Chapter, Drawing, Topic
from smid.theses.hybrid.arm.alternating import alternate
from smid.theses.hybrid.arm.embedded_arm import (
    INERTIA_START,
    SPEED_UNIT,
    TORQUE_UNIT,
    embedded_arm,
    figure_6_9,
    random_start,
    true_friction,
)
from smid.theses.hybrid.arm.embedded_study import COMPARED, WAYS, EmbeddedStudy, embedded_study
from smid.theses.hybrid.arm.exact_motion import ARM
from smid.theses.hybrid.arm.input_error import (
    INERTIA_UNIT,
    InputError,
    Motion,
    estimate_by_input_error,
    modulate_motion,
)
from smid.theses.hybrid.arm.records import SAMPLING_TIME, held_record, thesis_record
from smid.theses.hybrid.arm.traces import arm_traces, examples
from smid.theses.hybrid.arm.white import TABLE_F2_START, WhiteEstimate, estimate_white

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["SHAPES", "ArmStudy", "NetworkRuns", "alternating_runs", "arm_study", "input_error_runs", "shape_of"]

TABLE_F2 = {"euler": (22.85, 0.0028, 1.6, 0.28), "ODE23": (21.74, 0.0027, 1.6, 0.43)}
SECTION_F3 = (21.72, 21.75)  # 1/(kg m2)
SHAPES = ("right", "too smooth", "wrong", "too high")
EDGE, RIGHT = 1.5, (0.5, 1.5)  # rad/s; shares of the plant's jump
HIDDEN, SPREAD = (3,), 10.0  # of listing K.23
SPEEDS = np.linspace(-75.0, 75.0, 3001)  # rad/s, the range under one sine


@dataclass(frozen=True, eq=False, repr=False)
class NetworkRuns(Tabular):
    """1/J and networks from many starts.

    Parameters
    ----------
    theta
        Shape (n,). 1/J in 1/(kg m2).
    rmse
        Shape (n,). Of the torque, in Nm.
    networks
        From speed in 80 rad/s to torque in 16 Nm.
    """

    theta: Array
    rmse: Array
    networks: tuple[TanhNetwork, ...]

    @property
    def shapes(self) -> tuple[str, ...]:
        """Return each network's shape, see `shape_of`."""
        return tuple(shape_of(network) for network in self.networks)

    def _content(self) -> Iterator[Part]:
        counted = ", ".join(f"{self.shapes.count(shape)} {shape}" for shape in SHAPES)
        yield f"{self.theta.size} runs: 1/J from {self.theta.min():.4g} to {self.theta.max():.4g} 1/(kg m2); {counted}."

    def _rows(self) -> Iterator[dict[str, Any]]:
        columns = (self.theta.tolist(), self.rmse.tolist(), self.shapes)
        return (
            {"reciprocal_inertia": theta, "rmse": rmse, "shape": shape}
            for theta, rmse, shape in zip(*columns, strict=True)
        )

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"reciprocal_inertia": self.theta.tolist(), "rmse": self.rmse.tolist(), "shapes": list(self.shapes)}


def shape_of(network: TanhNetwork) -> str:
    """Return a network's shape, by its step from -1.5 to 1.5 rad/s compared with the plant's of 0.87 Nm.

    The shapes are `SHAPES`, figure 6.11: "right" within a half of the plant's step, "too smooth" below, "wrong" for a
    step as large in the other direction, "too high" above.

    Parameters
    ----------
    network
        From speed in 80 rad/s to torque in 16 Nm.

    Examples
    --------
    >>> shape_of(TanhNetwork((1, 1), np.array([1000.0, 0.0, -0.43 / 16, 0.0])))
    'wrong'
    """
    edges = np.array([-EDGE, EDGE])
    step = TORQUE_UNIT * np.diff(network(edges[:, None] / SPEED_UNIT))[0] / np.diff(true_friction(edges))[0]
    low, high = RIGHT
    return "wrong" if step <= -low else "too smooth" if step < low else "right" if step <= high else "too high"


def alternating_runs(seeds: Iterable[int], *, spread: float = 1.0, rounds: int = 1000) -> NetworkRuns:
    """Alternate from random weights, as listing K.22: one sine, speed and its gradient from the simulated plant.

    There is one run per seed. Weights start uniform from 0 to `spread`, in rad, s and Nm.

    Examples
    --------
    >>> alternating_runs([3], rounds=200).theta.round(1)
    array([21.7])
    """
    record = thesis_record(TABLE_F1["one_sine"])
    values, step = record.experiments[0].values, record.sampling_time
    motion = Motion(values["speed"], np.gradient(values["speed"], step), ARM["c"] * values["u"])
    hybrid = embedded_arm(HIDDEN)
    runs = [
        alternate(motion, TanhNetwork((1, *HIDDEN), random_start(hybrid, spread, seed)[1:]), rounds=rounds)
        for seed in seeds
    ]
    theta, rmse = np.array([(run.reciprocal_inertia, run.rmse) for run in runs]).T
    return NetworkRuns(theta, rmse, tuple(run.network for run in runs))


def input_error_runs(seeds: Iterable[int], *, input: str = "one_sine") -> NetworkRuns:
    """Estimate by input error, as listing K.23: J from 1, weights uniform from 0 to 10, one run per seed.

    Examples
    --------
    >>> input_error_runs([1]).theta.round(1)
    array([21.8])
    """
    problem = InputError(modulate_motion(held_record(TABLE_F1[input])), HIDDEN)
    neurons, size = HIDDEN[0], weight_count((1, *HIDDEN))
    rows, networks = [], []
    for seed in seeds:
        weights = SPREAD * np.random.default_rng(seed).uniform(size=size)
        weights[:neurons] *= SPEED_UNIT
        weights[2 * neurons :] /= TORQUE_UNIT
        found = estimate_by_input_error(problem, np.append(1.0 / INERTIA_UNIT, weights))
        rows.append((problem.reciprocal_inertia(found.theta), TORQUE_UNIT * np.sqrt(found.best)))
        networks.append(TanhNetwork(problem.sizes, found.theta[1:]))
    theta, rmse = np.array(rows).T
    return NetworkRuns(theta, rmse, tuple(networks))


@dataclass(frozen=True, eq=False, repr=False)
class ArmStudy(Chapter):
    """Section 6.3 of the thesis: the white estimates by name, and the runs of each estimation with a network."""

    title = "Hybrid models of a rotating arm"
    command = "hybrid arm"
    not_compared = (
        "The thesis judged good, moderate and bad from plots. Here a run is good if its free-run error is at most 1 % "
        "of the span, and bad beyond 10 %, over slower sines and over a voltage of another kind (figure F.8).",
        "The thesis does not state the range of its random weights in every study. Listing K.22 has 0 to 1, listing "
        "K.18 has 0 to 0.01. Both are run.",
        "The thesis does not list its filter program. Ours is the spline of order 3 at the least width.",
        "The thesis states no random seeds. Its optimiser is Matlab's of 1998.",
    )

    white: Mapping[str, WhiteEstimate]
    alternating: NetworkRuns
    input_error: NetworkRuns
    embedded: EmbeddedStudy

    @property
    def conclusion(self) -> str:
        """Return how many runs of the embedded arm are good, by way."""
        shares = []
        for way in dict.fromkeys(runs.way for runs in self.embedded.runs):
            counted = [runs for runs in self.embedded.runs if runs.way == way]
            good, total = sum(int(runs.good.sum()) for runs in counted), sum(runs.theta.size for runs in counted)
            shares.append(f"{good} of {total} ({WAYS[way].label})")
        return f"The embedded arm is right within 1 % of the span in {'; '.join(shares)} runs."

    def records(self) -> Dataset:
        """Return the arm's motion under every input of table F.1."""
        from smid.reports.chapter import together

        return together({name: held_record(sines) for name, sines in TABLE_F1.items()})

    def topics(self) -> Iterator[Topic]:
        """Return the white model, the estimates without simulation, and the embedded arm."""
        yield Topic(
            "Table F.2: the white model",
            "With Euler's method, the constants compensate the error of the integration. With the exact motion all "
            "four constants are found, also sticking, which stayed at its start value in the thesis.",
            self.white_table,
        )
        yield Topic(
            "Alternating and input error",
            "Both methods use speed and acceleration, so that no simulation is needed. Their inertia is right. Their "
            "networks have the jump at rest, no jump, or a jump in the wrong direction.",
            self.network_table,
            Drawing(self._alternating_figure, "Figure F.12: 1/J of all seeds by alternating; band: the thesis."),
            Drawing(self._networks_figure, "Figure 6.11: networks by shape."),
            Drawing(
                self._alternating_traces, "Figure F.13: the run by alternating whose torque is nearest to the plant's."
            ),
            Drawing(_filter_figure, "The modulating filter as a differentiator."),
        )
        yield Topic(
            "Table 8: the embedded arm",
            "From random weights most runs end in local minima. A search in input error needs no law of the friction "
            "and no start values. Its best points start descents that are as good as those from the proven law.",
            "Errors are those against the exact motion, over slower sines and over a voltage of another kind. The "
            "white model knows the law.",
            "Six equal sines never turn the arm backwards, so the network is arbitrary there, and its jump at rest is "
            "not that of the plant. The other kinds of voltage show what a record does not determine: under small "
            "sines the arm's drift depends on sticking, which most records do not show.",
            "The curve's error is a share of the largest friction. The whole jump at rest is 0.86 Nm, about 7 % of "
            "13 Nm, so a small share does not show that the jump is right. Its own column does.",
            "Figure 6.9: one neuron without biases has two weights. The error has a narrow, bent valley, twice, "
            "because both weights may change their signs. Beside it the error falls towards plateaus of large weights.",
            self.embedded,
            Drawing(self.embedded.plot, "1/J of every run; the line is the plant's."),
            *self._examples(),
            Drawing(
                lambda: figure_6_9().plot(),
                "Free-run error [rad] over both weights, which have no unit; the red point is the smallest error.",
            ),
        )

    def _alternating_figure(self) -> Figure:
        from smid.theses.hybrid.arm.figures import alternating_figure

        return alternating_figure(self.alternating, SECTION_F3)

    def _alternating_traces(self) -> Figure:
        from smid.theses.hybrid.arm.figures import trace_figure

        best = int(np.argmin(self.alternating.rmse))
        point = np.append(self.alternating.theta[best] / INERTIA_START, self.alternating.networks[best].weights)
        return trace_figure({"alternating": arm_traces(embedded_arm(HIDDEN, substeps=4), point, "one_sine")})

    def _examples(self) -> Iterator[Drawing]:
        """Yield figures F.4 with F.5, and F.8 with F.9, of the inputs that were run."""
        from smid.theses.hybrid.arm.figures import trace_figure

        for input, printed in (("six_unequal", "F.4 and F.5"), ("one_sine", "F.8 and F.9")):
            if found := examples(self.embedded, input):
                caption = f"Figures {printed}: trained record, validation, and the network with its neurons."
                yield Drawing(partial(trace_figure, found), caption)

    def _networks_figure(self) -> Figure:
        """Draw the best network of each shape that input error found."""
        from smid.theses.hybrid.arm.figures import friction_figure

        best: dict[str, int] = {}
        for k in np.argsort(self.input_error.rmse).tolist():
            best.setdefault(self.input_error.shapes[k], k)
        networks = {shape: self.input_error.networks[k] for shape, k in best.items()}
        curves = {shape: TORQUE_UNIT * network(SPEEDS[:, None] / SPEED_UNIT) for shape, network in networks.items()}
        return friction_figure(curves, SPEEDS)

    @property
    def white_table(self) -> Table:
        """Return table F.2."""
        header = ("parameter", "plant", "start", "thesis, Euler", "thesis, ODE23", *self.white)
        rows = tuple(
            (
                name,
                figure(ARM[name]),
                figure(start),
                *(f"{column[k]:.4g}" for column in TABLE_F2.values()),
                *(f"{found.values[name]:.4g}" for found in self.white.values()),
            )
            for k, (name, start) in enumerate(TABLE_F2_START.items())
        )
        errors = ("free run [rad]", "", "", "", "", *(figure(found.rmse) for found in self.white.values()))
        return Table("White arm, one sine (table F.2).", header, (*rows, errors), "l" + "r" * (len(header) - 1))

    @property
    def network_table(self) -> Table:
        """Return 1/J of all seeds and the counts of the networks' shapes, by alternating and input error."""
        low, high = SECTION_F3
        rows = []
        for label, runs, thesis in (
            ("alternating", self.alternating, "with and without jump"),
            ("input error", self.input_error, "good, three shapes"),
        ):
            inside = int(((runs.theta >= low) & (runs.theta <= high)).sum())
            counts = (str(runs.shapes.count(shape)) for shape in SHAPES)
            theta = (f"{value:.2f}" for value in (runs.theta.min(), np.median(runs.theta), runs.theta.max()))
            rows.append((label, *theta, f"{inside} of {runs.theta.size}", *counts, thesis))
        header = ("estimation", "least 1/J", "median", "largest", f"in {low} to {high}", *SHAPES, "thesis")
        return Table(
            f"All seeds, from random weights. The thesis found 1/J from {low} to {high} in its good solutions.",
            header,
            tuple(rows),
            "lrrrrrrrrl",
        )

    def plot(self) -> Figure:
        """Draw 1/J of every embedded run."""
        return self.embedded.plot()


def _filter_figure() -> Figure:
    from smid.theses.hybrid.arm.figures import response_figure

    return response_figure(ModulatingFilter(), SAMPLING_TIME)


def arm_study(
    starts: int = 100,
    *,
    inputs: Iterable[str] = tuple(TABLE_F1),
    ways: Iterable[str] = COMPARED,
    progress: Progress | None = None,
) -> ArmStudy:
    """Repeat section 6.3 of the thesis; `inputs` and `ways` are those of the embedded arm.

    Raises
    ------
    ModelError
        If there is no such input or way, or no start.

    Examples
    --------
    >>> from smid.models import ModelError
    >>> try:
    ...     arm_study(0)
    ... except ModelError as error:
    ...     print(error)
    starts = 0: give one or more
    """
    embedded = embedded_study(inputs, ways, starts=starts, progress=progress)
    sampled, held = thesis_record(TABLE_F1["one_sine"]), held_record(TABLE_F1["one_sine"])
    white = {
        "ours, Euler": estimate_white(sampled, "euler"),
        "ours, RK4": estimate_white(held, "rk4"),
        "ours, implicit": estimate_white(held, "rosenbrock"),
        "ours, exact": estimate_white(held, "exact"),
    }
    return ArmStudy(white, alternating_runs(range(starts)), input_error_runs(range(starts)), embedded)
