"""The versions that an interval depends on: of the code and of the packages."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.metadata import version
from pathlib import Path

import relaxations
from smid.display.versions import PACKAGES

# Release numbers stay the same while the code changes, so the sources that compute intervals are hashed with their
# paths. Reports and commands are not hashed.
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
    """Return a digest of the computing sources, and the versions of the packages, by name.

    Two processes with equal versions compute the same intervals from the same cell.
    """
    return dict(_own())
