"""The hybrid thesis's section 6.3 on the simulated arm, study by study, ours beside its numbers.

- white: all four constants, by Euler's method as in table F.2 and by the exact motion;
- alternating: 1/J and the network by turns, from random weights (section 6.3.4);
- input error: 1/J, and the three shapes of the network (section 6.3.5, figure 6.11);
- embedded: table 8.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from smid.display.result import Part, Result, Tabular
from smid.display.table import Table, figure
from smid.networks import Array, TanhNetwork, weight_count
from smid.signals import TABLE_F1
from smid.theses.hybrid.arm.alternating import alternate
from smid.theses.hybrid.arm.embedded_arm import (
    SPEED_UNIT,
    TORQUE_UNIT,
    embedded_arm,
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
from smid.theses.hybrid.arm.records import held_record, thesis_record
from smid.theses.hybrid.arm.white import TABLE_F2_START, WhiteEstimate, estimate_white

__all__ = ["SHAPES", "ArmStudy", "NetworkRuns", "alternating_runs", "arm_study", "input_error_runs", "shape_of"]

TABLE_F2 = {"euler": (22.85, 0.0028, 1.6, 0.28), "ODE23": (21.74, 0.0027, 1.6, 0.43)}
SHAPES = ("right", "too smooth", "wrong", "too high")
EDGE, RIGHT = 1.5, (0.5, 1.5)  # rad/s; shares of the plant's jump
HIDDEN, SPREAD = (3,), 10.0  # of listing K.23


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
        """Each network's shape, see `shape_of`."""
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
    """Tell a network's shape by its step from -1.5 to 1.5 rad/s, beside the plant's of 0.87 Nm.

    Parameters
    ----------
    network
        From speed in 80 rad/s to torque in 16 Nm.

    Returns
    -------
    str
        Of `SHAPES`, figure 6.11: "right" within a half of the plant's step, "too smooth" below, "wrong" where as large
        a step goes down, "too high" beyond.

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
    """Alternate from random weights, as listing K.22: one sine, speed and its gradient off the simulated plant.

    Parameters
    ----------
    seeds
        One run for each.
    spread
        Weights begin uniform from 0 to this, in rad, s and Nm.
    rounds
        Most rounds of each run.

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
    """Estimate by input error from random weights, as listing K.23: J from 1, weights from 0 to 10.

    Parameters
    ----------
    seeds
        One run for each.
    input
        Of `smid.signals.TABLE_F1`.

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
class ArmStudy(Result):
    """Section 6.3, ours beside the thesis.

    Parameters
    ----------
    white
        By what was estimated how.

    Examples
    --------
    >>> sorted(ArmStudy.__dataclass_fields__)
    ['alternating', 'embedded', 'input_error', 'white']
    """

    white: Mapping[str, WhiteEstimate]
    alternating: NetworkRuns
    input_error: NetworkRuns
    embedded: EmbeddedStudy

    @property
    def conclusion(self) -> str:
        """Say how often the embedded arm comes out right."""
        shares = []
        for way in dict.fromkeys(runs.way for runs in self.embedded.runs):
            counted = [runs for runs in self.embedded.runs if runs.way == way]
            good, total = sum(int(runs.good.sum()) for runs in counted), sum(runs.theta.size for runs in counted)
            shares.append(f"{good} of {total} ({WAYS[way].label})")
        return f"The embedded arm is no worse than the white model in {'; '.join(shares)} runs."

    @property
    def white_table(self) -> Table:
        """Table F.2."""
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
        """Alternating and input error: 1/J, and the networks' shapes counted."""
        rows = []
        for label, runs, thesis in (
            ("alternating", self.alternating, "21.72 to 21.75, with and without jump"),
            ("input error", self.input_error, "good, three shapes"),
        ):
            fine = runs.rmse <= 2.0 * np.median(np.sort(runs.rmse)[: max(1, runs.rmse.size // 2)])
            counts = (str(runs.shapes.count(shape)) for shape in SHAPES)
            rows.append(
                (
                    label,
                    f"{runs.theta[fine].min():.2f} to {runs.theta[fine].max():.2f}",
                    f"{fine.sum()} of {fine.size}",
                    *counts,
                    thesis,
                )
            )
        header = ("estimation", "1/J when good", "good", *SHAPES, "thesis")
        return Table(
            "From random weights; good: torque error at most twice the median of the better half.",
            header,
            tuple(rows),
            "llrrrrrl",
        )

    def _content(self) -> Iterator[Part]:
        yield self.conclusion
        yield self.white_table
        yield self.network_table
        yield self.embedded

    def plot(self) -> Figure:
        """Draw 1/J of every embedded run."""
        return self.embedded.plot()

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "white": {
                name: {"values": dict(found.values), "integration": found.integration, "rmse": found.rmse}
                for name, found in self.white.items()
            },
            "alternating": self.alternating.to_dict(),
            "input_error": self.input_error.to_dict(),
            "embedded": self.embedded.to_dict(),
        }


def arm_study(
    starts: int = 100,
    *,
    inputs: Iterable[str] = tuple(TABLE_F1),
    ways: Iterable[str] = COMPARED,
    progress: Callable[[str], None] | None = None,
) -> ArmStudy:
    """Repeat section 6.3.

    Parameters
    ----------
    starts
        Random starts of every estimation with a network.
    inputs
        Of the embedded arm, from `smid.signals.TABLE_F1`.
    ways
        Of the embedded arm, from `WAYS`.
    progress
        Told what is run next.

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
        "ours, exact": estimate_white(held, "exact"),
    }
    return ArmStudy(white, alternating_runs(range(starts)), input_error_runs(range(starts)), embedded)
