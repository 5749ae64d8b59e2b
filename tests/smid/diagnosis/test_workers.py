"""A diagnosis in several processes: the same result, and none of them is left behind."""

import os
import pickle
import subprocess
import sys
import threading
import time

import pytest

from smid.diagnosis import EFFECTS, Effect, diagnose
from smid.diagnosis.workers import copies
from tests.smid.diagnosis.lag_records import BOUND, LAG, dead_zone, lag, record, steps

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux makes copies of a process")


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_every_effect_of_the_library_can_be_sent_to_another_process(effect):
    assert pickle.loads(pickle.dumps(effect)) == effect


def tells_where(_model, _site):
    raise RuntimeError(f"in process {os.getpid()}")


def described(_values, _site):
    return ""


def test_two_processes_find_what_one_finds():
    u = steps(1, 240)
    data = record(u, lag(dead_zone(u, 0.3)))
    where = Effect("tells_where", "it fails and tells where", tells_where, described, needs="nothing")
    effects = [where, "input_dead_zone", "input_saturation", "input_noise", "quantisation"]
    one, two = (diagnose(LAG, data, BOUND, effects, certify=False, workers=n) for n in (1, 2))
    assert one.skipped.pop("tells_where") == f"RuntimeError: in process {os.getpid()}"
    assert two.skipped.pop("tells_where") != f"RuntimeError: in process {os.getpid()}"
    assert [cause.effect for cause in two.causes] == ["input_dead_zone"]
    assert two.to_dict() == one.to_dict()


def test_a_process_with_several_threads_is_not_copied():
    waiting = threading.Event()
    other = threading.Thread(target=waiting.wait)
    other.start()
    with copies(2) as pool:
        assert pool is None
    waiting.set()
    other.join()


KILLED = """
import os, signal, time
from smid.diagnosis.workers import copies

with copies(2) as pool:
    tasks = [pool.submit(time.sleep, 0.2) for _ in range(2)]
    print(*(process.pid for process in pool._processes.values()), flush=True)
    [task.result() for task in tasks]
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_copies_end_when_the_process_is_killed():
    told = subprocess.run([sys.executable, "-c", KILLED], stdout=subprocess.PIPE, text=True, check=False).stdout
    left = [int(pid) for pid in told.split()]
    assert len(left) == 2
    until = time.monotonic() + 30
    while left and time.monotonic() < until:
        left = [pid for pid in left if _runs(pid)]
        time.sleep(0.1)
    assert not left


def _runs(pid: int) -> bool:
    try:
        with open(f"/proc/{pid}/stat", encoding="ascii") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"  # ended, but nobody has asked for its result
    except FileNotFoundError:
        return False
