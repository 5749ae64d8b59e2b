"""One sensor on six plants, and the findings of the clutch thesis on records with long holds.

Prints two sections of docs/clutch.md.  Takes about twenty minutes on one core:

    python -m benchmarks.foreign_plants
"""

from __future__ import annotations

import sys

from smid.theses.clutch.held_chapter import HeldChapter, held_chapter
from smid.theses.clutch.plants_chapter import SHARED
from smid.theses.clutch.sensor_study import ForeignStudy, foreign_study


def _tell(words: str) -> None:
    print(words, file=sys.stderr, flush=True)


def plants_section(study: ForeignStudy) -> str:
    """Return the section of the six plants."""
    parts = [
        "## One sensor on six plants",
        "`smid clutch plants` writes these tables. PTX is one sensor for all temperatures. The best CPX or PX is taken "
        "for each record with the record in view, among all forms of the thesis for the record's temperature: each "
        "filter, and training on `step_a` or on `ramp_a` and `step_a`. Margin: its RMSE over that of PTX.",
        *SHARED,
        f"```\n{study.table}\n```",
        f"```\n{study.choices}\n```",
        study.conclusion,
    ]
    return "\n\n".join(parts)


def holds_section(chapter: HeldChapter) -> str:
    """Return the section of the records with long holds."""
    parts = [
        "## Findings of the thesis on records with long holds",
        "`smid clutch holds` writes these tables.",
        " ".join(chapter.not_compared),
        f"```\n{chapter.table}\n```",
        *(f"```\n{table.table}\n```" for table in chapter.tables),
        chapter.conclusion,
    ]
    return "\n\n".join(parts)


def run() -> str:
    """Return both sections."""
    return f"{plants_section(foreign_study(progress=_tell))}\n\n{holds_section(held_chapter(progress=_tell))}"


if __name__ == "__main__":
    print(run())
