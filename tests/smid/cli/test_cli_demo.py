import json
import re
from pathlib import Path

import pytest

from smid.data import DataError
from smid.records import record_path, true_parameters

ROOT = Path(__file__).parents[3]


def test_demo_finds_the_truth_and_ends_with_the_path_of_its_report(folder, smid, monkeypatch):
    monkeypatch.setattr("smid.cli.demo.SAMPLES", 90)  # one ramp, for speed
    result = smid("demo --json demo.json")
    assert result.exit_code == 0, result.output
    page = Path(result.stdout.splitlines()[-1])
    assert page == folder / "smid-report.html"
    text = page.read_text(encoding="utf-8")
    assert "simulated data, not measured" in text
    assert "the parameters move with the temperature" in text
    assert "lie inside every interval" in result.stdout
    document = json.loads(Path("demo.json").read_text(encoding="utf-8"))
    truth = true_parameters("clutch_20C_ramp_a")
    for interval in document["estimate"]["parameters"]:
        assert interval["lower"] <= truth[interval["name"]] <= interval["upper"]
    fits = [v["scores"][0]["fit_percent"] for v in document["validations"]]
    assert min(fits[:2]) > 97 > max(fits[2:]), "both records at 20 degC fit, the others do not"


def test_unknown_record_is_refused():
    with pytest.raises(DataError, match="no bundled record"):
        record_path("none.csv")


def test_the_example_of_the_readme_runs(tmp_path, monkeypatch, capsys):
    code = re.search(r"```python\n(.+?)```", (ROOT / "README.md").read_text(encoding="utf-8"), flags=re.DOTALL)[1]
    monkeypatch.chdir(tmp_path)
    (tmp_path / "data").symlink_to(ROOT / "data")
    exec(compile(code, "README.md", "exec"), {})
    assert (tmp_path / "report.html").exists()
    assert "alpha" in capsys.readouterr().out
