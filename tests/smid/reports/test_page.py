from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from scipy.signal import lfilter

import smid
from relaxations.search.enclosure import Proof, Reason
from smid.data.resample import Resampling
from smid.identification.estimate import CentreStatus
from smid.reports import check_writable, data_report, report, versions

VOID = {"meta", "link", "br", "img", "input", "hr"}


class Page(HTMLParser):
    """Checks that elements close in order; collects addresses, names, roles and text."""

    def __init__(self, text):
        super().__init__()
        self.open, self.addresses, self.ids, self.labels, self.words = [], [], [], [], []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attributes):
        if tag not in VOID:
            self.open.append(tag)
        given = dict(attributes)
        self.addresses += [given[k] for k in ("src", "href", "xlink:href", "srcset") if k in given]
        self.ids += [given["id"]] if "id" in given else []
        if tag == "svg":
            self.labels.append(given["aria-label"])

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        if tag not in VOID:
            self.handle_endtag(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, text):
        if "style" not in self.open:
            self.words.append(text)

    @property
    def text(self):
        return " ".join(" ".join(self.words).split())


def read(path):
    return Page(path.read_text(encoding="utf-8"))


def test_page_says_all_it_must(estimate, bound, validation, data, tmp_path):
    page = read(report(estimate, tmp_path / "r.html", bound, [validation], settings={"solver": "clarabel"}))
    assert "Proven: all parameters that explain the 40 samples" in page.text
    for part in (
        "Parameter intervals",
        "Least noise bound",
        "Simulation over the data",
        "Validation on other records",
        "Prior knowledge",
        "What is proven, and how",
        "Certificate",
        "Witness",
        "Not proven",
        "Settings and versions",
        data.checksum,
        "0.1 s",
        "complicating variables",
        "certified solves",
        "lower: prior box, upper: data",
        "run 2",
        estimate.centre_text,
        *versions().values(),
    ):
        assert part in page.text, part
    assert "simulated data" not in page.text
    assert len(page.labels) == 4
    assert all(page.labels)


def test_page_is_self_contained(estimate, bound, validation, tmp_path):
    path = report(estimate, tmp_path / "r.html", bound, [validation])
    page = read(path)
    assert all(address.startswith("#") for address in page.addresses)
    assert len(page.ids) == len(set(page.ids)), "names repeat between the figures"
    text = path.read_text(encoding="utf-8")
    for forbidden in ("@import", "<script", "<link", "<!ENTITY", "svg11.dtd"):
        assert forbidden not in text
    assert "url(http" not in text
    assert "prefers-color-scheme: dark" in text
    assert "@media print" in text


def test_simulated_data_are_labelled(estimate, tmp_path):
    labelled = replace(estimate, data=replace(estimate.data, source="run.csv (Simulated)"))
    page = read(report(labelled, tmp_path / "r.html", truth={"a1": -0.7, "b0": 0.5}))
    assert "simulated data, not measured" in page.text
    assert "-0.7 inside" in page.text


def test_a_free_run_with_a_noisy_input_says_that_many_errors_exceed(tmp_path):
    u = np.tile([1.0, -1.0, 1.0, 1.0, -1.0], 4)
    y = lfilter([0.5], [1.0, -0.7], u)
    data = smid.Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    estimate = smid.identify(smid.ErrorsInVariables(1, 0), data, {"u": 0.05, "y": 0.05}, tolerance=0.5)
    report(estimate, tmp_path / "r.html")
    assert "is driven by u as measured, noise included. So many errors may exceed" in read(tmp_path / "r.html").text


def test_resampling_is_told(estimate, tmp_path):
    record = Resampling("linear", 0.1, 0.02, 0.01, 50, {"y": 0.003})
    resampled = replace(estimate, data=replace(estimate.data, resampling=(record,)))
    text = read(report(resampled, tmp_path / "r.html")).text
    assert "50 samples were interpolated linearly" in text
    assert "jitter up to 0.02 s" in text
    assert "0.003 bar" in text


def test_nothing_proven_is_said(estimate, tmp_path):
    prior = tuple(
        replace(
            i,
            lower=-np.inf,
            upper=np.inf,
            inner_lower=np.nan,
            inner_upper=np.nan,
            proof_lower=Proof.BOX,
            proof_upper=Proof.BOX,
        )
        for i in estimate.intervals
    )
    nothing = replace(
        estimate,
        model=replace(estimate.model, values={}),
        intervals=prior,
        centre_status=CentreStatus.UNDECIDED,
        nearest=None,
        unbounded=("b0",),
        reason=Reason.UNBOUNDED,
        enclosure=None,
    )
    text = read(report(nothing, tmp_path / "r.html")).text
    assert "No box could be proven for b0" in text
    assert "Nothing else is proven" in text


def test_a_free_run_that_diverges_does_not_lose_the_page(estimate, tmp_path):
    wild = replace(estimate, model=estimate.model.with_values({"a1": -1e30, "b0": 1.0}))
    assert "cannot be simulated" in read(report(wild, tmp_path / "r.html")).text


def test_names_and_sources_are_escaped(estimate, tmp_path):
    odd = replace(estimate, data=replace(estimate.data, source="<b>run</b>&.csv"))
    path = report(odd, tmp_path / "r.html", settings={"note": "<i>"})
    text = path.read_text(encoding="utf-8")
    assert "&lt;b&gt;run&lt;/b&gt;&amp;.csv" in text
    assert "<b>run" not in text


def test_page_of_an_error_bound_alone(bound, data, estimate, tmp_path):
    path = data_report(tmp_path / "r.html", "Bound", "Found.", estimate.model, data, bound, document={})
    text = read(path).text
    assert "Found." in text
    assert "Parameter intervals" not in text


def test_unwritable_paths_are_refused_at_once(estimate, tmp_path):
    with pytest.raises(OSError, match="it is a folder"):
        check_writable(tmp_path)
    with pytest.raises(OSError, match="there is no folder"):
        report(estimate, tmp_path / "missing" / "r.html")


def test_an_old_page_stays_whole_when_writing_fails(estimate, tmp_path, monkeypatch):
    path = tmp_path / "r.html"
    path.write_text("old")

    def fail(*_arguments):
        raise OSError("no space left")

    monkeypatch.setattr("os.replace", fail)
    with pytest.raises(OSError, match="no space left"):
        report(estimate, path)
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["r.html"]
