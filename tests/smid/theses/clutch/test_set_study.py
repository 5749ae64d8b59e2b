"""Recursive sets on the clutch: the truth stays inside, they hold the batch intervals, a change is proven."""

import json

import numpy as np
import pytest

from smid.data import DataError
from smid.data.bundled import load_clutch
from smid.theses.clutch.set_study import NOISE_BOUNDS, changed_parameters, set_study
from tests.smid.theses.clutch.small_clutch_studies import small_set_study


@pytest.fixture(scope="module")
def study():
    return small_set_study()


def test_the_truth_never_leaves_the_set(study):
    assert study.never_left
    assert not study.known.changes
    assert (study.known.lower[0] < study.known.lower[-1]).all()


def test_the_recursive_intervals_hold_the_batch_intervals(study):
    last = study.batch.data.n_samples - 1
    for k, interval in enumerate(study.batch.intervals):
        # Every value that a verified point attains explains the samples, so no outer set may leave it out.
        assert study.known.lower[last, k] <= interval.inner_lower
        assert interval.inner_upper <= study.known.upper[last, k]
        assert interval.lower <= study.truth[k] <= interval.upper


def test_the_hidden_change_is_proven_and_never_before(study):
    assert study.changed.changes
    assert all(change.sample >= study.hidden for change in study.changed.changes)
    assert study.located.after < study.hidden <= study.located.sample
    last = changed_parameters(study.truth)
    assert ((study.changed.lower[-1] <= last) & (last <= study.changed.upper[-1])).all()


def test_the_changed_plant_has_unit_dc_gain_too(study):
    truth, changed = np.array(study.truth), changed_parameters(study.truth)
    assert changed[1:] / (1 + changed[0]) == pytest.approx(truth[1:] / (1 + truth[0]))


def test_larger_noise_proves_less(study):
    for found in study.records:
        counts = [len(found.changes[bound]) for bound in NOISE_BOUNDS]
        assert counts == sorted(counts, reverse=True)
        assert counts[0] > 0


def test_the_study_tells_and_draws(study):
    text = str(study)
    assert "never left the set" in text
    assert "times wider" in text
    assert "20C_step_b" in text
    assert json.loads(json.dumps(study.to_dict(), allow_nan=False))["never_left"] is True
    assert len(study.plot().axes) == 4


def test_bad_records_are_refused():
    with pytest.raises(DataError, match="20C_step_b"):
        set_study(load_clutch("20C_ramp_a"))
    records = load_clutch("20C_step_b").crop(0, 200)
    with pytest.raises(DataError, match="batch = 400 samples of 200"):
        set_study(records)
    with pytest.raises(DataError, match="say too little"):
        set_study(records, batch=60)
