"""Copies of this process: none is made beside other threads, none is left behind, and no interrupt is lost."""

import subprocess
import sys
import threading
import time

import pytest

from smid.processes import copies, side_by_side

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


SIDE_BY_SIDE = """
import os, time
from functools import partial
from smid.processes import side_by_side

def told(name, seconds):
    for k in range(2):
        time.sleep(seconds)
        yield name, k, os.getpid()
    {end}

began = time.monotonic()
found = side_by_side([partial(told, "slow", 0.4), partial(told, "quick", 0.05)])
items = [next(found)] if {one} else list(found)
found.close()
copies = {{pid for *_, pid in items}}
print(*(f"{{name}} {{k}}" for name, k, _ in items), sep=", ")
assert os.getpid() not in copies and len(copies) == len({{name for name, *_ in items}})
assert time.monotonic() - began < 30
"""


@pytest.mark.parametrize(
    ("end", "one", "said"),
    [
        ("pass", False, "quick 0, quick 1, slow 0, slow 1"),
        ("os._exit(3)", False, "quick 0, quick 1, slow 0, slow 1"),  # as where a copy crashes
        ("time.sleep(1000)", True, "quick 0"),  # nobody waits for the rest
    ],
)
def test_tasks_side_by_side_tell_what_they_have_as_it_comes(end, one, said):
    done = run(SIDE_BY_SIDE.format(end=end, one=one))
    assert done.stdout == f"{said}\n", done.stderr


def test_a_single_task_needs_no_copy():
    assert list(side_by_side([lambda: [1, 2]])) == [1, 2]
    assert list(side_by_side([])) == []


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
