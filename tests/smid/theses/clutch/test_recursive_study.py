"""The recursive estimators on the clutch records."""

import json
from dataclasses import replace

import numpy as np
import pytest

from smid.data import DataError
from smid.data.bundled import CLUTCH_RECORDS, load_clutch
from smid.recursive import NormalisedGradient
from smid.theses.clutch.recursive_study import MODELS, recursive_study


@pytest.fixture(scope="module")
def study():
    return recursive_study(load_clutch().crop(0, 1200))


def test_all_records_models_and_methods_are_there(study):
    names = {t.record for t in study.comparison.trackings}
    assert names == set(CLUTCH_RECORDS)
    assert {"20C_step_b", "60C_step_c", "m20C_step_c"} <= names  # those with hysteresis
    assert len(study.comparison.trackings) == 6 * len(MODELS) * len(CLUTCH_RECORDS)
    assert all(t.diverged is None for t in study.comparison.trackings)


def test_the_figure_of_the_thesis_comes_out_on_noise_too(study):
    gradient = [t for t in study.comparison.trackings if isinstance(t.method, NormalisedGradient)]
    of_the_thesis = [t for t in gradient if t.arx == MODELS[0]]
    assert max(t.largest_left_alone for t in of_the_thesis) < 1e-12
    assert study.on_noise.largest_left_alone < 1e-12
    assert study.on_noise.one_step.rmse > 10
    assert min(t.free_run.rmse for t in of_the_thesis) > 1
    assert "the thesis: 2e-14" in study.meaning


def test_the_table_holds_every_run(study):
    lines = str(study).splitlines()
    assert lines[2] == "Median over the records of the RMSE [bar]"
    assert len(str(study.summary).splitlines()) == 2 + 12
    assert sum(line.startswith(CLUTCH_RECORDS) for line in lines) == 132
    assert len(json.loads(json.dumps(study.to_dict()))["trackings"]) == 132
    assert len(study.plot().axes) == 2


def test_a_missing_channel_is_refused():
    data = load_clutch("20C_step_a").crop(0, 50)
    with pytest.raises(DataError, match="pressure"):
        recursive_study(replace(data.rename({"pressure": "p"})))
    assert np.isfinite(recursive_study(data).on_noise.one_step.rmse)
