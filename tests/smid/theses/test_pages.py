"""The page of a study is whole, self-contained, and says what is simulated."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from matplotlib.figure import Figure

from smid.data import Dataset
from smid.display.style import inline_svg
from smid.display.table import Table
from smid.reports.chapter import chapter_page
from smid.reports.content import Picture, Section
from smid.reports.formats import write_page
from smid.theses.chapter import Chapter, Drawing, Topic, write_chapter


def drawn(points, look="-"):
    figure = Figure()
    figure.subplots().plot(np.arange(points), look)
    return figure


def scattered(points):
    figure = Figure()
    figure.subplots().scatter(np.arange(points), np.arange(points))
    return figure


class Balance(HTMLParser):
    """Pairs opening with closing tags."""

    def __init__(self):
        super().__init__()
        self.open_tags = []

    def handle_starttag(self, tag, _attributes):
        if tag not in {"meta", "br", "img", "link"}:
            self.open_tags.append(tag)

    def handle_endtag(self, tag):
        assert self.open_tags.pop() == tag


@pytest.fixture
def page(tmp_path):
    data = Dataset.from_arrays(input=[0.0, 1, 2], output=[0.0, 1, 1], sampling_time=0.5)
    data = replace(data, source="made up (simulated)")
    table = Table("Errors <in> bar.", ("record", "remark", "RMSE"), (("first", "a & b", "0.5"),), "llr")
    sections = [
        Section("Numbers", ("One paragraph.", table)),
        Section("Pictures", (Picture(drawn(9), "A line"), Picture(scattered(3000), "A cloud"))),
    ]
    page = chapter_page(
        "A study", "It worked.", sections, data, document={}, not_compared=("This.",), settings={"command": "x"}
    )
    return write_page(page, tmp_path / "a.html").read_text(encoding="utf-8")


def test_everything_given_is_on_the_page(page):
    for words in ("A study", "It worked.", "Numbers", "One paragraph.", "a &amp; b", "Errors &lt;in&gt; bar.", "0.5"):
        assert words in page
    assert "What cannot be compared" in page
    assert "simulated data, not measured" in page
    assert page.count("<svg ") == 2
    assert page.count("<figcaption>") == 3


def test_the_page_needs_no_network(page):
    assert not re.findall(r"""(?:src|href)=["']https?:""", page)
    assert "<script" not in page


def test_tags_are_closed(page):
    checked = Balance()
    checked.feed(page)
    assert checked.open_tags == []


def test_a_cloud_of_points_becomes_pixels(page):
    assert page.count("<image ") == 1


def test_round_points_of_a_line_are_one_path_and_squares_are_not():
    points = inline_svg(drawn(50, "."), "points", "a")
    assert points.count("<use ") < 50, "ticks only"
    (path,) = re.findall(r'<path d="((?:M[\d. ]+h0)+)"', points)
    places = re.findall(r"M([\d.]+) ([\d.]+)h0", path)
    assert len(set(places)) == 50
    assert inline_svg(drawn(50, "s"), "squares", "a").count("<use ") > 50


def test_a_long_table_beside_its_figure_is_folded(tmp_path):
    def table(rows):
        return Table(f"{rows} rows", ("x",), tuple((str(k),) for k in range(rows)), "r")

    class Small(Chapter):
        title, command, conclusion = "Small", "clutch small", "Done."

        def topics(self):
            figure = Drawing(lambda: drawn(3), "A line")
            return [Topic("Drawn", table(6), table(7), figure), Topic("Not drawn", table(8))]

        def records(self):
            return Dataset.from_arrays(input=[0.0, 1], output=[0.0, 1], sampling_time=1.0)

        def to_dict(self):
            return {}

    page = write_chapter(Small(), tmp_path / "small.html").read_text(encoding="utf-8")
    folded = re.findall(r"<details>(.*?)</details>", page, flags=re.DOTALL)
    assert ["7 rows" in text for text in folded] == [True]
    assert all(f"{rows} rows" in page for rows in (6, 8))
