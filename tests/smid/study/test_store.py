"""The study's file: what it refuses, and what it keeps when the disk is full."""

import sqlite3
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest

from smid import OutputError, order_study
from smid.study import StudyError
from smid.study.cell import Cell, Job, Settings
from smid.study.outcome import Outcome, Status
from smid.study.store import FILE, open_store
from tests.smid.study.study_records import MODEL, QUICK, OwnLift, record

SUBJECT = {"data": {"run": "abc"}, "model": {"name": "m"}, "settings": {"rounds": 1}, "versions": {"numpy": "2.0"}}
LONG = Outcome(Status.FAILED, "x" * 3000, seconds=1.0, peak_memory=2.0)


def job(number):
    return Job.of(Cell("run", 8, (("y", 0.1),), "auto", number), "auto", MODEL, record(1), Settings())


def add_all(store):
    for number in range(1, 50):
        store.add(job(number), LONG)


@pytest.fixture
def begun(tmp_path):
    """A finished study of one cell."""
    with ThreadPoolExecutor(1) as thread:
        order_study(MODEL, {"run": record(1)}, 0.1, orders=[1], executor=thread, folder=tmp_path, **QUICK)
    return tmp_path


@pytest.mark.parametrize(
    ("data", "model", "settings", "words"),
    [
        ({"run": record(2)}, MODEL, {}, r"of other data: run was \w+\.\.\., now \w+\.\.\."),
        ({"other": record(1)}, MODEL, {}, "of other data: run was .* now none; other was none"),
        ({"run": record(1)}, OutputError(na=1), {}, "of other model: parameters a1 lower was -1.0, now none"),
        ({"run": record(1)}, MODEL, {"rounds": 7}, "of other settings: rounds was 1, now 7"),
    ],
)
def test_a_study_of_something_else_is_refused_with_what_differs(begun, data, model, settings, words):
    with pytest.raises(StudyError, match=words):
        order_study(model, data, 0.1, orders=[1], folder=begun, resume=True, **{**QUICK, **settings})


def test_a_study_of_other_versions_is_refused_with_both(tmp_path):
    with open_store(tmp_path, SUBJECT, resume=False):
        pass
    other = {**SUBJECT, "versions": {"numpy": "3.0"}}
    with (
        pytest.raises(StudyError, match=r"of other versions: numpy was 2\.0, now 3\.0"),
        open_store(tmp_path, other, resume=True),
    ):
        pass


def test_a_file_in_another_format_is_refused(begun):
    with sqlite3.connect(begun / FILE) as connection:
        connection.execute("PRAGMA user_version = 9")
    connection.close()
    with pytest.raises(StudyError, match="format 9, this version of smid reads format 1"):
        order_study(MODEL, {"run": record(1)}, 0.1, orders=[1], folder=begun, resume=True, **QUICK)


def test_a_study_is_neither_overwritten_nor_made_up(begun, tmp_path):
    with pytest.raises(StudyError, match="holds a study already"):
        order_study(MODEL, {"run": record(1)}, 0.1, orders=[1], folder=begun, **QUICK)
    with pytest.raises(StudyError, match="holds no study to resume"):
        order_study(MODEL, record(1), 0.1, orders=[1], folder=tmp_path / "none", resume=True)


def test_a_file_that_is_no_database_is_refused(tmp_path):
    (tmp_path / FILE).write_text("these are no tables" * 100)
    with pytest.raises(StudyError, match="is not a database"), open_store(tmp_path, SUBJECT, resume=True):
        pass


def test_a_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(StudyError, match="cannot make the folder"), open_store(tmp_path / "file" / "a", SUBJECT, False):
        pass


def test_two_studies_do_not_write_into_one_file(tmp_path):
    with (
        open_store(tmp_path, SUBJECT, resume=False),
        pytest.raises(StudyError, match="another process runs this study"),
        open_store(tmp_path, SUBJECT, resume=True),
    ):
        pass


def test_a_full_disk_is_told_and_leaves_the_file_whole(tmp_path):
    with open_store(tmp_path, SUBJECT, resume=False) as store:
        (pages,) = store.connection.execute("PRAGMA page_count").fetchone()
        store.connection.execute(f"PRAGMA max_page_count = {pages + 4}")
        with pytest.raises(StudyError, match=r"the disk is full; the runs done so far are kept\. Free some space"):
            add_all(store)
    with open_store(tmp_path, SUBJECT, resume=True) as store:
        kept = len(store.outcomes())
        assert 0 < kept < 49
        assert store.connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        assert store.outcomes() == {job(number).key: LONG for number in range(1, kept + 1)}
        store.add(job(kept + 1), LONG)


def test_equal_cells_of_other_data_model_or_settings_have_other_keys():
    one = job(1)
    others = [
        job(2),
        replace(one, data=record(2)),
        replace(one, model=OutputError(na=1)),
        replace(one, settings=Settings(rounds=3)),
        replace(one, versions={**one.versions, "numpy": "0"}),
        replace(one, cell=replace(one.cell, noise_bound=(("y", 0.2),))),
        replace(one, method="sparse"),
        replace(one, method=OwnLift(0.5)),
        replace(one, method=OwnLift(0.6)),
    ]
    assert len({one.key, *(other.key for other in others)}) == 10
    assert job(1).key == one.key


def test_an_outcome_that_is_not_a_number_anywhere_comes_back():
    odd = Outcome(Status.REFUSED, "order 1 is too low")
    back = Outcome.from_dict(odd.to_dict())
    assert (back.status, back.message, back.seconds != back.seconds) == (odd.status, odd.message, True)
