"""A certified polytope around the parameters that fit the data, which grows tighter by one direction at a time.

For a direction d, a relaxation bounds ``d'p`` over the feasible set (its support function): a half-space that holds
every parameter vector that fits. The box of an estimate is the first set of half-spaces. Others follow along the axes
of the verified points, for the set is often long and narrow, and along the slopes of what is to be bounded.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.polynomial import Polynomials
from relaxations.deadline import check_time
from relaxations.points.witness import find_witness
from relaxations.proof.bounding import Relaxed, relax
from relaxations.search.plan import Plan
from smid.feasible.feasible_set import FeasibleSet
from smid.identification.estimate import Estimate
from smid.identification.finite_box import Boxed
from smid.identification.missing import with_missing
from smid.models import ModelError

STEPS = 4  # of the search for a verified point, which begins beside the optimum
MARGIN = 1e-9  # keeps the directions of a flat set apart


@dataclass
class OuterSet:
    """Half-spaces ``directions @ p <= ends`` that hold every feasible p, and verified points.

    Parameters
    ----------
    estimate
        With certified intervals.
    names
        The parameters p.

    Attributes
    ----------
    directions, ends
        Shapes (m, n) and (m,).
    witnesses
        Each of shape (n_variables,). Verified points of the feasible set.
    solves
        Certified bounds that were computed.

    Raises
    ------
    ModelError
        Where an interval is not proven, or the feasible set has open kinks.
    """

    estimate: Estimate
    names: tuple[str, ...]
    directions: Array = field(init=False)
    ends: Array = field(init=False)
    witnesses: list[Array] = field(init=False)
    solves: int = field(init=False, default=0)

    def __post_init__(self) -> None:
        e = self.estimate
        if e.enclosure is None or not all(np.isfinite(i.width) for i in e.intervals):
            raise ModelError(f"the intervals of this estimate are not proven, so that nothing else is: {e.summary}")
        one = np.eye(len(self.names))
        self.directions = np.concatenate([one, -one])
        self.ends = np.concatenate([self.upper, -self.lower])
        self.witnesses = list(e.enclosure.witnesses)

    @property
    def lower(self) -> Array:
        """Return the lower ends of the certified intervals, shape (n,)."""
        return np.array([self.estimate[name].lower for name in self.names])

    @property
    def upper(self) -> Array:
        """Return the upper ends of the certified intervals, shape (n,)."""
        return np.array([self.estimate[name].upper for name in self.names])

    @property
    def points(self) -> Array:
        """Return the parameters of the verified points, shape (k, n)."""
        return np.array([w[self._place] for w in self.witnesses]).reshape(len(self.witnesses), len(self.names))

    @cached_property
    def axes(self) -> Array:
        """Return the directions in which the verified points spread, scaled to the box, shape (n, n)."""
        radius = 0.5 * (self.upper - self.lower)
        spread = (self.points - self.points.mean(axis=0)) / radius if len(self.points) else np.zeros((1, len(radius)))
        _, axes = np.linalg.eigh(spread.T @ spread + MARGIN * np.eye(len(radius)))
        return np.asarray(axes.T / radius, dtype=np.float64)

    def push(self, direction: Array) -> None:
        """Bound a direction over the feasible set, and look for a verified point far out in it."""
        check_time()
        place = zip(self._place.tolist(), direction.tolist(), strict=True)
        objective = Polynomials.from_terms([{(k,): -d for k, d in place if d}])
        certified = self._relaxed.bound(objective)
        self.solves += 1
        if np.isfinite(certified.bound):
            self.directions = np.vstack([self.directions, direction])
            self.ends = np.append(self.ends, -certified.bound)
        # A point that fits the windows of a long record may not fit all of it.
        if certified.point is not None and not self.estimate.windows:
            problem = self._relaxed.problem
            found = find_witness(problem, problem, objective, self._plan.complicating, certified.point, steps=STEPS)
            if found is not None:
                self.witnesses.append(found.point)

    @cached_property
    def _place(self) -> Index:
        numbers = {i.name: k for k, i in enumerate(self.estimate.intervals)}
        return np.array([numbers[name] for name in self.names], dtype=np.int64)

    @cached_property
    def _feasible(self) -> FeasibleSet:
        e = self.estimate
        feasible = FeasibleSet(e.model, e.proven_on, e.noise_bound)
        if feasible.openings:
            raise ModelError(
                f"the model {e.model.name!r} has Max, Min, Abs or sign that data and priors leave open: "
                "certified bands are for models without them"
            )
        count = len(e.intervals)
        lower, upper = feasible.problem.lower.copy(), feasible.problem.upper.copy()
        lower[:count], upper[:count] = [i.lower for i in e.intervals], [i.upper for i in e.intervals]
        whole = feasible.with_problem(feasible.problem.with_box(lower, upper))
        if not len(whole.missing):
            return whole
        assert e.enclosure is not None
        present = Boxed(whole.without(whole.missing), (), (), whole.problem)
        return with_missing(whole, present, e.enclosure, "clarabel").feasible

    @cached_property
    def _plan(self) -> Plan:
        return Plan.of(self._feasible.problem).without_cuts

    @cached_property
    def _relaxed(self) -> Relaxed:
        # On the certified box the least order gives the support function to a few parts in a thousand.
        return relax(self._feasible.problem, self._plan.method, self._plan.least)
