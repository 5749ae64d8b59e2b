"""A section of the page."""

from __future__ import annotations

import time
from collections.abc import Sequence


def section(title: str, head: Sequence[str], rows: Sequence[Sequence[str]], began: float) -> str:
    """Return a title, a table in Markdown and the seconds since it began."""
    lines = [" | ".join(row) for row in (head, ["---"] * len(head), *rows)]
    table = "\n".join(f"| {line} |" for line in lines)
    return f"## {title}\n\n{table}\n\n{time.perf_counter() - began:.0f} s."
