"""Intervals of polynomial models: prove a finite box, find a first feasible point, bound, and examine the centre."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.polynomial import Polynomials
from relaxations.deadline import STOPS, stopped_by
from relaxations.points.witness import find_witness
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.certificate_file import content_of
from relaxations.proof.proof_steps import Recorder, Step
from relaxations.search.enclosure import Enclosure, Reason
from relaxations.search.hierarchy import intervals
from relaxations.search.plan import Plan
from relaxations.solvers import Solver
from smid.feasible.feasible_set import FeasibleSet
from smid.identification.encloser import NOTHING, Certified, Enclosed, Settings, nearest_witness, proven_infeasible
from smid.identification.estimate import CentreStatus
from smid.identification.finite_box import Boxed, with_finite_box
from smid.identification.first_guess import equation_error_fit, magnitudes
from smid.identification.missing import with_missing


@dataclass
class Polynomial:
    """Encloses a set without open kinks; ``kept`` says whether to keep the steps of the proof."""

    feasible: FeasibleSet
    settings: Settings
    kept: bool
    plan: Plan = field(init=False)
    boxed: Boxed = field(init=False)
    steps: list[Step] = field(default_factory=list)

    def __post_init__(self) -> None:
        problem = self.feasible.problem
        self.plan = self._plan_of(problem)
        present = self.feasible.without(self.feasible.missing)
        self.boxed = Boxed(present, (), present.problem.unbounded, problem)

    def _plan_of(self, problem: PolynomialProblem) -> Plan:
        parameters = range(len(self.feasible.model.parameters))
        return Plan.of(problem, self.settings.method, self.settings.order, targets=parameters)

    def enclose(self) -> Enclosed:
        """Return the intervals of the parameters."""
        record = self.steps.append if self.kept else None
        try:
            # Prove a finite box.
            self.boxed = with_finite_box(self.feasible, self.settings.solver, self.settings.progress, record)
            if self.boxed.unbounded:
                return Enclosed(self.boxed, Reason.UNBOUNDED)
            enclosure = self._intervals(record)
            # The parameters' intervals without the missing samples give these a box, and all equations serve.
            if len(self.feasible.missing) and enclosure.empty is None:
                self.boxed = with_missing(self.feasible, self.boxed, enclosure, self.settings.solver, record)
                before, enclosure = enclosure, self._intervals(record)
                enclosure = replace(
                    enclosure, solves=before.solves + enclosure.solves, seconds=before.seconds + enclosure.seconds
                )
        except STOPS as stop:
            return Enclosed(self.boxed, Reason[stopped_by(stop)])
        return Enclosed(self.boxed, enclosure.reason, enclosure)

    def _intervals(self, record: Recorder | None) -> Enclosure:
        """Return the intervals of the parameters over the set with its box; look for a first feasible point before."""
        settings, feasible = self.settings, self.boxed.feasible
        # The plan depends on the polynomials alone. Cuts and projections begin from a guess, and not from a point.
        if len(self.feasible.missing):
            self.plan = self._plan_of(feasible.problem)
        guessed = self.plan.cuts or self.plan.projection is not None
        known = [] if guessed or not settings.witnesses else _first_witness(feasible, self.plan)
        return intervals(
            feasible.problem,
            range(len(feasible.model.parameters)),
            method=self.plan,
            solver=settings.solver,
            tolerance=settings.tolerance,
            rounds=settings.rounds,
            witnesses=settings.witnesses,
            nodes=settings.nodes,
            known=known,
            start=_start(feasible)[0] if guessed else None,
            executor=settings.executor,
            progress=settings.progress,
            record=record,
        )

    def certified(self, found: Enclosed) -> Certified:
        """Return the stated problem and the steps as a certificate."""
        if found.enclosure is None or not self.steps:
            return Certified(found, ())
        return Certified(found, (content_of(self.boxed.stated, self.steps),))

    def centre(self, enclosure: Enclosure) -> tuple[CentreStatus, Array | None]:
        """Decide whether the centres are feasible; where not, look for the nearest feasible point."""
        status = self.status(enclosure)
        found = status is CentreStatus.FEASIBLE
        return status, None if found else _nearest(self.boxed.feasible.problem, enclosure, self.plan)

    def status(self, enclosure: Enclosure) -> CentreStatus:
        """Decide whether the centres are feasible."""
        return centre_status(self.boxed.feasible.problem, enclosure, self.plan, self.settings.solver)


def _start(feasible: FeasibleSet) -> tuple[Array, float]:
    """Return the equation-error fit as a guess of a feasible point, and its RMS error."""
    parameters, rms = equation_error_fit(feasible)
    point = np.concatenate([parameters, np.zeros(feasible.n_variables - len(parameters))])
    return np.clip(point, feasible.problem.lower, feasible.problem.upper), rms


def _first_witness(feasible: FeasibleSet, plan: Plan) -> list[Array]:
    """Return a verified feasible point found from the equation-error fit, if any."""
    start, rms = _start(feasible)
    guess = magnitudes(feasible, start[: len(feasible.model.parameters)], max(rms, 1e-9))
    found = find_witness(feasible.problem, feasible.problem, NOTHING, plan.complicating, start, guess)
    return [] if found is None else [found.point]


def centre_status(problem: PolynomialProblem, enclosure: Enclosure, plan: Plan, solver: Solver) -> CentreStatus:
    """Decide whether the centres of intervals are feasible."""
    centre = np.array([i.centre for i in enclosure.intervals])
    count = len(centre)
    lower, upper = problem.lower.copy(), problem.upper.copy()
    lower[:count] = upper[:count] = centre
    fixed = problem.with_box(lower, upper)
    points = plan.points(fixed)
    start = np.clip(np.concatenate([centre, np.zeros(points.n_variables - count)]), points.lower, points.upper)
    others = np.setdiff1d(plan.complicating, np.arange(count))
    if find_witness(points, points, NOTHING, others, start) is not None:
        return CentreStatus.FEASIBLE
    relaxed = plan.bounds(fixed)
    empty = proven_infeasible(relaxed, Plan.of(relaxed, plan.method if plan.lifts else "auto"), solver)
    return CentreStatus.INFEASIBLE if empty else CentreStatus.UNDECIDED


def _nearest(problem: PolynomialProblem, enclosure: Enclosure, plan: Plan) -> Array | None:
    """Return the parameters of a verified point whose largest distance to the centre, in widths, is small."""
    begin = nearest_witness(enclosure)
    if begin is None:
        return None
    centre = np.array([i.centre for i in enclosure.intervals])
    count = len(centre)
    lower, upper = problem.lower.copy(), problem.upper.copy()
    lower[:count] = [i.lower for i in enclosure.intervals]
    upper[:count] = [i.upper for i in enclosure.intervals]
    problem = plan.points(problem.with_box(lower, upper))
    begin = begin if plan.projection is None else begin[plan.projection.kept]
    last = problem.n_variables
    width = np.array([max(i.width, 1e-300) for i in enclosure.intervals])
    # distance - |theta_k - centre_k| / width_k >= 0, the distance being one more variable
    closeness = Polynomials.from_terms(
        [
            {(last,): 1.0, (k,): sign / width[k], (): -sign * centre[k] / width[k]}
            for k in range(count)
            for sign in (1.0, -1.0)
        ]
    )
    extended = replace(
        problem,
        names=(*problem.names, "distance"),
        lower=np.append(problem.lower, 0.0),
        upper=np.append(problem.upper, 1.0),
    ).with_inequalities(closeness)
    # Minimise the distance from the nearest witness.
    found = find_witness(extended, extended, extended.variable(last), plan.complicating, np.append(begin, 1.0))
    return np.asarray(begin[:count] if found is None else found.point[:count])
