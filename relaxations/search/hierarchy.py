"""Intervals of variables over a polynomial set: relax, certify, contract, witness, branch.

Every bound of a round is computed on the same relaxation. Certified ends replace the box of their variables (the
parameters asked for and the complicating ones), which makes the next round's relaxation tighter; this stops when the
ends meet their witnesses or the box no longer shrinks. Whatever happens, interruption included, the ends returned are
the certified ones.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from enum import Enum
from functools import partial
from html import escape

import numpy as np

from relaxations.algebra.ball_arithmetic import Array, Index
from relaxations.deadline import STOPS, TimeIsUp, limited, map_in_time, stopped_by
from relaxations.errors import ProblemError
from relaxations.moments.lasserre import plan
from relaxations.moments.lift import METHODS as LIFTS
from relaxations.moments.lift import complicating_variables, lifted_variables
from relaxations.points.witness import find_witness
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.bounding import CLOSE, Emptiness, Outcome, Relaxed, lowest, relax, resolve
from relaxations.proof.proof_steps import Bound, Record
from relaxations.reductions.scaling import Scaling
from relaxations.search.benders.enclose import check_cuts, enclose
from relaxations.search.branching import branch_and_bound
from relaxations.search.interval_state import Ends
from relaxations.solvers.interface import check_solver

Progress = Callable[[str], None]

WORTH_STAYING = 0.5  # a round at a lower order that takes less off every width than this leads to the next order
STALLED = 0.01
LARGE = 10  # moments for each variable
CUTS = "benders"  # the method that is no relaxation
LONG = 300  # variables from which cuts are faster than a relaxation of the whole record
BOXES = 500  # for each end and stage of branching with cuts


class Proof(Enum):
    """What stands behind a number.

    Examples
    --------
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> x, y = variables("x y")
    >>> problem, _ = problem_of(x, [x * y == 1, x >= 0, x <= 2, y >= 0, y <= 4])
    >>> (found,) = intervals(problem, [0], witnesses=False).intervals
    >>> for end, own in zip((found.lower, found.upper), found.from_box):
    ...     print(round(end, 4), (Proof.BOX if own else Proof.PROVEN).value)
    0.25 certified in ball arithmetic
    2.0 not tightened by the data: the prior box's own end
    """

    PROVEN = "certified in ball arithmetic"
    BOX = "not tightened by the data: the prior box's own end"


class Reason(Enum):
    """Why the computation of intervals stopped.

    Examples
    --------
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> x, y = variables("x y")
    >>> problem, _ = problem_of(x, [x**2 + y**2 <= 1, x + y >= 2])
    >>> intervals(problem, [0], witnesses=False).reason.value
    'the feasible set is certified empty'
    """

    TIGHT = "every end meets its witness within the tolerance"
    STALLED = "the box no longer shrinks at this order; raise the order to tighten"
    ROUNDS = "the rounds asked for are used up"
    EMPTY = "the feasible set is certified empty"
    TIME = "the time limit was reached; the ends proven so far are returned"
    INTERRUPTED = "interrupted; the ends proven so far are returned"
    MEMORY = "out of memory; the ends proven so far are returned"
    UNBOUNDED = "no box could be proven, and nothing else without one: give bounds, or richer data"


@dataclass(frozen=True)
class Interval:
    """The range of one variable: certified outer ends, witnessed inner ends.

    Parameters
    ----------
    lower, upper
        Every feasible point lies between them; proven.
    inner_lower, inner_upper
        Values at verified feasible points; NaN where none was found.
    from_box
        Whether each end is the prior box's own.
    status
        The solver's words for each end, in its last solve.

    Examples
    --------
    >>> half = Interval("x", 0.0, 1.0, 0.1, 1.0, (True, False), ("", "Solved"))
    >>> half.width, half.centre, half.gap
    (1.0, 0.5, 0.1)
    """

    name: str
    lower: float
    upper: float
    inner_lower: float
    inner_upper: float
    from_box: tuple[bool, bool]
    status: tuple[str, str]

    @property
    def width(self) -> float:
        """Return the certified width."""
        return self.upper - self.lower

    @property
    def centre(self) -> float:
        """Return the middle of the certified interval."""
        return 0.5 * self.lower + 0.5 * self.upper

    @property
    def gap(self) -> float:
        """Return the larger distance of an outer end to its inner one; infinite without witness."""
        gaps = (self.inner_lower - self.lower, self.upper - self.inner_upper)
        return float("inf") if any(np.isnan(g) for g in gaps) else max(gaps)


@dataclass(frozen=True)
class Enclosure:
    """Intervals of the variables asked for, and how they came about.

    Parameters
    ----------
    intervals
        In the order asked for.
    witnesses
        Each of shape (n_variables,). Verified feasible points.
    empty
        The proof where the set is empty.
    order
        The highest one used; 0 where cuts did without a relaxation.
    rounds
        Contractions of the box.
    solves
        Bounds that were computed.
    seconds
        Wall clock.
    complicating
        Variables that the lift (or ``"rlt"``) lifted, or the outer ones of cuts; empty for other methods.
    largest_block, n_moments
        Size of the last relaxation.
    after_cuts
        Whether cuts went before it.
    """

    intervals: tuple[Interval, ...]
    witnesses: tuple[Array, ...]
    empty: Emptiness | None
    method: str
    order: int
    reason: Reason
    rounds: int
    solves: int
    seconds: float
    complicating: tuple[str, ...]
    largest_block: int
    n_moments: int
    after_cuts: bool = False

    @property
    def how(self) -> str:
        """Return in words the method, the variables that it treats apart, and its order."""
        names = {"lift": "parametric lift", CUTS: "Benders cuts"}
        within = f" in {', '.join(self.complicating)}" if self.complicating else ""
        order = f", order {self.order}" if self.order else ""
        before = f"{names[CUTS]}, then " if self.after_cuts else ""
        return f"{before}{names.get(self.method, f'{self.method} relaxation')}{within}{order}"

    @property
    def work(self) -> str:
        """Return in words what was solved."""
        kind = "linear programs" if self.method == CUTS else "programs" if self.after_cuts else "certified solves"
        return f"{self.solves} {kind}"

    def _repr_html_(self) -> str:
        titles = ("variable", "lower, certified", "lower, verified", "upper, verified", "upper, certified")
        head = "".join(f'<th scope="col">{title}</th>' for title in titles)
        rows = ""
        for i in self.intervals:
            ends = (i.lower, i.inner_lower, i.inner_upper, i.upper)
            cells = "".join(f'<td style="text-align: right">{float(end)!r}</td>' for end in ends)
            rows += f"<tr><td>{escape(i.name)}</td>{cells}</tr>"
        told = f"{self.how}, {self.work}: {self.reason.value}"
        return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table><p>{escape(told)}</p>"


@limited
def intervals(
    problem: PolynomialProblem,
    targets: Sequence[int],
    *,
    method: str = "auto",
    order: int | None = None,
    solver: str = "clarabel",
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
    record: Record | None = None,
) -> Enclosure:
    """Enclose the range of some variables over a polynomial set.

    Parameters
    ----------
    problem
        With a finite box.
    targets
        Variables whose intervals are asked for.
    method
        One of {"auto", "benders", "lift", "rlt", "sparse", "dense", "terms", "chordal", "textbook"}.
        ``"auto"`` takes cuts (:mod:`relaxations.search.benders`) for the complicating variables where
        :func:`takes_cuts` says so, and the lift for the others, or where cuts leave a gap.
    order
        Highest relaxation order; see :func:`resolve` for the default. Lower orders contract the box first.
    tolerance
        Stop once every gap is below ``tolerance`` times the interval's width (or 1e-7 of the value).
    rounds
        At most so many contractions.
    witnesses
        Search for inner ends. Without them an interval is outer only.
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
    progress
        Called with one line of text now and then.
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
    started = time.perf_counter()
    check_solver(solver)
    if rounds < 1:
        raise ProblemError(f"rounds is {rounds}: at least one is needed")
    cuts = takes_cuts(problem, method, order)
    only_cuts = method == CUTS
    method, order, complicating = resolve(problem, "auto" if cuts else method, order)
    least = lowest(problem, method, complicating)
    scaling = Scaling.of_box(problem)  # refuses an infinite box before any work
    say = progress or (lambda _: None)
    watched = sorted({*targets, *(complicating.tolist() if method in LIFTS else ())})
    ends = Ends(problem.lower.copy(), problem.upper.copy(), tolerance, absolute, list(known))
    empty: Emptiness | None = None
    reason, done, relaxed = None, 0, None
    # Lower orders contract the box at a fraction of the cost, so they go first.
    current_order = least
    try:
        # Refused before any work, at the highest order.
        if cuts:
            check_cuts(problem, complicating)
        elif method in LIFTS:
            lifted_variables(problem, order, method)
        else:
            plan(scaling.apply(problem), order, method)
        if cuts:
            suited = targets if only_cuts else [k for k in targets if k in complicating]
            empty = _cut(problem, ends, suited, complicating, start, solver, say, record)
            if empty is not None:
                reason = Reason.EMPTY
            elif ends.tight(targets):
                reason = Reason.TIGHT
            elif only_cuts:
                reason = Reason.ROUNDS
        for done in range(1, rounds + 1) if reason is None else ():
            current = ends.box(problem)
            relaxed = relax(current, method, current_order, solver)
            before = (ends.lower.copy(), ends.upper.copy())
            last = done == rounds
            empty = _round(
                problem, relaxed, ends, targets, watched, complicating, witnesses, last, executor, say, record
            )
            if empty is not None:
                reason = Reason.EMPTY
                break
            if witnesses and ends.tight(targets):
                reason = Reason.TIGHT
                break
            shrinkage = _shrinkage(before, ends, watched)
            if current_order < order and shrinkage < WORTH_STAYING:
                current_order += 1
            elif shrinkage < STALLED:
                reason = Reason.STALLED
                break
        if reason in (None, Reason.STALLED) and nodes and method in LIFTS and not ends.tight(targets):
            _branch(problem, ends, targets, complicating, method, least, nodes, solver, say, record)
            reason = Reason.TIGHT if ends.tight(targets) else reason
    except STOPS as stop:
        reason = Reason[stopped_by(stop)]
    return Enclosure(
        tuple(_interval(problem, ends, k) for k in targets),
        tuple(ends.pool),
        empty,
        method if done or not cuts else CUTS,
        current_order if done or not cuts else 0,
        reason or Reason.ROUNDS,
        done,
        ends.solves,
        time.perf_counter() - started,
        tuple(problem.names[k] for k in complicating) if method in LIFTS else (),
        relaxed.relaxation.largest_block if relaxed else 0,
        relaxed.relaxation.n_moments if relaxed else 0,
        cuts and done > 0,
    )


def takes_cuts(problem: PolynomialProblem, method: str, order: int | None) -> bool:
    """Return whether a call means cuts: where they are asked for, or a long record leaves the choice.

    The choice then falls on them for the variables that complicate. The multipliers that bound another variable change
    with those that do; a relaxation's, which are polynomials, follow them, and cuts have to be many.

    Parameters
    ----------
    order
        Asked for: of a relaxation, then.

    Raises
    ------
    ProblemError
        Where cuts are asked for that do not apply.

    Examples
    --------
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> x, y = variables("x y")
    >>> problem, _ = problem_of(x, [x * y == 1, x >= 0, x <= 2, y >= 0, y <= 4])
    >>> takes_cuts(problem, "benders", None), takes_cuts(problem, "auto", None)  # it is short
    (True, False)
    """
    if method == "auto":
        if problem.n_variables < LONG or order is not None:
            return False
        complicating = complicating_variables(problem)
        return complicating is not None and len(complicating) > 0
    if method != CUTS:
        return False
    if complicating_variables(problem) is None:
        raise ProblemError("too many variables complicate this problem for cuts: choose method='sparse'")
    return True


def _cut(
    problem: PolynomialProblem,
    ends: Ends,
    targets: Sequence[int],
    complicating: Index,
    start: Array | None,
    solver: str,
    say: Progress,
    record: Record | None,
) -> Emptiness | None:
    """Tighten the ends by cuts as far as they go; return the proof where the set is empty."""
    wanted, others = (
        [(k, sign) for k in chosen for sign in (1, -1)]
        for chosen in (targets, [k for k in complicating.tolist() if k not in targets])
    )
    begin = 0.5 * problem.lower + 0.5 * problem.upper if start is None else start
    return enclose(
        problem,
        ends,
        wanted,
        complicating,
        also=others,
        solver=solver,
        start=begin,
        nodes=BOXES,
        say=say,
        record=record,
    )


def _round(
    problem: PolynomialProblem,
    relaxed: Relaxed,
    ends: Ends,
    targets: Sequence[int],
    watched: Sequence[int],
    complicating: Index,
    witnesses: bool,
    last: bool,
    executor: Executor | None,
    say: Progress,
    record: Record | None,
) -> Emptiness | None:
    """Bound every watched variable once; update the ends; return the proof where the set is empty."""
    # One after the other, they are looked at when their turn comes: a witness of this round may have settled them.
    open_ends = (
        (k, sign)
        for k in watched
        for sign in (1, -1)
        if ends.lower[k] < ends.upper[k] and not (k in targets and witnesses and ends.end_tight(k, sign))
    )
    # What a solver loses shrinks with the box, so it need not be small beside the gap before the last round.
    bound = partial(_bound, problem, relaxed, max(CLOSE, 0.1 * ends.tolerance))
    # Beside a large relaxation the linear programs of a witness cost little.
    large = relaxed.relaxation.n_moments > LARGE * problem.n_variables
    for (k, sign), outcome in map_in_time(executor, bound, open_ends):
        ends.solves += 1
        ends.status[k, sign] = outcome.status
        proof = outcome.certificate
        if proof is None:
            continue
        if outcome.bound == np.inf:
            if record:
                record(Bound.of(relaxed, problem.variable(k, sign), outcome))
            return relaxed.emptiness(proof)
        width = ends.upper[k] - ends.lower[k]
        gained = ends.tighten(k, sign, outcome.bound)
        if record and gained > 0:
            record(Bound.of(relaxed, problem.variable(k, sign), outcome))
        if ends.lower[k] > ends.upper[k]:
            # Two proven bounds that contradict each other: no point satisfies both.
            return relaxed.emptiness(proof)
        # Elsewhere it is worth them once an end has settled.
        settled = last or large or gained < 0.1 * width
        if witnesses and k in targets and settled and outcome.point is not None:
            _try_witness(problem, ends, complicating, outcome.point, (k, sign))
        say(f"{problem.names[k]} in [{ends.lower[k]:.6g}, {ends.upper[k]:.6g}]")
    return None


def _bound(
    problem: PolynomialProblem, relaxed: Relaxed, close: float, end: tuple[int, int]
) -> tuple[tuple[int, int], Outcome]:
    return end, relaxed.bound(problem.variable(*end), close)


def _branch(
    problem: PolynomialProblem,
    ends: Ends,
    targets: Sequence[int],
    complicating: Index,
    method: str,
    order: int,
    nodes: int,
    solver: str,
    say: Progress,
    record: Record | None,
) -> None:
    """Tighten the ends that still have a gap to their witness by branch and bound."""
    for k in targets:
        for sign in (1, -1):
            inner = ends.inner(k)
            if np.isnan(inner[0]) or ends.end_tight(k, sign):
                continue
            box = ends.box(problem)
            start, best = (ends.lower[k], inner[0]) if sign > 0 else (-ends.upper[k], -inner[1])
            goal = best - ends.allowed_gap(k)
            bound = branch_and_bound(
                box,
                problem.variable(k, sign),
                complicating,
                lambda part: relax(part, method, order, solver),
                start=float(start),
                goal=partial(_fixed, float(goal)),
                nodes=nodes,
                report=lambda bound, goal: say(f"branching: bound {bound:.9g}, goal {goal:.9g}"),
                record=record,
            )
            if np.isfinite(bound):  # a witness exists, so the set is not empty
                ends.tighten(k, sign, bound)


def _fixed(goal: float, _: Outcome | None) -> float:
    return goal


def _try_witness(
    problem: PolynomialProblem, ends: Ends, complicating: Index, point: Array, end: tuple[int, int]
) -> None:
    """Look for a verified point that pushes an end outwards."""
    k, sign = end
    starts = [point]
    if ends.pool:
        starts.append(min(ends.pool, key=lambda p: sign * p[k]))
    box = ends.box(problem)
    for start in starts:
        found = find_witness(box, problem, problem.variable(k, sign), complicating, start)
        if found is not None:
            ends.pool.append(found.point)
            return


def _shrinkage(before: tuple[Array, Array], ends: Ends, watched: Sequence[int]) -> float:
    """Return the largest share of its width that a watched variable lost."""
    old = before[1][watched] - before[0][watched]
    new = ends.upper[watched] - ends.lower[watched]
    return float(np.max(1 - new[old > 0] / old[old > 0], initial=0.0))


def _interval(problem: PolynomialProblem, ends: Ends, k: int) -> Interval:
    lower, upper = float(ends.lower[k]), float(ends.upper[k])
    inner = ends.inner(k)
    # Sharing a box end is not the box's doing where a witness shows that the end is attained to the last digits.
    return Interval(
        problem.names[k],
        lower,
        upper,
        float(inner[0]),
        float(inner[1]),
        (bool(lower == problem.lower[k]), bool(upper == problem.upper[k])),
        (ends.status.get((k, 1), "not solved"), ends.status.get((k, -1), "not solved")),
    )


def uninterrupted(enclosure: Enclosure) -> Enclosure:
    """Return an enclosure that ran to its end; raise what stopped it where a caller cannot use a part.

    Returns
    -------
    Enclosure
        The one given.

    Raises
    ------
    TimeIsUp
        Where the time limit ended the computation.
    KeyboardInterrupt
        Where the user interrupted it.
    MemoryError
        Where memory did not suffice.

    Examples
    --------
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> x, y = variables("x y")
    >>> problem, _ = problem_of(x, [x**2 + y**2 <= 1])
    >>> found = intervals(problem, [0], witnesses=False)
    >>> uninterrupted(found) is found
    True
    >>> uninterrupted(replace(found, reason=Reason.MEMORY))
    Traceback (most recent call last):
        ...
    MemoryError
    """
    if enclosure.reason is Reason.TIME:
        raise TimeIsUp
    if enclosure.reason is Reason.INTERRUPTED:
        raise KeyboardInterrupt
    if enclosure.reason is Reason.MEMORY:
        raise MemoryError
    return enclosure


def contracted(problem: PolynomialProblem, enclosure: Enclosure) -> PolynomialProblem:
    """Return the problem on the box that an enclosure proves.

    Parameters
    ----------
    enclosure
        Of some of its variables.

    Returns
    -------
    PolynomialProblem
        The same set.

    Examples
    --------
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> x, y = variables("x y")
    >>> problem, _ = problem_of(x, [x * y == 1, x >= 0, x <= 2, y >= 0, y <= 4])
    >>> smaller = contracted(problem, intervals(problem, [0], witnesses=False))
    >>> smaller.lower.round(4), smaller.upper.round(4)  # of x and y
    (array([0.25, 0.  ]), array([2., 4.]))
    """
    place = {name: k for k, name in enumerate(problem.names)}
    lower, upper = problem.lower.copy(), problem.upper.copy()
    for interval in enclosure.intervals:
        lower[place[interval.name]], upper[place[interval.name]] = interval.lower, interval.upper
    return replace(problem, lower=lower, upper=upper)
