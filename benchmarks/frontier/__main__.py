"""Run some or all of them and write docs/frontier.md: ``python -m benchmarks.frontier [name ...]``."""

from __future__ import annotations

from pathlib import Path

from benchmarks.pages import write

NAMES = (
    "growth",
    "windows",
    "several",
    "curves",
    "first_principles",
    "contractors",
    "library",
    "exercise",
    "order_studies",
    "small",
    "named_problems",
    "analytic",
    "named_verdicts",
    "terms",
    "rlt",
)
HEAD = """# Benchmark of the relaxations

Bounds are certified unless a section says otherwise. Each section names the computer it was measured on.
`python -m benchmarks.frontier` writes the sections.
"""

if __name__ == "__main__":
    write("python -m benchmarks.frontier", __doc__, "benchmarks.frontier", NAMES, Path("docs/frontier.md"), HEAD)
