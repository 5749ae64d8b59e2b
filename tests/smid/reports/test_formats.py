"""The suffix of a path is the format: HTML, PDF where a browser prints it, Markdown, JSON."""

import json
import re
import shutil
import subprocess
from dataclasses import replace
from html.parser import HTMLParser

import jsonschema
import pytest

from smid.display.table import Table
from smid.reports import PdfWarning, check_report, pdf, report, schemas
from smid.reports.content import Equations, Facts, Items, Page, Rich, Section, coloured
from smid.reports.documents import diagnose_document, identify_document
from smid.reports.formats import write_page


class Cells(HTMLParser):
    """The text of each element of some kind."""

    def __init__(self, text, *tags):
        super().__init__()
        self.tags, self.open, self.texts = tags, [], []
        self.feed(text)

    def handle_starttag(self, tag, _attributes):
        if tag in self.tags:
            self.open.append(tag)
            self.texts.append("")

    def handle_endtag(self, tag):
        if self.open and self.open[-1] == tag:
            self.open.pop()

    def handle_data(self, data):
        if self.open:
            self.texts[-1] += data


def test_markdown_says_what_html_says(named, tmp_path):
    html = report(named, tmp_path / "r.html").read_text(encoding="utf-8")
    text = report(named, tmp_path / "r.md").read_text(encoding="utf-8")
    assert re.findall(r"^##? (.+)$", text, flags=re.MULTILINE) == Cells(html, "h1", "h2").texts
    plain = text.replace("\\", "")
    for words in Cells(html, "p", "td").texts[1:]:  # the first tells the time of writing
        assert " ".join(words.split()).removeprefix("simulated") in plain
    assert named.causes[0].sentence in plain


def test_pictures_of_markdown_are_beside_it(estimate, validation, tmp_path):
    path = report(estimate, tmp_path / "an estimate.md", validations=[validation])
    pictures = re.findall(r"^!\[(.+)\]\(<(.+)>\)$", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert [place for _, place in pictures] == [f"an estimate_files/figure-{k}.svg" for k in (1, 2, 3, 4)]
    for _, place in pictures:
        assert (tmp_path / place).read_text(encoding="utf-8").rstrip().endswith("</svg>")


def test_the_same_figure_gives_the_same_file(estimate, tmp_path):
    for name in ("a.md", "b.md"):
        report(estimate, tmp_path / name)
    one, other = ((tmp_path / f"{name}_files" / "figure-1.svg").read_bytes() for name in "ab")
    assert one == other


def test_nothing_in_markdown_reads_as_markup(tmp_path):
    table = Table("A < B.", ("a | b",), (("*c*\nd",),), "l")
    blocks = (
        "_x_ of clutch_20C costs $5",
        Items((coloured("<b>", "bad"),)),
        Facts((("C:\\data", "`d`"),)),
        Equations("Law", (Rich("y &= u", "<math></math>"), "z &= 1")),
        table,
    )
    page = Page("T", ("Done.",), (Section("S", blocks),), {})
    text = write_page(page, tmp_path / "p.md").read_text(encoding="utf-8")
    assert "\\_x\\_ of clutch_20C costs \\$5\n" in text
    assert "- \\<b>\n" in text
    assert "| C:\\\\data | \\`d\\` |" in text
    assert "$$\n\\begin{aligned}\ny &= u \\\\\nz &= 1\n\\end{aligned}\n$$" in text
    assert "| a \\| b |\n| :--- |\n| \\*c\\* d |" in text


def test_json_is_the_documented_one(estimate, bound, validation, named, tmp_path):
    def read(path):
        return json.loads(path.read_text(encoding="utf-8"))

    written = read(report(estimate, tmp_path / "r.json", bound, [validation]))
    assert written == json.loads(json.dumps(identify_document(estimate, bound, [validation])))
    assert read(report(named, tmp_path / "d.json")) == json.loads(json.dumps(diagnose_document(named)))


def test_a_data_set_has_the_page_of_its_record(estimate, tmp_path):
    (run,) = estimate.data.experiments
    two = estimate.data.with_experiments([run, replace(run, name="again")])
    for data, headings in ((estimate.data, ["Channels", "Samples"]), (two, 2 * ["Channels", "Samples"])):
        text = report(data, tmp_path / "data.md").read_text(encoding="utf-8")
        assert [line.split()[1] for line in text.splitlines() if line.startswith("## ")][: len(headings)] == headings
        document = json.loads(report(data, tmp_path / "data.json").read_text(encoding="utf-8"))
        jsonschema.validate(document, schemas()["smid.dataset/1"])
        for run, told in zip(data.experiments, document["experiments"], strict=True):
            assert told["samples"] == run.n_samples
            assert {c["channel"]: c["max"] for c in told["channels"]} == {n: v.max() for n, v in run.values.items()}


def test_a_result_without_a_page_is_told_in_a_line(estimate, tmp_path):
    for result in (estimate["a1"], None):
        with pytest.raises(
            TypeError, match=r"has no report: give an Estimate, a ModelFit, a ResponseBand, Projections, a Diag"
        ):
            report(result, tmp_path / "page.html")
    with pytest.raises(TypeError, match="notes and links belong to"):
        report(estimate.data, tmp_path / "page.html", notes=["a remark"])


@pytest.mark.parametrize("name", ["r.docx", "r", "r.HTML"])
def test_an_unknown_suffix_names_those_that_are_known(estimate, tmp_path, name):
    with pytest.raises(ValueError, match=r"choose \.html, \.pdf, \.md or \.json"):
        report(estimate, tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_the_page_beside_a_pdf_must_be_writable_too(tmp_path):
    (tmp_path / "r.html").mkdir()
    with pytest.raises(OSError, match="it is a folder"):
        check_report(tmp_path / "r.pdf")


@pytest.mark.skipif(pdf.find_browser() is None, reason="no Chromium on this machine: apt install chromium")
def test_chromium_prints_a_pdf_beside_its_page(estimate, tmp_path):
    path = report(estimate, tmp_path / "r.pdf")
    assert path == tmp_path / "r.pdf"
    assert path.read_bytes().startswith(b"%PDF-")
    assert "Parameter intervals" in (tmp_path / "r.html").read_text(encoding="utf-8")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["r.html", "r.pdf"]
    if shutil.which("pdftotext"):
        text = subprocess.run(["pdftotext", str(path), "-"], capture_output=True, text=True, check=True).stdout
        assert "Settings and versions" in text


def test_without_a_browser_the_page_is_made_and_the_cure_told(estimate, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", "")
    with pytest.warns(PdfWarning, match="no Chromium was found: install one .* the page is in .*r.html"):
        path = report(estimate, tmp_path / "r.pdf")
    assert path == tmp_path / "r.html"
    assert [p.name for p in tmp_path.iterdir()] == ["r.html"]


@pytest.mark.parametrize(
    ("script", "words"),
    [
        ("echo boom >&2; exit 3", r"failed \(boom\)"),
        ("exit 3", r"failed \(exit code 3\)"),
        ("exec sleep 60", "did not print within 0.3 s"),
    ],
)
def test_a_browser_that_fails_or_hangs_is_told(estimate, tmp_path, monkeypatch, script, words):
    program = tmp_path / "chromium"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    monkeypatch.setattr(pdf, "TIMEOUT", 0.3)
    monkeypatch.setenv("PATH", f"{tmp_path}:/bin:/usr/bin")
    with pytest.warns(PdfWarning, match=words):
        assert report(estimate, tmp_path / "r.pdf").suffix == ".html"
