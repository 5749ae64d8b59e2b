"""``smid clutch``: tables on the terminal, JSON and pages in files, one line for a mistake."""

import json
from pathlib import Path

import pytest

from smid.data.bundled import CLUTCH_RECORDS, load_clutch
from smid.theses.clutch import commands
from smid.theses.clutch.held_chapter import Finding, HeldChapter
from smid.theses.clutch.held_records import held_records
from smid.theses.clutch.recursive_study import recursive_study
from smid.theses.clutch.sensor_study import ForeignRow, ForeignStudy, table_5_3
from tests.smid.theses.clutch.small_clutch_studies import (
    PART,
    small_hammerstein_study,
    small_sensor_chapter,
    small_set_study,
)


@pytest.fixture
def small(monkeypatch):
    """Studies on few samples in place of the whole ones; what they were asked for is kept."""
    asked = {}

    def hammerstein(**settings):
        asked.update(settings)
        return small_hammerstein_study()

    monkeypatch.setattr(commands, "hammerstein_study", hammerstein)
    monkeypatch.setattr(commands, "set_study", lambda **_: small_set_study())
    monkeypatch.setattr(commands, "sensor_chapter", lambda seed, **_: asked.update(seed=seed) or small_sensor_chapter())
    records = load_clutch(("20C_ramp_a", "20C_step_a")).crop(0, 700)
    monkeypatch.setattr(commands, "recursive_study", lambda: recursive_study(records))
    return asked


def test_the_group_tells_its_commands(smid):
    result = smid("clutch")
    assert result.exit_code == 0
    for command in ("records", "hammerstein", "recursive", "sensors", "plants", "holds"):
        assert command in result.output


def test_records_are_listed(smid):
    result = smid("clutch records --json out.json --report out.html")
    assert "report: twin.json" in smid("clutch records --report twin.json").output
    assert Path("twin.json").read_text() == Path("out.json").read_text()
    assert result.exit_code == 0
    document = json.loads(Path("out.json").read_text(encoding="utf-8"))
    assert document["schema"] == "smid.clutch-records/1"
    assert tuple(row["record"] for row in document["records"]) == CLUTCH_RECORDS
    assert all(name in result.output for name in CLUTCH_RECORDS)
    assert "simulated data, not measured" in Path("out.html").read_text(encoding="utf-8")


def test_hammerstein_prints_writes_and_reports(smid, small):
    result = smid(f"clutch hammerstein --start {PART[0]} --stop {PART[1]} --order 2 --json out.json --report out.html")
    assert result.exit_code == 0
    assert small["part"] == PART
    assert list(small["orders"]) == [1, 2]
    assert "Phase 3: validation" in result.output
    assert "report: out.html" in result.output
    smid("clutch hammerstein --report twin.json")
    assert Path("twin.json").read_text() == Path("out.json").read_text()
    document = json.loads(Path("out.json").read_text(encoding="utf-8"))
    assert document["schema"] == "smid.clutch-hammerstein/1"
    assert document["phases"]["error_bound"]["lower"] <= document["phases"]["error_bound"]["upper"]
    assert document["thesis"]["printed"][2]["inverted"] is True
    page = Path("out.html").read_text(encoding="utf-8")
    for words in ("What the thesis prints", "What cannot be compared", "confidential", "simulated data, not measured"):
        assert words in page
    assert "<svg" in page


def test_recursive_prints_writes_and_reports(smid, small):
    result = smid("clutch recursive --json - --report out.html")
    assert result.exit_code == 0
    document = json.loads(result.output)  # standard output carries nothing else
    assert document["schema"] == "smid.clutch-recursive/1"
    assert document["sets"]["never_left"] is True
    assert len(document["estimators"]["trackings"]) == 6 * 2 * 2  # methods, models, records
    page = Path("out.html").read_text(encoding="utf-8")
    for words in ("2e-14", "Recursive set-membership", "What cannot be compared", "figure 3.12"):
        assert words in page
    assert smid("clutch recursive --report twin.json").output.count("times wider") == 1
    assert json.loads(Path("twin.json").read_text()) == document
    assert small == {}


def test_sensors_prints_writes_and_reports(smid, small):
    result = smid("clutch sensors --seed 4 --json out.json --report out.html")
    assert result.exit_code == 0
    assert small == {"seed": 4}
    smid("clutch sensors --report twin.json")
    assert Path("twin.json").read_text() == Path("out.json").read_text()
    assert "Table 5.3" in result.output
    document = json.loads(Path("out.json").read_text(encoding="utf-8"))
    assert document["schema"] == "smid.clutch-sensors/1"
    assert document["tables"][0]["rows"][0]["thesis"] == 0.2458
    page = Path("out.html").read_text(encoding="utf-8")
    for words in ("Table 5.3", "Figure 5.14", "One sensor for all temperatures", "An interval", "confidential"):
        assert words in page


def test_plants_and_holds_print_write_and_report(smid, monkeypatch):
    rows = (ForeignRow("rate", "60C_step_c", ("flow",), 0.16, 0.08, ("CPX same", 0.12), ("CPX all", 0.1)),)
    asked = {}
    monkeypatch.setattr(
        commands, "foreign_study", lambda names, **more: asked.update(names=names, **more) or ForeignStudy(rows)
    )
    result = smid("clutch plants --plant rate --seed 3 --json out.json --report out.html")
    assert result.exit_code == 0
    assert (asked["names"], asked["seed"]) == (("rate",), 3)
    document = json.loads(Path("out.json").read_text(encoding="utf-8"))
    assert (document["schema"], document["rows"][0]["ptx"]) == ("smid.clutch-plants/1", 0.08)
    assert "share no formula" in Path("out.html").read_text(encoding="utf-8")
    held = HeldChapter((table_5_3(),), (Finding("CPX20H fails", "fails", "0.2 mm", True),), {}, held_records())
    monkeypatch.setattr(commands, "held_chapter", lambda *_, **__: held)
    assert smid("clutch holds --json held.json --report held.html").exit_code == 0
    document = json.loads(Path("held.json").read_text(encoding="utf-8"))
    assert document["schema"] == "smid.clutch-holds/1"
    assert document["findings"][0]["agrees"] is True


@pytest.mark.parametrize(
    ("line", "cause"),
    [
        ("clutch hammerstein --start 100 --stop 110", "the part 100:110 of 20C_ramp_a is refused"),
        ("clutch hammerstein --stop 9999", "its 5001"),
        ("clutch hammerstein --start 0 --stop 100", "says too little of the model"),
        ("clutch hammerstein --order 0", "--order"),
        ("clutch hammerstein --start x", "--start"),
        ("clutch hammerstein --report none/out.html", "there is no folder"),
        ("clutch recursive --json none/out.json", "there is no folder"),
        ("clutch sensors --seed -1", "--seed"),
        ("clutch sensors --report none/out.html", "there is no folder"),
        ("clutch plants --plant Dall", "Dall"),
        ("clutch holds --seed -1", "--seed"),
        ("clutch nothing", "nothing"),
    ],
)
def test_a_mistake_is_one_line_and_code_2(smid, line, cause):
    result = smid(line)
    assert result.exit_code == 2
    assert cause in result.stderr
    assert len(result.stderr.splitlines()) == 1
    assert result.stderr.startswith("error: ")
    assert result.stdout == ""
