import os
import pickle
import threading
import time
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial

import numpy as np
import pytest

from relaxations import deadline
from relaxations.deadline import (
    TimeIsUp,
    check_time,
    map_in_time,
    remaining,
    stopped_by,
    time_limit,
)
from relaxations.errors import ProblemError
from relaxations.formats.expressions import problem_of, variables
from relaxations.proof.bounding import relax
from relaxations.search import minimum
from relaxations.search.enclosure import Reason
from relaxations.search.hierarchy import intervals
from relaxations.search.minimum import MinimumReason, minimise
from relaxations.solvers import Stop, clarabel, solve
from relaxations.solvers.capture import captured


def hard_problem(n):
    """Return a problem whose relaxation of order 2 has one block that takes a second for each iteration at n = 12."""
    xs = variables(" ".join(f"x{i}" for i in range(n)))
    objective = sum(xs[i] * xs[(i + 1) % n] * xs[(i + 2) % n] - 0.3 * xs[i] * xs[(i + 3) % n] for i in range(n))
    box = [end for x in xs for end in (x >= -1, x <= 1)]
    return problem_of(objective, [sum(x**2 for x in xs) <= n / 2, *box])


def seconds_of(call):
    """Return what a call took: processor time of this thread, for the machine may be busy with other things."""
    began = time.thread_time()
    found = call()
    return found, time.thread_time() - began


# ---------------------------------------------------------------- the limit itself


def test_the_earliest_of_nested_limits_counts():
    assert remaining() == np.inf
    with time_limit(1e3):
        with time_limit(1e6):
            assert remaining() <= 1e3
        with time_limit(10):
            assert remaining() <= 10
        assert 10 < remaining() <= 1e3
    assert remaining() == np.inf


def test_a_limit_ends_with_its_block_also_after_a_failure():
    with pytest.raises(TimeIsUp), time_limit(1e-9):
        check_time()
    assert remaining() == np.inf


def test_a_step_that_would_be_late_is_not_begun():
    with time_limit(10):
        check_time(1)
        with pytest.raises(TimeIsUp):
            check_time(100)


@pytest.mark.parametrize("seconds", [0, -1, float("nan"), None, "60"])
def test_a_limit_that_is_no_positive_number_is_refused_before_any_work(monkeypatch, seconds):
    def work(*_):
        raise AssertionError("work began")

    monkeypatch.setattr("relaxations.search.by_rounds.relax", work)
    monkeypatch.setattr(minimum, "relax", work)
    problem, objective = hard_problem(3)
    for call in (partial(minimise, problem, objective), partial(intervals, problem, [0])):
        with pytest.raises(ProblemError, match="give a positive number of seconds"):
            call(seconds=seconds)


def test_every_stop_has_a_name():
    class ArrayMemoryError(MemoryError):  # as numpy's
        pass

    assert [stopped_by(stop) for stop in (TimeIsUp(), KeyboardInterrupt(), ArrayMemoryError())] == [
        "TIME",
        "INTERRUPTED",
        "MEMORY",
    ]


def left(_):
    return remaining()


def test_workers_see_the_limit_of_the_thread_that_asks():
    for pool in (ThreadPoolExecutor(1), ProcessPoolExecutor(1)):
        with pool, time_limit(1e3):
            assert all(0 < value <= 1e3 for value in map_in_time(pool, left, range(3)))
    with ThreadPoolExecutor(1) as pool:
        assert list(map_in_time(pool, left, [0])) == [np.inf]
        with time_limit(np.inf):
            assert list(map_in_time(pool, left, [0])) == [np.inf]


def test_a_limit_keeps_its_instant_in_another_process():
    with time_limit(1e3):
        copy = pickle.loads(pickle.dumps(deadline._current.get()))
        assert copy.at == pytest.approx(deadline._current.get().at, abs=1.0)


def test_time_is_up_while_workers_are_still_busy():
    begun, go_on = threading.Event(), threading.Event()

    def wait(_):
        begun.set()
        assert go_on.wait(60)

    with ThreadPoolExecutor(1) as pool:
        with pytest.raises(TimeIsUp), time_limit(0.2):
            list(map_in_time(pool, wait, range(10)))
        assert begun.is_set()
        go_on.set()


# ---------------------------------------------------------------- solvers


def test_clarabel_stops_between_two_iterations():
    problem, objective = hard_problem(8)
    relaxed = relax(problem, "dense", 2, objective=objective)
    whole = solve(relaxed.program, np.zeros(relaxed.relaxation.n_moments))
    assert whole.stop is Stop.SOLVED
    with time_limit(0.5 * whole.seconds):
        cut, took = seconds_of(lambda: relaxed.bound(objective))
    assert took < 10 * whole.seconds + 1
    assert np.isneginf(cut.bound) or cut.bound <= minimise(problem, objective).upper


def test_ctrl_c_within_a_solve_is_not_swallowed(monkeypatch):
    def interrupt():
        raise KeyboardInterrupt

    problem, _ = hard_problem(4)
    relaxed = relax(problem, "dense", 2)
    cost = np.zeros(relaxed.relaxation.n_moments)
    cost[1:] = np.random.default_rng(0).normal(size=len(cost) - 1)
    calls = iter([np.inf] * 4)
    monkeypatch.setattr(clarabel, "remaining", lambda: next(calls, None) or interrupt())
    with pytest.raises(KeyboardInterrupt):
        solve(relaxed.program, cost)


@pytest.mark.parametrize("solver", ["clarabel", "highs", "scs", "OSQP", "SCIPY"])
def test_a_solver_has_what_is_left_as_its_limit(solver):
    x, y = variables("x y")
    problem, objective = problem_of(x - y, [x + y <= 1, x >= 0, x <= 1, y >= 0, y <= 1])
    if solver == "scs":
        pytest.importorskip("scs", reason="SCS is not installed")
    with time_limit(1e3):
        certified = relax(problem, "rlt", 1, solver).bound(objective)
    assert certified.bound == pytest.approx(-1, abs=1e-3)
    with time_limit(1e-9), pytest.raises(TimeIsUp):
        solve(relax(problem, "rlt", 1, solver).program, np.zeros(3), solver)


def test_data_that_are_not_finite_are_not_handed_to_a_solver(monkeypatch):
    problem, _ = hard_problem(3)
    relaxed = relax(problem, "dense", 2)
    cost = np.zeros(relaxed.relaxation.n_moments)
    cost[1] = np.nan
    monkeypatch.setattr(clarabel, "run", None)
    found = solve(relaxed.program, cost)
    assert found.stop is Stop.FAILED
    assert np.isnan(found.dual).all()
    assert np.isnan(found.moments).all()


def test_what_a_panic_writes_is_not_shown_and_other_text_is(capfd):
    with captured(2) as drop:
        with captured(2):  # as of another thread
            os.write(2, b"dropped")
        drop.append("panic")
    assert capfd.readouterr().err == ""
    with captured(2):
        os.write(2, b"kept")
    assert capfd.readouterr().err == "kept"


# ---------------------------------------------------------------- whole calls


@pytest.mark.parametrize("seconds", [0.2, 2.0])
def test_a_relaxation_that_takes_longer_is_cut_short(seconds):
    problem, objective = hard_problem(11)
    found, took = seconds_of(lambda: minimise(problem, objective, method="dense", seconds=seconds))
    assert found.reason is MinimumReason.TIME
    assert took < 1.1 * seconds + 1
    assert np.isfinite(found.lower)
    value = np.sum(objective.evaluate(np.zeros(11)))
    assert found.lower <= value


def test_intervals_within_a_time_limit_are_those_proven_so_far():
    problem, _ = hard_problem(11)
    found, took = seconds_of(lambda: intervals(problem, [0, 1], method="dense", order=2, seconds=0.5))
    assert found.reason is Reason.TIME
    assert took < 1.6
    assert [(i.lower, i.upper) for i in found.intervals] == [(-1.0, 1.0)] * 2
