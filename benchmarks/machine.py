"""What a figure was measured on."""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, version


def described(libraries: Sequence[str] = ("numpy", "scipy", "clarabel", "pyscipopt", "maingopy", "discopt")) -> str:
    """Return one sentence on machine and those of the libraries that are installed."""
    versions = []
    for name in libraries:
        with suppress(PackageNotFoundError):
            versions.append(f"{name} {version(name)}")
    return (
        f"Measured on {platform.machine()}, {os.cpu_count()} cores, {platform.system()}, Python "
        f"{platform.python_version()}; {', '.join(versions)}; one thread per process."
    )
