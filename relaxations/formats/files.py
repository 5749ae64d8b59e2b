"""A text file, and what a parser makes of it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from relaxations.errors import ProblemError

Parsed = TypeVar("Parsed")


def parsed(path: str | Path, parse: Callable[[str], Parsed]) -> Parsed:
    """Return what a parser makes of a file; its errors get the name of the file."""
    try:
        text = Path(path).read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise ProblemError(f"{path} cannot be read: {error.strerror}") from None
    try:
        return parse(text)
    except ProblemError as error:
        raise ProblemError(f"{path}: {error}") from None
