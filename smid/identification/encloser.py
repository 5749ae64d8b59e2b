"""What computes the parameter intervals of a feasible set: one protocol, fulfilled for two kinds of models.

Models without Max, Min, Abs and sign, or whose priors and data decide all of them, are polynomial
(:mod:`smid.identification.polynomial`); the others are piecewise (:mod:`smid.identification.piecewise`).
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.polynomial import Polynomials
from relaxations.deadline import Progress
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.bounding import relax
from relaxations.proof.method import Cuts, Method
from relaxations.proof.proof_steps import Kinks, Step
from relaxations.search.enclosure import Enclosure, Reason
from relaxations.search.plan import Plan
from relaxations.solvers import Solver
from smid.data.window import Window
from smid.identification.estimate import CentreStatus
from smid.identification.finite_box import Boxed

NOTHING = Polynomials.from_terms([{}])  # the objective of a search for any feasible point


@dataclass(frozen=True)
class Settings:
    """How intervals are computed; :func:`smid.identify` documents each setting."""

    method: str | Method | Cuts = "auto"
    order: int | None = None
    solver: Solver = "clarabel"
    tolerance: float = 1e-4
    rounds: int = 10
    nodes: int = 0
    executor: Executor | None = None
    progress: Progress | None = None


@dataclass(frozen=True)
class Enclosed:
    """What an encloser found: the box, why it stopped, and the enclosure (None where it ended before any bound).

    The box is None where it ended before one was looked for. The proof is about some ``windows`` of the record, or
    about all of it where there are none.
    """

    boxed: Boxed | None
    reason: Reason
    enclosure: Enclosure | None = None
    windows: tuple[Window, ...] = ()


class Encloser(Protocol):
    """Computes certified intervals of a feasible set. Its constructor refuses a wrong call before any work."""

    def enclose(self) -> Enclosed:
        """Return the intervals; where it is stopped, those proven so far."""

    def proof(self) -> tuple[PolynomialProblem, Sequence[Step], Kinks | None]:
        """Return the problem as a certificate file states it, the steps, and the kinks."""

    def centre(self, enclosure: Enclosure) -> tuple[CentreStatus, Array | None]:
        """Decide whether the interval centres are feasible; where not, return the nearest feasible point found."""


def nearest_witness(enclosure: Enclosure) -> Array | None:
    """Return the verified point whose parameters lie nearest to the centres, in widths; None without any."""
    centre = np.array([i.centre for i in enclosure.intervals])
    width = np.array([max(i.width, 1e-300) for i in enclosure.intervals])
    away = [float(np.abs((point[: len(centre)] - centre) / width).max()) for point in enclosure.witnesses]
    return enclosure.witnesses[int(np.argmin(away))] if away else None


def proven_infeasible(problem: PolynomialProblem, plan: Plan, solver: Solver) -> bool:
    """Return whether the lift, where it applies, proves that no point is feasible."""
    return plan.lifts and relax(problem, plan.method, plan.order, solver).bound(NOTHING).bound == np.inf
