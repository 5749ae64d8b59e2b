"""Units of a model and its data: what is the same, what is refused, and what is not known and so not refused."""

import pytest

import smid
from smid.diagnosis import EFFECTS
from smid.diagnosis.effects.check import cases
from smid.models import ModelError, OwnModel
from smid.models.units import check_units, unit_of

TANK = {
    "equations": ["d/dt level = (k*u - c*sqrt(2*g*level))/A", "w[t] = -a*w[t-1] + b*u[t-1]"],
    "outputs": {"level": {}, "pressure": "w"},
    "inputs": ["u"],
    "parameters": {
        "k": {"range": [0, 9], "unit": "m3/s/V"},
        "c": {"range": [0, 1], "unit": "m^2"},
        "g": {"range": 9.81, "unit": "m/s2"},
        "A": {"range": 4, "unit": "m²"},
        "a": [-1, 1],
        "b": {"range": [0, 1], "unit": "bar/V"},
    },
    "units": {"level": "m", "u": "V", "pressure": "bar"},
}


def changed(**fields):
    return {
        name: {**TANK[name], **value} if isinstance(value, dict) else value
        for name, value in {**TANK, **fields}.items()
    }


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("m3/s/V", "m^3 s^-1 V^-1"),
        ("m³·s⁻¹", "1000 l/s"),
        ("N m", "J"),
        ("Nm/V", "kg*m**2/(s**2 V)"),
        ("V/A", "kΩ/1000"),
        ("1/min", "rpm/(360 deg)"),
        ("µV/°C", "V/K/1000000"),
        ("%", "1/100"),
        ("-", "1"),
        ("kWh", "3600 kJ"),
        ("V/sqrt(Hz)", "V*s^0.5"),
    ],
)
def test_one_unit_in_two_ways(first, second):
    assert unit_of(first) is not None
    assert unit_of(first) == unit_of(second)


@pytest.mark.parametrize("text", ["", "furlong", "m/", "m + s", "m[t]", "C", "__import__('os')", "m3/(s", "?"])
def test_what_is_no_known_unit_is_not_known(text):
    assert unit_of(text) is None


@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"units": {"level": "", "u": "", "pressure": ""}},
        {"parameters": {"c": {"unit": ""}}},
        {"parameters": {"c": {"unit": "widgets"}}},
        {"equations": [TANK["equations"][0], "w[t] = 0.5*w[t-1] + 3*u[t-1]"], "parameters": {"a": 1}},
        {"equations": [TANK["equations"][0], "w[t] = -a*w[t-1] + b*Max(0, u[t-1])"]},
        {"equations": [TANK["equations"][0], "w[t] = -a*w[t-1] + b*Piecewise((u[t-1], u[t-1] > 1), (0, True))"]},
        {"equations": [TANK["equations"][0], "w[t] = -a*w[t-1] + b*u[t-1]*exp(-A/c)*sign(u[t-1])"]},
    ],
)
def test_what_may_be_right_is_taken(fields):
    if "parameters" in fields:
        fields = {
            **fields,
            "parameters": {
                n: v if n == "a" else {**TANK["parameters"][n], **v} for n, v in fields["parameters"].items()
            },
        }
    OwnModel(**changed(**fields))


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        (
            {"equations": [TANK["equations"][0], "w[t] = -a*w[t-1] + b*level[t-1]"]},
            r"w\[t\] = .* adds or compares|on the",
        ),
        (
            {"equations": [TANK["equations"][0], "w[t] = level + u"]},
            r"adds or compares level_true\[t\] in m and u\[t\] in kg",
        ),
        ({"equations": [TANK["equations"][0], "w[t] = b*u*exp(u)"]}, r"has exp\(u\[t\]\) of a quantity in"),
        ({"equations": [TANK["equations"][0], "w[t] = Min(b*u, level)"]}, "adds or compares"),
        ({"units": {"level": "cm"}}, r"d/dt level_true\[t\] = .* has m/\(100\*s\) on the left and m/s on the right"),
        ({"units": {"pressure": "mbar"}}, "on the left|adds or compares"),
        ({"parameters": {"A": {"range": 4, "unit": "cm2"}}}, "units: d/dt"),
        ({"parameters": {"k": {"range": 4, "unit": "l/s/V"}}}, r"m/s on the left and m/\(1000\*s\) on the right"),
        ({"constraints": ["c <= g"]}, r"units: .*>= 0 adds or compares"),
        ({"units": {"lvl": "m"}}, "unknown channel or signal in units 'lvl', did you mean 'level'"),
    ],
)
def test_different_units_are_refused_with_equation_and_units(fields, message):
    with pytest.raises(ModelError, match=message) as told:
        OwnModel(**changed(**fields))
    assert "\n" not in str(told.value)


def test_a_sensor_curve_has_the_unit_of_the_signal():
    sensor = {"level": {}, "pressure": {"signal": "w", "inverse": "s*value"}}
    parameters = {"s": {"range": [0, 1], "unit": "V/bar"}, "b": {"range": [0, 1], "unit": "1"}}
    OwnModel(**changed(outputs=sensor, parameters=parameters))
    with pytest.raises(ModelError, match="units: "):
        OwnModel(**changed(outputs=sensor, parameters={**parameters, "s": {"range": [0, 1], "unit": "A/bar"}}))


def record(**units):
    values = {"u": [0.0, 1, 1, 0], "level": [0.0, 1, 2, 2], "pressure": [0.0, 1, 1, 1]}
    outputs = {name: values[name] for name in ("level", "pressure")}
    return smid.Dataset.from_arrays(input={"u": values["u"]}, output=outputs, sampling_time=1.0, units=units)


def test_data_in_other_units_than_the_model_states_are_refused(tmp_path):
    model = smid.load_model(smid.save_model(OwnModel(**TANK), tmp_path / "model.toml"))
    assert model == OwnModel(**TANK)
    assert dict(smid.bind(model, record(level="m", u="V")).units) == TANK["units"]
    assert dict(smid.bind(model, record()).units) == TANK["units"]
    with pytest.raises(ModelError, match="'level' is in cm in the data, and in m in the model: convert the column"):
        smid.bind(model, record(level="cm"))
    kelvin = OwnModel(["w[t] = a*w[t-1]"], {"level": "w"}, parameters={"a": [0, 1]}, units={"level": "K"})
    with pytest.raises(ModelError, match="in °C in the data, and in K in the model"):
        smid.bind(kelvin, record(level="°C"))
    # A file that states no units of its channels takes those of the record.
    bare = OwnModel(**{**TANK, "units": {}})
    check_units(bare, {"level": "m", "u": "V", "pressure": "bar"})
    with pytest.raises(ModelError, match="units: d/dt level"):
        check_units(bare, {"level": "cm", "u": "V", "pressure": "bar"})


def test_renamed_channels_keep_their_units():
    model = OwnModel(["w[t] = a*w[t-1] + u[t-1]"], {"y": "w"}, ["u"], {"a": [0, 1]}, units={"u": "V", "w": "V"})
    data = smid.Dataset.from_arrays(input={"w": [0, 1, 1]}, output={"out": [0, 0, 1]}, sampling_time=1.0)
    assert dict(smid.bind(model, data).units) == {"w": "V", "w2": "V"}


def test_no_effect_of_the_library_contradicts_units():
    case = next(case for case in cases() if case.name == "two tanks" or "tanks" in case.name)
    units = {channel: "V" if channel in case.model.input_channels else "m" for channel in case.model.channels}
    check_units(case.model, units)
    extended = [x.model for effect in EFFECTS[::4] for x in effect.extensions(case.model, case.site)]
    assert len(extended) > 10
    for model in extended:
        check_units(model, units)
