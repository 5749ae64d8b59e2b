"""What a figure was measured on."""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from importlib.metadata import version


def described(libraries: Sequence[str] = ("numpy", "scipy", "clarabel", "pyscipopt")) -> str:
    """Return one sentence on machine and libraries."""
    versions = ", ".join(f"{name} {version(name)}" for name in libraries)
    return (
        f"Measured on {platform.machine()}, {os.cpu_count()} cores, {platform.system()}, Python "
        f"{platform.python_version()}; {versions}; one thread per process."
    )
