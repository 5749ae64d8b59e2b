"""A study of a thesis: it lists its contents once, and text, page and JSON follow from the list."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from smid.data import Dataset
from smid.display.result import Heading, Part, Result
from smid.display.table import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from smid.reports.content import Block

__all__ = ["Chapter", "Drawing", "Topic", "write_chapter"]

_LONG = 6  # rows of a table beside its figure


@dataclass(frozen=True)
class Drawing:
    """A figure with its caption, drawn only where a page is written."""

    draw: Callable[[], Figure]
    caption: str


class Topic:
    """A section of a study: a title, then sentences, tables, results and figures in their order."""

    def __init__(self, title: str, *parts: str | Table | Result | Drawing) -> None:
        self.title, self.parts = title, parts


class Chapter(Result):
    """A study of a thesis. A subclass states title, command, conclusion, topics, records and what is not comparable."""

    title: ClassVar[str]
    command: ClassVar[str]
    """Words after ``smid``, such as "clutch records"; they also name the JSON schema."""
    not_compared: ClassVar[tuple[str, ...]] = ()
    """Numbers of the thesis that cannot be compared with this study, and why."""

    @property
    @abstractmethod
    def conclusion(self) -> str:
        """Return the result in a few sentences."""

    @abstractmethod
    def topics(self) -> Iterable[Topic]:
        """Return the sections in their order."""

    @abstractmethod
    def records(self) -> Dataset:
        """Return the records that were used."""

    def _content(self) -> Iterator[Part]:
        for topic in self.topics():
            yield Heading(topic.title)
            yield from (part for part in topic.parts if not isinstance(part, Drawing))
        yield Heading("Conclusion")
        yield self.conclusion


def write_chapter(chapter: Chapter, path: str | PathLike[str], settings: Mapping[str, str] | None = None) -> Path:
    """Write a study as a page, in the format that the suffix of the path names, and return the path.

    Parameters
    ----------
    settings
        Options of the command, in the user's words; shown at the end of the page.

    Raises
    ------
    ValueError, OSError
        If the suffix names no format, or the page cannot be written.
    """
    from smid.reports.chapter import chapter_page
    from smid.reports.content import Section
    from smid.reports.documents import study_document
    from smid.reports.formats import write_page

    page = chapter_page(
        chapter.title,
        chapter.conclusion,
        [Section(topic.title, tuple(_section(topic))) for topic in chapter.topics()],
        chapter.records(),
        document=study_document(chapter.command.replace(" ", "-"), chapter.to_dict()),
        not_compared=chapter.not_compared,
        settings=settings,
    )
    return write_page(page, path)


def _section(topic: Topic) -> Iterator[Block]:
    """Return what a topic is on a page; where it has a figure, long tables are folded: the figure shows them."""
    from smid.reports.content import Folded

    is_drawn = any(isinstance(part, Drawing) for part in topic.parts)
    for part in topic.parts:
        for block in _blocks(part):
            if is_drawn and isinstance(block, Table) and len(block.rows) > _LONG:
                yield Folded(f"All {len(block.rows)} rows of the table", (block,))
            else:
                yield block


def _blocks(part: object) -> Iterator[Block]:
    """Return what a part of a topic is on a page; a result becomes its own tables and sentences."""
    from smid.reports import content

    if isinstance(part, Result):
        for inner in part._content():
            yield from _blocks(inner)
    elif isinstance(part, Drawing):
        yield content.Picture(part.draw(), part.caption)
    elif isinstance(part, Heading):
        yield content.Heading(part.title)
    else:
        assert isinstance(part, str | Table)
        yield part
