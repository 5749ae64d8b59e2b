"""Models of equations as text: what the text means, what is refused and where, and that a saved model comes back."""

import math

import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st

from smid import load_model, save_model
from smid.diagnosis.effects import input_backlash, sensor_bias
from smid.diagnosis.effects.check import cases
from smid.models import (
    VALUE,
    ErrorsInVariables,
    Hammerstein,
    Line,
    Measurement,
    Model,
    ModelError,
    OutputError,
    OwnModel,
    Parameter,
    Reactor,
    RotatingArm,
    Wiener,
    signal,
    simulate,
    t,
)
from smid.models.simulated import Simulated

TANKS = """
class = "OwnModel"
name = "two tanks"
equations = [
    "d/dt h = (k*u - c*h)/A",
    "w[t] = -a*w[t-1] + b*v[t-1]",
]
constraints = ["0 <= a + b <= 1"]
scheme = "euler"
substeps = 2
sampling_time = 0.5

[outputs]
h = {}
p = { signal = "w", inverse = "value + s*value**3" }

[inputs]
u = "u"
v = { noise = true }

[parameters]
k = { range = [0, 9], unit = "m3/V" }
c = [0, 2]
A = 4
a = [-1, 1]
b = [0, inf]
s = { range = [0, 1], null = 0 }
"""


def write(folder, text):
    path = folder / "model.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_file_gives_the_model_that_python_builds(tmp_path):
    h, w, u, v = map(signal, ("h_true", "w", "u", "v_true"))
    k, c, area, a, b, s = parameters = (
        Parameter("k", 0, 9, "m3/V"),
        Parameter("c", 0, 2),
        Parameter("A", 4, 4),
        Parameter("a", -1, 1),
        Parameter("b", 0, math.inf),
        Parameter("s", 0, 1, null=0),
    )
    by_hand = Model(
        "two tanks",
        parameters,
        (
            Line(h[t], (k.symbol * u[t] - c.symbol * h[t]) / area.symbol, rate=True),
            Line(w[t], -a.symbol * w[t - 1] + b.symbol * v[t - 1]),
        ),
        (
            Measurement("h", "h_true", "eta"),
            Measurement("p", "w", "eta2", VALUE + s.symbol * VALUE**3),
            Measurement("v", "v_true", "zeta"),
        ),
        (a.symbol + b.symbol, 1 - a.symbol - b.symbol),
        scheme="euler",
        substeps=2,
        sampling_time=0.5,
    )
    assert load_model(write(tmp_path, TANKS)) == by_hand
    assert load_model(save_model(by_hand, tmp_path / "saved.toml")) == by_hand


FOLLOWER = OutputError().with_values({"a1": -0.5, "b0": 2.0})
MODELS = [
    OutputError(3, 2, offset=True, stable=True, dc_gain=(0.5, 2)),
    OutputError(2, 1, integrator=True, bounds={"b0": (0, math.inf)}, input="lambda", output="déjà"),
    ErrorsInVariables(2, 1, pole_radius=0.9, minimum_phase=True),
    Hammerstein(2, input_scale=0.01, stable=True),
    Hammerstein(input_noise=True),
    Wiener(output_range=(-1, 2)),
    Reactor(sampling_time=np.float64(0.1)),
    RotatingArm(friction=True, drag=True),
    Simulated(FOLLOWER, "y_sim"),
    OwnModel(
        ["w[t] = c*c2*w[t-1]"], {"y": "w"}, {"c": "c_read"}, {"c": [0, 1], "c2": 1 / 3}, description='a "b" \x7f\\'
    ),
]


@pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
def test_every_class_comes_back_from_its_file(model, tmp_path):
    assert load_model(save_model(model, tmp_path / "model.toml")) == model


@given(
    st.floats(allow_nan=False), st.floats(allow_nan=False, allow_infinity=False), st.text(st.characters(codec="utf-8"))
)
def test_numbers_and_texts_come_back_exactly(tmp_path_factory, low, value, text):
    x = signal("x")
    a = Parameter("a", low, math.inf, text)
    line = Line(x[t], a.symbol * x[t - 1] + sympy.Float(value) * signal("u")[t])
    model = Model(text, (a,), (line,), (Measurement("y", "x", "eta"),), values={"a": value}, description=text)
    assert load_model(save_model(model, tmp_path_factory.mktemp("models") / "model.toml")) == model


@pytest.mark.parametrize("effect", [input_backlash.EFFECT, sensor_bias.EFFECT], ids=lambda effect: effect.name)
def test_an_extended_model_comes_back_and_runs_alike(effect, tmp_path):
    for case in cases():
        extension = next(iter(effect.extensions(case.model, case.site)))
        model = extension.model.with_values({**case.model.values, **extension.starts[0]})
        again = load_model(save_model(model, tmp_path / "model.toml"))
        for part in ("name", "parameters", "measurements", "constraints", "values", "origins", "sampling_time"):
            assert getattr(again, part) == getattr(model, part)
        # Sympy may write the same equation in another form.
        record = case.site.data.experiments[0].values
        for name, run in simulate(model, record, check=False).items():
            np.testing.assert_allclose(simulate(again, record, check=False)[name], run, rtol=1e-9, atol=1e-9)


OWN = {"equations": ["w[t] = a*w[t-1] + u[t-1]"], "outputs": {"y": "w"}, "inputs": ["u"], "parameters": {"a": [-1, 1]}}


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"equations": ["w[t] = a*w[t-1] + c*u[t-1]"]}, "column 19 of .*: 'c' is no parameter, no input"),
        ({"equations": ["w[t] = a*w[t-1] + uu[t-1]"]}, "column 19 .* did you mean 'u'"),
        ({"equations": ["w[t] = a*w[t-1] + u[t-1"]}, "column 20 .* cannot be read from here"),
        ({"equations": ["w[t] = a*w[t-1] + u.real"]}, "column 19 .*'u.real' is not understood"),
        ({"equations": ["w[t] = open(u[t])"]}, r"column 8 .*'open\(u\[t\]\)' is not understood"),
        ({"equations": ["w[t] = a*w[t-1] + u__x[t]"]}, "column 19 .*the name 'u__x' holds '__'"),
        ({"equations": ["w[t] = a*w[t-1] + u[t+1]"]}, "reads u.*, the future"),
        ({"equations": ["w[t] = a*w[t-1] + u[t/2]"]}, "column 19 .*not a signal at a fixed lag"),
        ({"equations": ["w[t] = a[t]*w[t-1] + u[t]"]}, "column 8 .*'a' is a parameter: leave out its index"),
        ({"equations": ["w[t] = a*w[t-1] + u[t]/(1-1)"]}, "column 19 .*divides by zero"),
        ({"equations": ["w[t] = a*w[t-1] + u[t]*9**9**9"]}, "column 24 .*more than 1000 digits"),
        ({"equations": ["w[t] = " + "(" * 5000 + "u"]}, "column 2"),
        ({"equations": ["w[t-1] = u"]}, "column 1 .*an equation begins with the signal"),
        ({"equations": ["w = w + u"]}, "algebraic loop"),
        ({"equations": ["w = u", "w = a*u"]}, "'w' is defined by 2 lines"),
        ({"equations": "w = u"}, "equations is 'w = u': give a list of texts"),
        ({"outputs": ["y"]}, r"the output 'y' shows 'y', which has no equation: add y\[t\] = .*\(w\)"),
        ({"outputs": "y"}, "outputs is 'y': give a list"),
        ({"outputs": {"y": {"signa": "w"}}}, "unknown entry of the output 'y' 'signa', did you mean 'signal'"),
        ({"outputs": {"y": {"signal": "w", "noise": 1}}}, "the noise of the output 'y' is 1"),
        ({"outputs": {"y": {"signal": "w", "inverse": "value + d"}}}, "column 9 of 'value . d': 'd' is no parameter"),
        ({"outputs": {"y": {"signal": "w", "inverse": 2}}}, "the inverse of the output 'y' is 2"),
        ({"outputs": {"y": 3}}, "the output 'y' is 3: give the name of a signal"),
        ({"inputs": ["u", "v"]}, "the input 'v' is in no equation"),
        ({"inputs": {"u": "u", "v": "w"}}, "the input 'w' has an equation"),
        ({"inputs": ["u 1"]}, "channel name 'u 1' cannot be used"),
        ({"constraints": ["a < 1"]}, "column 1 .*compare parameters by <= or >="),
        ({"constraints": ["a <= u"]}, "column 6 .*'u' is no parameter"),
        ({"parameters": {"a": [2, 1]}}, "give lower <= upper"),
        ({"parameters": {"a": "1"}}, "parameter 'a' is '1': give its value, or a range"),
        ({"parameters": {"a": {"rang": 1}}}, "unknown entry of parameter 'a' 'rang', did you mean 'range'"),
        ({"parameters": {"a": {"unit": 1}}}, "the unit of parameter 'a' is 1"),
        ({"parameters": {"a": {"null": "x"}}}, "null of parameter 'a' is 'x'"),
        ({"values": {"b": 1}}, "the value b = 1"),
        ({"scheme": "rk5"}, "unknown scheme 'rk5', did you mean 'rk4'"),
    ],
)
def test_mistakes_are_told_in_one_line(changed, message):
    with pytest.raises(ModelError, match=message) as told:
        OwnModel(**{**OWN, **changed})
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("c*h", "c*g", "model.toml, line 5, column 24: 'g' is no parameter"),
        ("a*w[t-1] +", "\\u0061*w[t-1] + x*", "model.toml, column 20 of 'w.*: 'x' is no parameter"),
        ("a + b <=", "a + b <", "model.toml, line 8, column 17: '0 <= a . b < 1' is no inequality"),
        ("h = {}", "h = {", "is not valid TOML: .*line 14"),
        ("s = {", "s = " + "[" * 3000, "is not valid TOML|too many brackets"),
    ],
)
def test_a_mistake_in_a_file_is_told_with_line_and_column(tmp_path, old, new, message):
    assert old in TANKS
    with pytest.raises(ModelError, match=message):
        load_model(write(tmp_path, TANKS.replace(old, new)))
