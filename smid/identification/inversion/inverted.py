"""Intervals by inversion of the free run, as `identify` gives them."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace

import numpy as np
import sympy

from relaxations.algebra.arrays import Array
from relaxations.deadline import STOPS, check_time, stopped_by
from relaxations.proof.bounding import Emptiness
from relaxations.search.enclosure import Enclosure, Interval, Reason
from smid.data import DataError, Dataset
from smid.identification.encloser import Certified, Enclosed, Settings, is_tight, nearest_witness, where_open
from smid.identification.estimate import CentreStatus
from smid.identification.inversion.certificate import run_certificate
from smid.identification.inversion.contraction import contracted
from smid.identification.inversion.cover import Cover, heaviest
from smid.identification.inversion.narrowing import Narrowing
from smid.identification.inversion.outermost import outermost
from smid.identification.inversion.record import Record
from smid.identification.windows.scan import Scan
from smid.models import Model, ModelError

NAME = "inversion"
MOST = 20_000
"""Contractions, unless ``nodes`` says otherwise."""

_TRIED = 8  # points of the box, to find whether anything is known of the run
_TOLD = 100  # contractions between two lines of progress


class Inverted:
    """Encloses the parameters by boxes.

    Raises
    ------
    ModelError
        For a parameter or an initial sample without a box, a function without an enclosure, or a run that is unknown
        whatever the parameters are.
    """

    def __init__(
        self,
        model: Model,
        data: Dataset,
        bounds: Mapping[str, float],
        settings: Settings,
    ) -> None:
        self.model, self.data, self.bounds, self.settings = model, data, bounds, settings
        loose = [p.name for p in model.parameters if not np.isfinite(p.upper - p.lower)]
        if loose:
            raise ModelError(
                f"inversion of the free run needs a box of every parameter. Give ends to {', '.join(loose)}, as in "
                f"model.bound({loose[0]}=(-10, 10))"
            )
        self.record = record = Record(model, data, bounds).with_products()
        self._narrowing = Narrowing.of(record, bounds)
        if self._narrowing is None and all(record.says_nothing(*ends) for ends in _points(record)):
            raise ModelError(_why_unknown(record))
        self.cover = Cover(record, settings.tolerance)
        self._not_written = ""

    def enclose(self) -> Enclosed:
        """Return the intervals of the parameters."""
        began, reason = time.perf_counter(), Reason.ROUNDS
        most, say = self.settings.nodes or MOST, self.settings.progress or (lambda _: None)
        try:
            self._narrow()
            self._start()
            while not (cover := self.cover).done and cover.contracted < most:
                check_time()
                before = cover.contracted
                cover.step()
                if before // _TOLD < cover.contracted // _TOLD:
                    say(f"{cover.contracted} contractions, {len(cover.boxes)} boxes left")
            reason = Reason.SMALLEST if self.cover.done else reason
        except STOPS as stop:
            reason = Reason[stopped_by(stop)]
        empty = None if self.cover.boxes else Emptiness(0.0, np.zeros(0))
        reason = Reason.EMPTY if empty else reason
        intervals = () if empty else self._intervals()
        if not empty and all(is_tight(interval, self.settings.tolerance) for interval in intervals):
            reason = Reason.TIGHT
        count = len(self.model.parameters)
        points = tuple(point[:count] for point in self.cover.points)
        seconds = time.perf_counter() - began
        return Enclosed(
            None,
            reason,
            Enclosure(intervals, points, empty, NAME, 0, reason, 0, self.cover.contracted, seconds, (), 0, 0),
        )

    def _narrow(self) -> None:
        """Narrow the box without a free run, as far as that goes."""
        narrowing = self._narrowing
        if narrowing is None:
            return
        for known in narrowing.steps():
            if known.empty:
                self.cover.clear()
                return
            self.record = self.record.within(*narrowing.ends(known))
            self.cover = Cover(self.record, self.settings.tolerance)
        if self.record.loose and all(self.record.says_nothing(*ends) for ends in _points(self.record)):
            raise ModelError(_why_unknown(self.record))

    def _start(self) -> None:
        """Look for points that fit, by a local search."""
        # It may diverge: a point may be found on the way.
        with suppress(DataError, ModelError), np.errstate(all="ignore"):
            self.cover.points += outermost(self.record, Scan(self.model, self.data, self.bounds))

    def _intervals(self) -> tuple[Interval, ...]:
        (lower, upper), (low, high) = self.cover.outer, self.cover.inner
        low, high = (np.where(np.isfinite(end), end, np.nan) for end in (low, high))
        ends = (end[: len(self.model.parameters)].tolist() for end in (lower, upper, low, high))
        return tuple(
            Interval(p.name, a, b, inner_a, inner_b, (a <= p.lower, b >= p.upper), ("", ""))
            for p, a, b, inner_a, inner_b in zip(self.model.parameters, *ends, strict=True)
        )

    @property
    def contradiction(self) -> str:
        """Return in words what is proven where no parameters fit."""
        bounds = ", ".join(f"{b:g} {self.data.channel(c).unit}".rstrip() + f" on {c}" for c, b in self.bounds.items())
        carried = ", ".join(f"{sample} ({share:.0%})" for _, sample, share in self.heaviest)
        carried = f". Most influential samples: {carried}" if carried else "."
        return (
            f"proven: no parameters within their boxes explain the data within {bounds}. Raise the bound, widen the "
            f"boxes or extend the model{carried}{self._not_written}"
        )

    @property
    def heaviest(self) -> tuple[tuple[str, int, float], ...]:
        """Return the samples that carry most of the proof of an empty set, with their shares."""
        return tuple((self.data.experiments[e].name, sample, share) for e, sample, share in heaviest(self.cover))

    def certified(self, found: Enclosed) -> Certified:
        """Return the certificate of the cover, and what was found with the ends that its checker proves."""
        claim, content = run_certificate(
            self.cover, self.bounds, self.settings.progress or (lambda _: None), self._narrowing
        )
        own = () if content is None else (content,)
        if claim is None or found.enclosure is None:
            return Certified(found, own)
        if found.reason is Reason.EMPTY:
            # Its arithmetic is not the search's: a proof that hangs by a rounding may fail.
            self._not_written = " No certificate is written: the checker's arithmetic does not prove it."
            return Certified(found, ())
        intervals = tuple(
            replace(i, lower=low, upper=high, from_box=(low <= p.lower, high >= p.upper))
            for i, p in zip(found.enclosure.intervals, self.model.parameters, strict=True)
            for low, high in [claim[i.name]]
        )
        tight = all(is_tight(i, self.settings.tolerance) for i in intervals)
        reason = found.reason if tight else where_open(found.reason)
        enclosure = replace(found.enclosure, intervals=intervals, reason=reason)
        return Certified(replace(found, reason=reason, enclosure=enclosure), own)

    def centre(self, enclosure: Enclosure) -> tuple[CentreStatus, Array | None]:
        """Decide whether the centres fit, from some initial states."""
        centre = np.array([i.centre for i in enclosure.intervals])
        lower, upper = self.record.lower.copy(), self.record.upper.copy()
        lower[: len(centre)] = upper[: len(centre)] = centre
        near = nearest_witness(enclosure)
        if any(self.record.fits(np.concatenate([centre, point[len(centre) :]])) for point in self.cover.points):
            return CentreStatus.FEASIBLE, None
        groups = self.record.groups(np.isfinite(upper - lower) & (lower < upper))
        found = contracted(self.record.rows(lower, upper), lower, upper, groups)
        if found.inside is not None and self.record.fits(found.inside):
            return CentreStatus.FEASIBLE, None
        return (CentreStatus.INFEASIBLE if found.empty else CentreStatus.UNDECIDED), near


def _points(record: Record) -> Iterator[tuple[Array, Array]]:
    """Yield some points of the box, as boxes; what has no ends keeps none."""
    known, rng = np.isfinite(record.upper - record.lower), np.random.default_rng(0)
    for share in (np.full(len(known), 0.5), *rng.uniform(size=(_TRIED, len(known)))):
        lower, upper = record.lower.copy(), record.upper.copy()
        lower[known] = upper[known] = (1 - share[known]) * lower[known] + share[known] * upper[known]
        yield lower, upper


def _why_unknown(record: Record) -> str:
    """Return in words why nothing is known of a run, whatever the parameters are, and what to do."""
    if record.loose:
        return (
            f"no channel measures {', '.join(record.loose)}, so nothing is known of where it begins, nor of the "
            f"run: give it bounds, as in model.bound({record.loose[0]}=(-10, 10))"
        )
    divisors = {
        power.base: None
        for line in record.model.lines
        for power in sorted(line.expression.atoms(sympy.Pow), key=str)
        if power.exp.could_extract_minus_sign() and not power.base.is_number
    }
    cause = f", which divides by {', '.join(map(repr, map(str, divisors)))}," if divisors else ""
    return (
        f"the free run{cause} is undefined or infinite wherever in the boxes it was tried: choose boxes without "
        "divisions by zero, roots and logarithms of negative numbers, or instability"
    )
