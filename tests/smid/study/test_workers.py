"""Workers that die: nothing is lost, nothing is run twice, and a cell that kills them is found out."""

import multiprocessing
import os
import signal
from collections import Counter
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import nullcontext

import pytest

from smid import order_study
from smid.study import Outcome, Status, StudyError
from smid.study.run_all import MOST_LOSSES, Pool, run_all
from tests.smid.study.study_records import MODEL, QUICK, proven, record
from tests.smid.study.study_to_kill import study


class Mortal(Executor):
    """One process that dies of some jobs, and takes with it all that it was handed; others end at the next look."""

    def __init__(self, killers, runs):
        self.killers, self.runs, self.handed, self.dead = killers, runs, [], False

    def submit(self, fn, /, *args, **kwargs):
        if self.dead:
            raise BrokenProcessPool("dead already")
        future = Future()
        if not args:
            future.set_result(fn(**kwargs))
            return future
        self.runs[args[0]] += 1
        self.handed.append(future)
        if args[0] in self.killers:
            self.dead = True
            for lost in self.handed:
                lost.set_exception(BrokenProcessPool("a process died"))
            self.handed = []
        return future

    def look(self):
        for future in self.handed:
            future.set_result(Outcome(Status.CERTIFIED, "done"))
        self.handed = []


def run(jobs, killers):
    """Run jobs; return how often each was run, and its outcome."""
    runs, taken, opened = Counter(), {}, []

    def take(job, outcome):
        assert job not in taken, "taken twice"
        taken[job] = outcome

    def open_executor():
        opened.append(Mortal(killers, runs))
        return nullcontext(opened[-1])

    run_all(jobs, Pool(open_executor, 2), take, lambda: opened[-1].look())
    return runs, taken


@pytest.mark.parametrize("killers", [set(), {"c"}, {"a", "f"}, {"a", "b", "c"}])
def test_a_cell_that_kills_its_worker_is_found_out_and_no_other_is_blamed(killers, monkeypatch):
    monkeypatch.setattr("smid.study.run_all._TICK", 0.01)
    jobs = list("abcdef")
    runs, taken = run(jobs, killers)
    assert set(taken) == set(jobs)
    assert {job for job, outcome in taken.items() if outcome.status is Status.FAILED} == killers
    assert all(runs[job] == MOST_LOSSES for job in killers)
    assert all(runs[job] <= 2 for job in set(jobs) - killers)
    assert all("its worker died each time" in taken[job].message for job in killers)


def test_a_real_worker_killed_in_the_middle_costs_no_cell(whole):
    killed = []

    def kill_one(line):
        if line.startswith("2 of 12") and not killed:
            victim = multiprocessing.active_children()[0]
            os.kill(victim.pid, signal.SIGKILL)
            killed.append(victim.pid)

    found = study(None, progress=kill_one)
    assert killed
    assert [o.status for o in found.outcomes] == [Status.CERTIFIED] * 12
    assert proven(found) == proven(whole)


def test_an_executor_that_is_broken_is_told():
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as executor:
        executor.submit(os.getpid).result()
        for process in multiprocessing.active_children():
            os.kill(process.pid, signal.SIGKILL)
            process.join()
        with pytest.raises(StudyError, match="give a fresh executor and resume"):
            order_study(MODEL, record(1, 5), 0.2, orders=[1], executor=executor, **QUICK)
