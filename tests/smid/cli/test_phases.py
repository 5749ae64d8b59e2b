"""`smid phases`: error bound, intervals and validation of any record, in one report."""

import json
from pathlib import Path

import numpy as np
import pytest


def irregular(path, seed, count=60):
    """Write a first-order plant behind a square, sampled at irregular instants."""
    random = np.random.default_rng(seed)
    t = 0.1 * np.arange(count) + random.uniform(-0.02, 0.02, count)
    valve, pressure = np.repeat(random.uniform(0, 100, count), 6)[:count], np.zeros(count)
    for k in range(1, count):
        kept = np.exp(-(t[k] - t[k - 1]) / 0.5)
        pressure[k] = kept * pressure[k - 1] + (1 - kept) * 2 * (valve[k - 1] / 100) ** 2
    pressure += random.uniform(-0.02, 0.02, count)
    rows = [f"{t[k]:.4f},{valve[k]:.4f},{pressure[k]:.6f}" for k in range(count)]
    Path(path).write_text("\n".join(["time [s],valve [%],pressure [bar]", *rows]) + "\n")


def test_a_record_with_irregular_stamps_in_three_phases(smid):
    irregular("first.csv", 1)
    irregular("second.csv", 2)
    options = "--input valve --output pressure --powers 2 --validate second.csv --json out.json --report out.html"
    result = smid(f"phases first.csv {options}")
    assert result.exit_code == 0, result.output
    assert "time stamps of first are not uniform" in result.output
    document = json.loads(Path("out.json").read_text(encoding="utf-8"))
    assert document["schema"] == "smid.phases/1"
    bound, used = document["error_bound"], document["estimate"]["noise_bound"]["pressure"]
    assert used == pytest.approx(1.2 * bound["upper"])
    assert [width["factor"] for width in document["widths"]] == [1.001, 1.05, 1.2, 1.5]
    (run,) = document["validations"]
    assert run["scores"][0]["experiment"] == "second"
    page = Path("out.html").read_text(encoding="utf-8")
    for title in ("Least noise bound", "Parameter intervals", "Widths against the noise bound", "Validation on other"):
        assert title in page
    assert "simulated" not in result.output


def test_a_model_file_and_a_given_bound(smid):
    result = smid("phases run.csv --input u --output y --model model.toml --noise-bound 0.11 --validate other.csv")
    assert result.exit_code == 0, result.output
    assert "The intervals are those at 0.11 bar" in result.output


def test_a_bound_below_the_least_one_is_a_proof(smid):
    result = smid("phases run.csv --input u --output y --noise-bound 0.01 --json out.json --report out.html")
    assert result.exit_code == 1
    assert "proven: no parameters explain the data" in result.output
    assert "empty" in json.loads(Path("out.json").read_text(encoding="utf-8"))
    assert "No parameters explain the data" in Path("out.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("phases run.csv --input u --output y --powers 2,x", "'2,x' is no list of powers: write it as 5,4,3"),
        ("phases run.csv --input u --output y --powers 2 --offset", "--offset belongs to a linear model"),
        ("phases long.csv --input u --output y --output time", "one input and one output"),
        ("phases constant.csv --input u --output y", "the input 'u' does not excite"),
        ("phases run.csv --output y", "Missing option '--input'"),
        ("phases run.csv --input u --output y --noise-bound 0.9x", "is below the least noise bound"),
    ],
)
def test_mistakes_end_in_one_line(smid, line, says):
    Path("constant.csv").write_text("\n".join(["time,u,y", *(f"{0.1 * k:.1f},1,{k % 3}" for k in range(30))]) + "\n")
    result = smid(line)
    assert result.exit_code == 2
    assert says in result.output
    assert len([line for line in result.output.splitlines() if line.startswith("error")]) == 1
