"""Intervals of models with Max, Min, Abs and sign: a list of sub-boxes whose union holds every feasible parameter.

The hull of the sub-boxes (:mod:`smid.identification.sub_box`) gives the intervals. Take the end with the widest gap to
its witness, and split the sub-box that sets the end. Contract the parts, and drop those that are certified empty. A
sub-box without open kinks is an ordinary polynomial problem for :func:`relaxations.search.hierarchy.intervals`. The
hull is proven at any time. (The loop of :mod:`relaxations.search.best_first` does not fit: it raises one bound, and
here every sub-box counts for all ends at once.)
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import STOPS, stopped_by
from relaxations.proof.bounding import Emptiness
from relaxations.proof.certificate_file import content_of
from relaxations.proof.method import Lift
from relaxations.search.enclosure import Enclosure, Interval, Reason, uninterrupted
from relaxations.search.hierarchy import intervals
from relaxations.search.interval_state import allowed_gap
from relaxations.search.plan import Plan
from smid.feasible.feasible_set import FeasibleSet
from smid.identification.encloser import Certified, Enclosed, Settings, nearest_witness, proven_infeasible
from smid.identification.estimate import CentreStatus
from smid.identification.finite_box import Boxed
from smid.identification.piecewise_proof import Trail, stated
from smid.identification.products import products_needed
from smid.identification.sub_box import Region, SubBox, boxed, contract, lifted, middle, split, witness, witness_near
from smid.models import ModelError

SPLITS = 80  # by default at most so many
BOXING_SPLITS = 12  # of them, at most so many to give every parameter a finite box
TOLERANCE = 2e-3  # an end is tight at this share of the width, or at the tolerance asked for


@dataclass
class Piecewise:
    """Encloses a set with open kinks: Max, Min, Abs or sign that priors and data alone do not decide.

    ``order`` and ``rounds`` of the settings serve the sub-boxes without open kinks. ``nodes`` allows that many splits
    where it is more than 80. ``tolerance`` is at least 0.2 %. A ModelError refuses a method other than the lift,
    kinks that it does not apply to, and a proof that cannot be written.
    """

    feasible: FeasibleSet
    settings: Settings
    kept: bool
    plan: Plan = field(init=False)
    trail: Trail = field(init=False)

    def __post_init__(self) -> None:
        feasible, method = self.feasible, self.settings.method
        self.plan = Plan.of(feasible.problem, method, self.settings.order)
        if method not in ("auto", "lift") and not isinstance(method, Lift):
            raise ModelError(
                f"a model with Max, Min, Abs or sign is bounded by the lift: method={method!r} does not apply"
            )
        unbounded = feasible.problem.unbounded
        if self.kept and products_needed(feasible.model, unbounded):
            raise ModelError(
                f"the proof of a box for {', '.join(unbounded)} beside Max, Min, Abs or sign cannot be written: give "
                "bounds, or leave certificate out"
            )
        lifted(feasible.model.name, feasible.problem)
        self.trail = Trail(kept=self.kept)

    def enclose(self) -> Enclosed:
        """Return the hull of the sub-boxes; its witnesses hold the parameters only."""
        feasible = self.feasible
        search = _Search(feasible, self.settings, self.plan, self.trail)
        try:
            reason = search.run()
        except STOPS as stop:
            reason = Reason[stopped_by(stop)]
        enclosure = search.enclosure(reason)
        derived = tuple(p.name for p in feasible.model.parameters if not np.isfinite(p.upper - p.lower))
        unbounded = tuple(i.name for i in enclosure.intervals if not np.isfinite(i.width))
        boxed = Boxed(feasible, () if unbounded else derived, unbounded, feasible.problem)
        return Enclosed(boxed, reason, enclosure)

    def certified(self, found: Enclosed) -> Certified:
        """Return the set with its kinks as variables, and the steps, as a certificate."""
        if found.enclosure is None:
            return Certified(found, ())
        problem, kinks = stated(self.feasible)
        steps = self.trail.whole(problem, len(self.feasible.model.parameters))
        return Certified(found, (content_of(problem, steps, kinks),) if steps else ())

    def centre(self, enclosure: Enclosure) -> tuple[CentreStatus, Array | None]:
        """Decide whether the centres are feasible; where not, return the witness nearest to them, in widths."""
        status = self.status(enclosure)
        return status, None if status is CentreStatus.FEASIBLE else nearest_witness(enclosure)

    def status(self, enclosure: Enclosure) -> CentreStatus:
        """Decide whether the centres are feasible."""
        centre = np.array([i.centre for i in enclosure.intervals])
        fixed = self.feasible.on_box(centre, centre)
        if witness_near(fixed, Region(centre, centre, {}), middle(fixed), 0, 1) is not None:
            return CentreStatus.FEASIBLE
        empty = proven_infeasible(fixed.problem, Plan.of(fixed.problem), self.settings.solver)
        return CentreStatus.INFEASIBLE if empty else CentreStatus.UNDECIDED


@dataclass
class _Search:
    """The state of one search: the regions that wait, the sub-boxes, the witnesses (parameters only)."""

    feasible: FeasibleSet
    settings: Settings
    plan: Plan
    trail: Trail
    waiting: list[Region] = field(init=False)
    first_width: Array = field(init=False)
    sub_boxes: list[SubBox] = field(default_factory=list)
    pool: list[Array] = field(default_factory=list)
    solves: int = 0
    used: int = 0
    empty: Emptiness | None = None
    started: float = field(default_factory=time.perf_counter)

    def __post_init__(self) -> None:
        count = len(self.feasible.model.parameters)
        lower, upper = self.feasible.problem.lower[:count].copy(), self.feasible.problem.upper[:count].copy()
        self.waiting = [Region(lower, upper, {}, self.trail)]
        self.first_width = np.where(np.isfinite(upper - lower), upper - lower, 0.0)
        self.tolerance = max(self.settings.tolerance, TOLERANCE)

    def run(self) -> Reason:
        """Split until every end meets its witness, nothing can be split, or the splits are used up."""
        ready = self._boxed()
        if ready is None:
            return Reason.UNBOUNDED
        self.waiting = ready
        while True:
            while self.waiting:
                sub_box = self._contracted(self.waiting[-1])
                self.waiting.pop()  # not before: an interruption must not lose it
                if sub_box is not None:
                    self.sub_boxes.append(sub_box)
                    self._find_witnesses(sub_box)
            if not self.sub_boxes:
                return Reason.EMPTY
            loose = [(k, sign) for gap, k, sign in self._gaps() if gap > 1]
            if not loose:
                return Reason.TIGHT
            if self.used >= max(self.settings.nodes, SPLITS):
                return Reason.ROUNDS
            setting = ((k, self._setting(k, sign)) for k, sign in loose)
            work = next(((k, sub_box) for k, sub_box in setting if not sub_box.settled), None)
            if work is None:
                return Reason.STALLED
            k, sub_box = work
            self._refine(sub_box)
            if self.settings.progress and (self.sub_boxes or self.waiting):
                low, high = self._ends(k)
                name = self.feasible.model.parameters[k].name
                self.settings.progress(
                    f"{name} in [{low:.6g}, {high:.6g}], {len(self.sub_boxes) + len(self.waiting)} sub-boxes"
                )

    def _boxed(self) -> list[Region] | None:
        """Give every region a finite box, splitting thresholds where needed; None where that fails."""
        pending, ready = list(self.waiting), []
        while pending:
            region = pending.pop()
            found = boxed(self.feasible, region, self.settings.solver)
            if isinstance(found, Region):
                ready.append(found)
            elif isinstance(found, Emptiness):
                self.empty = found
            else:
                stamped = self.feasible.on_box(region.lower, region.upper, region.choose)
                halves = split(SubBox(region, stamped, {}), self.first_width) if stamped.openings else ()
                self.used += 1
                if not halves or self.used > BOXING_SPLITS:
                    return None
                pending += halves
        return ready

    def _contracted(self, region: Region) -> SubBox | None:
        """Return the sub-box of a region; None where it is proven empty."""
        found = contract(self.feasible, region, self.settings.solver)
        if isinstance(found, Emptiness):
            self.empty = found
            return None
        self.solves += found.solves
        return found

    def _find_witnesses(self, sub_box: SubBox) -> None:
        """Look for witnesses at the ends of a sub-box that no witness comes near yet."""
        for k in range(len(sub_box.region.lower)):
            for sign in (1, -1):
                inner = self._inner(k, sign)
                if np.isnan(inner) or sub_box.end(k, sign) < inner - self._allowed(k):
                    point = witness(sub_box, k, sign)
                    self.pool += [] if point is None else [point]

    def _refine(self, sub_box: SubBox) -> None:
        """Split a sub-box, or compute its intervals where it has no open kinks."""
        place = next(i for i, c in enumerate(self.sub_boxes) if c is sub_box)
        self.used += 1
        if sub_box.feasible.openings:
            parts = split(sub_box, self.first_width)
            self.waiting += parts
            self.sub_boxes[place : place + 1] = [] if parts else [replace(sub_box, settled=True)]
            return
        count = len(sub_box.region.lower)
        with sub_box.region.trail.on(sub_box.feasible) as record:
            enclosure = uninterrupted(
                intervals(
                    sub_box.feasible.problem,
                    range(count),
                    order=self.plan.asked,
                    solver=self.settings.solver,
                    tolerance=self.tolerance,
                    rounds=self.settings.rounds,
                    record=record,
                )
            )
        self.solves += enclosure.solves
        self.pool += [w[:count] for w in enclosure.witnesses]
        if enclosure.empty is not None:
            self.empty = enclosure.empty
            del self.sub_boxes[place]
            return
        lower = np.array([i.lower for i in enclosure.intervals])
        upper = np.array([i.upper for i in enclosure.intervals])
        self.sub_boxes[place] = replace(sub_box, region=replace(sub_box.region, lower=lower, upper=upper), settled=True)

    def _setting(self, k: int, sign: int) -> SubBox:
        """Return the sub-box that sets an end."""
        return min(self.sub_boxes, key=lambda sub_box: sub_box.end(k, sign))

    def _gaps(self) -> list[tuple[float, int, int]]:
        """Return the gap of each end in units of what is allowed, and the end, the widest first."""
        gaps = []
        for k in range(len(self.feasible.model.parameters)):
            low, high = self._ends(k)
            allowed = self._allowed(k)
            for sign, gap in ((1, self._inner(k, 1) - low), (-1, self._inner(k, -1) + high)):
                gaps.append((np.inf if np.isnan(gap) else gap / allowed if allowed > 0 else 0.0, k, sign))
        return sorted(gaps, reverse=True)

    def _ends(self, k: int) -> tuple[float, float]:
        """Return the hull of all regions and sub-boxes, in one parameter."""
        parts = [c.region for c in self.sub_boxes] + self.waiting
        return min(float(p.lower[k]) for p in parts), max(float(p.upper[k]) for p in parts)

    def _inner(self, k: int, sign: int) -> float:
        """Return the least of ``sign`` times a parameter over the witnesses; NaN without any."""
        return min((sign * float(p[k]) for p in self.pool), default=np.nan)

    def _allowed(self, k: int) -> float:
        """Return the gap that counts as tight."""
        return allowed_gap(*self._ends(k), self.tolerance)

    def enclosure(self, reason: Reason) -> Enclosure:
        """Return the hull of the sub-boxes so far."""
        model, prior = self.feasible.model, self.feasible.problem
        found = []
        left = bool(self.sub_boxes or self.waiting)
        for k, parameter in enumerate(model.parameters):
            low, high = self._ends(k) if left else (float(prior.lower[k]), float(prior.upper[k]))
            inner = self._inner(k, 1), -self._inner(k, -1)
            at_box = (low == prior.lower[k], high == prior.upper[k])
            found.append(Interval(parameter.name, low, high, *inner, (bool(at_box[0]), bool(at_box[1])), ("", "")))
        return Enclosure(
            tuple(found),
            tuple(self.pool),
            self.empty if reason is Reason.EMPTY else None,
            self.plan.method.name,
            self.plan.order,
            reason,
            self.used,
            self.solves,
            time.perf_counter() - self.started,
            tuple(prior.names[k] for k in self.plan.complicating),
            max((sub_box.largest_block for sub_box in self.sub_boxes), default=0),
            max((sub_box.n_moments for sub_box in self.sub_boxes), default=0),
        )
