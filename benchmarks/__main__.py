"""Run some or all of them and write docs/benchmarks.md: ``make bench``, or ``python -m benchmarks [name ...]``."""

from __future__ import annotations

from pathlib import Path

from benchmarks.pages import write

NAMES = ("stamping", "beside_scip", "order_two", "diagnosis", "recursive")
HEAD = """# Benchmarks

Written by `make bench`: each beside a rival in the same run. Bounds of ours are certified.

Times, bounds and the figures of the diagnosis vary with the processor; every certified bound stays true.
For the tanks in `measured.md` the held-out RMSE of the same tree was 0.241 V on one processor and 0.185 V on another.
"""

if __name__ == "__main__":
    write("python -m benchmarks", __doc__, "benchmarks", NAMES, Path("docs/benchmarks.md"), HEAD)
