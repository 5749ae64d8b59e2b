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


def compare():
    """Diagnose in one process and in two, in a process that has one thread."""
    u = steps(1, 240)
    data = record(u, lag(dead_zone(u, 0.3)))
    where = Effect("tells_where", "it fails and tells where", tells_where, needs="nothing")
    effects = [where, "input_dead_zone", "input_saturation", "input_noise", "quantisation"]
    one, two = (diagnose(LAG, data, BOUND, effects, certify=False, workers=n) for n in (1, 2))
    assert one.skipped.pop("tells_where") == f"RuntimeError: in process {os.getpid()}"
    assert two.skipped.pop("tells_where") != f"RuntimeError: in process {os.getpid()}"
    assert [cause.effect for cause in two.causes] == ["input_dead_zone"]
    assert two.to_dict() == one.to_dict()


def run(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False)


def test_two_processes_find_what_one_finds():
    done = run("from tests.smid.diagnosis.test_workers import compare; compare()")
    assert done.returncode == 0, done.stderr


def test_a_process_with_several_threads_is_not_copied():
    waiting = threading.Event()
    other = threading.Thread(target=waiting.wait)
    other.start()
    with copies(2) as pool:
        assert pool is None
    waiting.set()
    other.join()


ENDED = """
import os, signal, time
from smid.diagnosis.workers import copies

with copies(2) as pool:
    tasks = [pool.submit(time.sleep, 0.5) for _ in range(2)]
    print(*(process.pid for process in pool._processes.values()), flush=True)
    {end}
"""


@pytest.mark.parametrize("end", ["os.kill(os.getpid(), signal.SIGKILL)", "raise KeyboardInterrupt", "pass"])
def test_no_copy_is_left(end):
    left = [int(pid) for pid in run(ENDED.format(end=end)).stdout.split()]
    assert len(left) == 2
    until = time.monotonic() + 30
    while left and time.monotonic() < until:
        left = [pid for pid in left if _runs(pid)]
        time.sleep(0.1)
    assert not left


INTERRUPTED = """
import os, signal
from smid.diagnosis import workers

def begin_and_interrupt(*arguments):
    os.kill(os.getpid(), signal.SIGINT)  # while the process is copied
    return first(*arguments)

first, workers.ProcessPoolExecutor = workers.ProcessPoolExecutor, begin_and_interrupt
try:
    with workers.copies(2):
        print("lost")
except KeyboardInterrupt:
    print("interrupted")
"""


def test_an_interrupt_while_copies_are_made_is_not_lost():
    done = run(INTERRUPTED)
    assert done.stdout == "interrupted\n", done.stderr


def _runs(pid: int) -> bool:
    try:
        with open(f"/proc/{pid}/stat", encoding="ascii") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"  # ended, but nobody has asked for its result
    except FileNotFoundError:
        return False
