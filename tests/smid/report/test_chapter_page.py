"""The page of a study is whole, self-contained, and says what is simulated."""

import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from matplotlib.figure import Figure

from smid.data import Dataset
from smid.reports.chapter import Picture, Section, chapter_report
from smid.table import Table


def drawn(points, marker="None"):
    figure = Figure()
    figure.subplots().plot(np.arange(points), marker=marker, linestyle="" if marker != "None" else "-")
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
        Section("Numbers", ("One paragraph.",), (table,)),
        Section("Pictures", (), (), (Picture(drawn(9), "A line"), Picture(drawn(3000, "."), "A cloud"))),
    ]
    path = chapter_report(
        tmp_path / "a.html", "A study", "It worked.", sections, data, not_compared=("This.",), settings={"command": "x"}
    )
    return path.read_text(encoding="utf-8")


def test_everything_given_is_on_the_page(page):
    for words in ("A study", "It worked.", "Numbers", "One paragraph.", "a &amp; b", "Errors &lt;in&gt; bar.", "0.5"):
        assert words in page
    assert "What cannot be compared" in page
    assert "simulated data, not measured" in page
    assert page.count("<svg ") == 2
    assert page.count("<figcaption>") == 2


def test_the_page_needs_no_network(page):
    assert not re.findall(r"""(?:src|href)=["']https?:""", page)
    assert "<script" not in page


def test_tags_are_closed(page):
    checked = Balance()
    checked.feed(page)
    assert checked.open_tags == []


def test_a_cloud_of_points_becomes_pixels(page):
    assert page.count("<image ") == 1


def test_a_path_that_cannot_be_written_is_refused_at_once(tmp_path):
    data = Dataset.from_arrays(input=[0.0, 1], output=[0.0, 1], sampling_time=1.0)
    with pytest.raises(OSError, match="there is no folder"):
        chapter_report(tmp_path / "none" / "a.html", "", "", [], data)
