"""The content of a report as data: sections of paragraphs, tables, equations and figures, for HTML and Markdown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Self

from markupsafe import Markup, escape

from smid.display.table import Table
from smid.display.versions import versions

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Rich(str):
    """Text with markup for HTML pages, such as a formula or a colour; plain text in other formats."""

    __slots__ = ("_html",)
    _html: str

    def __new__(cls, text: str, html: str) -> Self:
        """Keep the text and its markup."""
        rich = super().__new__(cls, text)
        rich._html = html
        return rich

    def __html__(self) -> str:
        """Return the markup, for template engines that escape text."""
        return self._html


def coloured(text: str, kind: str) -> Rich:
    """Return text in a colour of the page: "good", "bad" or "new"."""
    return Rich(text, f'<span class="{kind}">{escape(text)}</span>')


def joined(*parts: str) -> Rich:
    """Return the texts put together, with their markup.

    Examples
    --------
    >>> joined("a < b: ", coloured("yes", "good")).__html__()
    'a &lt; b: <span class="good">yes</span>'
    """
    return Rich("".join(parts), str(Markup().join(parts)))


@dataclass(frozen=True)
class Remark:
    """A paragraph in small print."""

    text: str


@dataclass(frozen=True)
class Heading:
    """A heading within a section."""

    text: str


@dataclass(frozen=True)
class Items:
    """A list."""

    items: tuple[str, ...]


@dataclass(frozen=True)
class Facts:
    """Names and their values."""

    rows: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Equations:
    """Formulas, one below the other, in LaTeX aligned at ``&``, with MathML if they are :class:`Rich`.

    ``label`` is the description for screen readers.
    """

    label: str
    rows: tuple[str, ...]


@dataclass(frozen=True)
class Picture:
    """A figure of a page; ``label`` is its description for screen readers, empty if the caption is enough."""

    figure: Figure
    caption: str
    label: str = ""


@dataclass(frozen=True)
class Folded:
    """Blocks behind one line, which a click opens."""

    summary: str
    blocks: tuple[Block, ...]


Block = str | Remark | Heading | Items | Facts | Equations | Table | Picture | Folded


@dataclass(frozen=True)
class Section:
    """A heading and its blocks; a plain string is a paragraph."""

    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Page:
    """A report, in any format.

    Parameters
    ----------
    result
        The result, in one paragraph or several.
    document
        The result as plain data, for the JSON format.
    simulated
        Whether the page is labelled as simulated data.
    settings
        The user's options; shown at the end.
    links
        Text -> address, relative to the page.
    lead
        What stands below the result, on the first screen.
    """

    title: str
    result: tuple[str, ...]
    sections: tuple[Section, ...]
    document: Mapping[str, Any]
    simulated: bool = False
    settings: Mapping[str, str] = field(default_factory=dict)
    links: Mapping[str, str] = field(default_factory=dict)
    lead: tuple[Block, ...] = ()
    written: str = field(default_factory=lambda: f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC")

    @property
    def versions(self) -> dict[str, str]:
        """Return the versions of the packages that computed the result."""
        return versions()

    @property
    def closing(self) -> Section:
        """Return the last section: the user's options, and the versions."""
        return Section("Settings and versions", (Facts((*self.settings.items(), *self.versions.items())),))
