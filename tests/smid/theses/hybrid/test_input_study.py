"""The study of inputs says what each tells, in a table, figures and JSON."""

import json

import pytest

from smid.models import ModelError
from smid.signals import TABLE_F1
from smid.theses.hybrid.inputs import arm_inputs, input_study


@pytest.fixture(scope="module")
def study():
    # All inputs take half a minute: the best and the worst of them show as much.
    some = {name: u for name, u in arm_inputs(200).items() if name in ("six_unequal", "tailored")}
    return input_study(some, budget=0, seed=3)


def test_the_study_names_what_is_told(study):
    assert list(arm_inputs(100)) == [*TABLE_F1, "tailored"]
    assert all(row.holds for row in study.rows)
    assert "inside all four intervals for 2 of 2 inputs" in study.conclusion
    assert "six_unequal" in str(study)
    document = json.loads(json.dumps(study.to_dict()))
    assert document["inputs"][0]["intervals"]["Ws"]["told"] is False
    assert document["inputs"][0]["holds"]


def test_its_figures_have_a_row_for_each_input(study):
    assert len(study.plot_spread().axes) == 6
    assert len(study.plot_intervals().axes) == 4


def test_too_short_a_record_is_refused():
    with pytest.raises(ModelError, match="at least 100"):
        input_study(samples=20)
