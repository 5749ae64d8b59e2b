"""A page as Markdown, for repositories and mail: tables, LaTeX, and figures as SVG files beside it."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from html import escape

from smid.display.table import Table
from smid.reports.content import Block, Equations, Facts, Folded, Heading, Items, Page, Picture, Remark, Section


def as_markdown(page: Page, keep: Callable[[Picture], str]) -> str:
    """Return the page in Markdown, with tables and formulas as GitHub shows them.

    ``keep`` saves a picture and returns its address.
    """
    head = f"Written {page.written} by smid {page.versions['smid']}."
    blocks = [f"# {_plain(page.title)}", f"{head} **Simulated data, not measured.**" if page.simulated else head]
    blocks += [f"[{_plain(words)}](<{address}>)" for words, address in page.links.items()]
    blocks.append("\n>\n".join(f"> {_plain(sentence)}" for sentence in page.result))
    blocks += [_block(block, keep) for block in page.lead]
    for section in (*page.sections, page.closing):
        blocks += _section(section, keep)
    return "\n\n".join(blocks) + "\n"


def _section(section: Section, keep: Callable[[Picture], str]) -> Iterable[str]:
    yield f"## {_plain(section.title)}"
    for block in section.blocks:
        yield _block(block, keep)


def _block(block: Block, keep: Callable[[Picture], str]) -> str:
    match block:
        case str(text) | Remark(text):
            return _plain(text)
        case Heading(text):
            return f"### {_plain(text)}"
        case Items(items):
            return "\n".join(f"- {_plain(item)}" for item in items)
        case Equations(_, rows):
            return "\n".join(["$$", "\\begin{aligned}", " \\\\\n".join(rows), "\\end{aligned}", "$$"])
        case Facts(rows):
            return _table(("", ""), rows, "ll")
        case Table(caption, header, rows, align):
            table = _table(header, rows, align)
            return f"{_plain(caption)}\n\n{table}" if caption else table
        case Picture(_, caption, label):
            return f"![{_plain(label or caption)}](<{keep(block)}>)\n\n{_plain(caption)}"
        case Folded(summary, inner):
            head = f"<details>\n<summary>{escape(summary)}</summary>"
            return "\n\n".join([head, *(_block(one, keep) for one in inner), "</details>"])


def _table(header: tuple[str, ...], rows: Iterable[tuple[str, ...]], align: str) -> str:
    ruler = tuple(":---" if side == "l" else "---:" for side in align)
    lines = [map(_plain, header), ruler, *(map(_plain, row) for row in rows)]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def _plain(text: str) -> str:
    """Return the text in one line, with every character escaped that Markdown would read as markup."""
    return re.sub(r"[\\`*<&|$]|(?<!\w)_|_(?!\w)", r"\\\g<0>", " ".join(text.split()))
