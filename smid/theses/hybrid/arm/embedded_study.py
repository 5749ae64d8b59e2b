"""The embedded arm from many starts: how many runs are right, with the thesis's method and ours (table 8).

A *way* sets the record, the integration, the number of neurons and the start. The thesis: Euler's method for plant and
model, every tenth sample, three neurons, 1/J from 16 and random weights. Ours: exact motion under held voltage, a
linearly implicit scheme that also follows sticking, five neurons, and one of five starts. Three contain no law of the
friction: random weights; the best of a global search in input error; the best of local descents in input error, of
which one neuron starts as a jump at rest. Two contain the law: the estimated white model, and the centres of its
certified intervals. All starts of a way are trained in lockstep.

Every model is run freely over two validation records, without noise and within the speeds of the training: slower
sines of the same kind, and a voltage of another kind (one sine for a sum, a sum for one sine). Both are the exact
motion of the arm, for all ways. The RMSE is a share of the span of the record's angle. The worse of the two decides:

    good: at most 1 %        moderate: at most 10 %        bad: above

The thesis judged by eye, from plots. The white model beside each way knows the law, and its four constants are
estimated from the same voltage and noise by the exact motion.

Reference: hybrid thesis, section 6.3.2, table 8, appendix F.1, figures F.3, F.4, F.7 and F.8.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from relaxations.algebra.arrays import Array
from relaxations.deadline import Progress
from smid.data import Dataset
from smid.display.result import Part, Tabular, plain
from smid.display.table import Table, figure
from smid.models import ModelError
from smid.models.errors import refuse_unknown
from smid.signals import TABLE_F1
from smid.theses.hybrid.arm.embedded_arm import (
    INERTIA_START,
    embedded_arm,
    embedded_error,
    friction_curve,
    random_start,
    true_friction,
)
from smid.theses.hybrid.arm.exact_motion import ARM
from smid.theses.hybrid.arm.friction_start import certified_start, white_start
from smid.theses.hybrid.arm.global_start import global_start, multistart_start
from smid.theses.hybrid.arm.input_error import modulate_motion, quiet_filter
from smid.theses.hybrid.arm.records import held_record, other_kind, slower, thesis_record
from smid.theses.hybrid.arm.white import estimate_white, white_free_run

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["COMPARED", "TABLE_8", "WAYS", "EmbeddedRuns", "EmbeddedStudy", "Way", "embedded_study", "run_embedded"]

GOOD, MODERATE, EXACT = 0.01, 0.1, 1e-9  # of the span
EVALUATIONS, AT_REST = 100, 1.5  # rad/s beyond which a jump is over
HIDDEN = 5
STIFF = "rosenbrock"  # sticking has a rate of 870 1/s; where the arm sticks for long, short steps are more accurate
ENCODER = 0.002  # rad, the least noise bound that the intervals are proven for

TABLE_8: dict[str, str] = {
    "one_sine": "5/9/15, 5/8/7, 12/0/7",
    "six_equal": "8/0/10",
    "six_one_negative": "7/4/9",
    "six_two_negative": "1/3/16",
    "eleven_equal": "0/0/20",
    "six_signs": "0/0/20",
    "six_unequal": "24/20/56",
}
"""Good/moderate/bad runs in the thesis."""


@dataclass(frozen=True)
class Way:
    """A record, an integration and a start for the embedded arm.

    Parameters
    ----------
    record
        Function that makes a record.
    scheme, substeps
        Of the integration of the models.
    hidden
        Number of neurons.
    starts
        Function that returns the starts, shape (B, p).

    Examples
    --------
    >>> WAYS["small"].hidden
    3
    """

    label: str
    record: Callable[..., Dataset]
    scheme: str
    hidden: int
    starts: Callable[[Dataset, float, Sequence[int]], Array]
    substeps: int = 1


def _random(neurons: int, spread: float) -> Callable[[Dataset, float, Sequence[int]], Array]:
    hybrid = embedded_arm((neurons,))
    return lambda _data, _bound, seeds: np.array([random_start(hybrid, spread, seed) for seed in seeds])


def _by_input_error(start: Callable[..., Array]) -> Callable[[Dataset, float, Sequence[int]], Array]:
    def starts(data: Dataset, bound: float, seeds: Sequence[int]) -> Array:
        motion = modulate_motion(data, quiet_filter(bound, data.sampling_time))
        judge = embedded_error(embedded_arm((HIDDEN,), scheme=STIFF), data).errors
        return np.array([start(motion, HIDDEN, judge=judge, seed=seed) for seed in seeds])

    return starts


def _proven(data: Dataset, bound: float, seeds: Sequence[int]) -> Array:
    return certified_start(data, max(bound, ENCODER), HIDDEN, seeds=seeds)


def _white(data: Dataset, _bound: float, seeds: Sequence[int]) -> Array:
    return white_start(data, HIDDEN, seeds=seeds)


WAYS: dict[str, Way] = {
    "random": Way("thesis, weights 0 to 1", thesis_record, "euler", 3, _random(3, 1.0)),
    "small": Way("thesis, weights 0 to 0.01", thesis_record, "euler", 3, _random(3, 0.01)),
    "local": Way("ours, but weights 0 to 1", held_record, STIFF, HIDDEN, _random(HIDDEN, 1.0)),
    "global": Way("ours, no law: global search", held_record, STIFF, HIDDEN, _by_input_error(global_start)),
    "multistart": Way("ours, no law but a jump", held_record, STIFF, HIDDEN, _by_input_error(multistart_start)),
    "white": Way("with the law, estimated", held_record, STIFF, HIDDEN, _white),
    "certified": Way("with the law, proven", held_record, STIFF, HIDDEN, _proven),
    "stepped": Way(
        "ours, no law, RK4 in 16 steps", held_record, "rk4", HIDDEN, _by_input_error(global_start), substeps=16
    ),
}


COMPARED = ("global", "multistart", "certified", "local", "random", "small")
"""The ways of a study by default, those without a law first."""


@dataclass(frozen=True, eq=False, repr=False)
class EmbeddedRuns(Tabular):
    """One way on one input, from many starts.

    Parameters
    ----------
    theta
        Shape (n,). 1/J of each run, in 1/(kg m2).
    training
        Shape (n,). Free-run RMSE in rad; infinite where the run diverges.
    validation
        Shape (n, 2). Free-run RMSE over slower sines and over a voltage of another kind, as shares of the spans.
    white
        Shape (2,). The same of the white model, estimated and simulated by its exact motion.
    curve
        Shape (n,). Largest error of the friction curve over the visited speeds, relative to the largest friction.
    jump
        Shape (n,). The network's step from -1.5 to 1.5 rad/s relative to the plant's.
    points
        Shape (n, p). What was found, as `embedded_error` has it.
    """

    input: str
    way: str
    theta: Array
    training: Array
    validation: Array
    white: Array
    curve: Array
    jump: Array
    points: Array

    @property
    def good(self) -> NDArray[np.bool_]:
        """Return which runs are right within 1 % of both spans."""
        return np.asarray(self.validation.max(axis=1) <= GOOD)

    @property
    def bad(self) -> NDArray[np.bool_]:
        """Return which runs miss one of the spans by more than 10 %."""
        return np.asarray(~(self.validation.max(axis=1) <= MODERATE))

    @property
    def counts(self) -> tuple[int, int, int]:
        """Return the numbers of good, moderate and bad runs."""
        good, bad = int(self.good.sum()), int(self.bad.sum())
        return good, self.theta.size - good - bad, bad

    def _content(self) -> Iterator[Part]:
        counts = "/".join(map(str, self.counts))
        yield f"{self.input}, {WAYS[self.way].label}: {counts} of {self.theta.size} runs good/moderate/bad."

    def _rows(self) -> Iterator[dict[str, Any]]:
        columns = {
            "reciprocal_inertia": self.theta,
            "slower_error": self.validation[:, 0],
            "other_error": self.validation[:, 1],
            "curve_error": self.curve,
            "jump": self.jump,
        }
        for numbers in zip(*(values.tolist() for values in columns.values()), strict=True):
            yield {"input": self.input, "way": self.way, **dict(zip(columns, numbers, strict=True))}


@dataclass(frozen=True, eq=False, repr=False)
class EmbeddedStudy(Tabular):
    """Several ways on several inputs."""

    runs: tuple[EmbeddedRuns, ...]

    @property
    def table(self) -> Table:
        """Return table 8, with the thesis's numbers."""
        judged = ("input", "way", "good/moderate/bad", "thesis", "1/J")
        header = (*judged, "slower", "other kind", "white", "curve", "jump")
        rows = []
        for runs in self.runs:
            shown = runs.good if runs.good.any() else ~runs.bad
            middle = np.median(runs.validation, axis=0)
            rows.append(
                (
                    runs.input,
                    WAYS[runs.way].label,
                    "/".join(map(str, runs.counts)),
                    TABLE_8[runs.input] if runs.way in ("random", "small") else "",
                    f"{runs.theta[shown].min():.2f} to {runs.theta[shown].max():.2f}" if shown.any() else "all bad",
                    *(f"{100 * share if share > EXACT else 0.0:.2g} %" for share in (*middle, runs.white.max())),
                    f"{100 * np.median(runs.curve[shown]):.1f} %" if shown.any() else "all bad",
                    figure(float(np.median(runs.jump[shown]))) if shown.any() else "all bad",
                )
            )
        caption = (
            "Embedded arm, plant's 1/J = 21.7391. Medians of free-run errors over slower sines and over a voltage of "
            "another kind, and the white model's larger one, as shares of the span; largest error of the friction "
            "curve, and its jump at rest over the plant's. These two and 1/J are of the good runs, or of the moderate "
            "ones where none is good."
        )
        return Table(caption, header, tuple(rows), "llrrlrrrrr")

    def _content(self) -> Iterator[Part]:
        yield self.table

    def _rows(self) -> Iterator[dict[str, Any]]:
        """Return a row for each run."""
        for runs in self.runs:
            yield from runs._rows()

    def plot(self) -> Figure:
        """Draw 1/J of every run, as figures F.3 and F.7: good, moderate and bad ones apart."""
        from smid.theses.hybrid.arm.figures import inertia_figure

        return inertia_figure(self)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "runs": [
                {
                    "input": runs.input,
                    "way": runs.way,
                    "counts": dict(zip(("good", "moderate", "bad"), runs.counts, strict=True)),
                    "thesis": TABLE_8[runs.input],
                    "white_error": runs.white.tolist(),
                    "reciprocal_inertia": runs.theta.tolist(),
                    "validation_error": plain(runs.validation),
                    "curve_error": runs.curve.tolist(),
                    "jump": runs.jump.tolist(),
                }
                for runs in self.runs
            ]
        }


def run_embedded(
    name: str,
    way: str,
    seeds: Iterable[int],
    *,
    noise_bound: float = 0.0,
    noise_seed: int | None = None,
    duration: float = 10.0,
) -> EmbeddedRuns:
    """Estimate the embedded arm from many starts, in lockstep.

    Parameters
    ----------
    name
        Input, from `smid.signals.TABLE_F1`.
    way
        From `WAYS`.
    seeds
        One run for each.
    noise_bound
        Of the record's angle, in rad; the noise is uniform. The validation records have no noise.
    noise_seed
        Needed if there is noise.
    duration
        Of the record, in seconds.

    Raises
    ------
    ModelError
        If there is no such input or way.

    Examples
    --------
    >>> run_embedded("one_sine", "small", [1]).theta.round(1)
    array([21.])
    """
    refuse_unknown("input", [name], TABLE_F1)
    refuse_unknown("way", [way], WAYS)
    chosen = WAYS[way]
    made: dict[str, Any] = {"noise_bound": noise_bound, "seed": noise_seed, "duration": duration}
    record = chosen.record(TABLE_F1[name], **made)
    checks, spans = _checks(name)
    # Train all starts on the record.
    hybrid = embedded_arm((chosen.hidden,), scheme=chosen.scheme, substeps=chosen.substeps)
    problem = embedded_error(hybrid, record)
    found = problem.lower(chosen.starts(record, noise_bound, list(seeds)), evaluations=EVALUATIONS)
    # Compare the networks with the plant's friction over the visited speeds, and at rest.
    speed = record.experiments[0].values["speed"]
    visited = speed[np.abs(speed) > ARM["eps"]]
    wanted, edges = true_friction(visited), np.array([-AT_REST, AT_REST])
    curves, jumps = [], []
    for values in map(problem.values, found):
        curves.append(np.abs(friction_curve(hybrid, values, visited) - wanted).max() / np.abs(wanted).max())
        jumps.append(np.diff(friction_curve(hybrid, values, edges))[0] / np.diff(true_friction(edges))[0])
    return EmbeddedRuns(
        name,
        way,
        INERTIA_START * found[:, 0],
        np.sqrt(problem.errors(found)),
        np.sqrt([embedded_error(hybrid, check).errors(found) for check in checks]).T / spans,
        _white_errors(name, noise_bound, noise_seed, duration),
        np.array(curves),
        np.array(jumps),
        found,
    )


def embedded_study(
    inputs: Iterable[str] = tuple(TABLE_F1),
    ways: Iterable[str] = COMPARED,
    *,
    starts: int = 100,
    progress: Progress | None = None,
) -> EmbeddedStudy:
    """Run several ways of `WAYS` on several inputs of `TABLE_F1`, from so many starts each.

    Raises
    ------
    ModelError
        If there is no such input or way, or no start.

    Examples
    --------
    >>> study = embedded_study(["one_sine"], ["small"], starts=1)
    >>> [(runs.input, runs.way) for runs in study.runs]
    [('one_sine', 'small')]
    """
    chosen, names = tuple(ways), tuple(inputs)
    refuse_unknown("input", names, TABLE_F1)
    refuse_unknown("way", chosen, WAYS)
    if starts < 1:
        raise ModelError(f"starts = {starts}: give one or more")
    done = []
    for name in names:
        for way in chosen:
            if progress is not None:
                progress(f"embedded arm: {name}, {WAYS[way].label}")
            done.append(run_embedded(name, way, range(starts)))
    return EmbeddedStudy(tuple(done))


def _checks(name: str) -> tuple[list[Dataset], Array]:
    """Return the validation records of an input, and the spans of their angles."""
    checks = [held_record(u) for u in (slower(TABLE_F1[name]), other_kind(TABLE_F1[name]))]
    return checks, np.array([np.ptp(check.experiments[0].values["y"]) for check in checks])


@lru_cache(maxsize=64)  # every way on an input has the same
def _white_errors(name: str, noise_bound: float, noise_seed: int | None, duration: float) -> Array:
    record = held_record(TABLE_F1[name], noise_bound=noise_bound, seed=noise_seed, duration=duration)
    values = estimate_white(record).values
    checks, spans = _checks(name)
    missed = [white_free_run(values, check) - check.experiments[0].values["y"] for check in checks]
    shares = np.asarray(np.sqrt(np.mean(np.square(missed), axis=1)) / spans)
    shares.setflags(write=False)
    return shares
