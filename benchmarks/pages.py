"""A page of measurements, section by section: what is run again takes the place of what was there."""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

from benchmarks.machine import described


def merged(page: str, part: str) -> str:
    """Put a section in the place of the one of the same title, or behind all others."""
    sections = re.split(r"(?m)^(?=## )", page)
    title = part.split("\n", 1)[0]
    place = next((k for k, section in enumerate(sections) if section.split("\n", 1)[0] == title), len(sections))
    sections[place : place + 1] = [part]
    return "\n\n".join(section.strip() for section in sections) + "\n"


def write(command: str, about: str, package: str, names: Sequence[str], page: Path, head: str) -> None:
    """Run the sections that the command line names, or all; print each as it comes, and put it on the page.

    Parameters
    ----------
    command, about : str
        For the help.
    package : str
        Where the modules are; each has a ``run`` that returns its section.
    names : sequence of str
    page : Path
    head : str
        Of a page that is new.
    """
    parser = argparse.ArgumentParser(prog=command, description=about)
    parser.add_argument("names", nargs="*", help=f"{', '.join(names)}; all of them without a name")
    parser.add_argument("--output", type=Path, default=page)
    given = parser.parse_args()
    unknown = set(given.names) - set(names)
    if unknown:
        parser.error(f"unknown: {', '.join(unknown)}; choose from {', '.join(names)}")
    for name in given.names or names:
        part = f"{import_module(f'{package}.{name}').run()}\n\n{described()}"
        print(f"\n{part}\n", flush=True)
        before = given.output.read_text(encoding="utf-8") if given.output.exists() else head
        given.output.write_text(merged(before, part), encoding="utf-8")
