"""``smid hybrid``: tables on the terminal, JSON and pages in files, one line for a mistake."""

import json
from pathlib import Path

import pytest

from smid.theses.hybrid import commands
from smid.theses.hybrid.reactor import (
    ReactorStudy,
    other_conditions,
    output_errors,
    requirement_study,
    time_constant_study,
)


@pytest.fixture
def asked(monkeypatch):
    """A study of few models in place of the whole one; what it was asked for is kept."""
    kept = {}
    study = ReactorStudy(
        output_errors(["factor"], starts=1, iterations=3),
        other_conditions(["factor"], starts=1, iterations=3),
        requirement_study(["factor"], ["series, extra"], starts=1, iterations=3),
        time_constant_study(starts=1, iterations=3),
    )

    def small(**settings):
        kept.update(settings)
        return study

    monkeypatch.setattr(commands, "reactor_study", small)
    return kept


def test_the_group_tells_its_commands(smid):
    result = smid("hybrid")
    assert result.exit_code == 0
    assert "reactor" in result.output


def test_reactor_prints_writes_and_reports(smid, asked):
    result = smid("hybrid reactor --starts 2 --iterations 7 --seed 3 --json out.json --report out.html")
    assert result.exit_code == 0
    assert (asked["starts"], asked["iterations"], asked["seed"]) == (2, 7, 3)
    assert "Table 6: what the networks learned" in result.output
    document = json.loads(Path("out.json").read_text(encoding="utf-8"))
    assert document["schema"] == "smid.hybrid-reactor/1"
    assert document["output_errors"]["plants"] == ["factor"]
    assert "What cannot be compared" in Path("out.html").read_text(encoding="utf-8")
    smid("hybrid reactor --report twin.json")
    assert Path("twin.json").read_text() == Path("out.json").read_text()


@pytest.mark.parametrize("command", ["hybrid reactor --starts 0", "hybrid reactor --json none/out.json"])
def test_a_mistake_is_one_line(smid, command):
    result = smid(command)
    assert result.exit_code == 2
    assert len(result.stderr.strip().splitlines()) == 1
