"""Copies of this process: none is made beside other threads, none is left behind, and no interrupt is lost."""

import subprocess
import sys
import threading
import time

import pytest

from smid.processes import copies

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux makes copies of a process")


def run(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120, check=False)


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
from smid.processes import copies

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
from smid import processes

def begin_and_interrupt(*arguments):
    os.kill(os.getpid(), signal.SIGINT)  # while the process is copied
    return first(*arguments)

first, processes.ProcessPoolExecutor = processes.ProcessPoolExecutor, begin_and_interrupt
try:
    with processes.copies(2):
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
