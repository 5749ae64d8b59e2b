"""Models from TOML files, and what a typing mistake is told."""

import math

import pytest

from smid.models import Hammerstein, ModelError, OutputError, Wiener, load_model, model_from_mapping
from smid.models.file import _KINDS, MODEL_CLASSES, fields_of_class, required_fields

CLUTCH = """
class = "Hammerstein"
poles = 1
powers = [5, 4, 3]
input_scale = 0.01
unit_dc_gain = true
stable = true
[bounds]
gamma1 = [-1, 0]
"""


def write(folder, text):
    path = folder / "model.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_file_gives_the_model_of_the_call(tmp_path):
    expected = Hammerstein(1, (5, 4, 3), input_scale=0.01, stable=True, bounds={"gamma1": (-1, 0)})
    assert load_model(write(tmp_path, CLUTCH)) == expected
    assert model_from_mapping({"class": "OutputError", "dc_gain": 2}) == OutputError(dc_gain=2)
    assert model_from_mapping({"class": "Wiener", "output_range": [-1, 1]}) == Wiener(output_range=(-1, 1))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('class = "Hamerstein"', "unknown class 'Hamerstein', did you mean 'Hammerstein'.*OutputError"),
        (
            'class = "Hammerstein"\npole = 1',
            "unknown field of Hammerstein 'pole', did you mean 'poles'.*zeros",
        ),
        ('class = "Hammerstein"\npoles = "one"', "'poles' of Hammerstein is 'one': give a whole number"),
        ('class = "Hammerstein"\npoles = true', "give a whole number"),
        ('class = "Hammerstein"\npowers = [3.5]', "give a list of whole numbers"),
        ('class = "OutputError"\nstable = 1', "give true or false"),
        ('class = "OutputError"\ninput = 1', "give a string"),
        ('class = "OutputError"\npole_range = [1]', r"give a range \[lower, upper\]"),
        ('class = "OutputError"\n[bounds]\na1 = 3', "give a table of ranges"),
        ('class = "OutputError"\n[fixed]\na1 = "x"', "give a table of numbers"),
        ("poles = 1", "names no class; write class"),
        ('clas = "OutputError"', "names no class, did you mean class by 'clas'"),
        ('Class = "OutputError"', "did you mean class by 'Class'"),
        ("class = 1", "class is 1, no string; write class"),
        ('class = "OutputError"\npole_radius = nan', "'pole_radius' of OutputError is nan: give a finite number"),
        ('class = "Hammerstein"\ninput_scale = inf', "give a finite number"),
        ('class = "OutputError"\n[bounds]\na1 = [nan, 1]', "give a table of ranges"),
        ('class = "OutputError"\n[bounds]\na9 = [0, 1]', "no parameter 'a9': its parameters are a1, b0"),
        (
            'class = "OutputError"\n[Bounds]\na1 = [0, 1]',
            "unknown field .* 'Bounds', did you mean 'bounds'",
        ),
        ('class = "OutputError"\n[priors]\nstable = true', "unknown field of OutputError 'priors'.*stable"),
        ('class = "Reactor"\nstable = true', "unknown field of Reactor 'stable'.*sampling_time"),
        ("class = ", "is not valid TOML"),
    ],
)
def test_mistakes_are_named(tmp_path, text, message):
    with pytest.raises(ModelError, match=message):
        load_model(write(tmp_path, text))


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ModelError, match=r"cannot read the model file .*nowhere\.toml"):
        load_model(tmp_path / "nowhere.toml")


def test_a_range_may_be_open_at_one_end(tmp_path):
    text = 'class = "OutputError"\n[bounds]\nb0 = [0, inf]\n'
    assert load_model(write(tmp_path, text)) == OutputError(bounds={"b0": (0, math.inf)})


@pytest.mark.parametrize("name", MODEL_CLASSES)
def test_every_field_has_a_default_or_is_asked_for_and_has_a_kind(name):
    required = required_fields(MODEL_CLASSES[name])
    if required:
        with pytest.raises(ModelError, match=f"{name} needs {required[0]}: give a list"):
            model_from_mapping({"class": name})
    else:
        assert model_from_mapping({"class": name}).parameters
    assert set(fields_of_class(MODEL_CLASSES[name]).values()) <= set(_KINDS)
