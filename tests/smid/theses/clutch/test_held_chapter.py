"""Records with long holds, and the findings of the thesis on them."""

import numpy as np
import pytest

from smid.models import ModelError
from smid.sensors import CFPX, CPX, PX, MedianFiltered
from smid.theses.clutch.held_chapter import SENSORS, HeldChapter, findings
from smid.theses.clutch.held_records import HELD_RECORDS, HOLD, held_records
from smid.theses.clutch.sensor_study import StructureRow, StructureTable
from smid.theses.clutch.sensor_study.structures import CFPX_PRINTED, CPX_PRINTED, FINAL_PRINTED, PX_PRINTED


@pytest.fixture(scope="module")
def data():
    return held_records()


def test_levels_last_longer_than_the_median(data):
    current = data.experiments[0].values["current"]
    changes = np.flatnonzero(np.diff(current)) * data.sampling_time
    holds = np.diff(changes)
    assert holds[holds > 0.01].min() > 2 * 0.5
    assert np.max(holds) >= HOLD - 0.01


def test_step_a_is_reached_from_below_and_step_b_from_both_sides(data):
    runs = dict(zip(HELD_RECORDS, data.experiments, strict=True))
    settled = {}
    for name in ("20C_step_a", "20C_step_b"):
        values = runs[name].values
        levels, before = values["current"][:-1], values["current"][1:]
        falls = (levels > before) & (before > 0)
        settled[name] = falls.sum()
    assert settled["20C_step_a"] == 0
    assert settled["20C_step_b"] > 10
    with pytest.raises(ModelError, match="no record '20C_step_z'"):
        held_records("20C_step_z")


def table(number, printed, name=str):
    rows = tuple(StructureRow(name(key), 1, mse, mse) for key, mse in printed.items())
    return StructureTable(number, "", "", rows)


def layers(hidden):
    return " - ".join(map(str, hidden))


def test_the_printed_tables_agree_with_themselves(data):
    tables = (
        table("5.1", CPX_PRINTED, layers),
        table("5.2", PX_PRINTED, layers),
        table("5.3", CFPX_PRINTED, lambda order: f"order {order}"),
        table("5.4", FINAL_PRINTED),
    )
    data = data.crop(0, 6000)
    step_a, step_b = (data.select(name) for name in ("20C_step_a", "20C_step_b"))
    polynomial = CFPX(8).fit(step_a, seed=1)
    known = {
        "CPX20 filtered": CPX((3,)).fit(step_a, seed=1, starts=1),
        "CPX20H": CPX((3,)).fit(step_b, seed=1, starts=1),
        "PX20H": PX((3,)).fit(step_b, seed=1, starts=1),
        "CFPX20 filtered": MedianFiltered(polynomial, 250),
    }
    sensors = {name: known.get(name, polynomial) for name in SENSORS}
    found = tuple(findings(tables, sensors, data))
    assert all(one.agrees for one in found if one.subject.startswith("Table"))
    by_figure = {one.subject.split(":")[0]: one for one in found}
    assert by_figure["Fig. 5.28"].agrees  # holds longer than the median
    chapter = HeldChapter(tables, found, {}, data)
    assert f"of {len(found)} findings" in chapter.conclusion
    assert chapter.to_dict()["findings"][0]["agrees"] is True
