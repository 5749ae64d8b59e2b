"""The process that runs the code of the steps, one after the other, in the folder of the record."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from relaxations.errors import UserError
from smid.app.steps import FILES, PRODUCED, STEPS
from smid.display.progress import Step

__all__ = ["work"]


def work(connection: Connection, folder: str) -> None:
    """Run each step that arrives on a connection, until the other end is closed.

    A step arrives as its name and its code. Events leave as plain data: ``line`` for progress, with ``done`` of
    ``total`` pieces, 0 where nobody knows how many there are; at last the result. SIGINT ends a step early.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Processes that a diagnosis starts are in the group of this one, so that one signal reaches them all.
    if hasattr(os, "setpgrp"):
        os.setpgrp()
    os.chdir(folder)
    # Here and not above: the server imports this module too, and needs neither figures nor pages.
    import smid.app.views  # noqa: F401  (loaded before the first step)

    names: dict[str, Any] = {"__name__": "__main__"}

    def tell(shown: object) -> None:
        """Stand in for ``print``: progress comes as text; results, which the page shows by itself, as objects."""
        if isinstance(shown, str):
            done, total = (shown.done, shown.total) if isinstance(shown, Step) else (0, 0)
            connection.send({"line": str(shown), "done": done, "total": total})

    names["print"] = tell
    with suppress(EOFError, OSError):
        connection.send({"ready": os.getpid()})
        while True:
            step, code = connection.recv()
            connection.send(_result(step, code, names))


def _result(step: str, code: str, names: dict[str, Any]) -> dict[str, Any]:
    """Run the code of a step; return what the page shows of it."""
    from smid.app.views import answer, empty_answer
    from smid.identification.identify import EmptyFeasibleSetError

    _forget(STEPS[STEPS.index(step) :], names)
    error, shown = "", None
    try:
        with _stoppable():
            exec(compile(code, f"<step {step}>", "exec"), names)
    except EmptyFeasibleSetError as proof:
        shown = empty_answer(proof, names)
    except BaseException as caught:
        error = _told(caught)
    # What a step has found before it failed is shown too.
    if shown is None and any(name in names for name in PRODUCED[step]):
        try:
            shown = answer(step, names)
        except Exception as caught:
            _forget([step], names)
            error = error or _told(caught)
    return {
        "error": error,
        "answer": None if shown is None else asdict(shown),
        "names": [name for made in PRODUCED.values() for name in made if name in names],
        "files": [(file, label) for file, label in FILES.get(step, {}).items() if Path(file).exists()],
    }


@contextmanager
def _stoppable() -> Iterator[None]:
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def _forget(steps: Sequence[str], names: dict[str, Any]) -> None:
    """Take back what steps have found, and the files that they wrote."""
    for step in steps:
        for name in PRODUCED[step]:
            names.pop(name, None)
        for file in FILES.get(step, ()):
            Path(file).unlink(missing_ok=True)


def _told(error: BaseException) -> str:
    """Return an error in a sentence: cause and cure where it is the user's, its kind where it is not."""
    match error:
        case KeyboardInterrupt():
            return "stopped before the end"
        case MemoryError():
            return "out of memory: take fewer samples"
        case UserError():
            return str(error)
        case OSError(filename=str(name), strerror=str(why)):
            return f"{name}: {why}; check the path and its permissions"
        case _:
            return f"a fault of smid ({type(error).__name__}: {error}): report it with the Python below"
