"""The reactor's studies on few models, their tables, figures and pages."""

import json
from dataclasses import replace

import numpy as np
import pytest

from smid.models import ModelError
from smid.theses.chapter import write_chapter
from smid.theses.hybrid.reactor import (
    ReactorStudy,
    other_conditions,
    output_errors,
    reactor_record,
    reactor_study,
    requirement_study,
    time_constant_study,
)
from smid.theses.hybrid.reactor.conditions import TRAININGS, VALIDATIONS
from smid.theses.hybrid.reactor.output_errors import CELLS


@pytest.fixture(scope="module")
def study():
    return ReactorStudy(
        output_errors(["two_in_succession"], starts=1, iterations=40),
        other_conditions(["two_in_succession"], starts=1, iterations=10),
        requirement_study(["factor"], ["series, simple", "series, extra", "parallel, simple"], starts=1, iterations=25),
        time_constant_study(starts=1, iterations=20),
    )


def test_extra_back_couplings_beat_simple_ones_in_series(study):
    largest = study.errors.largest
    for error in ("prediction", "simulation"):
        assert largest[error, "series, extra"][0] < 0.3 * largest[error, "series, simple"][0]
    assert largest["simulation", "parallel, as analysed"][0] < 0.1 * study.errors.alone[0]


def test_networks_with_enough_back_couplings_learn_what_is_required(study):
    by_column = {(item.column, item.error): item for item in study.requirements.learned}
    assert by_column["series, extra", "simulation"].largest(0.0, 2.0) < 0.005
    assert by_column["series, simple", "simulation"].largest(0.0, 2.0) > 0.01
    assert by_column["series, extra", "simulation"].requirement.couplings.inputs == 1


def test_other_conditions_hold_every_training_and_validation(study):
    """The network that is large enough beats the first principles, also from noisy records."""
    found = study.conditions
    assert len(found.largest) == len(TRAININGS) * len(VALIDATIONS) * len(CELLS)
    for training in ("staircase", "staircase, 1 % noise"):
        error = found.largest[training, "parallel, as analysed", "constant 0.5"][0]
        assert error < 0.1 * study.errors.alone[0]
    for plant, _, _ in found.runs.values():
        np.testing.assert_array_equal(plant, reactor_record("two_in_succession", "constant").values("y"))
    assert len([axes for axes in found.plot().axes if axes.lines]) == len(TRAININGS)
    assert study.errors.plot_runs().axes[0].lines


def test_noise_is_within_its_share_of_the_span():
    clean, noisy = (reactor_record("factor", noise_share=share).values("y") for share in (0.0, 0.01))
    assert 0.008 < np.abs(noisy - clean).max() / np.ptp(clean) <= 0.01


def test_only_the_network_in_the_balance_leaves_the_time_constant(study):
    assert study.time_constants.tau["static, in the balance"][0] == pytest.approx(2.0, rel=0.01)
    others = [tau[0] for way, tau in study.time_constants.tau.items() if way != "static, in the balance"]
    assert all(abs(tau - 2.0) > 0.02 for tau in others)


def test_it_prints_draws_and_becomes_json(study):
    text = str(study)
    for words in (*CELLS, "thesis: initial", "H_NN(s)", "figure 6.7", "2 s in the plant"):
        assert words in text
    assert len(study.errors.plot().axes) == 2
    assert len(study.requirements.plot().axes) == 2
    content = json.loads(json.dumps(study.to_dict()))
    assert content["requirements"]["networks"][0]["needs"] == [1, 1]


def test_a_model_that_runs_away_is_bad(study):
    key = ("prediction", "series, simple")
    errors = replace(study.errors, largest={**study.errors.largest, key: np.array([np.inf])})
    assert "bad" in str(errors.table("prediction"))
    json.dumps(errors.to_dict(), allow_nan=False)


def test_the_page_tells_what_cannot_be_compared(study, tmp_path):
    page = write_chapter(study, tmp_path / "page.html").read_text(encoding="utf-8")
    for words in ("Table 5", "Table 6", "What cannot be compared", "simulated data, not measured", "<svg"):
        assert words in page


def test_bad_settings_are_refused_at_once():
    with pytest.raises(ModelError, match="iterations = 0"):
        reactor_study(iterations=0)
    with pytest.raises(ModelError, match="plant"):
        reactor_record("nothing")
    with pytest.raises(ModelError, match="signal"):
        reactor_record("factor", "nothing")
