"""Built-in models of several inputs and outputs: their names, their runs, and what does not fit together."""

import numpy as np
import pytest
from scipy.signal import lfilter

from smid import Dataset, identify
from smid.models import Armax, ErrorsInVariables, Hammerstein, ModelError, OutputError, Wiener, simulate
from smid.models.file import model_from_mapping

INPUTS, OUTPUTS = ["pump", "heater"], ["level", "T"]
BOTH = {"input": INPUTS, "output": OUTPUTS}
RNG = np.random.default_rng(5)
# At rest for as long as any delay, so that a run from rest is a filter's response.
U = {name: np.concatenate([np.zeros(5), np.repeat(RNG.uniform(-1, 1, 12), 2)]) for name in INPUTS}
CLASSES = [OutputError, ErrorsInVariables, Armax, Hammerstein, Wiener]


def path(b, a, u, delay):
    return lfilter(np.concatenate([np.zeros(delay), b]), [1, *a], u)


def test_a_run_is_the_sum_of_the_paths_with_their_delays():
    model = OutputError(na=[2, 1], nb=[[1, 0], [0, 0]], delay=[[1, 4], [2, 0]], **BOTH)
    values = {"a1_level": -1.1, "a2_level": 0.3, "b0_level_pump": 0.5, "b1_level_pump": 0.2, "b0_level_heater": -0.4}
    values |= {"a1_T": -0.6, "b0_T_pump": 0.7, "b0_T_heater": 1.5}
    assert [p.name for p in model.parameters] == list(values)
    run = simulate(model, U, values)
    pump, heater = U.values()
    level = path([0.5, 0.2], [-1.1, 0.3], pump, 1) + path([-0.4], [-1.1, 0.3], heater, 4)
    np.testing.assert_allclose(run["level"], level, atol=1e-12)
    np.testing.assert_allclose(run["T"], path([0.7], [-0.6], pump, 2) + path([1.5], [-0.6], heater, 0), atol=1e-12)


@pytest.mark.parametrize("build", CLASSES)
def test_one_channel_in_a_list_is_that_channel(build):
    assert build(input=["flow"], output=["p"]) == build(input="flow", output="p")


@pytest.mark.parametrize("build", CLASSES)
def test_each_output_is_the_model_of_one_output_with_longer_names(build):
    # The line of T alone, with the names that it has beside level.
    both, one = build(**BOTH), build(input=INPUTS, output="T")
    longer = {p.name: p.name.replace("_pump", "_T_pump").replace("_heater", "_T_heater") for p in one.parameters}
    longer = {old: new if new != old else f"{old}_T" for old, new in longer.items()}
    values = {name: 0.1 * k - 0.25 for k, name in enumerate(longer)}
    others = {p.name: 0.0 for p in both.parameters}
    data = U | dict.fromkeys(OUTPUTS, np.zeros(29))
    whole = simulate(both, data, others | {longer[name]: value for name, value in values.items()})
    np.testing.assert_allclose(whole["T"], simulate(one, data, values)["T"], rtol=1e-12, equal_nan=True)


def test_priors_hold_for_each_path():
    model = OutputError(na=2, nb=1, stable=True, minimum_phase=True, dc_gain=2, **BOTH)
    assert {p.name for p in model.parameters if p.name.startswith("b")} == {
        f"b0_{y}_{u}" for y in OUTPUTS for u in INPUTS
    }  # each gain eliminates the last coefficient of its path
    shown = {frozenset(str(s) for s in c.free_symbols) for c in model.constraints}
    for y in OUTPUTS:
        assert frozenset({f"a1_{y}", f"a2_{y}"}) in shown
        for u in INPUTS:
            assert any(f"b0_{y}_{u}" in names for names in shown)
    assert model.parameter("a1_T").upper == 2


def test_noises_have_the_names_of_their_channels():
    noises = {m.channel: m.noise for m in ErrorsInVariables(**BOTH).measurements}
    assert noises == {"level": "eta_level", "T": "eta_T", "pump": "zeta_pump", "heater": "zeta_heater"}


def test_columns_may_have_the_names_of_signals_and_parameters():
    model = OutputError(input=["w_b", "b0_b_w_b"], output=["b", "eta_b"])
    assert set(model.channels) == {"w_b", "b0_b_w_b", "b", "eta_b"}
    inputs = [np.linspace(0, 1, 9), np.linspace(1, 0, 9)]
    other = OutputError(**BOTH)
    values = [0.1 * k - 0.3 for k in range(len(model.parameters))]
    runs = [
        simulate(
            one, dict(zip(names, inputs, strict=True)), dict(zip([p.name for p in one.parameters], values, strict=True))
        )
        for one, names in ((model, ("w_b", "b0_b_w_b")), (other, INPUTS))
    ]
    np.testing.assert_array_equal(runs[0]["b"], runs[1]["level"])
    np.testing.assert_array_equal(runs[0]["eta_b"], runs[1]["T"])


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"input": ["u", "u"]}, "input names 'u' 2 times: name each channel once"),
        ({"output": ["y", "z", "y"]}, "output names 'y' 2 times"),
        ({"input": []}, "input is an empty list"),
        ({"input": ["u", "y"]}, "channel 'y' stands for 2 channels"),
        ({"input": ["TI-103 Temp", "u"]}, "write 'TI_103_Temp'"),
        ({"na": [1, 2]}, "na = .1, 2. does not fit the outputs y"),
        ({**BOTH, "na": [1]}, "na = .1. does not fit the outputs level, T"),
        ({**BOTH, "delay": [1, 2]}, r"for each output a list .* as in \[\[1, 1\], \[1, 1\]\]"),
        ({**BOTH, "delay": [[1, 2], [1]]}, "delay = .* does not fit"),
        ({"input": INPUTS, "delay": [[1], [2]]}, r"as in \[1, 1\]"),
        ({"input": INPUTS, "delay": [1, -2]}, "delay = -2 is not a valid order"),
        ({"nb": [[True]]}, "nb = True is not a valid order"),
        ({"na": 1.5}, "na = 1.5 is not a valid order"),
        ({**BOTH, "bounds": {"a1": (0, 1)}}, "no parameter 'a1': its parameters are a1_level"),
    ],
)
def test_what_does_not_fit_is_named(fields, message):
    with pytest.raises(ModelError, match=message):
        OutputError(**fields)


def test_scales_of_other_inputs_and_gains_of_other_paths_are_refused():
    with pytest.raises(ModelError, match=r"input_scale = .* does not fit the inputs pump, heater"):
        Hammerstein(input=INPUTS, input_scale=[1.0])
    with pytest.raises(ModelError, match=r"fixed={'beta_heater': 1\.0}"):
        Hammerstein(input=INPUTS, unit_dc_gain=False, fixed={"beta_pump": 1.0})
    model = Hammerstein(
        input=INPUTS,
        powers=(1, 3),
        input_scale=[1, 0.5],
        unit_dc_gain=False,
        fixed={"beta_pump": 1.0, "beta_heater": 1.0},
    )
    assert [str(line.expression) for line in model.lines[:2]] == ["pump[t]", "heater[t]/2"]


def test_a_file_states_what_the_call_states():
    fields = {"input": INPUTS, "output": OUTPUTS, "na": [2, 1], "delay": [[1, 2], [3, 1]], "stable": True}
    assert model_from_mapping({"class": "OutputError", **fields}) == OutputError(**fields)
    with pytest.raises(ModelError, match="give a whole number, or for each output a list with one for each input"):
        model_from_mapping({"class": "OutputError", "delay": [[1.5]]})
    with pytest.raises(ModelError, match="give a string, or a list of strings"):
        model_from_mapping({"class": "OutputError", "input": ["u", 1]})


@pytest.mark.parametrize(
    ("build", "outputs", "bounds"),
    [
        (OutputError, OUTPUTS, {"level": 0.02, "T": 0.1}),
        (ErrorsInVariables, ["T"], {"T": 0.05, "pump": 0.01, "heater": 0.02}),
    ],
)
def test_intervals_hold_the_truth_of_each_path_with_a_bound_for_each_channel(build, outputs, bounds):
    pump, heater = U.values()
    clean = {
        "level": path([0.5], [-0.7], pump, 1) + path([-0.4], [-0.7], heater, 3),
        "T": path([0.7], [-0.3], pump, 2) + path([1.5], [-0.3], heater, 1),
    }
    truth = {
        "level": {"a1_level": -0.7, "b0_level_pump": 0.5, "b0_level_heater": -0.4},
        "T": {"a1_T": -0.3, "b0_T_pump": 0.7, "b0_T_heater": 1.5},
    }
    delay = {"level": [1, 3], "T": [2, 1]}
    noisy = {name: own + RNG.uniform(-1, 1, len(own)) * bounds.get(name, 0.0) for name, own in (U | clean).items()}
    data = Dataset.from_arrays(
        input={name: noisy[name] for name in INPUTS}, output={name: noisy[name] for name in outputs}, sampling_time=1.0
    )
    model = build(delay=[delay[name] for name in outputs], stable=True, input=INPUTS, output=outputs)
    estimate = identify(model, data, bounds, tolerance=1e-2)
    for name in outputs:
        for parameter, value in truth[name].items():
            found = estimate[parameter if len(outputs) > 1 else parameter.replace("_T", "")]
            assert found.lower <= value <= found.upper
            assert found.width < 0.5
