"""Tighten both ends of variables by cuts: search for feasible points, then prove the ends, coarsely before finely."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.polynomial import Polynomials
from relaxations.moments.conic import FEWER, check_bytes
from relaxations.points.witness import Verifier
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.bounding import Emptiness
from relaxations.proof.proof_steps import Branches, Cut, Part, Recorder, Step
from relaxations.search.benders.cuts import Cuts
from relaxations.search.benders.program import ask
from relaxations.search.benders.search import Asker, Point, inmost, outmost
from relaxations.search.benders.split import Split
from relaxations.search.benders.tree import Node, bound_end
from relaxations.search.interval_state import Ends
from relaxations.solvers import Solver

STAGES = (0.5, 0.05)  # shares of the width, before what is asked for: a box proven coarsely costs fine proofs little
USUAL_CUTS = 200
# How far a witness is drawn inside, tried in turn: so many times what the point exceeds by, and room to verify it.
BACK = ((1.1, 1e-8), (1.5, 1e-6), (4.0, 1e-4), (16.0, 1e-2))


@dataclass
class _Run:
    """One run: the problem, the proven ends, and the multipliers of the cuts that are used."""

    problem: PolynomialProblem
    ends: Ends
    complicating: Index
    solver: Solver
    nodes: int
    say: Callable[[str], None]
    record: Recorder | None
    shared: Array  # multipliers of cuts that any end may need
    own: dict[tuple[int, int], Array] = field(default_factory=dict)  # those near each end
    inside: Array | None = None  # a verified point with room

    @cached_property
    def verified(self) -> Verifier:
        """Return what verifies points; many a proof needs none."""
        return Verifier(self.problem)

    def asker(self, k: int, sign: int) -> Asker:
        """Return what asks for one end: its variable is an outer one beside those that complicate."""
        split = Split.of(self.ends.box(self.problem), np.union1d(self.complicating, [k]))
        known = [outer_rows(split), self.shared, self.own.get((k, sign), self.shared[:0])]
        return Asker(Cuts.of(split, np.unique(np.concatenate(known), axis=0)), self.solver)

    def centre(self, asker: Asker) -> Point | None:
        """Return the verified inner point with its room; None where there is none."""
        found = None if self.inside is None else asker(self.inside[asker.cuts.split.outer])
        return found if found is not None and found.excess < 0 else None


def enclose(
    problem: PolynomialProblem,
    ends: Ends,
    wanted: Sequence[tuple[int, int]],
    complicating: Index,
    *,
    also: Sequence[tuple[int, int]] = (),
    solver: Solver,
    start: Array | None,
    nodes: int,
    say: Callable[[str], None],
    record: Recorder | None = None,
) -> Emptiness | None:
    """Tighten some ends in place; return the proof where no point is feasible.

    The ends are certified at any time, also after an interruption.

    Parameters
    ----------
    wanted, also
        Ends that are to meet their witnesses, and ends worth proving coarsely, for the box that they give the others:
        lower ones with sign 1, upper ones with -1.
    start
        Shape (n_variables,). A guess of a feasible point, of which only the complicating entries are used. Without it
        (and without known points) branch and bound looks for a point.
    nodes
        Of branch and bound, for each end and stage.
    """
    # Begin at a verified point with room, where one is found.
    n_rows = problem.equalities.n_rows + problem.inequalities.n_rows
    run = _Run(problem, ends, complicating, solver, nodes, say, record, np.zeros((0, n_rows)))
    begin = ends.pool[-1] if ends.pool else start
    if begin is not None and len(complicating):
        _begin(run, begin)
    every = [end for end in (*also, *wanted) if ends.lower[end[0]] < ends.upper[end[0]]]
    # Search for points far out; share the cuts that are active there.
    if run.inside is not None:
        active = [_search(run, *end, 0.2 * ends.tolerance if end in wanted else 0.1) for end in every]
        run.shared = np.concatenate(active)  # what else was met on the way is of use to the search alone
    # Prove every end, coarsely before finely.
    for share in (*STAGES, 0.0):
        for end in every:
            empty = _prove(run, *end, share) if share or end in wanted else None
            if empty is not None:
                return empty
        if not ends.pool:  # nothing to aim at: finer stages would do the same again
            break
    return None


def check_cuts(problem: PolynomialProblem, complicating: Index) -> None:
    """Refuse a problem whose cuts would not fit the machine's memory (ProblemError)."""
    split = Split.of(problem, complicating)
    entries = USUAL_CUTS * (1 + len(split.inner)) * len(split.monomials)
    check_bytes(16 * entries, f"cuts over {problem.n_variables} variables ask for ", FEWER)


def _begin(run: _Run, guess: Array) -> None:
    """Look for a verified point with room, from a guess of all variables."""
    k = int(run.complicating[0])
    asker = run.asker(k, 1)
    outer = asker.cuts.split.outer
    room = inmost(asker, guess[outer], run.ends.lower[outer], run.ends.upper[outer])
    run.ends.solves += asker.asked
    if room is not None and room.excess < 0:
        run.inside = _witness(run, asker, room, room, (k, 1))
        run.say("a feasible point is " + ("not verified" if run.inside is None else "verified"))


def _search(run: _Run, k: int, sign: int, share: float) -> Array:
    """Find a verified point far out towards one end; return the multipliers of the cuts that hold it there."""
    ends, asker = run.ends, run.asker(k, sign)
    outer = asker.cuts.split.outer
    inside = run.centre(asker)
    if inside is None:
        return run.shared[:0]
    known = len(asker.cuts)
    cost = np.zeros(len(outer))
    cost[np.searchsorted(outer, k)] = sign
    point, active, near = outmost(asker, cost, inside, ends.lower[outer], ends.upper[outer], share)
    run.shared = np.concatenate([run.shared, asker.cuts.multipliers[known:]])
    run.own[k, sign] = asker.cuts.multipliers[near]
    _witness(run, asker, point, inside, (k, sign))
    ends.solves += asker.asked
    inner = ends.inner(k)
    run.say(f"{run.problem.names[k]}: feasible from {inner[0]:.6g} to {inner[1]:.6g}")
    return asker.cuts.multipliers[active]


def _prove(run: _Run, k: int, sign: int, share: float) -> Emptiness | None:
    """Raise one end to its witness, less a share of the width; return the proof where the set is empty."""
    problem, ends = run.problem, run.ends
    asker = run.asker(k, sign)
    outer = asker.cuts.split.outer
    target = int(np.searchsorted(outer, k))
    reached = np.inf

    def goal() -> float:
        inner = ends.inner(k)
        if np.isnan(inner[0]):
            return float("inf")
        # Less than counts as tight: a gap that is only negligible beside the value may be wide beside the width.
        allowed = max((share or ends.tolerance) * (inner[1] - inner[0]), 0.1 * ends.negligible(k))
        return float(min(sign * inner[0 if sign > 0 else 1], reached) - 0.9 * allowed)

    def feasible(point: Point) -> float:
        nonlocal reached
        reached = min(reached, float(sign * point.p[target]))  # verified or not, no cut excludes it
        if run.inside is None:
            guess = np.zeros(problem.n_variables)
            guess[outer] = point.p
            _begin(run, guess)
        inside = run.centre(asker)
        if inside is not None:
            _witness(run, asker, point, inside, (k, sign))
        return goal()

    # Branch until the goal is reached, and keep the cuts that were learnt for this end.
    known = len(asker.cuts)
    found = bound_end(
        asker,
        target,
        sign,
        ends.lower[outer],
        ends.upper[outer],
        goal(),
        run.nodes,
        feasible,
        lambda bound: run.say(f"{problem.names[k]}: proven {'above' if sign > 0 else 'below'} {sign * bound:.6g}"),
    )
    ends.solves += asker.asked
    ends.status[k, sign] = f"{found.nodes} boxes, {len(asker.cuts)} cuts"
    learnt = asker.cuts.multipliers[known:]
    run.own[k, sign] = np.concatenate([run.own.get((k, sign), learnt[:0]), learnt])
    if run.record:
        for step in _steps(found.root, run, asker.cuts, target, sign, found.bound):
            run.record(step)
    # A bound beyond the other end proves the set empty.
    crossed = found.bound > (ends.upper[k] if sign > 0 else -ends.lower[k])
    if crossed and not ends.pool:
        weights = found.weights[: problem.equalities.n_rows]
        total = float(weights.sum())
        return Emptiness(
            found.margin, weights / total if total > 0 else np.full(len(weights), 1 / max(len(weights), 1))
        )
    if not crossed:
        ends.tighten(k, sign, found.bound)
    if found.stop is not None:
        raise found.stop
    return None


def _steps(node: Node, run: _Run, cuts: Cuts, target: int, sign: int, bound: float) -> tuple[Step, ...]:
    """Return the proof of a bound on a node's box: its claims, then the parts that it was cut into."""
    outer, problem = cuts.split.outer, run.problem
    nothing = Polynomials.from_terms([{}])

    def objective(variable: int | None, sign: int) -> Polynomials:
        return nothing if variable is None else problem.variable(int(outer[variable]), sign)

    steps: list[Step] = []
    for claim in node.claims:
        taken = np.flatnonzero(claim.weights)
        proven = objective(claim.variable, claim.sign)
        steps.append(Cut(problem, proven, claim.bound, outer, claim.weights[taken], cuts.multipliers[taken]))
    if node.parts:
        parts = tuple(
            Part(int(outer[part.cut]), *part.range, _steps(part, run, cuts, target, sign, bound)) for part in node.parts
        )
        # Where all parts are empty, anything is proven.
        goal = (objective(target, sign), bound) if np.isfinite(bound) else (nothing, 1.0)
        steps.append(Branches(problem, *goal, parts))
    return tuple(steps)


def _witness(run: _Run, asker: Asker, point: Point, inside: Point, end: tuple[int, int]) -> Array | None:
    """Verify a feasible point near one that may exceed by a little, moved towards the inside as little as possible."""
    split = asker.cuts.split
    for times, margin in BACK:
        missing = times * max(point.excess, 0.0) + margin
        back = missing / (missing - inside.excess) if point.excess > -margin else 0.0
        p = point.p + back * (inside.p - point.p)
        answer = ask(split, p, asker.solver)
        if answer is None or answer.excess >= 0:
            continue
        found = run.verified(run.problem.variable(*end), split.recover(p, answer.inner))
        if found is not None:
            run.ends.pool.append(found.point)
            return found.point
    return None


def outer_rows(split: Split) -> Array:
    """Return unit multipliers of the constraints without inner variables, of equalities with both signs."""
    parts, before = [], 0
    total = split.equalities.count + split.inequalities.count
    for rows, both in ((split.equalities, True), (split.inequalities, False)):
        own = np.ones(rows.count, dtype=bool)
        stored = rows.mid.tocoo()
        own[stored.row[stored.col >= len(split.monomials)]] = False
        unit = np.zeros((int(own.sum()), total))
        unit[np.arange(len(unit)), before + np.flatnonzero(own)] = 1.0
        parts += [unit, -unit] if both else [unit]
        before += rows.count
    return np.concatenate(parts)
