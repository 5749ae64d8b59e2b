"""A real Dask cluster on loopback: the same study, a worker killed in the middle, and nobody there."""

import os
import signal
import socket
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from types import SimpleNamespace

import pytest

from smid.study import Outcome, Status, StudyError, dask_executor
from smid.study.run_all import Pool, run_all
from tests.smid.study.study_records import proven
from tests.smid.study.study_to_kill import study

distributed = pytest.importorskip("distributed", reason="Dask is an extra")


@pytest.fixture(scope="module")
def cluster():
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0", host="127.0.0.1", silence_logs=50
    ) as started:
        yield started


def test_a_study_on_dask_with_a_worker_killed_equals_one_here(cluster, whole):
    killed = []

    def kill_one(line):
        if line.startswith("2 of 12") and not killed:
            with distributed.Client(cluster.scheduler_address, set_as_default=False) as client:
                pid = next(iter(client.run(os.getpid).values()))
            os.kill(pid, signal.SIGKILL)
            killed.append(pid)

    with dask_executor(cluster.scheduler_address) as executor:
        found = study(None, progress=kill_one, executor=executor)
    assert killed
    assert [o.status for o in found.outcomes] == [Status.CERTIFIED] * 12
    assert proven(found) == proven(whole)


def test_a_cell_that_dask_gives_up_is_a_failed_cell():
    class Giving(ThreadPoolExecutor):
        def submit(self, fn, /, *args, **kwargs):
            future = super().submit(fn if not args else lambda: None, **kwargs)
            future.result()
            if args:
                future._result, future._exception = (
                    None,
                    distributed.KilledWorker("cell", SimpleNamespace(address="tcp://worker"), 3),
                )
            return future

    taken = []
    with Giving(1) as executor:
        run_all(["job"], Pool(lambda: nullcontext(executor), None), lambda *pair: taken.append(pair), lambda: None)
    ((job, outcome),) = taken
    assert job == "job"
    assert isinstance(outcome, Outcome)
    assert outcome.status is Status.FAILED
    assert "KilledWorker" in outcome.message


def test_an_address_nobody_answers_is_told_soon_and_with_a_cure():
    with socket.socket() as held:  # a port that is taken and never answered
        held.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{held.getsockname()[1]}"
        with (
            pytest.raises(StudyError, match=r"no Dask scheduler answers at .* within 1 s: start one with 'dask"),
            dask_executor(address, timeout=1.0),
        ):
            pass


def test_a_cluster_without_workers_is_told():
    with (
        distributed.LocalCluster(
            n_workers=0, protocol="tcp://", dashboard_address=":0", host="127.0.0.1", silence_logs=50
        ) as empty,
        pytest.raises(StudyError, match="has no workers: start some with 'dask worker"),
        dask_executor(empty.scheduler_address, timeout=1.0),
    ):
        pass
