"""A sensor for any record: several structures are trained, one is chosen on other samples, a third part tests it.

1. Each structure is trained on the training part, from several starts.
2. The start and the structure of the least RMSE on the selection part are chosen. A sensor with hysteresis gets the
   further effects, and any sensor a dead zone, that lower that RMSE.
3. The selection part gives the bound of the error.
4. The test part is read once, after the choice.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType
from typing import Any

import numpy as np

from relaxations.deadline import Progress
from smid.data import DataError, Dataset
from smid.data.channel import name_hint
from smid.data.edit import slice_samples
from smid.display.result import Heading, Part, Result
from smid.display.table import Table
from smid.models import ModelError
from smid.networks.descend import Progress as Descent
from smid.sensors.bounded import MARGIN, BoundedSensor, bound_error
from smid.sensors.certified import TrainedRange, trained_range
from smid.sensors.cfpx import CFPX
from smid.sensors.check import SensorCheck, check_sensor
from smid.sensors.cpx import CPX
from smid.sensors.dead_zone import DeadZone, enforced
from smid.sensors.ptx import PTX
from smid.sensors.ptx_dynamics import EFFECTS
from smid.sensors.ptx_selection import choose_effects
from smid.sensors.px import PX
from smid.sensors.sensor import VirtualSensor, require_training_data, training_rows
from smid.sensors.trained_on import TrainedOn

__all__ = ["STRUCTURES", "Candidate", "SensorTraining", "cut_records", "train_sensor"]

STRUCTURES = ("polynomial", "network", "delays", "hysteresis")
SHARES = (0.6, 0.2)  # of each record: training, selection; the rest is the test
MOST = 5  # parameters that an effect adds at most
LEAD = 500  # samples at most, before a part or at the start of a record, over which a sensor finds its state


@dataclass(frozen=True, eq=False)
class Candidate:
    """A trained sensor, and its RMSE on the training and the selection part, in the unit of the output.

    Examples
    --------
    >>> Candidate("polynomial of order 5 in P", CFPX(5), 0.2, 0.3).selection
    0.3
    """

    name: str
    sensor: VirtualSensor
    training: float
    selection: float


@dataclass(frozen=True, eq=False, repr=False)
class SensorTraining(Result):
    """The chosen sensor, what it was chosen from, and its test.

    Parameters
    ----------
    sensor
        With the bound of its error.
    candidates
        In the order of the selection, the best first.
    notes
        What was not tried, and why.
    """

    sensor: BoundedSensor
    candidates: tuple[Candidate, ...]
    test: SensorCheck
    certified: TrainedRange
    notes: tuple[str, ...] = ()

    @property
    def table(self) -> Table:
        """Return the candidates as text."""
        unit = self.test.output.unit
        shown = f" [{unit}]" * bool(unit)
        rows = tuple(
            (c.name, str(c.sensor.n_parameters), f"{c.training:.4g}", f"{c.selection:.4g}") for c in self.candidates
        )
        header = ("structure", "parameters", f"RMSE training{shown}", f"RMSE selection{shown}")
        return Table("Structures, the best on the selection part first.", header, rows, "lrrr")

    @property
    def conclusion(self) -> str:
        """Return the choice and its test in a few sentences."""
        best = self.candidates[0]
        return (
            f"Chosen: {best.name}, {best.sensor.n_parameters} parameters. On the test part, read after the choice: "
            f"{self.test.conclusion}"
        )

    @property
    def reliability(self) -> str:
        """Return in a sentence what the error bound promises."""
        bound = self.sensor
        return (
            f"The error bound is from {bound.n_samples} samples of the selection part, widened by "
            f"{100 * bound.margin:.0f} %. Without the widening, at most {100 * bound.violation:.2g} % of further "
            "samples would lie outside on average, if samples were independent."
        )

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield from self.notes
        yield self.reliability
        yield Heading("Test")
        yield self.test
        yield Heading("Range")
        yield self.certified
        yield self.conclusion

    def to_dict(self) -> dict[str, Any]:
        """Return the errors as plain data; `save_sensor` writes the sensor."""
        return {
            "chosen": self.candidates[0].name,
            "candidates": [
                {"name": c.name, "parameters": c.sensor.n_parameters, "training": c.training, "selection": c.selection}
                for c in self.candidates
            ],
            "test": self.test.to_dict(),
            "certified": self.certified.to_dict(),
            "notes": list(self.notes),
        }


def train_sensor(
    training: Dataset,
    inputs: Sequence[str],
    output: str,
    *,
    temperature: str | None = None,
    selection: Dataset | None = None,
    test: Dataset | None = None,
    structures: Sequence[str] = STRUCTURES,
    seed: int = 1,
    starts: int = 3,
    margin: float = MARGIN,
    progress: Progress | None = None,
) -> SensorTraining:
    """Return the best of several sensors, chosen on samples that trained none, with its error bound and test.

    Parameters
    ----------
    training
        Records with the channels. Without ``selection`` and ``test``, the first 60 % of each record train, the next
        20 % choose, and the last 20 % test; with one of them, what is needed is cut off the end of each record. The
        first tenth of a record that trains or chooses, at most 500 samples, is neither fitted nor scored.
    temperature
        Channel that changes the curve and the lag, beside the inputs.
    selection, test
        Other records, in the same or in other units.
    structures
        Among "polynomial", "network" (of one input), "delays" (a network of past samples of all inputs) and
        "hysteresis".
    seed
        Of splits and starts.
    starts
        Number of random starts of each structure; the selection part chooses among them.
    margin
        Share by which the error bound is widened.

    Raises
    ------
    DataError
        If a channel is missing or does not vary, units do not match, or every structure has more parameters than
        training samples.
    ModelError
        If there is no input, or a structure is not known.
    KeyboardInterrupt
        Only before the first structure is trained; later, the choice is among those that are.

    Examples
    --------
    >>> from smid.data.bundled import load_clutch
    >>> data = load_clutch("20C_step_a").crop(0, 2000)
    >>> found = train_sensor(data, ["pressure"], "position", structures=["polynomial"])
    >>> [one.name for one in found.candidates][0], found.test.scores[0].samples
    ('polynomial of order 10 in pressure', 400)
    """
    channels = _checked(inputs, output, temperature, structures)
    training, selection, test = _parts(training, selection, test)
    require_training_data(training, channels, output)
    told = TrainedOn.of(training, channels, output)
    for part in (selection, test):
        for name in (*channels, output):
            if name not in part.names:
                raise DataError(f"{part.source or 'a record'} has no channel {name!r}; {name_hint(name, part.names)}")
        told.read(part)
    offered = [one for structure in structures for one in _offered(structure, inputs, output, temperature)]
    samples = training_rows(training).size
    small = [(name, s) for name, s in offered if s.n_parameters <= 0.7 * samples]
    notes = [
        f"not tried: {name}, with {s.n_parameters} parameters for {samples} training samples"
        for name, s in offered
        if (name, s) not in small
    ]
    if not small:
        raise DataError(f"{notes[0].removeprefix('not tried: ')}: give more samples, or fewer inputs")
    # Train each, and choose.
    candidates: list[Candidate] = []
    with _interrupts() as interrupts:
        for number, (name, sensor) in enumerate(small, 1):
            tried: list[Candidate] = []
            for start in range(starts):
                tell = _teller(progress, f"{number} of {len(small)}: {name}, start {start + 1}")
                try:
                    made = sensor.fit(training, seed=np.random.default_rng((seed, start)), starts=1, progress=tell)
                    tried.append(_scored(name, made, training, selection))
                except KeyboardInterrupt:
                    if not (candidates or tried):
                        raise
                if interrupts:
                    break
            candidates.extend(sorted(tried, key=lambda c: c.selection)[:1])
            if interrupts:
                notes.append(f"interrupted at {name}, structure {number} of {len(small)}: the others were not tried")
                break
        best = min(candidates, key=lambda c: c.selection)
        stopped = bool(interrupts)
        candidates.extend(_with_effects(best, training, selection, seed, progress, interrupts))
        best = min(candidates, key=lambda c: c.selection)
        if interrupts and not stopped:
            notes.append(f"interrupted at the effects of {best.name}: the others were not tried")
    pressure = best.sensor.channels[0]
    zoned = enforced(DeadZone(best.sensor, pressure), training)
    if zoned.threshold is not None:
        candidates.append(_scored(f"{best.name}, with dead zone of {pressure}", zoned, training, selection))
    candidates.sort(key=lambda c: c.selection)
    bounded = bound_error(candidates[0].sensor, selection, margin=margin)
    # Nothing is chosen any more.
    return SensorTraining(bounded, tuple(candidates), check_sensor(bounded, test), trained_range(bounded), tuple(notes))


def _checked(inputs: Sequence[str], output: str, temperature: str | None, structures: Sequence[str]) -> tuple[str, ...]:
    """Return the channels that are read."""
    for structure in structures:
        if structure not in STRUCTURES:
            raise ModelError(f"no structure {structure!r}; {name_hint(structure, STRUCTURES)}")
    channels = (*inputs, *([] if temperature is None else [temperature]))
    if not inputs or len({*channels, output}) < len(channels) + 1:
        raise ModelError(f"channels {', '.join((*channels, output))}: give an input at least, and each channel once")
    return channels


def _parts(training: Dataset, selection: Dataset | None, test: Dataset | None) -> tuple[Dataset, Dataset, Dataset]:
    """Return the three parts; those that are not given are cut off the end of the training records."""
    first, second = SHARES
    last = 1.0 if test is not None else first + second
    middle = last if selection is not None else first * last / (first + second)
    return (
        _run_in(cut_records(training, 0.0, middle)),
        _run_in(cut_records(training, middle, last) if selection is None else selection),
        cut_records(training, last, 1.0) if test is None else test,
    )


def _run_in(data: Dataset) -> Dataset:
    """Return records whose first tenth is run over, not scored: no plant need be at rest where its record begins."""
    tenth = min(run.n_samples for run in data.experiments) // 10
    return data.with_n_init(max(data.n_init, min(LEAD, tenth)))


def cut_records(data: Dataset, begin: float, end: float) -> Dataset:
    """Return a part of each record, after a lead-in that the sensor runs over and that is not scored.

    Parameters
    ----------
    begin, end
        Shares of the record, from 0 to 1.

    Raises
    ------
    DataError
        If a record is too short.

    Examples
    --------
    >>> from smid.data.bundled import load_clutch
    >>> part = cut_records(load_clutch("20C_step_a"), 0.6, 0.8)
    >>> part.n_samples, part.n_init
    (1500, 500)
    """
    lead = min(LEAD, *(round(begin * run.n_samples) for run in data.experiments))
    runs = []
    for run in data.experiments:
        taken = range(round(begin * run.n_samples) - lead, round(end * run.n_samples))
        if len(taken) <= lead:
            raise DataError(f"{run.name} has {run.n_samples} samples, too few for three parts: give longer records")
        runs.append(slice_samples(run, taken, data.sampling_time))
    return data.with_experiments(runs).with_n_init(lead)


def _offered(
    structure: str, inputs: Sequence[str], output: str, temperature: str | None
) -> Iterator[tuple[str, VirtualSensor]]:
    """Yield the names and untrained sensors of a structure."""
    every = (*inputs, *([] if temperature is None else [temperature]))
    if structure == "delays":
        for delays in ((1, 2), (0, 1)):
            words = " and ".join(map(str, delays))
            yield f"network of {', '.join(every)}, delays {words}", CPX(inputs=every, delays=delays, output=output)
        return
    for name in inputs:
        if structure == "polynomial":
            for order in (5, 10, 20):
                yield f"polynomial of order {order} in {name}", CFPX(order, pressure=name, output=output)
        elif structure == "network":
            yield f"network of {name}", PX(pressure=name, output=output)
        else:
            for plays in (1, 2):
                words = "1 play" if plays == 1 else f"{plays} plays"
                warm = "" if temperature is None else f" and {temperature}"
                yield (
                    f"hysteresis of {name}{warm}, {words}",
                    PTX(plays=plays, pressure=name, temperature=temperature, output=output),
                )


def _with_effects(
    best: Candidate,
    training: Dataset,
    selection: Dataset,
    seed: int,
    progress: Progress | None,
    interrupts: Sequence[int],
) -> Iterator[Candidate]:
    """Yield a sensor with hysteresis after each effect that was offered; an effect that does not serve is left out."""
    if not isinstance(best.sensor, PTX):
        return
    for effect in EFFECTS:
        if interrupts or best.sensor.n_parameters + MOST > 0.7 * training_rows(training).size:
            return
        tell = _teller(progress, f"{best.name}, with {effect}")
        try:
            chosen = choose_effects(best.sensor, training, selection, effects=[effect], seed=seed, progress=tell).sensor
        except KeyboardInterrupt:
            return
        if chosen.effects != best.sensor.effects:
            best = _scored(f"{best.name}, with {effect}", chosen, training, selection)
            yield best


@contextmanager
def _interrupts() -> Iterator[list[int]]:
    """Collect interrupts from the keyboard: a descent returns its best point, and does not pass them on."""
    found: list[int] = []
    if threading.current_thread() is not threading.main_thread():  # only there a handler can be set
        yield found
        return

    def note(number: int, frame: FrameType | None) -> None:
        found.append(number)
        signal.default_int_handler(number, frame)

    before = {one: signal.signal(one, note) for one in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield found
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)


def _scored(name: str, sensor: VirtualSensor, training: Dataset, selection: Dataset) -> Candidate:
    errors = (float(np.sqrt(sensor.predict(part).mse(part))) for part in (training, selection))
    return Candidate(name, sensor, *errors)


def _teller(progress: Progress | None, name: str) -> Any:
    if progress is None:
        return None

    def tell(now: Descent) -> None:
        progress(f"{name}: step {now.iteration}")

    return tell
