import importlib
import json
import re
import sys
import time
import webbrowser
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from smid.cli.console import Progress
from smid.cli.demo import ACTUATOR, show
from smid.data import DataError
from smid.data.bundled import load_clutch, record_path, true_parameters
from smid.diagnosis import diagnose
from smid.diagnosis.diagnosis import ENDED_EARLY
from smid.theses.clutch.plant import simulate_clutch

ROOT = Path(__file__).parents[3]


@pytest.fixture
def _short(monkeypatch):
    """One ramp instead of two, and a handful of effects in this process, for speed."""
    monkeypatch.setattr("smid.cli.demo.SAMPLES", 90)
    few = ["operating_point", "output_curve", "input_dead_zone", "sensor_bias"]
    monkeypatch.setattr("smid.cli.demo.diagnose", partial(diagnose, effects=few, workers=1))


@pytest.mark.usefixtures("_short")
def test_demo_finds_the_truth_and_ends_with_the_path_of_its_report(folder, smid):
    result = smid("demo --json demo.json --since 0")
    assert result.exit_code == 0, result.output
    *_, times, last = result.stdout.splitlines()
    first = Path(last)
    assert first == folder / "smid-report.html"
    interval, whole = map(float, re.fullmatch(r"First .+ after ([\d.]+) s, report after ([\d.]+) s\.", times).groups())
    assert 0 < whole - interval < 600
    assert abs(whole - time.time()) < 600, "counted from the beginning of 1970"
    identification = folder / "smid-report-identification.html"
    pages = [page.read_text(encoding="utf-8") for page in (first, identification)]
    assert all("simulated data, not measured" in text for text in pages)
    assert f'href="{identification.name}"' in pages[0]
    assert f'href="{first.name}"' in pages[1]
    assert "records of the whole actuator" in pages[1]
    assert "lie inside every interval" in result.stdout
    document = json.loads(Path("demo.json").read_text(encoding="utf-8"))
    truth = true_parameters("hammerstein_20C_ramp_a")
    for interval in document["estimate"]["parameters"]:
        assert interval["lower"] <= truth[interval["name"]] <= interval["upper"]
    fits = [score["fit_percent"] for v in document["validations"] for score in v["scores"]]
    assert len(fits) == 2 + len(ACTUATOR) + 1
    assert min(fits[:2]) > 97 > max(fits[2:]), "both ramps of the same plant fit, the actuator and the steps do not"
    assert "Cause: operating_point." in result.stdout, "the pole of the plant on steps depends on the pressure"
    assert "Proven: no parameters of the base model explain" in result.stdout
    assert "Diagnosis of pressure: operating point" in pages[0]


@pytest.mark.usefixtures("_short")
def test_interrupted_in_the_diagnosis_the_demo_keeps_both_pages(folder, smid, monkeypatch):
    def interrupt(_self, line):
        if line.startswith("best so far: "):
            raise KeyboardInterrupt

    monkeypatch.setattr(Progress, "__call__", interrupt)
    result = smid("demo")
    assert result.exit_code == 130
    assert ENDED_EARLY in (folder / "smid-report.html").read_text(encoding="utf-8")
    assert (folder / "smid-report-identification.html").exists()


@pytest.mark.parametrize(("terminal", "display", "opened"), [(True, ":0", 1), (True, "", 0), (False, ":0", 0)])
def test_the_report_is_opened_where_somebody_sits_before_a_display(monkeypatch, terminal, display, opened):
    addresses = []
    monkeypatch.setattr(webbrowser, "open", addresses.append)
    monkeypatch.setattr(sys.stdout, "isatty", lambda: terminal, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("CI", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setenv("DISPLAY", display)
    show(Path("a report.html"))
    assert addresses == [(Path.cwd() / "a report.html").as_uri()][:opened]


def test_the_steps_are_what_their_script_makes(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "data")
    script = importlib.import_module("make_clutch")
    current, temperature = script.short_steps(), 20.0
    record = load_clutch("varying_pole_20C_steps")
    np.testing.assert_array_equal(record.values("current"), current)
    assert set(record.values("temperature")) == {temperature}
    free = simulate_clutch(current, temperature, script.PLANT)
    assert np.abs(record.values("pressure") - free).max() <= script.NOISE_BOUND


def test_unknown_record_is_refused():
    with pytest.raises(DataError, match="no bundled record"):
        record_path("none")


def test_the_example_of_the_readme_runs(tmp_path, monkeypatch, capsys):
    code = re.search(r"```python\n(.+?)```", (ROOT / "README.md").read_text(encoding="utf-8"), flags=re.DOTALL)[1]
    monkeypatch.chdir(tmp_path)
    (tmp_path / "data").symlink_to(ROOT / "data")
    exec(compile(code, "README.md", "exec"), {})
    assert (tmp_path / "report.html").exists()
    assert "alpha" in capsys.readouterr().out
