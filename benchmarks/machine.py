"""What a figure was measured on."""

from __future__ import annotations

import os
import platform
from importlib.metadata import version


def described() -> str:
    """Return one sentence on machine and libraries."""
    libraries = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy", "clarabel", "pyscipopt"))
    return (
        f"Measured on {platform.machine()}, {os.cpu_count()} cores, {platform.system()}, Python "
        f"{platform.python_version()}; {libraries}; one thread per process."
    )
