import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from relaxations import check
from relaxations.search.enclosure import Reason
from smid.cli import main
from smid.cli.console import Progress

COMMON = "run.csv --input u --output y --model model.toml"


def test_identify_prints_intervals_and_validation_and_writes_both_files(smid):
    result = smid(f"identify {COMMON} --noise-bound 0.1 --validate other.csv --json out.json --report out.html")
    assert result.exit_code == 0, result.output
    assert "validation on other.csv" in result.stdout
    estimate = json.loads(Path("out.json").read_text())["estimate"]
    truth = {"a1": -0.7, "b0": 0.5}
    for interval in estimate["parameters"]:
        assert interval["lower"] <= truth[interval["name"]] <= interval["upper"]
    assert estimate["noise_bound"] == {"y": 0.1}
    assert estimate["data"]["source"] == "run.csv (SIMULATED record, not a measurement)"
    assert "<title>" in Path("out.html").read_text(encoding="utf-8")


def test_without_a_noise_bound_a_multiple_of_the_least_is_taken_and_said(smid):
    result = smid(f"identify {COMMON} --json out.json")
    assert result.exit_code == 0, result.output
    assert "noise bound used: 1.2 x" in result.stdout
    assert "(the default)" in result.stdout
    document = json.loads(Path("out.json").read_text())
    assert document["estimate"]["noise_bound"]["y"] == pytest.approx(1.2 * document["error_bound"]["upper"])


@pytest.mark.parametrize(("bound", "code"), [("0.1", 0), ("0.01", 1)])
def test_the_proof_is_written_and_checked_by_the_other_program(smid, bound, code):
    result = smid(f"identify {COMMON} --noise-bound {bound} --stop 15 --certificate proof.json")
    assert result.exit_code == code, result.output
    assert "certificate: proof.json (python -m relaxations.check proof.json)" in result.stdout
    document = check.read("proof.json")
    assert document["variables"][:2] == ["a1", "b0"]
    assert any(theorem.empty for theorem in check.check(document)) == bool(code)


def test_json_to_standard_output_comes_alone(smid):
    result = smid(f"error-bound {COMMON} --json -")
    assert result.exit_code == 0
    assert json.loads(result.stdout)["error_bound"]["upper"] <= 0.1
    assert result.stderr == ""


def test_estimate_goes_to_validate(smid):
    assert smid(f"identify {COMMON} --noise-bound 0.1 --json out.json").exit_code == 0
    result = smid("validate out.json other.csv run.csv --json scores.json --report scores.html")
    assert result.exit_code == 0, result.output
    scores = [v["scores"][0] for v in json.loads(Path("scores.json").read_text())["validations"]]
    assert [s["experiment"] for s in scores] == ["other", "run"]
    assert all(s["fit_percent"] > 80 and s["noise_bound"] == 0.1 for s in scores)
    assert Path("scores.html").exists()


@pytest.mark.parametrize("command", ["error-bound", "identify --noise-bound 0.1", "identify --noise-bound 0.01"])
def test_a_report_in_json_is_what_json_writes(smid, command):
    smid(f"{command} {COMMON} --json out.json --report twin.json")
    assert Path("twin.json").read_text() == Path("out.json").read_text()


def test_a_report_in_markdown_has_its_figures_beside_it(smid):
    result = smid(f"error-bound {COMMON} --report bound.md")
    assert result.stdout.endswith("report: bound.md\n")
    assert "## Least noise bound" in Path("bound.md").read_text(encoding="utf-8")
    assert Path("bound_files/figure-1.svg").exists()


def test_without_a_browser_the_page_is_written_and_one_line_says_so(smid, monkeypatch):
    monkeypatch.setenv("PATH", "")
    result = smid(f"error-bound {COMMON} --report bound.pdf")
    assert result.exit_code == 0
    assert result.stdout.endswith("report: bound.html\n")
    assert result.stderr.startswith("warning: no PDF: no Chromium was found: install one")
    assert result.stderr.count("\n") == 1
    assert Path("bound.html").exists()


def test_start_and_stop_are_kept_in_the_source(smid):
    assert smid(f"identify {COMMON} --noise-bound 0.1 --start 2 --stop 32 --json out.json").exit_code == 0
    data = json.loads(Path("out.json").read_text())["estimate"]["data"]
    assert data["samples"] == 30
    assert "samples 2:32" in data["source"]


def test_columns_without_header_get_names(smid):
    lines = Path("run.csv").read_text().splitlines()[2:]
    Path("bare.csv").write_text("\n".join(lines) + "\n")
    result = smid("identify bare.csv --input 1 --output 2 --sampling-time 0.1 --model model.toml --noise-bound 0.1")
    assert result.exit_code == 0, result.output
    assert "|noise of c2|" in result.stdout


def test_errors_in_variables(smid):
    Path("eiv.toml").write_text('class = "ErrorsInVariables"\nna = 1\ndelay = 1\nstable = true\n')
    line = "identify run.csv --stop 15 --input u --output y --model eiv.toml --noise-bound 0.1"
    refused = smid(line)
    assert refused.exit_code == 2
    assert "give --input-noise-bound" in refused.stderr
    result = smid(f"{line} --input-noise-bound 0.01 --rounds 1 --order 1 --json out.json")
    assert result.exit_code == 0, result.output
    assert json.loads(Path("out.json").read_text())["estimate"]["noise_bound"] == {"u": 0.01, "y": 0.1}


def test_bound_too_small_is_a_proven_negative(smid):
    result = smid(f"identify {COMMON} --noise-bound 0.01 --json out.json --report out.html")
    assert result.exit_code == 1
    assert result.stdout.startswith("proven: no parameters explain the data within 0.01 bar on y.")
    empty = json.loads(Path("out.json").read_text())["empty"]
    assert 0.01 < empty["least_bound"] <= 0.1
    assert empty["samples"]
    assert all(0 <= s["index"] < 40 for s in empty["samples"])
    assert "No parameters explain the data" in Path("out.html").read_text(encoding="utf-8")


def test_interrupted_in_the_intervals_keeps_what_is_proven(smid, monkeypatch):
    def interrupt(*_arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(Progress, "__call__", interrupt)
    result = smid(f"identify {COMMON} --noise-bound 0.1 --json out.json")
    assert result.exit_code == 130
    assert "interrupted: all printed bounds are proven" in result.stderr
    estimate = json.loads(Path("out.json").read_text())["estimate"]
    assert estimate["stopped"] == Reason.INTERRUPTED.name.lower()
    a1, b0 = estimate["parameters"]
    assert a1["lower"] <= -0.7 <= a1["upper"]
    assert b0["lower"] <= 0.5 <= b0["upper"]


def test_interrupted_in_the_error_bound_gives_no_intervals(smid, monkeypatch):
    def interrupt(*_arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(Progress, "__call__", interrupt)
    result = smid(f"identify {COMMON}")
    assert result.exit_code == 130


def test_an_error_bound_that_the_time_limit_ends_without_a_result_says_so(smid):
    result = smid(f"error-bound {COMMON} --seconds 1e-6 --json out.json")
    assert result.exit_code == 130
    assert "not known" in result.stdout
    assert "ended early: the least noise bound is not known" in result.stderr
    assert json.loads(Path("out.json").read_text())["error_bound"]["upper"] is None


@pytest.mark.parametrize("arguments", [["-m", "smid", "--version"], ["-m", "smid"]])
def test_runs_as_a_module(arguments):
    done = subprocess.run([sys.executable, *arguments], capture_output=True, text=True, check=True)
    assert "smid" in done.stdout
    assert done.stderr == ""


def test_a_pipe_is_quiet_and_carries_the_exit_code():
    line = f"identify {COMMON} --noise-bound 0.01".split()
    done = subprocess.run([sys.executable, "-m", "smid", *line], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr == ""
    assert "\x1b" not in done.stdout


def test_a_record_without_header_is_validated_by_the_estimate_it_gave(tmp_path):
    rng = np.random.default_rng(3)
    u = rng.uniform(-1, 1, 40)
    y = np.zeros(40)
    for k in range(1, 40):
        y[k] = 0.7 * y[k - 1] + u[k - 1]
    record = tmp_path / "run.dat"
    np.savetxt(record, np.stack([u, y + rng.uniform(-0.05, 0.05, 40)], axis=1))
    model = tmp_path / "oe.toml"
    model.write_text('class = "OutputError"\nstable = true\n')
    estimate = tmp_path / "estimate.json"
    arguments = [str(record), "--input", "0", "--output", "1", "--sampling-time", "1", "--model", str(model)]
    first = CliRunner().invoke(main, ["identify", *arguments, "--noise-bound", "0.1", "--json", str(estimate)])
    assert first.exit_code == 0, first.output
    second = CliRunner().invoke(main, ["validate", str(estimate), str(record)])
    assert second.exit_code == 0, second.output
    assert "c1" in second.output
