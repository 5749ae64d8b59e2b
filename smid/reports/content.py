"""What a page says, as data: sections of paragraphs, tables, equations and figures, for HTML and Markdown alike."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any, Self

from markupsafe import Markup, escape
from matplotlib.figure import Figure

from smid.display.table import Table
from smid.display.versions import versions

__all__ = [
    "Block",
    "Equations",
    "Facts",
    "Heading",
    "Items",
    "Page",
    "Picture",
    "Remark",
    "Rich",
    "Section",
    "coloured",
    "joined",
]


class Rich(str):
    """Text with a look of its own on an HTML page: a formula, a colour. Anywhere else it is plain text.

    Parameters
    ----------
    html
        Markup, as it goes into the page.

    Examples
    --------
    >>> Rich("alpha", "<math><mi>α</mi></math>").upper()
    'ALPHA'
    """

    __slots__ = ("_html",)
    _html: str

    def __new__(cls, text: str, html: str) -> Self:
        """Keep both."""
        rich = super().__new__(cls, text)
        rich._html = html
        return rich

    def __html__(self) -> str:
        """Return the markup, for whatever escapes text."""
        return self._html


def coloured(text: str, kind: str) -> Rich:
    """Return text in a colour of the page.

    Parameters
    ----------
    kind
        "good", "bad" or "new".
    """
    return Rich(text, f'<span class="{kind}">{escape(text)}</span>')


def joined(*parts: str) -> Rich:
    """Put texts together, rich ones or plain ones.

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
    """Names and what belongs to them."""

    rows: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Equations:
    """Formulas, one below the other.

    Parameters
    ----------
    label
        What they are, for readers who do not see them.
    rows
        LaTeX aligned at ``&``, and MathML where they are :class:`Rich`.
    """

    label: str
    rows: tuple[str, ...]


@dataclass(frozen=True)
class Picture:
    """A figure of a page.

    Parameters
    ----------
    label
        What it shows, for readers who do not see it; empty where the caption says so.
    """

    figure: Figure
    caption: str
    label: str = ""


Block = str | Remark | Heading | Items | Facts | Equations | Table | Picture


@dataclass(frozen=True)
class Section:
    """A heading and what stands below it.

    Parameters
    ----------
    blocks
        A plain string is a paragraph.
    """

    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Page:
    """A report, whatever format it is written in.

    Parameters
    ----------
    result
        What was found, in a paragraph or a few.
    document
        The same as plain data: what its JSON twin holds.
    simulated
        Whether numbers on it come from a simulation; the page is labelled then.
    settings
        What was asked for, in the user's words; shown at the end.
    links
        Words -> address, relative to the page.
    written
        When.
    """

    title: str
    result: tuple[str, ...]
    sections: tuple[Section, ...]
    document: Mapping[str, Any]
    simulated: bool = False
    settings: Mapping[str, str] = field(default_factory=dict)
    links: Mapping[str, str] = field(default_factory=dict)
    written: str = field(default_factory=lambda: f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC")

    @property
    def versions(self) -> dict[str, str]:
        """Return what computed it."""
        return versions()

    @property
    def closing(self) -> Section:
        """Return the last section: what was asked for, and what computed it."""
        return Section("Settings and versions", (Facts((*self.settings.items(), *self.versions.items())),))
