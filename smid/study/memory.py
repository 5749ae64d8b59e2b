"""The largest resident memory of this process since a moment.

Linux keeps a high-water mark that can be set back. Elsewhere the mark is that of the process's whole life.
"""

from __future__ import annotations

import sys
from contextlib import suppress
from pathlib import Path

__all__ = ["forget_peak", "peak_memory"]

_OWN = Path("/proc/self")


def forget_peak() -> None:
    """Set the high-water mark back to what is resident now, where the system can."""
    with suppress(OSError):
        (_OWN / "clear_refs").write_text("5")


def peak_memory() -> float:
    """Return the high-water mark in MB; NaN where the system tells none.

    Examples
    --------
    >>> forget_peak()
    >>> peak_memory() > 10 or sys.platform == "win32"
    True
    """
    with suppress(OSError):
        for line in (_OWN / "status").read_text().splitlines():
            if line.startswith("VmHWM:"):
                return float(line.split()[1]) * 1024 / 1e6
    try:
        import resource
    except ImportError:
        return float("nan")
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most / 1e6 if sys.platform == "darwin" else most * 1024 / 1e6
