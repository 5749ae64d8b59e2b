"""What a tightener of intervals gets and gives: one file each, used in turn by :mod:`relaxations.search.hierarchy`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Protocol

from relaxations.algebra.arrays import Array
from relaxations.deadline import Progress
from relaxations.points.witness import Witness
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.proof_steps import Recorder
from relaxations.search.enclosure import Reason
from relaxations.search.interval_state import Ends
from relaxations.search.plan import Plan
from relaxations.solvers import Solver

Search = Callable[[Array, Array, Array, int, int], Witness | None]
BOXES = 500  # for each end and stage of branching with cuts


@dataclass(frozen=True)
class Task:
    """The intervals that are asked for, as :func:`relaxations.search.hierarchy.intervals` documents them.

    Where the problem is a relaxation, ``search`` looks for points in its place: on a box (lower and upper ends), from a
    start, for a small variable, or a large one with sign -1.
    """

    problem: PolynomialProblem
    targets: Sequence[int]
    plan: Plan
    solver: Solver
    rounds: int
    witnesses: bool
    nodes: int
    start: Array | None
    executor: Executor | None
    say: Progress
    record: Recorder | None
    search: Search | None = None


class Tightener(Protocol):
    """A way to tighten certified ends in place; whatever interrupts it, the ends are proven."""

    def __call__(self, task: Task, ends: Ends) -> Reason | None:
        """Return why nothing more is to be done; STALLED or None lets the next tightener go on."""
