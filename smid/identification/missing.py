"""The noises of missing samples: a box for each, so that the equations that read it can be used.

A missing sample is no constraint, but every certified bound needs a finite box of all variables. So the parameters are
enclosed first by the equations that read no missing sample, as if the record were split there. What holds for some of
the equations holds for all of them. Then the equation of a missing sample's own instant gives it, as in a simulation:
its other terms are bounded by interval arithmetic over the box of the parameters and of the samples before it.

Such boxes may widen from sample to sample, as those of an oscillating plant do. A wide one is tightened by a relaxation
of the equations before it. Where that does not help, the sample is left out with the equations that read it: a new
state begins after it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.bounding import relax
from relaxations.proof.proof_steps import Bound, Quotient, Recorder
from relaxations.search.enclosure import Enclosure
from relaxations.search.plan import Plan
from relaxations.solvers import Solver
from smid.feasible.feasible_set import FeasibleSet
from smid.feasible.regimes import ranges
from smid.identification.finite_box import Boxed

Terms = list[tuple[float, float, list[int]]]
WIDE, WIDEST = 0.1, 1.0  # shares of the range of the output: a wider box is tightened, and of no use
WINDOW = 20  # samples whose equations tighten a box


def with_missing(
    whole: FeasibleSet, boxed: Boxed, enclosure: Enclosure, solver: Solver, record: Recorder | None = None
) -> Boxed:
    """Return the set with those missing samples that get a useful box.

    Parameters
    ----------
    whole
        The set with all missing samples.
    boxed, enclosure
        The set without them, with a finite box, and the intervals of its parameters.
    record
        Called with the steps that prove the boxes.
    """
    problem = whole.problem
    place = {name: k for k, name in enumerate(problem.names)}
    lower, upper = problem.lower.copy(), problem.upper.copy()
    known = boxed.feasible.problem
    own = np.array([place[name] for name in known.names])
    lower[own], upper[own] = known.lower, known.upper
    for interval in enclosure.intervals:
        lower[place[interval.name]], upper[place[interval.name]] = interval.lower, interval.upper
    # Take the equations in order of time; each may give one missing sample, in terms of variables with a box.
    reading = np.unique(problem.equalities.rows[np.isin(problem.equalities.factors, whole.missing).any(axis=1)])
    reading = reading[np.lexsort((reading, *whole.samples[reading].T[::-1]))]
    equalities = problem.equalities.take(reading)
    pending = dict(enumerate(equalities.terms()))
    left = set(whole.missing.tolist())
    span = _largest_range(whole)
    count = -1
    while count != len(left):  # once, for a model of one line
        count = len(left)
        for k, terms in list(pending.items()):
            given = _given(terms, left)
            if given is None:
                continue
            del pending[k]
            v, factor = given
            lower[v] = upper[v] = 0.0
            rest = ranges(equalities.take(np.array([k])), lower, upper)
            ends = sorted((-float(rest.low[0]) / factor, -float(rest.high[0]) / factor))
            lower[v], upper[v] = np.nextafter(ends, (-np.inf, np.inf))
            if not np.isfinite(upper[v] - lower[v]):
                continue
            if record:
                record(Quotient(problem, int(reading[k]), v))
            if upper[v] - lower[v] > WIDE * span:
                part = _before(whole, int(reading[k]), problem.with_box(lower, upper), left - {v})
                lower[v], upper[v] = _tightened(part, problem.names[v], solver, record)
            if upper[v] - lower[v] <= WIDEST * span:
                left.remove(v)
    return replace(boxed, feasible=whole.with_problem(problem.with_box(lower, upper)).without(np.array(sorted(left))))


def _given(terms: Terms, left: set[int]) -> tuple[int, float] | None:
    """Return the only variable of these that an equality holds and its factor, where that is a number; else None."""
    factors = {v: (mid, rad, len(own)) for mid, rad, own in terms for v in own if v in left}
    if len(factors) != 1 or sum(v in left for _, _, own in terms for v in own) != 1:
        return None
    ((v, (mid, rad, degree)),) = factors.items()
    return (v, mid) if degree == 1 and rad == 0 else None


def _before(whole: FeasibleSet, row: int, problem: PolynomialProblem, left: set[int]) -> PolynomialProblem:
    """Return the equations of the last samples up to an equation, without those that read what has no box."""
    run, instant = whole.samples[row]
    runs, instants = whole.samples.T
    rows = np.flatnonzero((runs == run) & (instants <= instant) & (instants > instant - WINDOW))
    kept = [np.arange(len(whole.model.parameters)), problem.equalities.take(rows).occurring()]
    others = np.setdiff1d(np.arange(problem.n_variables), np.concatenate(kept))
    return problem.without(np.union1d(others, np.array(sorted(left), dtype=np.int64)))[0]


def _tightened(problem: PolynomialProblem, name: str, solver: Solver, record: Recorder | None) -> tuple[float, float]:
    """Return certified ends of a variable."""
    v = problem.names.index(name)
    plan = Plan.of(problem)
    relaxed = relax(problem, plan.method, plan.least, solver)
    ends = [float(-problem.lower[v]), float(problem.upper[v])]
    for k, sign in enumerate((1.0, -1.0)):
        certified = relaxed.bound(problem.variable(v, sign))
        # An empty set is bounded by anything; the whole will be proven empty.
        if -ends[k] < certified.bound < np.inf:
            ends[k] = -certified.bound
            if record:
                record(Bound.of(relaxed, problem.variable(v, sign), certified))
    return -ends[0], ends[1]


def _largest_range(feasible: FeasibleSet) -> float:
    """Return the largest range of the outputs that have missing samples."""
    channels = (c for c in feasible.model.output_channels if feasible.data.missing[c])
    return max(float(np.nanmax(samples) - np.nanmin(samples)) for samples in map(feasible.data.stacked, channels))
