"""What a computation of bounds does: which method, which orders, and whether cuts go first. Made once, passed down."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from numbers import Integral

import numpy as np

from relaxations.algebra.arrays import Index
from relaxations.algebra.polynomial import Polynomials
from relaxations.errors import ProblemError
from relaxations.moments.parametric_lift import complicating_variables, nonlinear_variables
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.method import LIFTS, Cuts, Lift, Method, Sparse, method_of
from relaxations.reductions.projection import Projection
from relaxations.reductions.scaling import Scaling
from relaxations.reductions.sparsity import cliques
from relaxations.search.benders.enclose import check_cuts

MOST_BEFORE_A_LIFT = 3  # variables that complicate: of more, cuts took up to twice as long as the lift alone
VERY_LONG = 10_000  # moments from which cuts bound the other variables faster, too
LONG = 600  # moments of the least lift from which cuts are faster than a relaxation of the whole record


@dataclass(frozen=True)
class Plan:
    """A relaxation method with its orders, the complicating variables, and whether cuts go first.

    Parameters
    ----------
    order, least
        The highest order and the least one: lower orders contract the box first.
    asked
        The highest order that the caller gave.
    complicating
        Variables without which every constraint is affine. Where no small set exists, a large one, which serves the
        local search for points only.
    cuts, only_cuts
        Whether cuts go before the relaxations, or in their place.
    projection
        Eliminates the noises of curves; then the plan is one for the problem without them.

    Examples
    --------
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> a, x, y = variables("a x y")
    >>> problem, _ = problem_of(x, [a * x + a * y == 1])
    >>> plan = Plan.of(problem, "auto")
    >>> plan.method.name, plan.least, plan.order, plan.complicating, plan.cuts
    ('lift', 1, 2, array([0]), False)
    """

    method: Method
    order: int
    least: int
    asked: int | None
    complicating: Index
    cuts: bool
    only_cuts: bool
    projection: Projection | None = None

    @staticmethod
    def of(
        problem: PolynomialProblem,
        method: str | Method | Cuts | Plan = "auto",
        order: int | None = None,
        objective: Polynomials | None = None,
        targets: Sequence[int] | None = None,
    ) -> Plan:
        """Return what a call means for a problem.

        With ``targets``, the variables that are asked for, noises that would complicate the problem are eliminated
        where that is possible (:mod:`relaxations.reductions.projection`); methods without a lift keep them.

        ``"auto"`` is the lift where few variables complicate, the sparse hierarchy elsewhere. An objective counts as
        a constraint; where one is given, few are less than half of those in a clique of the sparse hierarchy. On a long
        record whose order is not asked for, cuts go first: they bound the variables that complicate, and the lift
        bounds the others. (The multipliers of other variables follow those that complicate. A relaxation's multipliers
        are polynomials and can follow them; cuts would have to be many.) Where many variables complicate beside other
        targets, the lift goes alone; on a very long record, cuts do.

        Raises
        ------
        ProblemError
            For an unknown method, one that does not apply, or an order too low for the degrees.
        """
        if isinstance(method, Plan):
            return method
        if order is not None and not isinstance(order, Integral):
            raise ProblemError(f"order {order!r} is no whole number: give one, or None for the usual order")
        chosen = method_of(method)
        order = order if order is not None or chosen is None else chosen.order
        lifts = chosen is None or isinstance(chosen, (*LIFTS, Cuts))
        projection = None if targets is None or not lifts else _projection(problem, targets)
        if projection is not None:
            problem = projection.inner(problem.lower, problem.upper)
        whole = problem
        if objective is not None:  # among the equalities: a lift may leave inequalities out, but not the objective
            whole = replace(problem, equalities=Polynomials.join([problem.equalities, objective]))
        few = complicating_variables(whole)
        if isinstance(chosen, Cuts) and few is None:
            raise ProblemError("too many variables complicate this problem for cuts: choose method='sparse'")
        long = few is not None and len(few) > 0 and (1 + len(few)) * problem.n_variables >= LONG
        # Each variable that complicates multiplies the boxes that cuts need. Where a relaxation has to follow for other
        # targets, it alone is faster.
        if few is not None and len(few) > MOST_BEFORE_A_LIFT and targets is not None:
            own = targets if projection is None else np.searchsorted(projection.kept, targets)
            long = long and bool(np.isin(own, few).all())
        cuts = isinstance(chosen, Cuts) or (chosen is None and order is None and long)
        relaxation = chosen if chosen is not None and not isinstance(chosen, Cuts) else _usual(whole, few, objective)
        least, usual = relaxation.orders(whole)
        if order is not None and order < least:
            raise ProblemError(f"order {order} is too low for the degrees in this problem: the least order is {least}")
        complicating = nonlinear_variables(whole) if few is None else few
        only_cuts = isinstance(chosen, Cuts) or (cuts and (1 + len(complicating)) * problem.n_variables >= VERY_LONG)
        return Plan(relaxation, order or max(least, usual), least, order, complicating, cuts, only_cuts, projection)

    @property
    def lifts(self) -> bool:
        """Return whether the method treats the complicating variables apart."""
        return isinstance(self.method, LIFTS)

    def points(self, problem: PolynomialProblem) -> PolynomialProblem:
        """Return the problem in which points are searched and verified, on the same box."""
        return problem if self.projection is None else self.projection.inner(problem.lower, problem.upper)

    def bounds(self, problem: PolynomialProblem) -> PolynomialProblem:
        """Return the problem that is relaxed, on the same box."""
        return problem if self.projection is None else self.projection.on(problem.lower, problem.upper).problem

    @property
    def without_cuts(self) -> Plan:
        """Return the plan with relaxations alone."""
        return replace(self, cuts=False, only_cuts=False)

    def check(self, problem: PolynomialProblem) -> None:
        """Refuse a problem that would not fit the memory at the highest order, before any work.

        Raises
        ------
        ProblemError
        """
        if self.cuts:
            check_cuts(problem, self.complicating)
        else:
            self.method.check(Scaling.of_box(problem).apply(problem), self.order)


def _projection(problem: PolynomialProblem, targets: Sequence[int]) -> Projection | None:
    """Return the projection that leaves few complicating variables; None where it is of no use."""
    few, projection = complicating_variables(problem), Projection.of(problem, targets)
    if projection is None or (few is not None and not np.isin(few, projection.removed).any()):
        return None
    left = complicating_variables(projection.inner(problem.lower, problem.upper))
    return None if left is None else projection


def _usual(problem: PolynomialProblem, few: Index | None, objective: Polynomials | None) -> Method:
    """Return the method of ``"auto"`` for a problem that has the objective as a row."""
    # The hierarchy on an objective of its own is exact at order 1 or 2 on most small problems. The lift need not be.
    if few is None or (objective is not None and 2 * len(few) >= max(map(len, cliques(problem)))):
        return Sparse()
    return Lift()
