"""Published polynomial problems with known optima: a certified bound never lies above one."""

import time

import numpy as np
import pytest

from relaxations.library import load, names
from relaxations.proof.bounding import relax
from relaxations.search.hierarchy import intervals
from relaxations.search.plan import Plan

CASES = {name: load(name) for name in names()}
SECONDS = 30.0  # no case is begun after that
SMALL = [
    name
    for name, case in CASES.items()
    if case.is_bounded and case.problem.n_variables <= 6 and not name.startswith("smid_")
]
IDENTIFICATION = [name for name in CASES if name.startswith("smid_")]


def test_the_library_holds_the_cases_that_are_tested():
    assert len(SMALL) >= 10
    assert len(IDENTIFICATION) >= 10


def test_no_certified_bound_lies_above_a_known_optimum(record_property):
    started, done, close, false = time.perf_counter(), 0, [], []
    for name in SMALL:
        if time.perf_counter() - started > SECONDS:
            break
        case = CASES[name]
        problem, objective = case.problem, case.objective
        least = max(1, -(-max(problem.degree, objective.degree) // 2))
        order = max(least, min(case.order or 2, 2))
        for method in ("sparse", "textbook"):
            certified = relax(problem, method, order, objective=objective).bound(objective)
            done += 1
            size = max(1.0, abs(case.optimum))
            if certified.bound > case.optimum + 1e-7 * size:
                false.append((name, method, certified.bound, case.optimum))
            if abs(certified.bound - case.optimum) < 1e-6 * size:
                close.append((name, method))
    record_property("bounds", done)
    record_property("within 1e-6", len(close))
    print(f"{done} bounds, {len(close)} within 1e-6 of the optimum")
    assert done >= 10
    assert not false


@pytest.mark.parametrize("name", IDENTIFICATION)
def test_ends_of_identification_problems_are_met_from_outside(name):
    case = CASES[name]
    problem, objective = case.problem, case.objective
    degree_one = objective.term_degrees == 1
    assert degree_one.sum() == 1
    k = int(objective.factors[degree_one].max())
    sign = float(objective.coefficients.mid[degree_one][0])
    found = intervals(problem, [k], method=Plan.of(problem, "lift")).intervals[0]
    bound = found.lower if sign > 0 else -found.upper
    optimum = case.optimum
    # The optima are those of a solver with tolerances of 1e-9 and a gap of about 1e-6.
    assert bound <= optimum + 1e-6 * max(1.0, abs(optimum))
    assert bound == pytest.approx(optimum, abs=1e-4 * max(found.width, np.abs(optimum)))
