"""Small linear programs by HiGHS itself: `scipy.optimize.linprog` takes several times as long as its solver on them."""

from __future__ import annotations

import highspy
import numpy as np
from scipy import sparse

from relaxations.algebra.arrays import Array

# HiGHS's presolve (1.12 to 1.15) crashes the process on some programs of `linear_step`. Without it they take no longer.
_OPTIONS = (("output_flag", False), ("presolve", "off"), ("threads", 1))
_STRICT = (("solver", "simplex"), ("primal_feasibility_tolerance", 1e-10), ("dual_feasibility_tolerance", 1e-10))
INFEASIBLE = highspy.HighsModelStatus.kInfeasible


class _Quiet(highspy.Highs):
    """HiGHS without callbacks: to enable them prints its name."""

    def enableCallbacks(self) -> None:
        """Enable none."""


def prepared(
    cost: Array,
    rows: sparse.csr_array | sparse.csr_matrix,
    ends: tuple[Array, Array],
    box: tuple[Array, Array],
) -> highspy.Highs:
    """Return a linear program that is ready to run: the least cost in a box where rows lie between their ends."""
    solver, program = _Quiet(), highspy.HighsLp()  # type: ignore[no-untyped-call]
    for option, value in _OPTIONS:
        solver.setOptionValue(option, value)
    program.num_row_, program.num_col_ = rows.shape
    program.col_cost_, (program.col_lower_, program.col_upper_) = cost, box
    program.row_lower_, program.row_upper_ = ends
    program.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
    program.a_matrix_.start_ = rows.indptr
    program.a_matrix_.index_ = rows.indices
    program.a_matrix_.value_ = rows.data
    solver.passModel(program)
    return solver


def minimum(
    cost: Array,
    rows: sparse.csr_array | sparse.csr_matrix,
    ends: tuple[Array, Array],
    box: tuple[Array, Array],
    seconds: float,
) -> Array | highspy.HighsModelStatus:
    """Return the point of a box with the least cost whose rows lie between their ends, or why there is none."""
    solver = prepared(cost, rows, ends, box)
    for option, value in (*_STRICT, ("time_limit", seconds)):
        solver.setOptionValue(option, value)
    solver.run()
    status = solver.getModelStatus()
    return np.array(solver.getSolution().col_value) if status == highspy.HighsModelStatus.kOptimal else status
