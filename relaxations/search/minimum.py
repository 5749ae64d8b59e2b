"""The minimum of a polynomial: raise the order, extract minimisers, branch, until a proven bound meets a point.

The lower end is certified (:mod:`relaxations.proof.certificate`). The upper end is the objective at a point that is
proven to be feasible (:mod:`relaxations.points.witness`), where one was found. What costs least goes first, and the
search stops as soon as the ends meet: bounds from single rows (:mod:`relaxations.search.presolve`), the least order,
products of linear constraints at order 1, a few branches, higher orders while their blocks are small
(:mod:`relaxations.search.orders`), and at last contraction and branch and bound.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from functools import partial
from html import escape
from pathlib import Path

import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.ball_arithmetic import Balls
from relaxations.algebra.polynomial import Polynomials
from relaxations.deadline import STOPS, Progress, check_seconds, stopped_by, time_limit
from relaxations.moments.parametric_lift import METHODS as LIFTS
from relaxations.points.extraction import minimisers
from relaxations.points.feasible_points import FeasiblePoints
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.bounding import CertifiedBound, Relaxed, relax
from relaxations.proof.certificate_file import write_certificate
from relaxations.proof.method import Dense, Method, Order, Sparse, relaxation_method
from relaxations.proof.proof_steps import Bound, Level, Recorder, Step
from relaxations.reductions.scaling import Scaling
from relaxations.reductions.vanishing import products, settle
from relaxations.search.branching import branch_and_bound
from relaxations.search.enclosure import contracted, uninterrupted
from relaxations.search.hierarchy import intervals
from relaxations.search.orders import check_orders, node_order, not_flat, ways
from relaxations.search.plan import Plan
from relaxations.search.presolve import beyond, presolve
from relaxations.solvers import Solver, check_solver

BRANCHES = 400
MORE_BRANCHES = 10  # where the bound has met a value that no proof confirms
EARLY = 40  # branches before an order whose blocks cost as much as one of these widths: the first, the second, others
EARLY_WIDTHS = (np.inf, 20, 15)
STARTS = 8  # of the local search, beside the points of the relaxations
WORTH_PRODUCTS = 0.1  # of the gap: products of constraints that close less are left out of the branches
CONTRACTIONS = 5  # of the box before branching
SEARCHING = 0.9  # of the time allowed; the rest is for the verification of points
VERIFYING = 0.3  # seconds that this gets at least


class MinimumReason(Enum):
    """Why the search for a minimum stopped."""

    TIGHT = "the bound meets the value at a verified point within the tolerance"
    EMPTY = "no point satisfies all constraints (proven)"
    UNVERIFIED = "the bound is proven; no feasible point was verified"
    ORDERS = "the bound is proven; the verified point leaves a gap: raise order or nodes"
    TIME = "the time limit was reached; the bound proven so far is returned"
    INTERRUPTED = "interrupted; the bound proven so far is returned"
    MEMORY = "out of memory; the bound proven so far is returned"


@dataclass(frozen=True)
class Minimum:
    """The proven ends of a minimum, verified points, and the problem itself.

    Parameters
    ----------
    lower
        Certified: no feasible point has a smaller objective. Infinite where the feasible set is proven empty.
    upper
        The objective at a feasible point that is proven to exist; NaN where none was found.
    points
        Each of shape (n_variables,). Verified feasible points whose objective lies within the tolerance of the best
        one, which comes first.
    order
        Highest order of a relaxation that was used.
    nodes
        Relaxations solved in branch and bound.
    """

    problem: PolynomialProblem
    objective: Polynomials
    lower: float
    upper: float
    points: tuple[Array, ...]
    order: int
    nodes: int
    reason: MinimumReason
    seconds: float

    @property
    def gap(self) -> float:
        """Return ``upper - lower``; NaN without a verified point."""
        return self.upper - self.lower

    @property
    def point(self) -> dict[str, float]:
        """Return the best point by names; empty where none was found."""
        return dict(zip(self.problem.names, self.points[0].tolist(), strict=True)) if self.points else {}

    def __str__(self) -> str:
        if self.reason is MinimumReason.EMPTY:
            return str(self.reason.value)
        where = ", ".join(f"{name} = {value:.6g}" for name, value in self.point.items())
        reached = f"<= {self.upper:.9g}, reached at {where}" if self.point else "(no feasible point was verified)"
        branches = f", {self.nodes} branches" if self.nodes else ""
        return f"{self.lower:.9g} <= minimum {reached} (order {self.order}{branches})"

    def _repr_html_(self) -> str:
        numbers = {"lower end, certified": self.lower, "upper end, verified": self.upper, **self.point}
        rows = "".join(
            f'<tr><td>{escape(k)}</td><td style="text-align: right">{float(v)!r}</td></tr>' for k, v in numbers.items()
        )
        head = '<tr><th scope="col">minimum</th><th scope="col">value</th></tr>'
        return f"<table><thead>{head}</thead><tbody>{rows}</tbody></table><p>{escape(self.reason.value)}</p>"


@dataclass
class _Search:
    """What is known so far of a problem after presolve: points, the certified bound, and the work done."""

    problem: PolynomialProblem
    plan: Plan
    points: FeasiblePoints
    solver: Solver
    nodes: int  # allowed
    say: Progress
    lower: float
    record: Recorder | None
    order: int
    method: Method  # the plan's, with products of linear constraints once they have raised the bound
    branches: int = 0
    not_flat: Callable[[], set[int]] = set  # cliques of the last relaxation

    @property
    def goal(self) -> float:
        """Return the bound that is good enough: that of a proven point."""
        return self.points.less(self.points.best)

    @property
    def hoped(self) -> bool:
        """Return whether the bound meets the least value that a local search found, proven or not."""
        return self.lower >= self.points.less(self.points.hope)

    def run(self) -> None:
        """Raise the order, then branch, until the bound meets a point."""
        problem, objective = self.problem, self.points.objective
        check_orders(self.plan, problem, objective)
        early = True
        for number, way in enumerate(ways(self.plan, problem, objective, lambda: self.not_flat())):
            order = way.order
            if early and way.width > EARLY_WIDTHS[min(number, 2)]:
                early = False
                self._branch_early()
                if self.hoped:
                    break
            self._raise(order, way.steps)
            if order == 1 and not self.hoped and self.lower < np.inf:
                self._multiply()
            if not number and not self.hoped and self.lower < np.inf:
                self._scatter()
            if self.lower == np.inf:
                return
            self.say(f"order {self.order}: bound {self.lower:.9g}, best point {self.points.hope:.9g}")
            if self.hoped:
                break  # a higher order cannot gain more than a proof of the point, or branches where it fails
        if self.nodes:
            self.points.prove()
            if self.lower < self.goal:
                self.nodes = min(self.nodes, MORE_BRANCHES) if self.hoped else self.nodes
                _branch(self)

    def _multiply(self) -> None:
        """Bound the objective once more at order 1, with products of linear constraints; keep them if they help."""
        before, plain = self.lower, self.method
        if not isinstance(plain, Sparse | Dense) or plain.products:
            return
        self.method = replace(plain, products=True)
        self._raise(1, 1)
        if self.lower - before <= WORTH_PRODUCTS * (self.points.hope - before):
            self.method = plain

    def _scatter(self) -> None:
        """Search for points from random starts, seeded, so that a run can be repeated."""
        problem = self.problem
        for share in np.random.default_rng(0).random((STARTS, problem.n_variables)):
            self.points.search(problem.lower + share * (problem.upper - problem.lower))

    def _raise(self, order: Order, steps: int) -> None:
        """Bound the objective by the relaxation of an order, and search for points from its moments."""
        objective = self.points.objective
        relaxed = self.relaxed(self.problem, order, steps)
        certified = relaxed.bound(objective)
        if self.record and certified.bound > self.lower:
            self.record(Bound.of(relaxed, objective, certified))
        self.order, self.lower = relaxed.relaxation.order, max(self.lower, certified.bound)
        self.not_flat = partial(not_flat, relaxed, objective, certified, order)
        if self.lower < np.inf:
            for point in (certified.point, *_extracted(relaxed, certified)):
                self.points.search(point)

    def _branch_early(self) -> None:
        """Branch a little before the next order, whose relaxation costs as much as many parts of the box."""
        self.points.prove()
        curved = self.plan.complicating
        if self.lower >= self.goal or not len(curved):
            return
        steps: list[Step] = []
        order = min(node_order(self.plan, self.problem, self.points.objective), self.order)
        record = steps.append if self.record else None
        bound = self.split(self.problem, curved, order, np.inf, min(EARLY, self.nodes), record)
        # A file holds the proof that closes the gap, and no tree that a higher order replaces.
        if self.record is None or bound >= self.goal:
            self.lower = max(self.lower, bound)
            if self.record:
                for step in steps:
                    self.record(step)

    def split(
        self, problem: PolynomialProblem, curved: Index, order: int, best: float, nodes: int, record: Recorder | None
    ) -> float:
        """Return a bound by branching on a box outside of which the objective is at least ``best``."""
        points, objective = self.points, self.points.objective

        def bounded(part: PolynomialProblem) -> Relaxed:
            self.branches += 1
            return self.relaxed(part, order)

        def goal(certified: CertifiedBound | None) -> float:
            """Search and prove a point from each certified bound; return the bound that is enough."""
            point = None if certified is None else certified.point
            if point is not None and np.isfinite(point).all() and objective.evaluate(point)[0] < points.best:
                points.search(point)
                points.prove()
            return self.goal

        def report(bound: float, enough: float) -> None:
            if self.record is None:  # what is recorded is proven in the end
                self.lower = max(self.lower, min(bound, best))
            self.say(f"branching: bound {min(bound, best):.9g}, goal {enough:.9g}")

        return branch_and_bound(
            problem,
            objective,
            curved,
            bounded,
            start=self.lower,
            goal=goal,
            nodes=nodes,
            report=report,
            record=record,
        )

    def relaxed(self, problem: PolynomialProblem, order: Order, steps: int = 1) -> Relaxed:
        """Return the relaxation of an order on a problem that may have a smaller box."""
        return relax(problem, self.method, order, self.solver, self.points.objective, steps)


def minimise(
    problem: PolynomialProblem,
    objective: Polynomials,
    *,
    method: str | Method = "auto",
    order: int | None = None,
    tolerance: float = 1e-6,
    nodes: int = BRANCHES,
    seconds: float = np.inf,
    solver: Solver = "clarabel",
    progress: Progress | None = None,
    certificate: str | Path | None = None,
) -> Minimum:
    """Enclose the minimum of a polynomial over a polynomial set.

    Parameters
    ----------
    problem
        Variables without a finite box need rows that bound them, by :mod:`relaxations.search.presolve`.
    objective
        One row.
    method
        A short name of :func:`relaxations.proof.method_names` or a method object, but not cuts.
    order
        Highest relaxation order; by default as high as blocks of width 70 allow.
    tolerance
        Stop once the gap is below this share of the minimum's magnitude, or of one.
    nodes
        At most so many relaxations in branch and bound.
    seconds
        Time allowed, wall clock; then what is proven so far is returned. A tenth of it is kept for the verification of
        points.
    certificate
        File for the proof of the lower end, or of an empty set, for ``python -m relaxations.check FILE``; nothing is
        written where the box alone proves as much.

    Raises
    ------
    ProblemError
        Before any solve: unknown method or solver, order too low, infinite box, memory too small, no positive time.

    Examples
    --------
    >>> from relaxations.library import load
    >>> case = load("gms_st_e01")
    >>> found = minimise(case.problem, case.objective)
    >>> round(found.lower, 6), round(found.upper, 6), case.optimum
    (-6.666667, -6.666667, -6.6666667)
    """
    started = time.perf_counter()
    # Refuse a wrong call before any work.
    check_seconds(seconds)
    check_solver(solver)
    chosen = method if method == "auto" else relaxation_method(method)
    if certificate:
        Path(certificate).unlink(missing_ok=True)  # an old file would prove something else
    proof: list[Step] = []
    stated, presolved = problem, presolve(problem, proof.append)
    if presolved is None:
        if certificate:
            write_certificate(certificate, stated, proof)
        seconds = time.perf_counter() - started
        return Minimum(stated, objective, np.inf, np.nan, (), 0, 0, MinimumReason.EMPTY, seconds)
    problem = presolved
    Scaling.of_box(problem)
    plan = Plan.of(problem, chosen, order, objective)
    points = FeasiblePoints(beyond(stated, problem), objective, products(problem), tolerance)
    search = _Search(
        problem,
        plan,
        points,
        solver,
        nodes,
        progress or (lambda _: None),
        _least_on_box(problem, objective),
        proof.append if certificate else None,
        plan.least,
        plan.method,
    )
    reason = MinimumReason.ORDERS
    try:
        with time_limit(SEARCHING * seconds):
            search.run()
    except STOPS as stop:
        reason = MinimumReason[stopped_by(stop)]
    # Prove points in the time that is left, and say how far the search came.
    with time_limit(max(seconds - (time.perf_counter() - started), VERIFYING)):
        verified = [] if search.lower == np.inf else points.distinct()
    if search.lower == np.inf:
        reason = MinimumReason.EMPTY
    elif search.lower >= search.goal:
        reason = MinimumReason.TIGHT
    elif reason is MinimumReason.ORDERS and not verified:
        reason = MinimumReason.UNVERIFIED
    if certificate and proof:
        write_certificate(certificate, stated, proof)
    return Minimum(
        stated,
        objective,
        search.lower,
        points.best if verified else float("nan"),
        tuple(point for _, point in verified),
        search.order,
        search.branches,
        reason,
        time.perf_counter() - started,
    )


def _extracted(relaxed: Relaxed, certified: CertifiedBound) -> list[Array]:
    """Return the minimisers that the moments show, in the problem's own variables."""
    if certified.moments is None or relaxed.relaxation.method in LIFTS:
        return []
    step = max(1, -(-relaxed.problem.degree // 2))
    found = minimisers(relaxed.relaxation, certified.moments, step)
    return [] if found is None else [relaxed.scaling.recover(point) for point in found]


def _branch(search: _Search) -> None:
    """Close the remaining gap by branch and bound, on the box of the points better than the best one."""
    points, objective, plan = search.points, search.points.objective, search.plan
    problem, best = search.problem, points.best
    # Points that are worse than the best one known are left out.
    better = problem.with_inequalities(objective.below(best)) if np.isfinite(best) else problem
    whole = node_order(plan, better, objective)  # the objective as a constraint may couple all variables
    curved = plan.complicating
    steps: list[Step] = []
    record = steps.append if search.record else None

    def prove(bound: float) -> None:
        """Record what holds of better points; no other point has an objective below the best one known."""
        if search.record and np.isfinite(best):
            search.record(Level(better, objective, min(bound, best), best, tuple(steps)))
        elif search.record:
            for step in steps:
                search.record(step)
        search.lower = max(search.lower, min(bound, best))

    # Contract the box of the better points.
    found = uninterrupted(
        intervals(
            better,
            range(problem.n_variables),
            method=search.method,
            order=whole,
            solver=search.solver,
            rounds=CONTRACTIONS,
            witnesses=False,
            progress=search.say,
            record=record,
        )
    )
    smaller = None if found.empty is not None else settle(contracted(better, found), points.vanishing)
    if smaller is None:
        prove(best)
        return

    # Outside of the contracted box the objective is above the value that the box was contracted with. A box that shrank
    # to nearly a point says more by itself than a relaxation scaled to it.
    if record is None:
        search.lower = max(search.lower, min(_least_on_box(smaller, objective), best))
    if search.lower >= search.goal or not len(curved):  # what is linear gains nothing from smaller boxes
        return

    order = node_order(plan, problem, objective)
    bound = search.split(smaller, curved, order, best, search.nodes, record)
    if bound > search.lower:
        prove(bound)


def _least_on_box(problem: PolynomialProblem, objective: Polynomials) -> float:
    """Return the box's own bound: no monomial differs from its middle by more than its coefficient."""
    terms = Scaling.of_box(problem).polynomials(objective)
    constant = terms.term_degrees == 0
    middle = terms.coefficients[constant].segment_sum(terms.rows[constant], 1)
    reach = Balls.exact(terms.coefficients.magnitude()[~constant]).segment_sum(terms.rows[~constant], 1)
    return float((middle - reach).lower[0])
