"""The schema file of model files is up to date, takes what smid takes, and refuses typing mistakes."""

import json
import re
import tomllib
from pathlib import Path

import jsonschema
import pytest

from smid import OutputError, Wiener, save_model
from smid.models.file import _KINDS, MODEL_CLASSES
from smid.models.schema import _KINDS as SCHEMAS
from smid.models.schema import SCHEMA_FILE, model_schema
from smid.models.simulated import Simulated

PAGE = (Path(__file__).parents[3] / "docs" / "model-files.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```toml\n(.*?)^```$", PAGE, flags=re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def check():
    return jsonschema.Draft7Validator(json.loads(SCHEMA_FILE.read_text(encoding="utf-8")))


def test_the_file_is_what_the_classes_give():
    cure = "python -m smid.models.schema writes it"
    assert json.loads(SCHEMA_FILE.read_text(encoding="utf-8")) == model_schema(), cure
    jsonschema.Draft7Validator.check_schema(model_schema())
    assert SCHEMAS.keys() == _KINDS.keys()


def test_every_field_has_a_description():
    for one in model_schema()["oneOf"]:
        assert [name for name, field in one["properties"].items() if not field.get("description")] == [], one["title"]


def test_files_of_the_page_and_of_save_model_are_valid(check, tmp_path):
    assert {tomllib.loads(block)["class"] for block in BLOCKS} == set(MODEL_CLASSES)
    follower = OutputError().with_values({"a1": -0.5, "b0": 2.0})
    saved = [save_model(model, tmp_path / "m.toml").read_text() for model in (Wiener(), Simulated(follower, "s"))]
    for text in (*BLOCKS, *saved):
        check.validate(tomllib.loads(text))


@pytest.mark.parametrize(
    "text",
    [
        'class = "Hamerstein"',
        "poles = 1",
        'class = "Hammerstein"\npole = 1',
        'class = "Hammerstein"\npoles = "one"',
        'class = "OutputError"\nbounds = { a1 = 3 }',
        'class = "OwnModel"\noutputs = ["y"]',
        'class = "OwnModel"\nequations = ["w[t] = u[t]"]\noutputs = { y = { signl = "w" } }',
        'class = "OwnModel"\nequations = ["w[t] = u[t]"]\noutputs = ["w"]\nparameters = { a = "1" }',
    ],
)
def test_mistakes_are_not_valid(check, text):
    assert not check.is_valid(tomllib.loads(text))
