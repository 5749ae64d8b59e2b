"""``smid hybrid arm``: tables on the terminal, JSON and a page in files."""

import json
from pathlib import Path

import pytest

from smid.theses.hybrid import commands
from smid.theses.hybrid.arm import arm_study


@pytest.fixture
def asked(monkeypatch):
    """A study of few runs in place of the whole one; what it was asked for is kept."""
    kept = {}

    def small(starts, **settings):
        kept.update(settings, starts=starts)
        return arm_study(2, inputs=["one_sine"], ways=["small"])

    monkeypatch.setattr(commands, "arm_study", small)
    return kept


def test_arm_prints_writes_and_reports(smid, asked):
    result = smid("hybrid arm --starts 3 --input one_sine --json out.json --report out.html")
    assert result.exit_code == 0
    assert (asked["starts"], asked["inputs"]) == (3, ("one_sine",))
    assert "White arm, one sine (table F.2)" in result.output
    document = json.loads(Path("out.json").read_text(encoding="utf-8"))
    assert document["schema"] == "smid.hybrid-arm/1"
    assert document["white"]["ours, exact"]["values"]["Ws"] == pytest.approx(1.2)
    assert "What cannot be compared" in Path("out.html").read_text(encoding="utf-8")


def test_an_unknown_input_is_one_line(smid):
    result = smid("hybrid arm --input two_sines")
    assert result.exit_code == 2
    assert len(result.stderr.strip().splitlines()) == 1
