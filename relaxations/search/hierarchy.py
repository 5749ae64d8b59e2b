"""Intervals of variables over a polynomial set: tighteners take their turns on one set of certified ends.

- cuts (:mod:`relaxations.search.by_cuts`), for long records;
- rounds of relaxation and contraction (:mod:`relaxations.search.by_rounds`);
- branch and bound (:mod:`relaxations.search.by_branches`), where a gap is left and nodes are allowed.

Noises of curves are eliminated before (:mod:`relaxations.search.projected`).

They stop when all ends meet their witnesses. Whatever happens, interruption included, the ends returned are certified.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import Executor

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import STOPS, Progress, limited, stopped_by
from relaxations.errors import ProblemError
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.method import Cuts, Method
from relaxations.proof.proof_steps import Recorder
from relaxations.reductions.scaling import Scaling
from relaxations.search.by_branches import by_branches
from relaxations.search.by_cuts import by_cuts
from relaxations.search.by_rounds import by_rounds
from relaxations.search.enclosure import Enclosure, Interval, Reason
from relaxations.search.interval_state import Ends
from relaxations.search.plan import Plan
from relaxations.search.projected import through_projection
from relaxations.search.tightener import Task, Tightener
from relaxations.solvers import Solver, check_solver

__all__ = ["intervals"]


@limited
def intervals(
    problem: PolynomialProblem,
    targets: Sequence[int],
    *,
    method: str | Method | Cuts | Plan = "auto",
    order: int | None = None,
    solver: Solver = "clarabel",
    tolerance: float = 1e-4,
    rounds: int = 10,
    witnesses: bool = True,
    known: Sequence[Array] = (),
    absolute: float = 0.0,
    nodes: int = 0,
    start: Array | None = None,
    seconds: float = np.inf,  # noqa: ARG001  (read by the decorator)
    executor: Executor | None = None,
    progress: Progress | None = None,
    record: Recorder | None = None,
) -> Enclosure:
    """Enclose the range of some variables over a polynomial set.

    Parameters
    ----------
    problem
        With a finite box.
    targets
        Variables whose intervals are asked for.
    method
        A short name of :func:`relaxations.proof.method_names`, a method object, or a plan made before.
        :class:`relaxations.search.plan.Plan` says what ``"auto"`` takes.
    order
        Highest relaxation order; by default 2 for at most two complicating variables and 1 beyond, or the least that
        the degrees allow.
    solver
        The name of a conic solver, or a :class:`relaxations.solvers.BackEnd`.
    tolerance
        Stop once every gap is below ``tolerance`` times the interval's width (or 1e-8 of the value).
    rounds
        At most so many contractions.
    witnesses
        Search for inner ends.
    known
        Verified feasible points to begin with.
    absolute
        A gap below this is tight too, in the variable's unit.
    nodes
        Where contraction has stalled with a gap left, branch with at most so many relaxations for each end.
    start
        Shape (n_variables,). A guess of a feasible point, where cuts are taken and none is known.
    seconds
        Time allowed, wall clock; then the ends proven so far are returned.
    executor
        Solves the bounds of a round side by side. Threads do, for a solver does not hold Python's lock.
    record
        Called with each step of the proof (:mod:`relaxations.proof.proof_steps`).

    Raises
    ------
    ProblemError
        Before any solve: unknown method or solver, order too low, infinite box, memory too small, no positive time.

    Examples
    --------
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> x, y = variables("x y")
    >>> problem, _ = problem_of(x, [x * y == 1, x >= 0, x <= 2, y >= 0, y <= 4])
    >>> (found,) = intervals(problem, [0]).intervals
    >>> found.lower <= found.inner_lower, found.inner_upper <= found.upper
    (True, True)
    >>> round(found.lower, 4), round(found.upper, 4), found.gap < 1e-4
    (0.25, 2.0, True)
    """
    # Refuse a wrong call before any work.
    check_solver(solver)
    if rounds < 1:
        raise ProblemError(f"rounds is {rounds}: at least one is needed")
    plan = Plan.of(problem, method, order, targets=targets)
    Scaling.of_box(problem)
    task = Task(
        problem, targets, plan, solver, rounds, witnesses, nodes, start, executor, progress or _say_nothing, record
    )
    ends = Ends(problem.lower.copy(), problem.upper.copy(), tolerance, absolute, list(known))
    if plan.projection is not None:
        return through_projection(plan.projection, task, ends, tightened)
    return tightened(task, ends)


def tightened(task: Task, ends: Ends) -> Enclosure:
    """Return what the tighteners prove; they update the ends."""
    started = time.perf_counter()
    reason: Reason | None = None
    try:
        task.plan.check(task.problem)
        for tighten in _tighteners(task):
            reason = tighten(task, ends) or reason
            if reason not in (None, Reason.STALLED):
                break
    except STOPS as stop:
        reason = Reason[stopped_by(stop)]
    return _enclosure(task, ends, reason or Reason.ROUNDS, time.perf_counter() - started)


def _tighteners(task: Task) -> list[Tightener]:
    """Return what is tried in turn."""
    plan = task.plan
    branches = task.nodes > 0 and plan.lifts
    return [*([by_cuts] if plan.cuts else []), by_rounds, *([by_branches] if branches else [])]


def _say_nothing(_: str) -> None:
    """Tell nobody about progress."""


def _enclosure(task: Task, ends: Ends, reason: Reason, seconds: float) -> Enclosure:
    """Return what is proven so far as a result."""
    plan, size = task.plan, ends.relaxed.relaxation if ends.relaxed else None
    without = plan.cuts and not ends.rounds  # cuts alone
    return Enclosure(
        tuple(_interval(task.problem, ends, k) for k in task.targets),
        tuple(ends.pool),
        ends.empty,
        Cuts.name if without else plan.method.name,
        0 if without else ends.order or plan.least,
        reason,
        ends.rounds,
        ends.solves,
        seconds,
        tuple(task.problem.names[k] for k in plan.complicating) if plan.lifts else (),
        size.largest_block if size else 0,
        size.n_moments if size else 0,
        plan.cuts and ends.rounds > 0,
    )


def _interval(problem: PolynomialProblem, ends: Ends, k: int) -> Interval:
    lower, upper = float(ends.lower[k]), float(ends.upper[k])
    inner = ends.inner(k)
    return Interval(
        problem.names[k],
        lower,
        upper,
        float(inner[0]),
        float(inner[1]),
        (bool(lower == problem.lower[k]), bool(upper == problem.upper[k])),
        (ends.status.get((k, 1), "not solved"), ends.status.get((k, -1), "not solved")),
    )
