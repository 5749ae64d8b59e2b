"""Certified intervals of variables as a result: their ends, what proves each, and why the computation stopped."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from html import escape

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import TimeIsUp
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.bounding import Emptiness
from relaxations.proof.method import Cuts


class Proof(Enum):
    """What proves an end of an interval.

    Examples
    --------
    >>> print(Proof.BOX.value)
    not tightened by the data: the prior box's own end
    """

    PROVEN = "certified in ball arithmetic"
    BOX = "not tightened by the data: the prior box's own end"


class Reason(Enum):
    """Why the computation of intervals stopped.

    Examples
    --------
    >>> print(Reason.EMPTY.value)
    the feasible set is certified empty
    """

    TIGHT = "every end meets a verified point within the tolerance"
    STALLED = "the bounds no longer improve at this order; raise the order to tighten"
    ROUNDS = "all rounds are used"
    SMALLEST = "smaller boxes would prove no more; more steps between samples tighten a differential equation's ends"
    OUTLIERS = "more outliers are allowed than were found, so the bounds are those of parts of the record"
    WINDOWS = "longer windows of the record would tighten the bounds: the model remembers for long"
    EMPTY = "the feasible set is certified empty"
    TIME = "the time limit was reached; the ends proven so far are returned"
    INTERRUPTED = "interrupted; the ends proven so far are returned"
    MEMORY = "out of memory; the ends proven so far are returned"
    UNBOUNDED = "no finite box could be proven, so there are no bounds: give bounds, or data with more excitation"


STOPPED = {Reason.TIME: TimeIsUp, Reason.INTERRUPTED: KeyboardInterrupt, Reason.MEMORY: MemoryError}
"""What ended a computation early."""


@dataclass(frozen=True)
class Interval:
    """The range of one variable: certified outer ends, and inner ends at verified points.

    Parameters
    ----------
    lower, upper
        Every feasible point lies between them; proven.
    inner_lower, inner_upper
        Values at verified feasible points; NaN where none was found.
    from_box
        Whether each end is the prior box's own.
    status
        The solver's words for each end.

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
    """Intervals of the variables asked for, in that order, and how they were computed.

    Parameters
    ----------
    witnesses
        Each of shape (n_variables,). Verified feasible points.
    empty
        The proof where the set is empty.
    order
        The highest one used; 0 where cuts needed no relaxation.
    rounds, solves
        Contractions of the box, and bounds computed.
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
        names = {"lift": "parametric lift", Cuts.name: "Benders cuts", "inversion": "inversion of the free run"}
        within = f" in {', '.join(self.complicating)}" if self.complicating else ""
        order = f", order {self.order}" if self.order else ""
        before = f"{names[Cuts.name]}, then " if self.after_cuts else ""
        return f"{before}{names.get(self.method, f'{self.method} relaxation')}{within}{order}"

    @property
    def work(self) -> str:
        """Return in words what was solved."""
        kinds = {Cuts.name: "linear programs", "inversion": "contractions"}
        kind = "programs" if self.after_cuts else kinds.get(self.method, "certified solves")
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


def uninterrupted(enclosure: Enclosure) -> Enclosure:
    """Return an enclosure that ran to its end; raise again what stopped it otherwise."""
    if enclosure.reason in STOPPED:
        raise STOPPED[enclosure.reason]
    return enclosure


def contracted(problem: PolynomialProblem, enclosure: Enclosure) -> PolynomialProblem:
    """Return the problem on the box that an enclosure of some of its variables proves."""
    place = {name: k for k, name in enumerate(problem.names)}
    lower, upper = problem.lower.copy(), problem.upper.copy()
    for interval in enclosure.intervals:
        lower[place[interval.name]], upper[place[interval.name]] = interval.lower, interval.upper
    return problem.with_box(lower, upper)
