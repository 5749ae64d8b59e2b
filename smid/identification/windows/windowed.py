"""Intervals over a long record, proven on the windows of it that hold their ends."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.deadline import STOPS, Progress, stopped_by
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.proof_steps import Step
from relaxations.search.enclosure import Enclosure, Interval, Reason
from relaxations.search.interval_state import allowed_gap
from smid.data import DataError, Dataset
from smid.data.window import Window, cut_all
from smid.feasible.feasible_set import FeasibleSet
from smid.feasible.template import Templates
from smid.fitting.fit import Fitting
from smid.identification.encloser import Enclosed, Settings, nearest_witness
from smid.identification.estimate import CentreStatus
from smid.identification.polynomial import Polynomial, centre_status
from smid.identification.windows.scan import Scan, best_run
from smid.identification.windows.whole_record import WholeRecord, suits
from smid.models import Model

LONG = 2000
"""Samples from which windows are the default."""

MOST = 5000
"""Samples of all windows together: beyond, a proof takes minutes."""

_SHARE = 0.5  # of the record: larger windows gain nothing
_GROWTHS = 3  # of the windows, each twice as long
_BACK = (0.0, 1e-6, 1e-3)  # shares of the way to a run inside, tried until a run is verified


def has_windows(model: Model, data: Dataset) -> bool:
    """Return whether a record is long, and its model one whose runs can be scanned and verified."""
    if data.n_samples < LONG or not suits(Templates.of(model)):
        return False
    return Fitting(model, data, [np.zeros(run.n_samples, bool) for run in data.experiments]).frees_initial


class Windowed:
    """Encloses a set by windows; where they would be most of the record, by all of it."""

    def __init__(
        self, model: Model, data: Dataset, bounds: Mapping[str, float], settings: Settings, kept: bool
    ) -> None:
        self.model, self.data, self.bounds, self.settings, self.kept = model, data, bounds, settings, kept
        self._windows: tuple[Window, ...] = ()
        self._whole = WholeRecord(Templates.of(model), data)
        self._inner: Polynomial | None = None
        self._fitting: list[Array] = []  # parameters that are verified to fit all samples
        self._say: Progress = settings.progress or (lambda _: None)

    def enclose(self) -> Enclosed:
        """Return the intervals of the parameters; their inner ends fit the whole record."""
        began = time.perf_counter()
        try:
            scan = Scan(self.model, self.data, self.bounds)
            rows, length = self._scanned(scan)
        except STOPS as stop:
            return Enclosed(None, Reason[stopped_by(stop)])
        except DataError:  # no run stays finite
            return self._proven_on(())
        # Prove the intervals on windows, which grow until the ends meet verified runs.
        best: Enclosed | None = None
        for growth in range(_GROWTHS + 1):
            windows, short = self._windows_of(scan, rows, length << growth)
            if not windows or (short and best is not None):
                break
            try:
                found = self._proven_on(windows)
            except DataError:  # an input that stands still in short windows
                continue
            if found.enclosure is None or found.enclosure.empty is not None:
                return found
            best = self._met(found, found.enclosure, short, time.perf_counter() - began)
            # Longer windows help only where the proof met points that fit these windows, and not the whole record.
            if best.reason is not Reason.ROUNDS or found.reason is not Reason.TIGHT:
                return best
            rows = np.union1d(rows, self._objecting(scan, found.enclosure))
        return best if best is not None and self._fitting else self._proven_on(())

    def _windows_of(self, scan: Scan, rows: Index, length: int) -> tuple[tuple[Window, ...], bool]:
        """Return windows of at most so many samples, and whether they are shorter than asked; none for all samples."""
        asked = length
        while sum(map(len, windows := scan.windows(rows, length))) > MOST and length > 1:
            length //= 2
        if self.data.n_samples <= MOST and sum(map(len, windows)) > _SHARE * self.data.n_samples:
            return (), False
        return windows, length < asked

    def _scanned(self, scan: Scan) -> tuple[Index, int]:
        """Return the errors that hold the ends, and how many samples before them count."""
        self._say(f"least error of a free run: {scan.least:.6f} times the noise bound")
        tolerance = self.settings.tolerance / 4
        if scan.least >= 1.0:
            return scan.least_rows, scan.memory(tolerance)
        self._verify(scan, scan.inside)
        held, effects = [scan.least_rows], []
        for name in scan.free:
            ends = [scan.extreme(name, sign) for sign in (1, -1)]
            self._say(f"{name} between {ends[0].value:.6g} and {ends[1].value:.6g}, by linear programs")
            for end in ends:
                self._verify(scan, end.vector)
                held.append(end.rows)
            effects.append(scan.difference(*ends))
        return np.unique(np.concatenate(held)), scan.memory(tolerance * min(effects, default=1.0))

    def _verify(self, scan: Scan, vector: Array) -> None:
        """Keep the parameters of a run, or of one nearer to the run inside, that are verified to fit all samples."""
        for share in _BACK:
            moved = vector + share * (scan.inside - vector)
            values = scan.values(moved)
            if self._whole.holds(values, scan.problem.simulate(moved), self.bounds):
                self._fitting.append(np.array([values[p.name] for p in self.model.parameters]))
                return

    def _proven_on(self, windows: tuple[Window, ...]) -> Enclosed:
        data = cut_all(self.data, windows) if windows else self.data
        # One half of the tolerance is for the proof, the other for what windows leave open.
        settings = replace(self.settings, tolerance=self.settings.tolerance / 2)
        self._inner = Polynomial(FeasibleSet(self.model, data, self.bounds), settings, self.kept)
        self._windows = windows
        self._say(f"proof on {data.n_samples} of {self.data.n_samples} samples")
        return replace(self._inner.enclose(), windows=windows)

    def _met(self, found: Enclosed, enclosure: Enclosure, short: bool, seconds: float) -> Enclosed:
        """Return proven intervals with inner ends that fit the whole record: none where no run is verified to."""
        runs = np.array(self._fitting or [np.full(len(enclosure.intervals), np.nan)])
        ends = zip(enclosure.intervals, runs.min(axis=0).tolist(), runs.max(axis=0).tolist(), strict=True)
        intervals = tuple(replace(i, inner_lower=low, inner_upper=high) for i, low, high in ends)
        reason = enclosure.reason
        if reason in (Reason.TIGHT, Reason.STALLED, Reason.ROUNDS):
            tight = all(map(self._is_tight, intervals))
            open_ends = Reason.ROUNDS if reason is Reason.TIGHT else reason
            reason = Reason.TIGHT if tight else Reason.WINDOWS if short else open_ends
        met = replace(enclosure, intervals=intervals, witnesses=tuple(self._fitting), reason=reason, seconds=seconds)
        return replace(found, enclosure=met, reason=reason)

    def _is_tight(self, interval: Interval) -> bool:
        return interval.gap <= allowed_gap(interval.lower, interval.upper, self.settings.tolerance)

    def _objecting(self, scan: Scan, enclosure: Enclosure) -> Index:
        """Return the errors that are beyond the bound at points that fit the windows."""
        count = len(self.model.parameters)
        return np.unique(np.concatenate([scan.beyond(point[:count]) for point in enclosure.witnesses]))

    def proof(self) -> tuple[PolynomialProblem, Sequence[Step], None]:
        """Return the problem of the windows, and the steps."""
        assert self._inner is not None
        return self._inner.proof()

    def centre(self, enclosure: Enclosure) -> tuple[CentreStatus, Array | None]:
        """Decide whether the centres fit the whole record; where not, return the nearest parameters that do."""
        assert self._inner is not None
        if not self._windows:
            return self._inner.centre(enclosure)
        values = {i.name: i.centre for i in enclosure.intervals}
        if self._whole.holds(values, best_run(self.model, self.data, self.bounds, values), self.bounds):
            return CentreStatus.FEASIBLE, None
        problem, plan = self._inner.boxed.feasible.problem, self._inner.plan
        status = centre_status(problem, enclosure, plan, self.settings.solver)
        # What fits the windows may not fit the whole record.
        return CentreStatus.UNDECIDED if status is CentreStatus.FEASIBLE else status, nearest_witness(enclosure)
