"""``smid hybrid inputs``: tables on the terminal, JSON and a page in files, one line for a mistake."""

import json
from pathlib import Path

from smid.theses.hybrid import commands
from smid.theses.hybrid.inputs import arm_inputs, input_study


def test_the_command_writes_json_and_page(monkeypatch, smid):
    study = input_study({"six_unequal": arm_inputs(150)["six_unequal"]}, budget=0)
    asked = {}

    def kept(**settings):
        asked.update(settings)
        return study

    monkeypatch.setattr(commands, "input_study", kept)
    result = smid("hybrid inputs --samples 200 --budget 0 --seed 3 --json out.json --report out.html")
    assert result.exit_code == 0
    assert (asked["samples"], asked["budget"], asked["seed"]) == (200, 0, 3)
    smid("hybrid inputs --report twin.json")
    assert Path("twin.json").read_text() == Path("out.json").read_text()
    assert json.loads(Path("out.json").read_text(encoding="utf-8"))["schema"] == "smid.hybrid-inputs/1"
    assert "Certified intervals" in Path("out.html").read_text(encoding="utf-8")


def test_a_mistake_is_one_line(smid):
    for wrong in ("--budget 1", "--samples 5", "--noise-bound 0"):
        refused = smid(f"hybrid inputs {wrong}")
        assert refused.exit_code == 2
        assert len(refused.stderr.strip().splitlines()) == 1
