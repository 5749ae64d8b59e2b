"""``smid study``: a table, files, folders; one line for a mistake."""

import json
import os
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from smid.cli import main
from smid.study import Status, order_study
from tests.smid.study.study_records import record

COMMON = "--input u --output y --model model.toml --orders 1"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for seed, name in ((1, "run"), (2, "other")):
        data = record(seed, 6)
        rows = [f"{0.1 * k:.1f},{data.values('u')[k]},{data.values('y')[k]:.6f}" for k in range(6)]
        Path(f"{name}.csv").write_text("\n".join(["# SIMULATED record.", "time [s],u [V],y [bar]", *rows]) + "\n")
    Path("model.toml").write_text('class = "OutputError"\nna = 1\nstable = true\n')


@pytest.fixture
def smid():
    """Run a command line; arguments are split at blanks."""
    return lambda line: CliRunner().invoke(main, line.split(), prog_name="smid")


def test_a_study_is_printed_written_reported_and_resumed(smid):
    line = f"study run.csv other.csv {COMMON} --noise-bounds 0.2 --samples 5"
    result = smid(f"{line} --folder kept --json out.json --report out.html")
    assert result.exit_code == 0, result.output
    assert result.output.splitlines()[-2] == "All 2 runs have certified intervals."
    document = json.loads(Path("out.json").read_text(encoding="utf-8"))
    assert document["schema"] == "smid.study/1"
    assert [c["record"] for c in document["cells"]] == ["run", "other"]
    assert "simulated" in Path("out.html").read_text(encoding="utf-8")
    again = smid(f"{line} --resume kept --json again.json --report twin.json")
    assert Path("twin.json").read_text() == Path("again.json").read_text()
    assert again.exit_code == 0
    assert json.loads(Path("again.json").read_text(encoding="utf-8"))["cells"] == document["cells"], (
        "a cell was run again"
    )
    refused = smid(f"study run.csv {COMMON} --noise-bounds 0.2 --resume kept")
    assert refused.exit_code == 2
    assert "kept holds a study of other data" in refused.stderr
    taken = smid(f"{line} --folder kept")
    assert (taken.exit_code, "holds a study already" in taken.stderr) == (2, True)


def test_factors_become_bounds_that_suit_all_records(smid, monkeypatch):
    asked = {}

    def remember(*given, **settings):
        asked.update(settings, bounds=given[2])
        raise KeyboardInterrupt

    monkeypatch.setattr(sys.modules["smid.cli.study"], "order_study", remember)
    smid(f"study run.csv other.csv {COMMON} --noise-bounds 2x,0.5 --methods auto,sparse --workers 3")
    (relative, absolute) = (bound["y"] for bound in asked["bounds"])
    assert absolute == 0.5
    assert f"{relative:.4g}" == str(relative)
    assert 0 < relative <= 0.2, "twice the least bound, and noise within 0.1 explains the data"
    assert (asked["orders"], asked["methods"], asked["workers"]) == ((1,), ("auto", "sparse"), 3)


def test_an_interrupted_study_says_how_to_go_on(smid, monkeypatch):
    def stopped(*given, **settings):
        def stop(_):
            raise KeyboardInterrupt

        return order_study(*given, **{**settings, "progress": stop})

    monkeypatch.setattr(sys.modules["smid.cli.study"], "order_study", stopped)
    result = smid(f"study run.csv {COMMON} --noise-bounds 0.2 --folder kept")
    assert result.exit_code == 130
    assert "continue with --resume kept" in result.stderr
    assert "1 not run" in result.output


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("--samples 1,x", "'x' is not a positive integer"),
        ("--methods best", "'best' is not a method"),
        ("--noise-bounds 0.5x", "below the least noise bound"),
        ("--noise-bounds 0.2 --samples 50", "has 6 samples, fewer than 50"),
        ("--workers 2 --dask tcp://127.0.0.1:1", "give one of them"),
        ("--folder a --resume b", "give one of them"),
        ("--noise-bounds 0.2 --resume none", "holds no study to resume"),
        ("--noise-bounds 0.2 --dask nowhere", "no Dask scheduler answers at nowhere"),
        ("run.csv", "two records have the name 'run'"),
    ],
)
def test_a_mistake_is_one_line(smid, line, words):
    result = smid(f"study run.csv {COMMON} {line}")
    assert result.exit_code == 2
    assert words in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert Status.CERTIFIED.value not in result.stdout
    assert "a" not in os.listdir()
