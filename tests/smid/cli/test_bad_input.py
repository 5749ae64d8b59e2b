"""Each mistake: exit code 2, one line ``error: cause; cure`` on standard error, nothing computed."""

from pathlib import Path

import pytest

DATA = "run.csv --input u --output y"
MODEL = "--model model.toml"


@pytest.fixture(autouse=True)
def _no_solve(monkeypatch):
    """Only the library's own checks may run: a solve would be too late."""

    def solve(*_arguments):
        raise AssertionError("solved before the mistake was told")

    monkeypatch.setattr("relaxations.proof.bounding.solve", solve)


def refused(result):
    assert result.exit_code == 2, (result.output, result.exception)
    assert result.stdout == ""
    assert result.stderr.startswith("error: ")
    assert result.stderr.count("\n") == 1
    return result.stderr


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (
            f"identify {DATA} {MODEL} --solver gurobbi --noise-bound 0.1",
            ["gurobbi", "choose one of clarabel"],
        ),
        (f"identify {DATA} {MODEL} --solver gurobbi", ["gurobbi"]),
        (f"identify {DATA} {MODEL} --method magic", ["magic", "sparse"]),
        (f"identify {DATA} {MODEL} --noise-bound 0.1 --order 1 --order 2", ["--order is given twice"]),
        (f"identify {DATA} {MODEL} --noise-bound 0.1 --input T", ["no column 'T'"]),
        (f"identify {DATA} {MODEL} --noise-bound 0", ["not positive"]),
        (f"identify {DATA} {MODEL} --noise-bound -0.1", ["not positive"]),
        (f"identify {DATA} {MODEL} --noise-bound nan", ["is not a noise bound"]),
        (f"identify {DATA} {MODEL} --noise-bound wide", ["is not a noise bound", "1.2x"]),
        (f"identify {DATA} {MODEL} --noise-bound 0.9x", ["below the least noise bound"]),
        (
            f"identify {DATA} {MODEL} --report missing/report.html",
            ["there is no folder missing", "create it"],
        ),
        (f"identify {DATA} {MODEL} --report out.txt", ["'.txt' is not a report format", "choose .html, .pdf"]),
        (f"error-bound {DATA} {MODEL} --report out", ["choose .html, .pdf"]),
        ("demo --report out.doc", ["choose .html, .pdf"]),
        (f"identify {DATA} {MODEL} --json missing/out.json", ["there is no folder missing"]),
        (f"identify {DATA} {MODEL} --json .", ["it is a folder"]),
        (f"identify {DATA} {MODEL} --start 30 --stop 20", ["none of the 40 samples"]),
        (f"identify {DATA} {MODEL} --stop 3", ["3 samples, the model needs 4"]),
        (f"identify {DATA} {MODEL} --order 0", ["--order"]),
        (f"identify {DATA} {MODEL} --sampling-time -1 --noise-bound 0.1", ["not positive"]),
        (f"identify {DATA} {MODEL} --time stamp", ["no column 'stamp'"]),
        (f"identify {DATA} {MODEL} --input-noise-bound 0.1", ["exact"]),
        (f"identify {DATA} {MODEL} --validate none.csv", ["no file 'none.csv'"]),
        (f"identify {DATA} {MODEL} --bogus", ["--bogus"]),
        (f"identify {DATA} --model none.toml", ["none.toml", "check the path"]),
        (f"identify {DATA}", ["--model"]),
        (f"identify none.csv --input u --output y {MODEL}", ["no file 'none.csv'"]),
        (f"identify run.csv --input uu --output y {MODEL}", ["no column 'uu'", "did you mean 'u'"]),
        (f"error-bound run.csv --input u --output z {MODEL}", ["no column 'z'"]),
        (f"error-bound {DATA} {MODEL} --solver gurobbi", ["gurobbi"]),
        ("validate model.toml run.csv", ["is not valid JSON"]),
        ("validate none.json run.csv", ["none.json"]),
        ("validate none.json", ["DATA"]),
        ("demo --report missing/report.html", ["there is no folder missing"]),
        ("identfy", ["identfy"]),
    ],
)
def test_mistake_is_told_in_one_line(smid, line, words):
    message = refused(smid(line))
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("model", "words"),
    [
        ('class = "OutputError"\nstabel = true', ["stabel", "did you mean 'stable'"]),
        ('class = "OutputErorr"', ["OutputErorr", "did you mean 'OutputError'"]),
        ("na = 1", ["names no class"]),
        ("class = ", ["is not valid TOML"]),
        ('class = "OutputError"\nna = "one"', ["'na'", "whole number"]),
    ],
)
def test_bad_model_file(smid, model, words):
    Path("model.toml").write_text(model)
    message = refused(smid(f"identify {DATA} {MODEL}"))
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("\n0.5,", "\n0.4,", ["run.csv"]),  # repeated
        ("\n0.5,", "\n0.3,", ["run.csv"]),  # unsorted
        ("\n0.5,1.0,", "\n0.5,inf,", ["'u'", "sample 5", "0.5 s"]),
        ("\n0.5,1.0,", "\n0.5,high,", ["'u'", "high", "line 8"]),
    ],
)
def test_bad_record(smid, old, new, words):
    text = Path("run.csv").read_text().replace("\n0.5,-1.0,", "\n0.5,1.0,")
    assert old in text
    Path("run.csv").write_text(text.replace(old, new))
    message = refused(smid(f"identify {DATA} {MODEL}"))
    for word in words:
        assert word in message


def test_order_too_low_names_the_least(smid):
    Path("model.toml").write_text('class = "Hammerstein"\npowers = [3, 1]\nstable = true\ninput_noise = true\n')
    line = f"identify {DATA} {MODEL} --noise-bound 0.1 --input-noise-bound 0.1 --method sparse --order 1"
    assert "the least order is" in refused(smid(line))


def test_estimate_without_model_is_refused(smid):
    Path("empty.json").write_text(
        '{"schema": "smid.identify/1", "empty": {"message": "", "least_bound": 0.1, "samples": []}}'
    )
    assert "no parameters explain" in refused(smid("validate empty.json run.csv"))
    Path("other.json").write_text('{"schema": "other/1"}')
    assert "other/1" in refused(smid("validate other.json run.csv"))
    Path("list.json").write_text("[1]")
    assert "holds no result" in refused(smid("validate list.json run.csv"))
