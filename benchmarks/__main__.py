"""Run some or all of them and write docs/benchmarks.md: ``make bench``, or ``python -m benchmarks [name ...]``."""

from __future__ import annotations

from pathlib import Path

from benchmarks.pages import write

NAMES = ("stamping", "beside_scip", "order_two", "diagnosis", "recursive")
HEAD = """# Benchmarks

Written by `make bench`: each beside a rival in the same run. Bounds of ours are certified.
"""

if __name__ == "__main__":
    write("python -m benchmarks", __doc__, "benchmarks", NAMES, Path("docs/benchmarks.md"), HEAD)
