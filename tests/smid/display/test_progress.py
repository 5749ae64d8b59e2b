"""A bar shows how much is done only where that is known, and disappears; progress=True makes one."""

import numpy as np
import pytest

import smid
from smid.display import progress
from smid.display.progress import Bar, Step, counted, duration


@pytest.fixture
def drawn(monkeypatch, capsys):
    """Return what is drawn on standard error, a picture for each line; a second goes by between two lines."""
    clock = iter(range(10_000))
    monkeypatch.setattr(progress.time, "monotonic", lambda: float(next(clock)))
    return lambda: [part.strip() for part in capsys.readouterr().err.split("\r") if part.strip()]


def test_what_is_left_follows_from_the_pieces_that_are_done(drawn):
    with Bar() as bar:
        say = counted(bar, "fits", 4)
        say("gain")
        say("drift")
    pictures = drawn()
    assert [picture.partition(" |")[0] for picture in pictures] == ["fits", "fits: gain", "fits: drift"]
    assert pictures[0].endswith("| 0/4, 1 s")
    assert pictures[1].endswith("| 1/4, 2 s, about 3 s left")
    assert pictures[2].endswith("| 2/4, 3 s, about 2 s left")


def test_a_second_series_of_as_many_pieces_is_timed_on_its_own(drawn):
    with Bar() as bar:
        counted(bar, "fits", 2)("gain")
        for _ in range(6):
            bar("searching")
        counted(bar, "fits", 2)("drift")
    assert drawn()[-1].endswith(" s, about 1 s left")


def test_the_estimate_of_the_work_itself_is_shown(drawn):
    with Bar() as bar:
        bar(Step("runs", 1, 7, left=7200.0))
    assert drawn()[0].endswith("| 1/7, 1 s, about 2 h left")


def test_where_the_number_of_pieces_is_unknown_no_share_is_shown(drawn):
    with Bar() as bar:
        bar("a1 in [0, 1]")
        bar("x" * 500)
    short, long = drawn()
    assert short == "a1 in [0, 1] (1 s)"
    assert len(long) < 500
    assert long.endswith(" s)")


def test_true_is_a_bar_and_false_is_none(capsys):
    u, y = [1.0, 0, 1, 1, 0, 0, 1, 0], [0.0, 1, 0.5, 1.3, 1.6, 0.8, 0.4, 1.2]
    for asked in (False, None):
        smid.identify(smid.OutputError(stable=True), (u, y), 0.1, progress=asked)
        assert capsys.readouterr().err == ""
    smid.identify(smid.OutputError(stable=True), (u, y), 0.1, progress=True)
    assert "a1 in [" in capsys.readouterr().err
    smid.order_study(smid.OutputError(stable=True), smid.data.as_dataset((u, y, 1), smid.OutputError()), 0.1,
                     orders=[1], executor=Now(), progress=True)  # fmt: skip
    assert "0/1" in capsys.readouterr().err


class Now:
    """An executor that works at once."""

    def submit(self, work, *arguments):
        from concurrent.futures import Future

        future = Future()
        future.set_result(work(*arguments))
        return future


def test_a_diagnosis_tells_the_fits_of_a_round():
    rng = np.random.default_rng(0)
    u = rng.uniform(-1, 1, 200)
    lines = []
    y = np.concatenate([[0, 0], u[:-2]]) + 0.01 * rng.standard_normal(200)
    smid.diagnose(smid.OutputError(0), (u, y, 1.0), effects=["input_delay", "gain"], workers=1, progress=lines.append)
    steps = [line for line in lines if isinstance(line, Step)]
    assert steps[0].what == "fits"
    assert (steps[0].done, steps[steps[0].total].done) == (0, steps[0].total)
    assert all(0 <= step.done <= step.total for step in steps)


def test_times_have_a_unit_of_their_size():
    assert [duration(x) for x in (0.0, 59, 60, 5399, 5400)] == ["1 s", "59 s", "1 min", "90 min", "1.5 h"]
