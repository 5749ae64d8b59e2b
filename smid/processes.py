"""Worker processes on this machine, which end with this process even if it is killed.

Each watches a pipe whose other end only this process holds.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager, suppress
from itertools import chain
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from threading import Thread, active_count
from typing import TypeVar

__all__ = ["THREADS", "can_copy", "copies", "side_by_side", "spawned"]

Item = TypeVar("Item")

# Without a limit each worker uses all cores: a fit of 0.4 s then took 15 s.
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "RAYON_NUM_THREADS")
_ENDING = {signal.SIGINT, signal.SIGTERM}


@contextmanager
def spawned(count: int) -> Iterator[ProcessPoolExecutor]:
    """Start new processes of one thread each, for as long as the context lasts.

    They work on every system and beside other threads; the user's script needs a ``__main__`` guard.
    """
    context = get_context("spawn")
    watched, held = context.Pipe(duplex=False)
    with watched, held, _one_thread_each():
        pool = ProcessPoolExecutor(count, context, _begin, (watched,))
        try:
            yield pool
        except BaseException:
            held.close()  # ends the workers; their results are not needed
            raise
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def can_copy() -> bool:
    """Return whether this process can be copied safely: on Linux, with a single thread."""
    return sys.platform == "linux" and active_count() == 1


@contextmanager
def copies(count: int) -> Iterator[Executor | None]:
    """Copy this process, with all that it has imported, for as long as the context lasts.

    A copy starts in milliseconds and does not run the user's script again.  Where this process cannot be copied, and
    where one process is wanted, None is given.
    """
    if count < 2 or not can_copy():
        yield None
        return
    context = get_context("fork")
    watched, held = context.Pipe(duplex=False)
    with watched, held:
        with _no_interrupt():
            pool = ProcessPoolExecutor(count, context, _begin_copy, (watched, held))
            pool.submit(int)
        try:
            yield pool
        finally:
            held.close()  # ends the copies, also in the middle of what nobody waits for
            pool.shutdown(wait=True, cancel_futures=True)


def side_by_side(tasks: Sequence[Callable[[], Iterable[Item]]]) -> Generator[Item]:
    """Yield what tasks yield, as it comes: each task has a copy of this process, with a copy of all it works on.

    A single task runs in this process; for several it must be one that can be copied. A copy that crashes yields no
    more.
    """
    if len(tasks) < 2:
        yield from chain.from_iterable(task() for task in tasks)
        return
    context = get_context("fork")
    watched, held = context.Pipe(duplex=False)
    with watched, held:
        running = {}
        try:
            with _no_interrupt():
                for task in tasks:
                    told, tell = context.Pipe(duplex=False)
                    with tell:
                        running[told] = context.Process(target=_tell, args=(task, tell, watched, held))
                        running[told].start()
            unfinished = list(running)
            while unfinished:
                ready = wait(unfinished)
                for told in [one for one in unfinished if one in ready]:
                    try:
                        yield told.recv()
                    except EOFError:
                        unfinished.remove(told)
        finally:
            held.close()  # ends the copies
            for told, process in running.items():
                process.join()
                told.close()


@contextmanager
def _no_interrupt() -> Iterator[None]:
    """Hold back what interrupts the making of a copy: it would be lost."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _ENDING)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Set the number of threads that new processes inherit, unless the user has set it."""
    missing = [name for name in THREADS if name not in os.environ]
    os.environ.update(dict.fromkeys(missing, "1"))
    try:
        yield
    finally:
        for name in missing:
            os.environ.pop(name, None)


def _begin(watched: Connection) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches every process of a terminal; only the first reacts
    Thread(target=_end_with, args=(watched,), daemon=True).start()


def _begin_copy(watched: Connection, held: Connection) -> None:
    held.close()  # a copy inherits it, and only the first process may hold it
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    _begin(watched)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _ENDING)


def _tell(task: Callable[[], Iterable[Item]], tell: Connection, watched: Connection, held: Connection) -> None:
    """Send what a task yields to the process that this one is a copy of."""
    _begin_copy(watched, held)
    for item in task():
        tell.send(item)


def _end_with(watched: Connection) -> None:
    with suppress(EOFError, OSError):
        watched.recv_bytes()  # nothing is ever sent: this returns when the other end is closed
    os._exit(1)
