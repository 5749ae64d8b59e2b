"""Worker processes of a diagnosis: copies of this process, with all that it has imported and compiled.

A copy starts in milliseconds and does not run the user's script again. Only a process with one thread can be copied
safely, and not on every system: elsewhere the diagnosis stays in its process, unless it is given an executor.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import AbstractContextManager, nullcontext
from multiprocessing import get_context

__all__ = ["copies"]

_LOOK = 1.0  # s


def copies(count: int) -> AbstractContextManager[Executor | None]:
    """Return a pool of copies of this process as a context; of None where one process is asked for or can be had."""
    if count < 2 or sys.platform != "linux" or threading.active_count() > 1:
        return nullcontext(None)
    return ProcessPoolExecutor(count, get_context("fork"), _end_with, (os.getpid(),))


def _end_with(parent: int) -> None:
    """End this process soon after its parent has ended, even if that was killed."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(_LOOK)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
