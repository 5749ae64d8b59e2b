"""The server answers this machine's own page only, and runs each step as the Python that it shows."""

import json
import multiprocessing
import socket

import pytest

import smid

LINEAR = {"class": "OutputError", "OutputError.na": "1", "OutputError.nb": "0", "OutputError.delay": "1"}
ROLES = {"role:valve": "input", "role:level (LT-1)": "output"}


@pytest.fixture
def with_model(served, content):
    """The server after the third step."""
    served.fields.clear()
    assert served.drop("run.csv", content) == "run.csv"
    for step, fields in (("data", {}), ("channels", {**ROLES, "train_stop": "15"}), ("model", LINEAR)):
        done = served.run(step, **fields)
        assert done["error"] == "", step
    return served


def test_nothing_is_found_without_the_secret_or_outside_this_machine(served):
    assert served.ask("/")[0] == served.ask("/wrong/")[0] == 404
    port = int(served.address.split(":")[2].split("/")[0])
    others = [found[4][0] for found in socket.getaddrinfo(socket.gethostname(), port, socket.AF_INET)]
    for host in {other for other in others if not other.startswith("127.")}:
        with pytest.raises(OSError, match="refused"):
            socket.create_connection((host, port), timeout=5)


@pytest.mark.parametrize(
    "headers", [{"Host": "evil.example:80"}, {"Origin": "http://evil.example"}, {"Origin": "null"}]
)
@pytest.mark.parametrize(("path", "body"), [("", None), ("stop", b""), ("file?name=a.csv", b"1"), ("run/data", b"")])
def test_another_site_is_refused(served, headers, path, body):
    status, text = served.ask(path, body, **headers)
    assert status == 403
    assert "Traceback" not in text


def test_the_page_loads_nothing_from_elsewhere(served):
    status, text = served.ask("")
    assert status == 200
    assert "http" not in text.replace("http-equiv", "")
    assert served.ask("app.js")[0] == 200


def test_a_file_is_no_path(served):
    assert served.drop("../../up.csv", b"1\n2\n") == "up.csv"
    for name in ("", "..", ".hidden", "proof.json"):
        assert served.ask(f"file?name={name}", b"x")[0] == 400, name
    assert served.ask("download/up.csv")[0] == served.ask("download/../run.csv")[0] == 404


@pytest.fixture
def as_script(served, tmp_path, monkeypatch):
    """Run the Python that was shown as a script beside the file; return the names that it defines."""

    def run(name, content):
        (tmp_path / name).write_bytes(content)
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(smid, "report", lambda *_, **__: None)  # has its own tests, and takes its time
        names = {"__name__": "__main__"}
        exec(compile(served.ask("download/session.py")[1], "session.py", "exec"), names)
        return names

    return run


def test_each_step_shows_what_it_found_and_the_python_that_finds_it(with_model, content, as_script):
    least = with_model.run("least")
    assert "Least noise bound of level__LT_1_" in least["answer"]["html"]
    offered = float(least["answer"]["values"]["bound:level__LT_1_"])
    assert 0.02 < offered < 0.07
    found = with_model.run("intervals", **{"bound:level__LT_1_": "0.05", "certificate": "yes"})
    assert [name for name, _ in found["files"]] == ["intervals.html", "model.toml", "proof.json", "intervals.json"]
    assert found["lines"]
    assert "Proven: all parameters that explain the 15 samples" in found["answer"]["html"]
    assert "simulated" in with_model.ask("download/intervals.html")[1]
    tested = with_model.run("misfit")
    assert "The residual is" in tested["answer"]["html"]
    assert [name for name, _ in tested["files"]] == ["report.html", "residuals.html"]

    names = as_script("run.csv", content)
    results = json.loads(with_model.ask("download/intervals.json")[1])["estimate"]["parameters"]
    for there, here in zip(names["estimate"].intervals, results, strict=True):
        assert (there.lower, there.upper) == pytest.approx((here["lower"], here["upper"]), rel=1e-9)
        assert there.lower < {"a1": -0.8, "b0": 1.0}[there.name] < there.upper
    assert names["least"].upper < offered
    assert names["tested"].conclusion in tested["answer"]["html"]


def test_a_step_that_runs_again_takes_back_those_below(with_model):
    assert "model" in with_model.run("model")["names"]
    assert with_model.run("channels")["names"] == ["overview", "record", "train", "test"]
    assert "needs the step 'model'" in with_model.run("intervals")["error"]
    script = with_model.ask("download/session.py")[1]
    assert "from_file" in script
    assert "OutputError" not in script


def test_an_empty_set_is_a_result_with_a_proof_and_the_misfit_goes_on(with_model):
    found = with_model.run("intervals", **{"bound:level__LT_1_": "0.001", "certificate": "yes"})
    assert found["error"] == ""
    assert "Proven: no parameters explain the data within 0.001 m" in found["answer"]["html"]
    assert [name for name, _ in found["files"]] == ["intervals.html", "proof.json", "intervals.json"]
    assert "empty" in json.loads(with_model.ask("download/intervals.json")[1])
    tested = with_model.run("misfit")
    assert "smid.fit(model, train)" in tested["code"]
    assert tested["error"] == ""


def test_what_a_step_found_before_it_failed_is_shown(with_model):
    with_model.run("channels", test_start="190")
    with_model.run("model")
    tested = with_model.run("misfit")
    assert tested["error"].startswith("10 samples") or "samples" in tested["error"]
    assert tested["names"][-1] == "run"
    assert "Free runs" in tested["answer"]["html"]


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("empty.csv", b"", "the file holds no rows"),
        ("words.csv", b"a,b\nc,d\n", "words.csv"),
        ("noise.npz", b"PK\x03\x04 no archive", "noise.npz"),
        (
            "marks.csv",
            b"time,y\n" + b"".join(b"%d,%d\n" % (k, -9999 if k == 5 else k % 3) for k in range(20)),
            "missing=-9999",
        ),
    ],
)
def test_a_bad_file_gets_the_error_of_the_package(served, name, content, words):
    served.fields.clear()
    served.drop(name, content)
    done = served.run("data")
    assert words in done["error"]
    assert "fault of smid" not in done["error"]
    assert "Traceback" not in done["error"]
    assert (done["answer"], done["names"]) == (None, [])


def test_a_model_takes_all_inputs_of_the_record(served):
    served.fields.clear()
    served.drop("run.csv", b"time,u,v,y\n" + b"".join(b"%d,%d,%d,%d\n" % (k, k % 3, k % 5, k % 2) for k in range(40)))
    served.run("data")
    served.run("channels", **{"role:u": "input", "role:v": "input", "role:y": "output"})
    for form in (LINEAR, {"class": "file"}):
        done = served.run("model", **form)
        assert done["error"] == ""
        assert "model" in done["names"]
        assert all(f"<mi>{name}</mi>" in done["answer"]["html"] for name in "uv")


def test_the_cause_is_that_of_the_python_and_its_model_that_of_the_next_round(with_model, content, as_script):
    with_model.drop("late.csv", late(content))
    for step in ("data", "channels", "model"):
        with_model.run(step)
    found = with_model.run("cause", **{"bound:level__LT_1_": "", "effects": "input_delay"})
    assert "Cause: input delay" in found["answer"]["html"]
    assert as_script("late.csv", late(content))["diagnosis"].gain_sentence in found["answer"]["html"]
    again = with_model.run("model", **{"class": "file", "toml": found["answer"]["values"]["extended"]})
    assert again["error"] == ""
    assert again["names"][-1] == "model"


def late(content):
    """The record with its output four samples later."""
    comment, header, *lines = content.decode().splitlines()
    rows = [line.split(",") for line in lines]
    shifted = [f"{time},{u},{rows[max(k - 4, 0)][2]}" for k, (time, u, _) in enumerate(rows)]
    return "\n".join([comment, header, *shifted, ""]).encode()


def test_work_can_be_stopped_and_the_next_step_runs(with_model):
    done = with_model.run("cause", stop_at="trying", **{"bound:level__LT_1_": "0.05", "effects": ""})
    assert done["answer"], done["error"]
    assert "ended early" in done["answer"]["html"]
    assert with_model.run("least")["error"] == ""


def test_a_process_that_dies_is_replaced(with_model):
    (process,) = multiprocessing.active_children()
    process.kill()
    assert "read the record again" in with_model.run("least")["error"]
    assert with_model.run("data")["names"] == ["overview"]
