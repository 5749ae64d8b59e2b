"""Worker processes on this machine.

They are spawned and not forked, because a fork in the middle of another library's threads can hang. They end with their
parent process, even if it is killed: each watches a pipe whose other end only the parent holds.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection
from threading import Thread

# Without a limit each worker uses all cores: a fit of 0.4 s then took 15 s.
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "RAYON_NUM_THREADS")


@contextmanager
def local_workers(count: int) -> Iterator[ProcessPoolExecutor]:
    """Start processes of one thread each, for as long as the context lasts."""
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
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches every process of a terminal; only the parent reacts
    Thread(target=_end_with, args=(watched,), daemon=True).start()


def _end_with(watched: Connection) -> None:
    with suppress(EOFError, OSError):
        watched.recv_bytes()  # nothing is ever sent: this returns when the other end is closed
    os._exit(1)
