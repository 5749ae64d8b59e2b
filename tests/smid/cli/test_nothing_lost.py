"""Samples that look wrong are told before long work, and what is finished survives a later failure."""

import json
from pathlib import Path

import pytest

from smid.diagnosis import Diagnosis
from tests.smid.cli.conftest import write_record

IDENTIFY = "identify long.csv --input u --output y --model model.toml --noise-bound 0.12"
DIAGNOSE = "diagnose long.csv --input u --output y --model model.toml --noise-bound 0.12 --effects gain --workers 1"


def begun(*_arguments, **_settings):
    raise AssertionError("the long work began")


def spoilt(change):
    """Change the columns of a row of the record: of the samples from 50 on, or all."""
    lines = Path("long.csv").read_text().splitlines()
    rows = [change(k, *line.split(",")) for k, line in enumerate(lines[2:])]
    Path("long.csv").write_text("\n".join([*lines[:2], *(",".join(row) for row in rows)]) + "\n")


@pytest.mark.parametrize("line", [IDENTIFY, DIAGNOSE])
@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda k, t, u, y: (t, u, "25.0" if k == 50 else y), "warning: y has 1 glitch of up to 2"),
        (lambda k, t, u, y: (t, u, "0.3" if 50 <= k < 90 else y), "warning: y stands still at 0.3"),
        (lambda k, t, u, y: (t, u, "2"), "warning: y is constant: check that its sensor works"),  # noqa: ARG005
    ],
)
def test_wrong_samples_are_told_before_the_work(smid, monkeypatch, line, change, words):
    spoilt(change)
    monkeypatch.setattr("smid.cli.identify.identify_model", begun)
    monkeypatch.setattr("smid.cli.diagnose.diagnose_model", begun)
    result = smid(line)
    assert isinstance(result.exception, AssertionError)
    assert words in result.stderr


def test_a_sound_record_raises_no_warning(smid):
    write_record(Path("sound.csv"), seed=5, count=2000)
    assert smid("fit sound.csv --input u --output y --model model.toml").stderr == ""


@pytest.mark.parametrize("line", [f"{DIAGNOSE} --prove-name 5", f"{IDENTIFY}"])
@pytest.mark.parametrize("option", ["--json nowhere/a.json", "--report nowhere/a.html"])
def test_a_path_that_cannot_be_written_is_refused_before_the_work(smid, monkeypatch, line, option):
    monkeypatch.setattr("smid.cli.identify.identify_model", begun)
    monkeypatch.setattr("smid.cli.diagnose.diagnose_model", begun)
    result = smid(f"{line} {option}")
    assert result.exit_code == 2, result.output
    assert "there is no folder nowhere; create it" in result.stderr
    assert smid(f"{IDENTIFY} --certificate nowhere/proof.json").exit_code == 2


@pytest.mark.parametrize(
    ("proof", "error"),
    [("prove_name", RuntimeError("the solver\ncrashed")), ("prove_parameters", KeyboardInterrupt())],
)
def test_a_proof_that_fails_in_any_way_costs_only_the_proof(smid, monkeypatch, proof, error):
    rows = Path("long.csv").read_text().splitlines()
    late = [row.split(",")[2] for row in (*rows[2:3] * 3, *rows[2:])]  # three samples of delay
    spoilt(lambda k, t, u, y: (t, u, late[k]))  # noqa: ARG005

    def failing(diagnosis, *_arguments, **_settings):
        assert isinstance(diagnosis, Diagnosis)
        assert json.loads(Path("out.json").read_text())["verdict"] == "named", "not written before the proof"
        raise error

    monkeypatch.setattr(f"smid.cli.diagnose.{proof}", failing)
    option = "--prove-name 5" if proof == "prove_name" else "--prove 20"
    result = smid(f"{DIAGNOSE.replace('gain', 'input_delay')} {option} --no-certify --json out.json --report out.md")
    assert result.exit_code == 0, result.output
    assert "Cause: input_delay" in result.stdout
    assert Path("out.md").exists()
    told = "RuntimeError: the solver crashed" if isinstance(error, RuntimeError) else "interrupted"
    assert [line for line in result.stderr.splitlines() if told in line]
    assert "Traceback" not in result.output
