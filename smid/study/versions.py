"""The versions that an interval depends on: of the code that computes it and of the packages below."""

from __future__ import annotations

import hashlib
from functools import cache
from importlib.metadata import version
from pathlib import Path

import relaxations
from smid.versions import PACKAGES

__all__ = ["computing_versions"]

# Release numbers stand still while the code is worked on, so the sources themselves are hashed: those that intervals
# come from, and not the pages and commands that show them.
_SMID, _RELAXATIONS = Path(__file__).parents[1], Path(relaxations.__path__[0])
_SOURCES = ((_RELAXATIONS, "**/*.py"), (_SMID, "*.py"), (_SMID, "data/*.py"), (_SMID, "models/*.py"))


@cache
def _own() -> tuple[tuple[str, str], ...]:
    digest = hashlib.sha256()
    for folder, pattern in _SOURCES:
        for path in sorted(folder.glob(pattern)):
            digest.update(path.read_bytes())
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
