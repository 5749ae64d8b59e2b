"""The versions that an interval depends on: of the code that computes it and of the packages below."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.metadata import version
from pathlib import Path

import relaxations
from smid.display.versions import PACKAGES

__all__ = ["computing_versions"]

# Release numbers stay the same while the code changes, so the sources are hashed: the rooms that intervals come from,
# and not the pages and commands that show them. The paths are hashed as well, so that a move makes a study stale.
HASHED = ("data", "models", "networks", "fitting", "feasible", "identification", "verification")
"""Rooms of `smid` that decide what an interval is; all of `relaxations` does."""


@cache
def _own() -> tuple[tuple[str, str], ...]:
    smid = Path(__file__).parents[1]
    digest = hashlib.sha256()
    for folder in (Path(relaxations.__path__[0]), *(smid / room for room in HASHED)):
        for path in sorted(folder.rglob("*.py")):
            digest.update(path.relative_to(folder).as_posix().encode() + b"\0" + path.read_bytes())
    return ("code", digest.hexdigest()[:16]), *((name, version(name)) for name in PACKAGES)


def computing_versions() -> dict[str, str]:
    """Return a digest of the computing sources, and the versions of the packages they use.

    Returns
    -------
    dict
        Name -> version; two processes whose dictionaries are equal compute the same intervals from the same cell.

    Examples
    --------
    >>> list(computing_versions())
    ['code', 'smid', 'numpy', 'scipy', 'sympy', 'cvxpy', 'clarabel']
    """
    return dict(_own())
