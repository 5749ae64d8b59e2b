"""What a diagnosis prints agrees with itself: text, page and plain data have one source, and no claim belies one."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from smid import diagnose
from smid.diagnosis import Diagnosis
from smid.diagnosis.cause import percent
from smid.reports.diagnosis_page import diagnosis_page
from tests.smid.diagnosis.lag_records import BOUND, LAG, dead_zone, lag, late, record, steps
from tests.smid.diagnosis.test_diagnose import of

EFFECTS = ["input_dead_zone", "input_delay", "extra_lag", "output_saturation", "sensor_bias", "periodic_disturbance"]


def seen(hidden: str, seed: int) -> Diagnosis:
    """Diagnose a record with one effect, two, or none hidden in it."""
    u = steps(seed, 300)
    w = {
        "none": lag(u),
        "delay": lag(late(u, 3)),
        "saturation": np.minimum(lag(u), 0.6),
        "offset and zone": lag(dead_zone(u, 0.3)) + 0.2,
        "slow lag": lfilter([0.2], [1, -0.8], lag(u)),
        "slow wave": lag(u) + 0.3 * np.sin(2 * np.pi * np.arange(300) / 500),  # a period longer than the record
    }[hidden]
    return diagnose(LAG, record(u, w, seed), BOUND, EFFECTS, certify=False, workers=1)


HIDDEN = ("none", "delay", "saturation", "offset and zone", "slow lag", "slow wave")


@pytest.fixture(scope="module", params=[*HIDDEN, "of:named", "of:none", "of:ambiguous"])
def diagnosis(request: pytest.FixtureRequest) -> Diagnosis:
    name = request.param
    return of(name[3:]) if name.startswith("of:") else seen(name, HIDDEN.index(name))


def test_no_interval_of_a_cause_includes_no_effect(diagnosis):
    """Of an effect with several sizes, one has to differ from its null value."""
    for cause in diagnosis.causes:
        sizes = [p for p in cause.parameters if p.null is not None and p.lower is not None and p.upper is not None]
        assert not sizes or any(not p.lower <= p.null <= p.upper for p in sizes), str(cause)


def test_what_is_less_likely_than_not_is_a_doubt(diagnosis):
    sure = diagnosis.causes[: -1 if diagnosis.alternatives else None]
    assert all(cause.confidence >= 0.5 for cause in sure)
    named = {cause.effect for cause in diagnosis.causes}
    assert not named & set(diagnosis.doubts)


def test_no_rejected_rival_has_the_better_merit(diagnosis):
    for cause in diagnosis.causes:
        odds = [rival.odds for rival in cause.rivals]
        assert odds == sorted(odds), "best first"
        for rival in cause.rivals:
            assert rival.odds >= 1 or not rival.why.startswith(("rejected", "less likely")), str(cause)


def test_no_size_is_beyond_what_the_record_spans(diagnosis):
    """A threshold of an input or an output lies within what the channel reaches, and so does an offset."""
    data = diagnosis.data
    largest = {data.channel(name).unit: 0.0 for name in data.names}
    for name in data.names:
        unit = data.channel(name).unit
        largest[unit] = max(largest[unit], float(np.abs(data.stacked(name)).max()), float(np.ptp(data.stacked(name))))
    duration = data.sampling_time * max(run.n_samples for run in data.experiments)
    for parameter in (p for cause in diagnosis.causes for p in cause.parameters):
        limit = {**largest, "s": duration, "rad/s": np.inf, "samples": data.n_samples}.get(parameter.unit, np.inf)
        assert abs(parameter.value) <= limit, str(parameter)


def test_no_period_is_longer_than_the_record(diagnosis):
    duration = diagnosis.data.sampling_time * max(run.n_samples for run in diagnosis.data.experiments)
    for parameter in (p for cause in diagnosis.causes for p in cause.parameters if p.unit == "rad/s"):
        assert 2 * np.pi / parameter.value <= duration, str(parameter)


def test_text_page_and_plain_data_say_the_same(diagnosis):
    plain, said, page = json.loads(json.dumps(diagnosis.to_dict())), str(diagnosis), diagnosis_page(diagnosis)
    box = " ".join(page.result)
    names = [cause.effect for cause in diagnosis.causes]
    assert [cause["effect"] for cause in plain["causes"]] == names
    assert page.document["causes"] == diagnosis.to_dict()["causes"]
    places = [
        said.index(f"{cause.effect} ({percent(cause.confidence)}): {cause.sentence}") for cause in diagnosis.causes
    ]
    assert places == sorted(places)
    for cause in diagnosis.causes:
        assert f"(probability {percent(cause.confidence)}). {cause.sentence}" in box
    assert (diagnosis.verdict == "none") == (not names)
    if diagnosis.verdict == "named":
        headline_is(diagnosis, names[0])
    assert diagnosis.gain_sentence in said
    assert diagnosis.gain_sentence in box
    assert diagnosis.misfit.sentence in said
    for figure in (plain["gain"]["rmse_before"], plain["gain"]["rmse_after"]):
        assert f"{figure:.4g}" in diagnosis.gain_sentence


def test_an_extended_model_that_errs_more_on_the_test_part_is_said_to():
    found = of("named")
    assert "errs more" not in str(found)
    worse = replace(found, gain=replace(found.gain, rmse_after=2 * found.gain.rmse_before))
    assert "The extended model errs more there than the base model" in str(worse)
    assert "The extended model errs more there than the base model" in " ".join(diagnosis_page(worse).result)


def headline_is(diagnosis: Diagnosis, effect: str) -> None:
    page = diagnosis_page(diagnosis)
    assert diagnosis.conclusion.startswith(f"Cause: {effect}")
    assert page.title.split(": ")[1].startswith(effect.replace("_", " "))
    assert page.result[0].startswith(f"Cause: {effect.replace('_', ' ')} (probability ")


def test_the_headline_is_the_first_cause_where_a_later_one_is_ambiguous():
    ambiguous, first = of("ambiguous"), of("named").causes[0]
    both = replace(ambiguous, causes=(first, *ambiguous.causes))
    headline_is(both, first.effect)
    assert f"It is {' or '.join(ambiguous.alternatives)}." in both.conclusion
