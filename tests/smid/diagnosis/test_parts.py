"""The test part of a record: nothing but the gain depends on it."""

import json
from dataclasses import replace

import numpy as np
import pytest

from smid.diagnosis import diagnose
from smid.diagnosis.parts import STARTING, split
from tests.smid.diagnosis.lag_records import BOUND, LAG, dead_zone, lag, record, steps

EFFECTS = ["input_dead_zone", "sensor_bias", "input_delay"]


def spoilt(data, test):
    """The record with nonsense wherever the output is in the test part; a dataset admits no NaN."""
    nonsense = 1e9 * np.random.default_rng(0).normal(size=data.n_samples)
    (run,), (mask,) = data.experiments, test
    return data.with_experiments((replace(run, values={**run.values, "y": np.where(mask, nonsense, run.values["y"])}),))


def test_nonsense_in_the_test_part_changes_nothing_but_the_gain():
    u = steps(0, 400)
    data = record(u, lag(dead_zone(u, 0.3)))
    test = split(LAG, data, 0.2).test
    found, blind = (
        diagnose(LAG, d, BOUND, EFFECTS, certify=False, workers=1).to_dict() for d in (data, spoilt(data, test))
    )
    for plain in (found, blind):
        for key in ("gain", "unexplained", "data"):
            del plain[key]
        # What removing a cause does to the test error is part of the gain.
        for cause in plain["causes"] + plain["details"]:
            for key in ("rmse_before", "rmse_after", "chance", "structure_before", "structure_after"):
                del cause["evidence"][key]
    # Where nothing can be measured, a cause is listed as a detail.
    assert found["causes"] == blind["causes"] + blind["details"]
    assert found["model"]["parameters"] is not None
    for key in ("misfit", "faults", "skipped", "dropped", "base", "test_samples", "doubts"):
        assert json.dumps(found[key]) == json.dumps(blind[key]), key


@pytest.mark.parametrize("share", [0.2, 0.5])
def test_the_test_part_is_the_end_of_each_experiment(share):
    u = steps(0, 300)
    data = record(u, lag(u))
    parts = split(LAG, data, share)
    assert parts.seen.experiments[0].n_samples == round((1 - share) * 300)
    assert parts.test[0].sum() == round(share * 300)
    assert not parts.test[0][: round((1 - share) * 300)].any()


def test_a_whole_test_experiment_lends_its_first_samples_to_its_initial_states():
    u = steps(0, 300)
    one, other = record(u, lag(u)), record(u, lag(u), 1)
    data = one.with_experiments((one.experiments[0], replace(other.experiments[0], name="again")))
    parts = split(LAG, data, ["again"])
    assert [run.name for run in parts.seen.experiments] == [data.experiments[0].name]
    assert [int(mask.sum()) for mask in parts.test] == [0, 300 - STARTING]
