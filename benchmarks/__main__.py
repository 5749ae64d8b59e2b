"""Run some or all of them and write docs/benchmarks.md: ``make bench``, or ``python -m benchmarks [name ...]``."""

from __future__ import annotations

from pathlib import Path

from benchmarks.pages import write

NAMES = ("stamping", "beside_scip", "order_two", "diagnosis", "recursive", "sensor_export")
HEAD = """# Benchmarks

Each section compares smid with another tool, or with another method, in the same run. The bounds of smid are certified.
`make bench` writes this page.

Times, bounds and the figures of the diagnosis vary with the processor. Every certified bound is valid on every
processor. Example: with an earlier version the error of the cascaded tanks on unseen samples was 0.241 V on one
processor and 0.185 V on another. [Measured records](measured.md) are diagnosed with the arithmetic of two.

[Comparison with other identification tools](peers.md) shows free runs on measured records.
"""

if __name__ == "__main__":
    write("python -m benchmarks", __doc__, "benchmarks", NAMES, Path("docs/benchmarks.md"), HEAD)
