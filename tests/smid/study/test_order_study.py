"""The grid, its outcomes, and going on with what is kept."""

import math
from concurrent.futures import ThreadPoolExecutor

import pytest

from relaxations.errors import ProblemError
from relaxations.proof import Lift
from smid import DataError, ModelError, identify, order_study
from smid.models import Line, Measurement, Model, Parameter, signal, t
from smid.study import Status, StudyError
from smid.study.versions import computing_versions
from tests.smid.study.study_records import MODEL, QUICK, TRUTH, OwnLift, proven, record


@pytest.fixture
def thread():
    """One thread of this process: no start of a worker to wait for."""
    with ThreadPoolExecutor(1) as executor:
        yield executor


def test_every_combination_is_certified_and_holds_the_truth(thread):
    records = {"first": record(1), "second": record(2)}
    study = order_study(MODEL, records, [0.1, 0.15], orders=[1], sample_sizes=[5, 8], executor=thread, **QUICK)
    assert len(study.cells) == len(set(study.cells)) == 8
    assert [o.status for o in study.outcomes] == [Status.CERTIFIED] * 8
    for _, outcome in study.done:
        assert outcome.seconds > 0
        assert outcome.peak_memory > 1
        assert outcome.solves > 0
        for interval in outcome.intervals:
            assert interval.lower <= TRUTH[interval.name] <= interval.upper


def test_a_cell_is_what_identify_gives(thread):
    study = order_study(MODEL, record(1), 0.1, orders=[2], sample_sizes=[6], executor=thread)
    alone = identify(MODEL, record(1).crop(0, 6), 0.1, order=2)
    assert study.outcomes[0].intervals == alone.intervals


def test_a_method_object_is_a_method_of_the_study(thread):
    study = order_study(MODEL, record(1), 0.1, orders=[1], methods=["lift", OwnLift(0.5)], executor=thread, **QUICK)
    assert [cell.method for cell in study.cells] == ["lift", "own lift"]
    short, own = study.outcomes
    assert own.method == "own lift"
    assert own.intervals == short.intervals
    assert study.to_dict()["cells"][1]["method"] == "own lift"


def test_a_worker_process_gets_the_method_object():
    study = order_study(MODEL, record(1), 0.1, orders=[1], methods=[OwnLift(0.5)], **QUICK)
    assert (study.outcomes[0].status, study.outcomes[0].method) == (Status.CERTIFIED, "own lift")


def test_a_study_is_resumed_with_the_same_method_object_only(thread, tmp_path):
    settings = {**QUICK, "orders": [1], "executor": thread, "folder": tmp_path}
    first = order_study(MODEL, record(1), 0.1, methods=[OwnLift(0.5)], **settings)
    again = order_study(MODEL, record(1), 0.1, methods=[OwnLift(0.5), "sparse"], **settings, resume=True)
    assert again.outcomes[0] == first.outcomes[0]  # its time too: the run was not repeated
    with pytest.raises(StudyError, match=r"of other settings: methods own lift share was 0\.5, now 0\.6"):
        order_study(MODEL, record(1), 0.1, methods=[OwnLift(0.6)], **settings, resume=True)


def test_an_order_that_is_too_low_is_refused_and_the_rest_goes_on(thread):
    a, b, u, w = Parameter("a", 0.1, 1), Parameter("b", 0.1, 1), signal("u"), signal("w")
    line = Line(w[t], a.symbol * b.symbol * w[t - 1] + b.symbol * u[t - 1])
    model = Model("product", (a, b), (line,), (Measurement("y", "w", "eta"),))
    study = order_study(model, record(1), 0.2, orders=[1, 2], methods=["sparse"], executor=thread, **QUICK)
    assert [o.status for o in study.outcomes] == [Status.REFUSED, Status.CERTIFIED]
    assert "order 1 is too low" in study.outcomes[0].message
    assert study.conclusion == "2 runs: 1 certified, 1 does not apply."
    assert "order 1 is too low" in str(study)


def test_a_proof_of_emptiness_is_a_result(thread):
    study = order_study(MODEL, record(1), [0.01, 0.1], orders=[1], executor=thread, **QUICK)
    assert [o.status for o in study.outcomes] == [Status.EMPTY, Status.CERTIFIED]
    assert "no parameters explain the data" in study.messages[0]


def test_an_unforeseen_error_ends_its_cell_only(thread, monkeypatch):
    def broken(*_, **__):
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr("smid.study.run_cell.identify", broken)
    study = order_study(MODEL, record(1), 0.1, orders=[1], executor=thread)
    assert study.outcomes[0].status is Status.FAILED
    assert study.outcomes[0].message == "ZeroDivisionError: a bug"


def test_what_failed_is_tried_again_on_resuming(thread, monkeypatch, tmp_path):
    def hungry(*_, **__):
        raise MemoryError

    with monkeypatch.context() as patch:
        patch.setattr("smid.study.run_cell.identify", hungry)
        first = order_study(MODEL, record(1), 0.1, orders=[1], executor=thread, folder=tmp_path, **QUICK)
    assert "out of memory" in first.outcomes[0].message
    again = order_study(MODEL, record(1), 0.1, orders=[1], executor=thread, folder=tmp_path, resume=True, **QUICK)
    assert again.outcomes[0].status is Status.CERTIFIED


def test_a_worker_of_other_versions_is_refused(thread, monkeypatch):
    monkeypatch.setattr("smid.study.cell.computing_versions", lambda: {**computing_versions(), "numpy": "0.1"})
    with pytest.raises(StudyError, match=r"a worker has numpy .*, not 0\.1: install the same versions"):
        order_study(MODEL, record(1), 0.1, orders=[1], executor=thread)


def test_a_resumed_study_equals_one_in_a_piece(thread, tmp_path):
    given = (MODEL, {"first": record(1, 5), "second": record(2, 5)}, [0.1, 0.2])
    settings = {**QUICK, "orders": [1], "executor": thread}
    whole = order_study(*given, **settings)
    done = 0

    def stop(_):
        nonlocal done
        done += 1
        if done == 3:
            raise KeyboardInterrupt

    part = order_study(*given, **settings, folder=tmp_path, progress=stop)
    assert part.interrupted
    assert 0 < len(part.done) < len(part.cells)
    assert f"{len(part.cells) - len(part.done)} not run" in part.conclusion
    rest = order_study(*given, **settings, folder=tmp_path, resume=True)
    assert not rest.interrupted
    assert proven(rest) == proven(whole)
    times = {cell: outcome.seconds for cell, outcome in rest.done}
    assert all(times[cell] == outcome.seconds for cell, outcome in part.done), "a cell was run twice"


def test_a_resumed_study_may_grow(thread, tmp_path):
    settings = {**QUICK, "orders": [1], "executor": thread, "folder": tmp_path}
    first = order_study(MODEL, record(1), 0.1, **settings)
    more = order_study(MODEL, record(1), [0.1, 0.3], **settings, resume=True)
    assert len(more.done) == 2
    assert more.outcomes[0] == first.outcomes[0]


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"orders": [0]}, ModelError, "positive integer"),
        ({"orders": []}, ModelError, "orders is empty"),
        ({"methods": ["fast"]}, ProblemError, "unknown method 'fast'"),
        ({"methods": [Lift]}, ProblemError, "is no relaxation method"),
        ({"methods": [OwnLift(1.0), OwnLift(2.0)]}, ModelError, "two methods have the name 'own lift'"),
        ({"methods": ["lift", Lift()]}, ModelError, "two methods have the name 'lift'"),
        ({"methods": [OwnLift(object())]}, ModelError, "method 'own lift' cannot be saved with a study: object has no"),
        ({"sample_sizes": [9]}, DataError, "has 8 samples, fewer than 9"),
        ({"sample_sizes": [2]}, DataError, "take a longer record"),
        ({"noise_bound": [0.1, -1.0]}, ModelError, "positive number"),
        ({"workers": 0}, ModelError, "at least 1"),
        ({"resume": True}, ModelError, "folder"),
        ({"noise_bound": []}, ModelError, "noise_bound is empty"),
    ],
)
def test_bad_input_is_refused_before_any_work(change, error, words):
    settings = {"noise_bound": 0.1, "orders": [1], **change}
    with pytest.raises(error, match=words):
        order_study(MODEL, record(1), settings.pop("noise_bound"), **settings)


def test_noise_bounds_by_channel_and_repeated_cells(thread):
    study = order_study(MODEL, record(1), [{"y": 0.1}, 0.1], orders=[1, 1], executor=thread, **QUICK)
    assert len(study.cells) == 1
    assert study.cells[0].noise_bound == (("y", 0.1),)
    assert math.isfinite(study.outcomes[0].gap)
