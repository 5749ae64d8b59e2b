"""Check mutants in this process under limits of time and memory, and judge what is accepted.

A check that takes longer than its time is stopped by an alarm on the processor's time; one that cannot be stopped (it
is inside a single operation) ends the process, and the command counts it.
"""

from __future__ import annotations

import contextlib
import functools
import json
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Any

from benchmarks.soundness.mutations.library import Genuine, library
from benchmarks.soundness.mutations.mutate import KINDS, NOT_APPLICABLE, Mutant, mutant
from benchmarks.soundness.mutations.oracle import judge
from relaxations import check

__all__ = ["MEGABYTES", "SECONDS", "VERDICTS", "Batch", "run_batch", "run_mutants"]

SECONDS, MEGABYTES = 2.0, 500
ORACLE_SECONDS = 10.0
KILL_SECONDS = 60  # of real time: nothing answers any more
VERDICTS = ("accepted", "refused", "unreadable", "failure")
PROGRAM_SHARE = {"name": 0.1, "text": 0.02, "bomb": 0.05}  # how often the program itself runs as well
PLAIN_SHARE = 0.001


@dataclass(frozen=True)
class Batch:
    """What became of some mutants.

    Parameters
    ----------
    seed, first, count : int
    verdicts : dict of str to dict of str to int
        How many of each kind ended how.
    changes : dict of str to list of int
        How often each mutation was used, and how often what it made was accepted.
    judged, without_points, given_up : int
        Accepted files that were judged with at least one feasible point, without any, and not in time.
    programs : int
        Runs of ``python -m relaxations.check``.
    slowest, largest : float
        Seconds and megabytes of one check.
    failures : list of dict
        Number, reason and file of each.
    """

    seed: int
    first: int
    count: int
    verdicts: dict[str, dict[str, int]]
    changes: dict[str, list[int]]
    judged: int = 0
    without_points: int = 0
    given_up: int = 0
    programs: int = 0
    slowest: float = 0.0
    slowest_number: int = -1
    largest: float = 0.0
    seconds: float = 0.0
    failures: list[dict[str, Any]] = field(default_factory=list)


class _TimeLimit(BaseException):
    """The alarm; no ``except Exception`` may take it."""


def run_batch(folder: str, seed: int, first: int, count: int) -> Batch:
    """Run some mutants in a worker process, under limits.

    Parameters
    ----------
    folder : str
        Of the genuine files; a file there names the mutant under way for each process.
    seed, first, count : int
    """
    with open(Path(folder) / f"under_way.{os.getpid()}", "w", encoding="utf-8") as under_way:

        def announce(number: int) -> None:
            under_way.seek(0)
            under_way.write(f"{number:12d}")
            under_way.flush()

        return run_mutants(_library(folder), seed, first, count, announce)


@functools.cache
def _library(folder: str) -> list[Genuine]:
    return library(Path(folder))


def run_mutants(
    genuine: Sequence[Genuine], seed: int, first: int, count: int, announce: Callable[[int], None] = lambda _: None
) -> Batch:
    """Run some mutants in this process.

    Parameters
    ----------
    genuine : sequence of Genuine
    seed, first, count : int
    announce : callable
        Called with the number of each mutant before it is checked.
    """
    started = time.process_time()
    verdicts = {kind: dict.fromkeys(VERDICTS, 0) for kind in KINDS}
    totals: dict[str, Any] = {"judged": 0, "without_points": 0, "given_up": 0, "programs": 0}
    changes: dict[str, list[int]] = {}
    failures: list[dict[str, Any]] = []
    slowest, slowest_number, largest = 0.0, -1, 0.0
    with tempfile.TemporaryDirectory() as own:
        path = Path(own) / "mutant.json"
        for number in range(first, first + count):
            one = mutant(seed, number, genuine)
            # A lone surrogate, which no encoding has, stands in the file as it does in a string of JSON: escaped.
            path.write_text(one.text, encoding="utf-8")
            announce(number)
            verdict, reason, theorems, spent, used = checked(path)
            if spent > slowest:
                slowest, slowest_number = spent, number
            largest = max(largest, used)
            if verdict == "accepted":
                try:
                    reason = _stated_badly(one, theorems) or _judged(one, theorems, number, totals)
                except NOT_APPLICABLE as error:
                    reason = f"accepted, and not a certificate for another reader: {type(error).__name__}: {error}"
            if not reason and _takes_the_program(one, seed, number):
                totals["programs"] += 1
                reason = _program(path, verdict)
            if reason:
                failures.append({"number": number, "reason": reason, "changes": list(one.changes), "text": one.text})
            verdicts[one.kind]["failure" if reason and verdict != "accepted" else verdict] += 1
            for change in one.changes:
                used_of = changes.setdefault(change, [0, 0])
                used_of[0] += 1
                used_of[1] += verdict == "accepted"
    return Batch(
        seed, first, count, verdicts, changes, **totals, slowest=slowest, slowest_number=slowest_number,
        largest=largest, seconds=time.process_time() - started, failures=failures,
    )  # fmt: skip


def checked(path: Path) -> tuple[str, str, tuple[Any, ...], float, float]:
    """Return verdict, reason of a failure, theorems, seconds and megabytes of one check."""
    theorems: tuple[Any, ...] = ()
    verdict, reason = "accepted", ""
    before, started = _peak(), time.process_time()
    try:
        with _limits():
            theorems = check.check(check.read(path))
    except check.Unreadable:
        verdict = "unreadable"
    except check.Refused:
        verdict = "refused"
    except _TimeLimit:
        verdict, reason = "failure", f"a check takes more than {SECONDS:g} s"
    except MemoryError:
        verdict, reason = "failure", f"a check takes more than {MEGABYTES} MB"
    except Exception as error:  # what is not one of the checker's own exceptions is a traceback for its user
        verdict, reason = "failure", f"{type(error).__name__}: {error}"[:300]
    spent, used = time.process_time() - started, _peak() - before
    if not reason and spent > SECONDS:
        verdict, reason = "failure", f"a check takes {spent:.1f} s"
    return verdict, reason, theorems, spent, used


def _peak() -> float:
    """Return the largest memory of this process so far, in megabytes."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1e6 if sys.platform == "darwin" else 1e3)


@contextlib.contextmanager
def _limits() -> Iterator[None]:
    """Limit memory and processor time of what is inside."""
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    with _alarm(SECONDS * 1.25):
        if sys.platform == "linux":
            size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
            resource.setrlimit(resource.RLIMIT_AS, (size + MEGABYTES * 1_000_000, hard))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


@contextlib.contextmanager
def _alarm(seconds: float) -> Iterator[None]:
    def stop(signum: int, frame: FrameType | None) -> None:  # noqa: ARG001
        raise _TimeLimit

    # A second alarm on real time: its default action ends the process where nothing can interrupt what runs.
    old = signal.signal(signal.SIGPROF, stop)
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.setitimer(signal.ITIMER_PROF, seconds, 0.5)
    signal.setitimer(signal.ITIMER_REAL, KILL_SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGPROF, old)


def _stated_badly(one: Mutant, theorems: Sequence[Any]) -> str:
    """Return why an accepted file should not be: what it says is not clear from what is printed of it."""
    if not theorems:
        return "accepted, and states nothing"
    names = json.loads(one.text)["variables"]
    if len(set(names)) < len(names):
        return "accepted with two variables of one name"
    if any(not name.isprintable() for name in names):
        return "accepted with a name that holds control characters"
    return ""


def _judged(one: Mutant, theorems: Sequence[Any], number: int, totals: dict[str, Any]) -> str:
    try:
        with _alarm(ORACLE_SECONDS):
            found = judge(json.loads(one.text), theorems, one.sources, random.Random(number))
    except (_TimeLimit, MemoryError, OverflowError):  # huge numbers
        totals["given_up"] += 1
        return ""
    totals["judged" if found.points else "without_points"] += 1
    return f"false claim: {found.false}" if found.false else ""


def _takes_the_program(one: Mutant, seed: int, number: int) -> bool:
    share = max(PROGRAM_SHARE.get(what, PLAIN_SHARE) for what in (one.kind, *one.changes))
    return random.Random(f"program {seed} {number}").random() < share


def _program(path: Path, verdict: str) -> str:
    """Run the program on the file; return what is wrong with its answer."""
    command = [sys.executable, "-m", "relaxations.check", str(path)]
    try:
        done = subprocess.run(command, capture_output=True, timeout=KILL_SECONDS, check=False)
    except subprocess.TimeoutExpired:
        return "the program does not end"
    printed = (done.stdout + done.stderr).decode("utf-8", "backslashreplace")
    if "Traceback" in printed or done.returncode not in (0, 1, 2):
        return f"the program ends with code {done.returncode}: {printed[-200:]!r}"
    if (done.returncode == 0) != (verdict == "accepted"):
        return f"the program ends with code {done.returncode}, the check says {verdict}"
    if any(not (character.isprintable() or character == "\n") for character in printed):
        return "the program prints control characters"
    return ""
