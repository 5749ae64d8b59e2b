"""Run some or all of them and write docs/frontier.md: ``python -m benchmarks.frontier [name ...]``."""

from __future__ import annotations

import argparse
import re
from importlib import import_module
from pathlib import Path

from benchmarks.machine import described

NAMES = ("beside_scip", "order_two", "growth", "exercise", "order_studies", "named_problems", "terms", "rlt")
HEAD = """# The relaxations, measured

Written by `python -m benchmarks.frontier`, section by section: each says what it was measured on. Bounds are certified
unless it says otherwise.
"""


def merged(page: str, part: str) -> str:
    """Put a section in the place of the one of the same title, or behind all others."""
    sections = re.split(r"(?m)^(?=## )", page)
    title = part.split("\n", 1)[0]
    place = next((k for k, section in enumerate(sections) if section.split("\n", 1)[0] == title), len(sections))
    sections[place : place + 1] = [part]
    return "\n\n".join(section.strip() for section in sections) + "\n"


def main() -> None:
    """Print each section as it comes; a section keeps its place on the page until it is run again."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.frontier", description=__doc__)
    parser.add_argument("names", nargs="*", help=f"{', '.join(NAMES)}; all of them without a name")
    parser.add_argument("--output", type=Path, default=Path("docs/frontier.md"))
    given = parser.parse_args()
    unknown = set(given.names) - set(NAMES)
    if unknown:
        parser.error(f"unknown: {', '.join(unknown)}; choose from {', '.join(NAMES)}")
    for name in given.names or NAMES:
        part = f"{import_module(f'benchmarks.frontier.{name}').run()}\n\n{described()}"
        print(f"\n{part}\n", flush=True)
        page = given.output.read_text(encoding="utf-8") if given.output.exists() else HEAD
        given.output.write_text(merged(page, part), encoding="utf-8")


if __name__ == "__main__":
    main()
