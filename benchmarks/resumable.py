"""Run cases in worker processes and keep each result at once: an interrupted run goes on where it stopped."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

    CaseResult = TypeVar("CaseResult", bound=DataclassInstance)

__all__ = ["kept", "run"]


def kept(cache: Path) -> list[dict[str, Any]]:
    """Read what earlier runs have left.

    Parameters
    ----------
    cache : Path
        One JSON object a line; a file that is missing is empty.

    Returns
    -------
    list of dict
    """
    entries = []
    for line in cache.read_text(encoding="utf-8").splitlines() if cache.exists() else ():
        try:
            entries.append(json.loads(line))
        except json.JSONDecodeError:  # an empty line, or what an interrupted run left unfinished
            continue
    return entries


def run(
    cache: Path,
    function: Callable[..., CaseResult],
    cases: Sequence[tuple[Any, ...]],
    workers: int,
    also: Mapping[str, Any] | None = None,
) -> Iterator[CaseResult]:
    """Run cases side by side, and append each result to the file as soon as it is there.

    Parameters
    ----------
    cache : Path
    function : callable
        Of a module, so that worker processes can import it.
    cases : sequence of tuple
        Its arguments.
    workers : int
    also : mapping, optional
        Fields to keep beside the result's own.

    Yields
    ------
    CaseResult
        In the order in which they are done.
    """
    cache.parent.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(workers) as pool, cache.open("a", encoding="utf-8") as file:
        file.write("\n")  # ends a line that an interrupted run left unfinished; empty lines are skipped
        for future in as_completed([pool.submit(function, *case) for case in cases]):
            result = future.result()
            file.write(json.dumps(asdict(result) | dict(also or {})) + "\n")
            file.flush()
            yield result
