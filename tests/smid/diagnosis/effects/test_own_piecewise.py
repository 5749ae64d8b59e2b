"""An effect of the user's own may hold a Piecewise: it is checked, fitted and named as any other."""

import pickle

import numpy as np
import pytest
import sympy

import smid
from smid.diagnosis import Effect, Extension, check_effect
from smid.diagnosis.effects.parts.naming import find, free_name, fresh
from smid.models import Model, OutputError, simulate
from smid.models.edit_lines import rename_channels

ABOVE = sympy.Rational(1, 4)


def extend(model, site):
    rise = fresh(model, "rise", (-2, 2), "", 0.0)
    boosted = free_name(model, f"{site.input}_boosted")
    rewritten = model.insert_before(
        site.input,
        lambda u: u + rise.symbol * sympy.Piecewise((u - ABOVE, (u > ABOVE) & (u < 5)), (0, True)),
        [rise],
        new_name=boosted,
    )
    yield Extension(rewritten, starts=({rise.name: -0.3}, {rise.name: 0.3}))


def describe(values, site):
    return f"Above {float(ABOVE)} the slope of {site.input} rises by {find(values, 'rise'):.2f}."


BOOST = Effect("boost", "the input acts more above a threshold", extend, describe)


@pytest.fixture(scope="module")
def record():
    rng = np.random.default_rng(5)
    u = rng.uniform(-1, 1, 400)
    acting = u + 0.7 * np.where(u > 0.25, u - 0.25, 0.0)
    y = simulate(OutputError(), {"u": acting}, {"a1": -0.6, "b0": 0.5})["y"] + rng.uniform(-0.01, 0.01, 400)
    return smid.Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.1)


def test_the_effect_keeps_the_contract():
    check_effect(BOOST)


def test_the_effect_is_fitted_and_named(record):
    diagnosis = smid.diagnose(OutputError(), record, 0.01, [BOOST, "input_delay", "sensor_bias"], workers=1)
    assert [cause.effect for cause in diagnosis.causes] == ["boost"]
    (rise,) = [p for p in diagnosis.causes[0].parameters if p.name.startswith("rise")]
    assert rise.value == pytest.approx(0.7, abs=0.03)


@pytest.mark.parametrize(
    "condition",
    [
        lambda u, v: u > v,
        lambda u, v: (u >= v) & (v < 2) | sympy.Eq(u, 0),
        lambda u, v: sympy.Ne(u, v),
    ],
)
def test_a_model_with_a_piecewise_is_stored_sent_and_renamed(condition):
    gain = smid.Parameter("gain", -1, 1)
    model = OutputError().insert_before(
        "u", lambda u: sympy.Piecewise((gain.symbol * u, condition(u, gain.symbol)), (0.1, True)), [gain]
    )
    assert Model.from_dict(model.to_dict()) == model
    assert pickle.loads(pickle.dumps(model)) == model
    there = rename_channels(model, {"u": "current", "y": "w"})
    values, u = {"gain": 0.4, "a1": -0.5, "b0": 1.0}, np.linspace(-3, 3, 30)
    assert np.array_equal(
        simulate(there, {"current": u}, values)["w"],
        simulate(model, {"u": u}, values)["y"],
    )


@pytest.mark.parametrize("text", ["Piecewise(1, 2)", "Piecewise((u[t], u[t]), (0, True))", "u[t] > 1", "(u[t], 1)"])
def test_a_text_that_is_no_piecewise_is_refused(text):
    stored = OutputError().to_dict()
    with pytest.raises(smid.ModelError, match=r"is no branch|is no condition|is not understood"):
        Model.from_dict({**stored, "lines": {"w": text}})
