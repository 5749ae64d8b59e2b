"""A study that is killed, or interrupted, goes on as if nothing had been."""

import contextlib
import os
import random
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

from smid.study.store import FILE
from tests.smid.study.study_records import proven
from tests.smid.study.study_to_kill import study

SCRIPT = Path(__file__).with_name("study_to_kill.py")
PATIENCE = 120.0  # seconds


def begin(folder):
    """Start the study in a session of its own, so that what it leaves behind can be seen."""
    return subprocess.Popen(
        [sys.executable, SCRIPT, folder],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def done(process):
    """Return how many cells are done; the process waits until it may go on."""
    return int(process.stdout.readline().split()[0])


def go_on(process):
    process.stdin.write("\n")
    process.stdin.flush()


def wait_for_a_cell(process):
    first = done(process)
    go_on(process)
    while done(process) == first:
        go_on(process)


def has_ended(group):
    """Tell whether every process of a session ends soon."""
    until = time.monotonic() + PATIENCE
    while time.monotonic() < until:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.05)
    return False


def kept(folder):
    """Return what is in the file: cell -> outcome, as written."""
    connection = sqlite3.connect(folder / FILE)
    with contextlib.closing(connection):
        return dict(connection.execute("SELECT cell, outcome FROM cells"))


def test_a_study_killed_again_and_again_equals_one_in_a_piece(tmp_path, whole):
    chance = random.Random(7)
    before = {}
    for _ in range(2):  # four cells at most are done between two lines: twelve are not reached
        with begin(tmp_path) as process:
            wait_for_a_cell(process)
            go_on(process)
            time.sleep(chance.uniform(0, 0.5))
            os.kill(process.pid, signal.SIGKILL)
        assert has_ended(process.pid), "workers live on"
        now = kept(tmp_path) if (tmp_path / FILE).is_file() else {}
        assert before.items() <= now.items(), "a cell was lost or run twice"
        before = now
    assert 0 < len(before) < len(whole.cells)
    last = study(tmp_path)
    assert proven(last) == proven(whole)
    assert before.items() <= kept(tmp_path).items()
    assert len(kept(tmp_path)) == len(last.cells) == len(whole.cells)


def test_an_interrupt_keeps_what_is_done_and_leaves_no_process(tmp_path, whole):
    with begin(tmp_path) as process:
        wait_for_a_cell(process)
        os.kill(process.pid, signal.SIGINT)  # to this process alone; a terminal would tell the workers too
        _, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0
    assert "Traceback" not in errors
    assert has_ended(process.pid)
    assert 0 < len(kept(tmp_path)) < len(whole.cells)
    assert proven(study(tmp_path)) == proven(whole)
