"""Intervals over a long record, proven on the windows of it that hold their ends."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.deadline import STOPS, Progress, stopped_by
from relaxations.moments.parametric_lift import complicating_variables
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.method import Cuts
from relaxations.search.enclosure import Enclosure, Reason
from smid.data import DataError, Dataset
from smid.data.window import Window, cut_all, windows_before
from smid.feasible.feasible_set import FeasibleSet
from smid.feasible.template import Templates
from smid.fitting.problem import Fitting
from smid.identification.encloser import (
    Certified,
    Enclosed,
    Settings,
    is_tight,
    nearest_witness,
    where_open,
    with_inner_ends,
)
from smid.identification.estimate import CentreStatus
from smid.identification.piecewise import TOLERANCE, Piecewise
from smid.identification.polynomial import Polynomial
from smid.identification.windows.free_runs import FreeRuns
from smid.identification.windows.noise_programs import NoisePrograms
from smid.identification.windows.search import Search
from smid.identification.windows.whole_record import WholeRecord, suits
from smid.models import Model

LONG = 1000
"""Samples from which windows are the default."""

MOST, MOST_NOISY, MOST_PIECEWISE = 20_000, 5000, 400
"""Samples of all windows together, those where inputs are noisy, and with kinks: beyond, a proof takes minutes."""

_FEW = 600
"""Noises of which cuts alone bound all parameters of several poles sooner, and in shorter files, than the lift."""

_SHARE = 0.5  # of the record: larger windows gain nothing
_GROWTHS = 3  # of the windows, each twice as long


def has_windows(model: Model, data: Dataset) -> bool:
    """Return whether a record is long, and its model one whose runs can be searched and verified."""
    if data.n_samples < LONG or not suits(Templates.of(model)):
        return False
    if inputs_are_noisy(model):
        return not any(data.missing[channel] for channel in model.channels)
    return Fitting(model, data, [np.zeros(run.n_samples, bool) for run in data.experiments]).frees_initial


def inputs_are_noisy(model: Model) -> bool:
    """Return whether an input has noise."""
    return any(m.noise is not None and m.signal in model.inputs for m in model.measurements)


class Windowed:
    """Encloses a set by windows; where they would be most of the record, by all of it."""

    def __init__(
        self, model: Model, data: Dataset, bounds: Mapping[str, float], settings: Settings, kept: bool
    ) -> None:
        self.model, self.data, self.bounds, self.settings, self.kept = model, data, bounds, settings, kept
        self._windows: tuple[Window, ...] = ()
        self._whole = WholeRecord(Templates.of(model), data)
        self._most = MOST_NOISY if inputs_are_noisy(model) else MOST
        if self._whole.templates.hinges:
            self._most = MOST_PIECEWISE
            self.settings = replace(settings, tolerance=max(settings.tolerance, 2 * TOLERANCE))
        self._lag = max(line.max_lag for line in self._whole.templates.lines)
        self._inner: Polynomial | Piecewise | None = None
        self._search: Search | None = None
        self._fitting: tuple[Array, ...] = ()  # parameters that are verified to fit all samples
        self._say: Progress = settings.progress or (lambda _: None)

    def enclose(self) -> Enclosed:
        """Return the intervals of the parameters; their inner ends fit the whole record."""
        began, tolerance = time.perf_counter(), self.settings.tolerance / 4
        try:
            self._search = self._begun()
            held = self._search.held(tolerance)
        except STOPS as stop:
            return Enclosed(None, Reason[stopped_by(stop)])
        except DataError:  # no run stays finite, or the windows leave a parameter without a box
            return self._proven_on(())
        self._fitting, places = held.fitting, held.places
        # Prove the intervals on windows, which grow until the ends meet verified runs.
        best: Enclosed | None = None
        for growth in range(_GROWTHS + 1):
            windows, short = self._windows_of(places, held.length << growth)
            if not windows or (short and best is not None):
                break
            try:
                found = self._proven_on(windows)
            except DataError:  # an input that stands still in short windows
                continue
            if found.enclosure is None or found.enclosure.empty is not None:
                return found
            best = self._met(found, found.enclosure, short, time.perf_counter() - began)
            # Where the proof met points that fit these windows, ask the whole record about them; lengthen the windows.
            if best.reason is not Reason.ROUNDS or found.reason is not Reason.TIGHT:
                return best
            try:
                for point in self._beyond(found.enclosure):
                    near, objecting = self._search.near(self._values(point), tolerance)
                    self._fitting, places = (*self._fitting, *near), np.concatenate([places, objecting])
            except STOPS as stop:
                proven = replace(found.enclosure, reason=Reason[stopped_by(stop)])
                return self._met(found, proven, short, time.perf_counter() - began)
            best = self._met(found, found.enclosure, short, time.perf_counter() - began)
            if best.reason is Reason.TIGHT:
                return best
        return best if best is not None and self._fitting else self._proven_on(())

    def _begun(self) -> Search:
        common = (self.model, self.data, self.bounds, self._whole, self._say)
        return NoisePrograms(*common, self.settings.solver) if inputs_are_noisy(self.model) else FreeRuns(*common)

    def _windows_of(self, places: Index, length: int) -> tuple[tuple[Window, ...], bool]:
        """Return windows of at most so many samples, and whether they are shorter than asked; none for all samples."""
        # Samples before the first equation are read by it.
        places, asked = np.maximum(places, [0, self._lag]), length
        while sum(map(len, windows := windows_before(places, length))) > self._most and length > 1:
            length //= 2
        if self.data.n_samples <= self._most and sum(map(len, windows)) > _SHARE * self.data.n_samples:
            return (), False
        return windows, length < asked

    def _values(self, point: Array) -> dict[str, float]:
        """Return the values of the parameters, the first entries of a point."""
        return {p.name: float(value) for p, value in zip(self.model.parameters, point, strict=False)}

    def _proven_on(self, windows: tuple[Window, ...]) -> Enclosed:
        data = cut_all(self.data, windows) if windows else self.data
        # One half of the tolerance is for the proof, the other for what windows leave open.
        settings = replace(self.settings, tolerance=self.settings.tolerance / 2)
        feasible = FeasibleSet(self.model, data, self.bounds)
        if windows and not feasible.openings and _suits_cuts(feasible.problem):
            settings = replace(settings, method=Cuts.name)
        self._inner = (Piecewise if feasible.openings else Polynomial)(feasible, settings, self.kept)
        self._windows = windows
        self._say(f"proof on {data.n_samples} of {self.data.n_samples} samples")
        return replace(self._inner.enclose(), windows=windows)

    def _met(self, found: Enclosed, enclosure: Enclosure, short: bool, seconds: float) -> Enclosed:
        """Return proven intervals with inner ends that fit the whole record."""
        intervals, reason = with_inner_ends(enclosure.intervals, self._fitting), enclosure.reason
        if reason in (Reason.TIGHT, Reason.STALLED, Reason.ROUNDS):
            tight = all(is_tight(interval, self.settings.tolerance) for interval in intervals)
            reason = Reason.TIGHT if tight else Reason.WINDOWS if short else where_open(reason)
        met = replace(enclosure, intervals=intervals, witnesses=self._fitting, reason=reason, seconds=seconds)
        return replace(found, enclosure=met, reason=reason)

    def _beyond(self, enclosure: Enclosure) -> list[Array]:
        """Return the outermost points that fit the windows, at the ends that no verified parameters meet."""
        points = np.array(enclosure.witnesses)
        intervals = with_inner_ends(enclosure.intervals, self._fitting)
        loose = [k for k, interval in enumerate(intervals) if not is_tight(interval, self.settings.tolerance)]
        return [points[np.argmin(sign * points[:, k])] for k in loose for sign in (1, -1)]

    def certified(self, found: Enclosed) -> Certified:
        """Return the proof on the windows as a certificate, which states them."""
        if self._inner is None:
            return Certified(found, ())
        origin = {"windows": [window.to_dict() for window in self._windows]}
        inner = self._inner.certified(found).certificates
        return Certified(found, tuple({**content, "origin": origin} for content in inner))

    def centre(self, enclosure: Enclosure) -> tuple[CentreStatus, Array | None]:
        """Decide whether the centres fit the whole record; where not, return the nearest parameters that do."""
        assert self._inner is not None
        if not self._windows:
            return self._inner.centre(enclosure)
        assert self._search is not None
        if self._search.fits({i.name: i.centre for i in enclosure.intervals}):
            return CentreStatus.FEASIBLE, None
        status = self._inner.status(enclosure)
        # What fits the windows may not fit the whole record.
        return CentreStatus.UNDECIDED if status is CentreStatus.FEASIBLE else status, nearest_witness(enclosure)


def _suits_cuts(problem: PolynomialProblem) -> bool:
    """Return whether cuts alone serve: few noises, and more than the one pole for which the lift is exact."""
    few = complicating_variables(problem)
    return few is not None and len(few) > 1 and problem.n_variables <= _FEW
