"""A page as one HTML file, without a network, for light and dark screens, phones and paper; zoomable by a script."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from importlib.resources import files

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from smid.display.style import inline_svg
from smid.display.table import Table
from smid.reports.content import Block, Equations, Facts, Folded, Heading, Items, Page, Picture, Remark
from smid.reports.traces import traces_of

_BLOCKS = (Equations, Facts, Folded, Heading, Items, Picture, Remark, Table)


def as_html(page: Page) -> str:
    """Return the page in HTML."""
    figures = [one.figure for one in _pictures((*page.lead, *(b for section in page.sections for b in section.blocks)))]
    traces = {figure: found.to_dict() for figure in figures if (found := traces_of(figure))}
    return _environment().get_template("page.html.j2").render(page=page, drawn=_drawn, traces=traces, static=_static)


def as_fragment(blocks: Sequence[Block], name: str) -> str:
    """Return blocks in HTML for a page that has the look of a report; ``name`` differs from part to part of it.

    Its figures are pictures alone: such a page may forbid scripts within it.
    """
    return _environment().get_template("fragment.html.j2").render(blocks=blocks, name=name, drawn=_drawn, traces={})


def _pictures(blocks: Iterable[Block]) -> Iterator[Picture]:
    for block in blocks:
        if isinstance(block, Picture):
            yield block
        elif isinstance(block, Folded):
            yield from _pictures(block.blocks)


def _static(name: str) -> Markup:
    return Markup((files("smid.reports") / "static" / name).read_text(encoding="utf-8"))


def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("smid.reports"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.tests |= {kind.__name__.lower(): _test(kind) for kind in _BLOCKS}
    return environment


def _test(kind: type) -> Callable[[object], bool]:
    def test(block: object) -> bool:
        return isinstance(block, kind)

    return test


def _drawn(picture: Picture, name: str) -> Markup:
    return Markup(inline_svg(picture.figure, picture.label or picture.caption, name))
