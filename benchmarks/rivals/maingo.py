"""MAiNGO on the same polynomial problem: global optimisation by McCormick relaxations. It needs boxes."""

from __future__ import annotations

import time

import maingopy

from benchmarks.rivals.stated import RivalEnd, boxes, sums
from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem


class _Stated(maingopy.MAiNGOmodel):  # type: ignore[misc]
    """A polynomial problem as MAiNGO asks for it."""

    def __init__(self, problem: PolynomialProblem, objective: Polynomials) -> None:
        super().__init__()
        self.problem, self.objective = problem, objective

    def get_variables(self) -> list[maingopy.OptimizationVariable]:
        """Return the variables with their boxes."""
        return [maingopy.OptimizationVariable(maingopy.Bounds(*ends)) for ends in boxes(self.problem)]

    def evaluate(self, x: list[maingopy.FFVar]) -> maingopy.EvaluationContainer:
        """Return objective and constraints, ``g <= 0`` and ``h == 0``."""
        found = maingopy.EvaluationContainer()
        found.objective = sums(self.objective, x)[0]
        found.eq = sums(self.problem.equalities, x)
        found.ineq = [-value for value in sums(self.problem.inequalities, x)]
        return found


def maingo_minimum(problem: PolynomialProblem, objective: Polynomials, gap: float, limit: float) -> RivalEnd:
    """Minimise a polynomial, to a gap relative to ``max(1, |minimum|)`` or until a limit in seconds."""
    stated = _Stated(problem, objective)  # the solver does not keep it alive
    solver = maingopy.MAiNGO(stated)
    for option, value in (("epsilonA", gap), ("epsilonR", gap), ("maxTime", limit)):
        solver.set_option(option, value)
    for verbosity in ("loggingDestination", "writeResultFile", "LBP_verbosity", "UBP_verbosity", "BAB_verbosity"):
        solver.set_option(verbosity, 0)
    started = time.process_time()
    solver.solve()
    seconds = time.process_time() - started
    lower = float(solver.get_final_LBD())
    return RivalEnd(lower, float(solver.get_objective_value()) - lower, seconds)
