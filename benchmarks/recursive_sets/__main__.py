"""Print the sections asked for."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from benchmarks.recursive_sets import SECTIONS


def main(names: Sequence[str]) -> None:
    """Print the sections asked for, as they come."""
    unknown = [name for name in names if name not in SECTIONS]
    if unknown:
        raise SystemExit(f"no section {unknown[0]!r}: choose from {', '.join(SECTIONS)}")
    for name in names or SECTIONS:
        print(SECTIONS[name](), end="\n\n", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
