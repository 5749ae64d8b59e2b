"""Contrasts of the colours, and what a page gives to those who do not see it."""

import re
from html.parser import HTMLParser
from importlib.resources import files
from itertools import pairwise

import pytest

CSS = (files("smid.reports") / "templates" / "page.css").read_text(encoding="utf-8")
LIGHT, DARK, PRINT = (dict(re.findall(r"--(\w+): (#\w+)", block)) for block in re.findall(r":root {(.+?)}", CSS, re.S))


def luminance(colour):
    """WCAG 2.2, relative luminance."""
    digits = colour[1:] if len(colour) == 7 else "".join(2 * digit for digit in colour[1:])
    parts = [int(digits[k : k + 2], 16) / 255 for k in (0, 2, 4)]
    red, green, blue = (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(one, other):
    dark, light = sorted((luminance(one), luminance(other)))
    return (light + 0.05) / (dark + 0.05)


def test_contrast_is_that_of_the_standard():
    assert contrast("#000", "#ffffff") == pytest.approx(21)
    assert contrast("#767676", "#fff") == pytest.approx(4.54, abs=0.01)


@pytest.mark.parametrize("colours", [LIGHT, DARK, PRINT], ids=["light", "dark", "print"])
def test_text_stands_out_four_and_a_half_times_and_lines_three_times(colours):
    for name in ("ink", "soft", "red", "green", "blue"):
        assert contrast(colours[name], colours["paper"]) >= 4.5, name
        assert contrast(colours[name], colours["panel"]) >= 4.5, f"{name} on a panel"
    assert contrast(colours["blue"], colours["shade"]) >= 4.5, "what is new in a formula"
    for name in ("orange", "sky"):
        assert contrast(colours[name], colours["paper"]) >= 3, name


class Outline(HTMLParser):
    """Collects what readers of a screen go by."""

    def __init__(self, text):
        super().__init__()
        self.starts = []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.starts.append((tag, dict(attributes)))

    def all(self, *tags):
        return [(tag, given) for tag, given in self.starts if tag in tags]


FIGURES = {"identification": 3, "diagnosis": 3, "comparison": 1, "residuals": 1}
"""The fewest figures of each page."""


@pytest.fixture(params=FIGURES)
def kind(request):
    return request.param


@pytest.fixture
def outline(kind, pages):
    return Outline((pages / f"{kind}.html").read_text(encoding="utf-8"))


def test_language_title_and_landmarks_are_there(outline):
    assert outline.all("html") == [("html", {"lang": "en"})]
    assert [len(outline.all(tag)) for tag in ("title", "h1", "header", "main", "footer")] == [1] * 5


def test_headings_skip_no_level(outline):
    levels = [int(tag[1]) for tag, _ in outline.all("h1", "h2", "h3", "h4")]
    assert all(after <= before + 1 for before, after in pairwise(levels))


def test_every_header_of_a_table_says_what_it_heads_and_every_row_has_one(outline):
    headers = outline.all("th")
    assert {given["scope"] for _, given in headers} == {"col", "row"}
    rows, in_head = 0, False
    for tag, _ in outline.starts:
        in_head = (in_head or tag == "thead") and tag != "tbody"
        rows += tag == "tr" and not in_head
    assert sum(given["scope"] == "row" for _, given in headers) == rows


def test_every_figure_has_a_caption_and_pictures_have_words(outline, kind):
    assert len(outline.all("svg")) >= FIGURES[kind]
    assert all(given["role"] == "img" and len(given["aria-label"]) > 10 for _, given in outline.all("svg"))
    assert len(outline.all("figcaption")) >= len(outline.all("svg"))


def test_what_scrolls_can_be_reached_by_the_keyboard(outline):
    for _, given in outline.all("div", "ul"):
        if given.get("class") in ("wide", "equations"):
            assert given["tabindex"] == "0"
