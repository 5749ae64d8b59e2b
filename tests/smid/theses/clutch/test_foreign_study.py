"""The study of six plants is made as it says; its numbers are for the command."""

import numpy as np
import pytest

from smid.sensors import CPX, PTX, PX
from smid.theses.clutch.plants import plant_records
from smid.theses.clutch.plants_chapter import PlantsChapter
from smid.theses.clutch.sensor_study import HELD_OUT, ForeignRow, ForeignStudy, foreign, foreign_study


@pytest.fixture(scope="module")
def small():
    patch = pytest.MonkeyPatch()
    patch.setattr(foreign, "plant_records", lambda plant, seed: plant_records(plant, seed=seed).crop(1000, 1500))
    patch.setattr(foreign, "PTX", lambda: PTX(hidden=(2,), plays=1))
    patch.setattr(foreign, "CPX", lambda: CPX(hidden=(2,)))
    patch.setattr(foreign, "PX", lambda: PX(hidden=(2,)))
    yield foreign_study(("backlash",), starts=1)
    patch.undo()


def test_a_row_for_each_held_out_record(small):
    assert [row.record for row in small.rows] == list(HELD_OUT)
    for row in small.rows:
        assert row.favoured[1] <= row.rival[1]
        assert " all" not in row.rival[0]
        assert row.margin == pytest.approx(row.rival[1] / row.error)
    assert str(small.table).count("backlash") == len(HELD_OUT)
    assert "held-out records" in small.conclusion
    assert len(small.plot().axes) == 1
    assert len(small.to_dict()["rows"]) == len(HELD_OUT)


def test_the_page_says_what_is_shared(small):
    chapter = PlantsChapter(small)
    words = str(chapter)
    assert "share no formula" in words
    assert chapter.conclusion == small.conclusion


def test_the_conclusion_counts():
    rows = [
        ForeignRow("rate", name, (), 0.2, e, ("CPX", 0.1), ("CPX all", 0.05)) for name, e in (("a", 0.04), ("b", 0.2))
    ]
    said = ForeignStudy(tuple(rows)).conclusion
    assert "smaller RMSE on 1 of 2" in said
    assert "0.50 to 2.50 times" in said
    assert "beaten on 1 of 2; their RMSE is 0.25 to 1.25" in said
    assert np.isfinite(rows[0].margin)
