"""The largest resident memory of this process since a moment.

Linux keeps a high-water mark that can be reset. On other systems the mark counts from the start of the process.
"""

from __future__ import annotations

import sys
from contextlib import suppress
from pathlib import Path

_OWN = Path("/proc/self")


def forget_peak() -> None:
    """Reset the high-water mark to the memory that is resident now, if the system can."""
    with suppress(OSError):
        (_OWN / "clear_refs").write_text("5")


def peak_memory() -> float:
    """Return the high-water mark in MB; NaN if the system does not state it."""
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
