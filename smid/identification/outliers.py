"""Intervals that hold although some samples break the noise bound: at most so many outputs, wherever they are.

Which samples are outliers is not known, and there are too many choices to try them all. But of disjoint parts of the
record, one more than outliers, at least one is free of them (pigeonhole principle). So the parameters lie in the hull
of the sets of the parts.

1. Cut the record into such parts. The hull of their intervals is a box that holds for every choice of the outliers.
2. Look within this box for *spoilt* stretches: a few samples in a row that no parameters of the box fit. Each holds at
   least one outlier, and is left out. Of what remains, fewer samples are outliers.
3. Cut the rest into parts again, of which fewer are needed, until no more spoilt stretches are found. Where each
   allowed outlier has its stretch, the rest has none, and is one part.

Outliers that are allowed and not there cost width: the parts are shorter than the record.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from relaxations.algebra.arrays import Array, Mask
from relaxations.deadline import STOPS, Progress, stopped_by
from relaxations.search.enclosure import STOPPED, Enclosure, Reason, uninterrupted
from smid.data import DataError, Dataset
from smid.data.window import Window, part_of
from smid.feasible.template import Templates, is_polynomial
from smid.fitting.problem import Fitting
from smid.identification.certificates import Content, ProvenPart, Round, bundle_of
from smid.identification.choice import encloser_for
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
from smid.identification.windows.scan import best_run
from smid.identification.windows.whole_record import WholeRecord, suits
from smid.identification.windows.windowed import inputs_are_noisy
from smid.models import Model, ModelError

_SUSPECTS = 4  # stretches that are tried for each outlier that is left
_REACHES = (2, 4, 12)  # of a stretch to both sides, in lags of the model


@dataclass(frozen=True)
class _Enclosed:
    """The intervals on a part of the record, and their proof."""

    enclosure: Enclosure
    proven: ProvenPart


Box = dict[str, tuple[float, float]]


class WithOutliers:
    """Encloses the parameters that fit all but some samples.

    Parameters
    ----------
    outliers
        At most so many of each output.
    windows
        Whether a long part may be proven on windows.

    Raises
    ------
    ModelError
        If ``outliers`` is no number of samples, or the parts would be too short for the model.
    """

    def __init__(
        self,
        model: Model,
        data: Dataset,
        bounds: Mapping[str, float],
        settings: Settings,
        kept: bool,
        outliers: int,
        windows: bool,
    ) -> None:
        if isinstance(outliers, bool) or not isinstance(outliers, int) or outliers < 0:
            raise ModelError(f"outliers={outliers!r}: give how many samples of each output may break the noise bound")
        self.model, self.data, self.bounds, self.settings, self._kept = model, data, bounds, settings, kept
        self._outliers, self._windows = outliers, windows
        self._allowed = outliers * len(model.output_channels)
        self._say: Progress = settings.progress or (lambda _: None)
        self.spoilt: list[Window] = []
        self._rounds: list[Round] = []
        needed = (self._allowed + 1) * (model.max_lag + len(model.parameters) + 1)
        if data.n_samples < needed:
            raise ModelError(
                f"{self._allowed} outliers leave no information in {data.n_samples} samples: the record is cut into "
                f"{self._allowed + 1} parts, which needs {needed} samples; allow fewer, or take a longer record"
            )

    def enclose(self) -> Enclosed:
        """Return the hull of the parts; its inner ends are verified to fit all but the outliers."""
        began, box = time.perf_counter(), {p.name: (float(p.lower), float(p.upper)) for p in self.model.parameters}
        found: list[Enclosure] = []
        points: list[Array] = []
        reason = Reason.ROUNDS
        try:
            while True:
                # The hull of the parts, of which one is free of outliers.
                masked = self._with_missing(self._spoilt_samples())
                try:
                    parts = [self._enclosed(box, windows, masked, self.settings) for windows in self._parts()]
                except DataError:
                    if not found:
                        raise
                    break  # a part has too few samples left; what is proven holds
                self._rounds.append(Round([part.proven for part in parts]))
                found = [part.enclosure for part in parts if part.enclosure.empty is None]
                box = {name: (max(box[name][0], low), min(box[name][1], high)) for name, (low, high) in _hull(found)}
                if not found or any(low > high for low, high in box.values()):
                    return Enclosed(None, Reason.EMPTY)
                # Leave out what no parameters of the hull fit.
                new = self._spoilt(box)
                self._rounds[-1] = replace(self._rounds[-1], spoilt=new)
                self.spoilt += [window for stretch in new for window in stretch.windows]
                self._say(f"{len(self.spoilt)} of at most {self._allowed} outliers found")
                if len(self.spoilt) > self._allowed:
                    return Enclosed(None, Reason.EMPTY)
                if not new:
                    break
            reason = Reason.OUTLIERS if len(self.spoilt) < self._allowed else where_open(found[-1].reason)
            points = self._verified([w[: len(box)] for one in found for w in one.witnesses])
        except STOPS as stop:
            reason = Reason[stopped_by(stop)]
        if not found:
            return Enclosed(None, reason)
        hull = (
            replace(i, lower=low, upper=high) for i, (low, high) in zip(found[-1].intervals, box.values(), strict=True)
        )
        intervals = with_inner_ends(hull, points)
        if all(is_tight(interval, self.settings.tolerance) for interval in intervals):
            reason = Reason.TIGHT
        seconds, solves = time.perf_counter() - began, sum(one.solves for one in found)
        whole = replace(
            found[-1], intervals=intervals, witnesses=tuple(points), reason=reason, solves=solves, seconds=seconds
        )
        return Enclosed(None, reason, whole)

    heaviest: tuple[tuple[str, int, float], ...] = ()
    """The samples that carry the proof of an empty set: several proofs have them."""

    @property
    def contradiction(self) -> str:
        """Return in words what is proven where no parameters fit."""
        stretches = ", ".join(
            f"{w.first} to {w.last} of {self.data.experiments[w.experiment].name}" for w in self.spoilt[:5]
        )
        where = f" Samples that no parameters fit: {stretches}." if stretches else ""
        return (
            f"proven: no parameters explain the data even if {self._outliers} samples of each output break the noise "
            f"bound.{where} Allow more outliers, raise the bound or extend the model."
        )

    def _enclosed(self, box: Box, windows: Sequence[Window], data: Dataset, settings: Settings) -> _Enclosed:
        """Return the intervals on a part of the record, within a box, and their proof where it is kept.

        ModelError if a parameter has none, or no certificate can hold the proof.
        """
        part = part_of(data, windows)
        encloser = encloser_for(self.model.bound(**box), part, self.bounds, settings, self._kept, self._windows)
        found = encloser.enclose()
        contents: tuple[Content, ...] = ()
        if found.enclosure is not None:
            uninterrupted(found.enclosure)
            if self._kept:
                certified = encloser.certified(found)
                found, contents = certified.found, certified.certificates
            assert found.enclosure is not None
            if self._kept and found.enclosure.empty is not None and not contents:
                raise ModelError("the checker's arithmetic does not prove that a part is empty: leave certificate out")
            return _Enclosed(found.enclosure, ProvenPart(windows, contents))
        if found.reason in STOPPED:
            raise STOPPED[found.reason]
        lost = ", ".join(found.boxed.unbounded) if found.boxed else "the parameters"
        raise ModelError(
            f"no box could be proven for {lost} from {part.n_samples} of {self.data.n_samples} samples: give bounds, "
            "or allow fewer outliers"
        )

    def _parts(self) -> list[list[Window]]:
        """Return as many parts of the record as outliers may be left, and one more."""
        count = self._allowed - len(self.spoilt) + 1
        spoilt = [next(iter(own.values())) for own in self._spoilt_samples()]
        before, total = 0, max(sum(int((~gone).sum()) for gone in spoilt), 1)
        windows: list[list[Window]] = [[] for _ in range(count)]
        for e, gone in enumerate(spoilt):
            # Of the samples that are not left out, number k belongs to part k * count // total.
            number = before + np.cumsum(~gone)
            part = np.maximum(number - 1, 0) * count // total
            for k in np.unique(part).tolist():
                own = np.flatnonzero(part == k)
                windows[k].append(Window(e, int(own[0]), int(own[-1])))
            before = int(number[-1])
        return windows

    def _spoilt(self, box: Box) -> list[ProvenPart]:
        """Return stretches that no parameters of a box fit, around the largest errors of the run at its centre."""
        left = self._allowed - len(self.spoilt)
        centre = {name: (0.5 * low + 0.5 * high,) * 2 for name, (low, high) in box.items()}
        everything = [np.ones(run.n_samples, bool) for run in self.data.experiments]
        problem = Fitting(self.model.bound(**centre), self.data, everything, scale=self.bounds)
        errors = np.abs(problem.residual(problem.start({})))
        suspects = np.argsort(errors)[::-1][: _SUSPECTS * left]
        found: list[ProvenPart] = []
        for e, sample in problem.places[suspects[errors[suspects] > 1]].tolist():
            run = Window(e, 0, self.data.experiments[e].n_samples - 1)
            known = [*self.spoilt, *(window for stretch in found for window in stretch.windows)]
            near = [piece for piece in run.without(known) if piece.first <= sample <= piece.last]
            for piece in near:
                reaches = (lags * self.model.max_lag for lags in _REACHES)
                stretches = (Window(e, max(sample - r, piece.first), min(sample + r, piece.last)) for r in reaches)
                proofs = (self._fits_nothing(box, stretch) for stretch in stretches)
                found += [*filter(None, proofs)][:1]
        return found

    def _fits_nothing(self, box: Box, stretch: Window) -> ProvenPart | None:
        """Return the proof that no parameters of a box fit a stretch, where there is one."""
        with suppress(DataError, ModelError):  # too short, an input that stands still, or nothing is proven
            found = self._enclosed(box, [stretch], self.data, replace(self.settings, witnesses=False))
            return found.proven if found.enclosure.empty is not None else None
        return None

    def _verified(self, points: Sequence[Array]) -> list[Array]:
        """Return points a little inside the given ones that are verified to fit all but the allowed outliers."""
        if not len(points):
            return []
        middle, share = np.mean(points, axis=0), self.settings.tolerance / 4
        return [p for point in points if self._fits(p := point + share * (middle - point))]

    def _fits(self, parameters: Array) -> bool:
        """Return whether parameters are verified to fit all but the allowed outliers of each output."""
        if not is_polynomial(self.model) or inputs_are_noisy(self.model):
            return False
        templates = Templates.of(self.model)
        if not suits(templates):
            return False
        values = {p.name: float(v) for p, v in zip(self.model.parameters, parameters, strict=True)}
        best = best_run(self.model, self._with_missing(self._spoilt_samples()), self.bounds, values)
        beyond = [
            {c: np.abs(run.values[c] - found[c]) > self.bounds[c] for c in self.model.output_channels}
            for run, found in zip(self.data.experiments, best, strict=True)
        ]
        if any(sum(int(own[c].sum()) for own in beyond) > self._outliers for c in self.model.output_channels):
            return False
        whole = WholeRecord(templates, self._with_missing(beyond))
        return whole.holds(values, whole.noises(best), self.bounds)

    def _spoilt_samples(self) -> list[dict[str, Mask]]:
        """Return the samples of each output that are left out, per experiment."""
        masks = [np.zeros(run.n_samples, bool) for run in self.data.experiments]
        for w in self.spoilt:
            masks[w.experiment][w.first : w.last + 1] = True
        return [dict.fromkeys(self.model.output_channels, mask) for mask in masks]

    def _with_missing(self, lost: Sequence[Mapping[str, Mask]]) -> Dataset:
        """Return the record without some samples of its outputs."""
        runs = [
            replace(run, values={**run.values, **{c: np.where(gone, np.nan, run.values[c]) for c, gone in own.items()}})
            for run, own in zip(self.data.experiments, lost, strict=True)
        ]
        return self.data.with_experiments(runs)

    def certified(self, found: Enclosed) -> Certified:
        """Return the rounds as a bundle of certificates."""
        beyond = self.spoilt or any(part.certificates for one in self._rounds for part in one.parts)
        return Certified(found, (bundle_of(self.model, self._allowed, self._rounds),) if beyond else ())

    def centre(self, enclosure: Enclosure) -> tuple[CentreStatus, Array | None]:
        """Decide whether the centres fit all but the outliers."""
        fits = self._fits(np.array([i.centre for i in enclosure.intervals]))
        return (CentreStatus.FEASIBLE, None) if fits else (CentreStatus.UNDECIDED, nearest_witness(enclosure))


def _hull(found: Sequence[Enclosure]) -> Iterator[tuple[str, tuple[float, float]]]:
    for intervals in zip(*(one.intervals for one in found), strict=True):
        yield intervals[0].name, (min(i.lower for i in intervals), max(i.upper for i in intervals))
