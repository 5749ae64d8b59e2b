"""`smid track`: intervals of a file or a stream, proven changes, one line for a mistake."""

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from smid.cli import main
from smid.data import DataError, Dataset
from smid.data.experiment import Experiment
from smid.recursive import Arx, RecursiveSet, Sample, TrackedSet, follow, samples_of

OPTIONS = "--input u --output y --noise-bound 0.1001"


def changing(path, count=120, at=80):
    random = np.random.default_rng(0)
    u, w = random.choice([-1.0, 1.0], count), np.zeros(count)
    for k in range(1, count):
        pole = 0.8 if k < at else 0.4
        w[k] = pole * w[k - 1] + (1 - pole) * 2 * u[k - 1]
    y = w + random.uniform(-0.1, 0.1, count)
    rows = [f"{0.1 * k:.1f},{u[k]:g},{y[k]:.6f}" for k in range(count)]
    Path(path).write_text("\n".join(["time [s],u [V],y [bar]", *rows]) + "\n")
    return rows


def streamed(lines, options=f"{OPTIONS} --bounds b0=-10:10"):
    text = "\n".join(["time [s],u [V],y [bar]", *lines]) + "\n"
    return CliRunner().invoke(main, ["track", "-", *options.split()], input=text, prog_name="smid")


def test_a_record_with_a_change(smid):
    changing("change.csv")
    result = smid(f"track change.csv {OPTIONS} --json out.json --report out.html --refine-every 50 --pieces 4")
    assert result.exit_code == 0, result.output
    assert "Proven: the plant changed between" in result.output
    document = json.loads(Path("out.json").read_text(encoding="utf-8"))
    assert document["schema"] == "smid.track/1"
    (change,) = document["changes"]
    assert change["after"] < 80 <= change["sample"]
    truth = {"a1": -0.4, "b0": 1.2}
    for interval in document["intervals"]:
        assert interval["lower"] <= truth[interval["name"]] <= interval["upper"]
    assert len(document["history"]["a1"]["lower"]) == 120
    assert "certified changes" in Path("out.html").read_text(encoding="utf-8")


def test_a_stream_gives_the_intervals_of_the_file(smid):
    rows = changing("change.csv")
    assert smid(f"track change.csv {OPTIONS} --bounds b0=-10:10 --json file.json").exit_code == 0
    result = streamed(rows, f"{OPTIONS} --bounds b0=-10:10 --json stream.json --live")
    assert result.exit_code == 0, result.output
    assert "a change of the plant is proven" in result.output
    documents = [json.loads(Path(name).read_text(encoding="utf-8")) for name in ("file.json", "stream.json")]
    assert documents[0]["intervals"] == documents[1]["intervals"]
    assert documents[0]["changes"] == documents[1]["changes"]


def test_a_stream_with_missing_samples_and_empty_cells():
    rows = changing("steady.csv", at=200)
    del rows[50:53]
    rows[20] = rows[20].rpartition(",")[0] + ","
    result = streamed(rows, f"{OPTIONS} --bounds b0=-10:10 --json out.json")
    assert result.exit_code == 0, result.output
    document = json.loads(Path("out.json").read_text(encoding="utf-8"))
    assert len(document["history"]["a1"]["lower"]) == 120
    assert document["changes"] == []
    a1 = document["intervals"][0]
    assert a1["lower"] <= -0.8 <= a1["upper"]
    assert a1["upper"] - a1["lower"] < 0.1


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda rows: [*rows[:30], rows[10]], "row 31 of the stream goes back in time, from 2.9 s to 1 s: sort"),
        (lambda rows: [*rows[:30], "2.95,1,1"], "row 31 of the stream is 0.05 s after the last one"),
        (lambda rows: [*rows[:30], "3.0,1,bad"], "row 31 of the stream: y is 'bad', not a number"),
        (lambda rows: rows[:0], "there is no sample to follow"),
    ],
)
def test_bad_streams_end_in_one_line(change, says):
    result = streamed(change(changing("x.csv")))
    assert result.exit_code == 2
    (line,) = [line for line in result.output.splitlines() if line.startswith("error")]
    assert says in line


@pytest.mark.parametrize(
    ("line", "says"),
    [
        (f"track run.csv {OPTIONS} --drift a=b", "gives no drift: write 1e-4, or a1=1e-4,b0=1e-3"),
        (f"track run.csv {OPTIONS} --drift q=1", "unknown parameter 'q'"),
        (f"track run.csv {OPTIONS} --bounds b0=1", "gives no interval: write b0=-10:10"),
        (f"track run.csv {OPTIONS} --input-noise-bound z=1", "'z' is none of u"),
        ("track - --output y --noise-bound 1", "a stream needs --input U and one --output Y"),
        (f"track - {OPTIONS} --start 3", "--start and --stop belong to a file"),
        (f"track constant.csv {OPTIONS}", "the input u is constant, which says nothing of the plant"),
        (f"track back.csv {OPTIONS}", "lies before that of row"),
    ],
)
def test_mistakes_end_in_one_line(smid, line, says):
    rows = changing("x.csv")
    Path("back.csv").write_text("\n".join(["time,u,y", *rows[:30], rows[3]]) + "\n")
    Path("constant.csv").write_text("\n".join(["time,u,y", *(f"{0.1 * k:.1f},1,{k % 3}" for k in range(30))]) + "\n")
    result = smid(line)
    assert result.exit_code == 2
    assert says in result.output
    assert len([line for line in result.output.splitlines() if line.startswith("error")]) == 1


def test_runs_one_after_the_other_keep_the_time_between_them():
    def run(name, start):
        return Experiment(name, {"u": [1.0, -1.0, 1.0], "y": [0.0, 0.2, 0.0]}, start)

    data = Dataset.from_arrays(input={"u": [1.0, -1.0, 1.0]}, output={"y": [0.0, 0.2, 0.0]}, sampling_time=0.5)
    both = data.with_experiments([run("one", 0.0), run("two", 2.5)])
    samples = list(samples_of(both))
    assert [sample.time for sample in samples] == [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5]
    assert [sample.missing for sample in samples] == [False] * 3 + [True] * 2 + [False] * 3
    estimator = RecursiveSet(Arx(), 1.0, {"b0": (-10.0, 10.0)})
    taken = follow(estimator, samples, pieces=0)
    found = TrackedSet.of(both, estimator, taken)
    assert found.unknown == ("a1",) or "b0" in found.unknown
    assert "says next to nothing of" in found.conclusion
    with pytest.raises(DataError, match="the run two starts at 0 s, before 1 s"):
        list(samples_of(data.with_experiments([run("one", 0.0), run("two", 0.0)])))


def test_an_interrupt_ends_a_stream_with_its_result():
    def samples(count):
        yield from [Sample(0.1 * k, ((-1.0) ** k,), 0.0) for k in range(count)]
        raise KeyboardInterrupt

    estimator = RecursiveSet(Arx(), 1.0, {"b0": (-10.0, 10.0)})
    assert len(follow(estimator, samples(20))) == 20
    with pytest.raises(KeyboardInterrupt):
        follow(estimator, samples(0))


def test_a_row_that_is_refused_loses_no_result(smid):  # noqa: ARG001
    rows = changing("change.csv", at=120)
    result = streamed([*rows[:90], "3.0,1,0.5", *rows[90:]], f"{OPTIONS} --bounds b0=-10:10 --json out.json --pieces 4")
    assert result.exit_code != 0
    assert "goes back in time" in result.output
    assert "The result is that of the 90 samples before." in result.output
    document = json.loads(Path("out.json").read_text(encoding="utf-8"))
    assert len(document["history"]["a1"]["lower"]) == 90
    assert document["intervals"][0]["lower"] <= -0.8 <= document["intervals"][0]["upper"]
