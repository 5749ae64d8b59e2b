"""The fields of the page become Python; what makes no sense is refused before anything runs."""

import ast
import tomllib

import pytest

from smid.app.model_forms import BUILT_IN, asked_model, model_fields, own_model_text, prior_fields
from smid.app.steps import PRODUCED, STEPS, code_of
from smid.data import DataError
from smid.models import ModelError, model_from_mapping

ALL = [name for names in PRODUCED.values() for name in names]
FIELDS = {
    **{"file": "run.csv", "role:u": "input", "role:y": "output", "role:T": "further", "class": "OutputError"},
    **{"OutputError.na": "2", "prior.stable": "yes", "bound:y": "0.1", "certificate": "yes", "train_stop": "50"},
}


@pytest.mark.parametrize("step", STEPS)
def test_the_code_of_a_step_is_python_that_defines_what_the_step_produces(step):
    tree = ast.parse(code_of(step, FIELDS, ALL))
    stored = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
    assert stored & set(PRODUCED[step])


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"missing": "-9999; Bad", "decimal": ","}, 'decimal=",", missing=["-9999", "Bad"]'),
        ({"units": "u=V, y=°C", "delimiter": "tab"}, 'delimiter="\\t", units={"u": "V", "y": "°C"}'),
        ({"sampling_time": "0.5", "time": "t"}, 'time="t", sampling_time=0.5'),
        ({"bundled": "heated_tank"}, 'record_path("heated_tank")'),
    ],
)
def test_options_of_reading_are_arguments(fields, words):
    assert words in code_of("data", FIELDS | fields)


def test_names_that_equations_cannot_hold_are_renamed():
    code = code_of("channels", {"file": 'a "b".csv', "role:TI-1": "output", "role:u": "input"}, ALL)
    assert 'record.rename({"TI-1": "TI_1"})' in code
    assert r'"a \"b\".csv"' in code


def test_infinite_bounds_are_python_too():
    code = code_of("model", FIELDS | {"prior.bounds": "b0 = [0, inf]"}, ALL)
    assert 'bounds={"b0": [0, float("inf")]}' in code


@pytest.mark.parametrize("text", ['# 1\nclass = "Wiener"', "a = '''b'''\nc = 'd'", 'a = "\\\\d"\r\nb = 1'])
def test_the_text_of_a_model_file_is_written_as_it_was_given(text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    first, *_ = code_of("model", {"class": "file", "toml": text}, ALL).partition("model = ")
    exec(first, {})
    assert (tmp_path / "given.toml").read_text("utf-8").splitlines() == text.splitlines()


def test_several_channels_are_stated_in_a_built_in_model():
    several = {"role:TI-1": "input", "OutputError.delay": "1, 3"}
    code = code_of("model", FIELDS | several, ALL)
    assert 'input=["u", "TI_1"], output=["y"], na=2, delay=[1, 3]' in code


def test_one_number_may_stand_for_a_list():
    assert "inverse_powers=[2]" in code_of("model", {"class": "Wiener", "Wiener.inverse_powers": "2"}, ALL)


def test_bounds_of_several_channels_go_by_name_and_those_of_inputs_not_to_a_diagnosis():
    several = FIELDS | {"bound:u": "0.2"}
    assert 'noise_bound={"y": 0.1, "u": 0.2}' in code_of("intervals", several, ALL)
    assert "noise_bound=0.1," in code_of("cause", several, ALL)
    assert 'error_bound(model, train, {"u": 0.2}' in code_of("least", several | {"bound:y": ""}, ALL)


@pytest.mark.parametrize(
    ("step", "fields", "words"),
    [
        ("data", {"file": ""}, "no file was given"),
        ("data", {"sampling_time": "soon"}, "sampling time is 'soon'"),
        ("data", {"units": "V"}, "write them as in u=V,y=bar"),
        ("channels", {"role:y": ""}, "no channel is an output"),
        ("channels", {"train_stop": "half"}, "train stop is 'half'"),
        ("model", {"OutputError.na": "many"}, "field 'na' is 'many': give a whole number"),
        ("model", {"OutputError.na": "-1"}, "-1"),
        ("model", {"class": "file", "toml": " "}, "the model has no text"),
        ("intervals", {"bound:y": ""}, "the noise bound is missing"),
        ("intervals", {"bound:y": "0,3"}, "the noise bound of y is '0,3'"),
        ("cause", {"cause_seconds": "x"}, "cause seconds is 'x'"),
    ],
)
def test_a_field_that_makes_no_sense_is_refused(step, fields, words):
    with pytest.raises((DataError, ModelError)) as told:
        code_of(step, FIELDS | fields, ALL)
    assert words in str(told.value)


def test_a_step_names_the_one_that_must_come_first():
    with pytest.raises(DataError, match="'intervals' needs the step 'model'"):
        code_of("intervals", FIELDS, ["overview", "record"])


@pytest.mark.parametrize("name", BUILT_IN)
def test_a_form_as_it_is_asks_for_the_model_as_it_is(name):
    fields = {f"{name}.{one.name}": one.usual for one in model_fields(name)}
    assert asked_model(name, fields | {f"prior.{one.name}": one.usual for one in prior_fields()}) == {}


def test_the_text_to_begin_with_is_a_model():
    content = tomllib.loads(own_model_text(["u", "v"], ["y", "z"]))
    assert model_from_mapping(content).channels == ("u", "v", "y", "z")
