"""What a study shows: table, frame, figure, plain data, page."""

import json
import math

import pytest

from relaxations.search.enclosure import Proof
from smid import DataError
from smid.identification.estimate import ParameterInterval
from smid.reports import report
from smid.study import Cell, Outcome, Settings, Status, Study
from smid.study.time_left import time_left
from tests.smid.study.study_records import MODEL, record


def interval(name, width):
    return ParameterInterval(name, "bar", -width, width, -0.9 * width, 0.9 * width, Proof.PROVEN, Proof.BOX)


def made(records=("run",), sizes=(8,), bounds=(0.1,), methods=("auto",), orders=(1,)):
    """Return a study with widths that grow with the bound and times that grow with N, without any solve."""
    cells = tuple(
        Cell(r, n, (("y", b),), m, k) for r in records for n in sizes for b in bounds for m in methods for k in orders
    )
    outcomes = tuple(
        Outcome(
            Status.CERTIFIED,
            "Tight.",
            (interval("a1", c.noise_bound[0][1] / c.order), interval("b0", c.noise_bound[0][1])),
            "lift",
            ("a1",),
            12,
            34,
            5,
            c.samples / 100,
            120.0,
        )
        for c in cells
    )
    return Study(MODEL, {r: record(k) for k, r in enumerate(records)}, Settings(), cells, outcomes, False)


FULL = {
    "records": ("one", "two"),
    "sizes": (6, 8),
    "bounds": (0.1, 0.2),
    "methods": ("auto", "sparse"),
    "orders": (1, 2),
}


def test_the_table_has_the_columns_that_vary():
    header = made(orders=(1, 2), bounds=(0.1, 0.2)).table.header
    assert header == ("bound", "order", "a1", "b0", "gap", "time [s]", "memory [MB]", "ended")
    full = made(**FULL)
    assert full.table.header[:5] == ("record", "N", "bound", "method", "order")
    assert len(full.table.rows) == 32
    assert full.conclusion == "All 32 runs have certified intervals."
    assert "record run, N 8" in made().table.caption


def test_printed_ends_are_rounded_outwards():
    text = made(bounds=(2 / 3,)).table.rows[0][0]
    low, high = (float(end) for end in text.strip("[]").split(","))
    assert low <= -2 / 3 < 2 / 3 <= high


@pytest.mark.parametrize(
    ("varied", "titles"),
    [
        ({}, ["bounds", ""]),
        ({"orders": (1, 2)}, ["bounds", ""]),
        ({"bounds": (0.1, 0.2)}, ["width", ""]),
        ({"sizes": (6, 8)}, ["width", "", "time"]),
    ],
)
def test_only_what_varies_is_drawn(varied, titles):
    axes = made(**varied).plot().axes
    assert [a.get_title(loc="left") for a in axes] == titles
    assert all(a.get_ylabel() for a in axes), "an axis without a label"


def test_the_figure_shows_the_numbers():
    study = made(bounds=(0.1, 0.2), orders=(1, 2))
    widths = study.plot().axes[1].lines[0]
    assert list(widths.get_xdata()) == [0.1, 0.2]
    assert list(widths.get_ydata()) == pytest.approx([0.2, 0.4])
    full = made(**FULL).plot("two")
    assert [a.get_title(loc="left").split("\n")[0] for a in full.axes if a.get_title(loc="left")] == [
        "bounds",
        "width",
        "width",
        "time at ±0.1 bar",
    ]
    with pytest.raises(DataError, match="no record 'three'"):
        made(**FULL).plot("three")


def test_the_frame_has_a_row_for_each_cell_and_parameter():
    frame = made(**FULL).to_pandas()
    assert len(frame) == 64
    assert set(frame["parameter"]) == {"a1", "b0"}
    assert (frame["upper"] - frame["lower"] == frame["width"]).all()
    assert frame["bound of y"].tolist()[:2] == [0.1, 0.1]


def test_plain_data_are_json_and_html_is_escaped():
    study = made(orders=(1, 2))
    odd = Study(
        MODEL, study.records, Settings(), study.cells, (study.outcomes[0], Outcome(Status.REFUSED, "1 < 2")), True
    )
    document = json.loads(json.dumps(odd.to_dict(), allow_nan=False))
    assert document["cells"][0]["parameters"][0]["upper"] == 0.1
    assert document["cells"][1]["seconds"] is None
    assert document["interrupted"] is True
    assert "1 &lt; 2" in odd._repr_html_()
    assert odd.messages == ("run, N = 8, bound 0.1, auto, order 2: 1 < 2",)


def test_the_page_has_a_picture_for_each_record_and_every_cell(tmp_path):
    page = report(made(**FULL), tmp_path / "study.html", settings={"orders": "1, 2"}).read_text()
    assert page.count("<svg ") == 2
    assert page.count("<td") > 32 * 10
    nothing = Study(MODEL, {"run": record(1)}, Settings(), made().cells, (Outcome(Status.REFUSED, "too low"),), False)
    page = report(nothing, tmp_path / "none.html").read_text()
    assert "Runs without intervals" in page
    assert "<svg" not in page


def test_the_time_left_follows_the_kind_of_cell():
    study = made(orders=(1, 2))
    first, second = study.cells
    done = {first: Outcome(Status.CERTIFIED, "", seconds=10.0)}
    assert time_left([second], done, 10.0) == 10.0
    assert time_left([second], done, 5.0) == 5.0, "two at a time"
    assert math.isnan(time_left([], done, 5.0))
    assert math.isnan(time_left([second], {}, 5.0))
    assert math.isnan(Outcome(Status.REFUSED, "").gap)
