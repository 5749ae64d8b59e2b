"""What is written has exactly the fields and types that docs/json.md gives, and the schemas that ship are those."""

import json
import re
from pathlib import Path

import jsonschema
import pytest

from smid.reports import schemas
from tests.smid.cli import json_tables
from tests.smid.cli.json_tables import OBJECTS

COMMON = "run.csv --input u --output y --model model.toml"


@pytest.mark.parametrize(
    ("line", "name"),
    [
        (f"identify {COMMON} --validate other.csv", "smid.identify/1"),
        (f"identify {COMMON} --noise-bound 0.1", "smid.identify/1"),
        (f"identify {COMMON} --noise-bound 0.01", "smid.identify/1, empty"),
        (f"error-bound {COMMON}", "smid.error-bound/1"),
        (f"response {COMMON} --noise-bound 0.1 --samples 3", "smid.response/1"),
        (f"projections {COMMON} --noise-bound 0.1 --directions 4", "smid.projection/1"),
        (f"fit {COMMON}", "smid.fit/1"),
        ("validate estimate.json other.csv", "smid.validate/1"),
        ("compare estimate.json other.csv", "smid.compare/1"),
        ("residuals estimate.json long.csv", "smid.residuals/1"),
        ("show run.csv", "smid.show/1"),
        ("doctor", "smid.doctor/1"),
        (f"phases {COMMON} --validate other.csv", "smid.phases/1"),
        (f"phases {COMMON} --noise-bound 0.01", "smid.phases/1, empty"),
        ("track long.csv --input u --output y --noise-bound 0.2 --pieces 0", "smid.track/1"),
        ("track long.csv --input u --output y --noise-bound 0.2 --pieces 0 --drift 1e-3", "smid.track/1"),
        (f"study {COMMON} --noise-bounds 0.1 --orders 1", "smid.study/1"),
    ],
)
def test_documents_are_as_documented(smid, line, name):
    if "estimate.json" in line:
        smid(f"identify {COMMON} --noise-bound 0.1 --json estimate.json")
    smid(f"{line} --json out.json")
    document = json.loads(Path("out.json").read_text(encoding="utf-8"))
    assert document["schema"] == name.split(",")[0]
    jsonschema.validate(document, schemas()[document["schema"]])
    assert ("empty" in document) == name.endswith("empty")


def test_the_schemas_that_ship_are_those_of_the_documentation():
    cure = "write them again: python -m tests.smid.cli.json_tables"
    assert schemas() == json_tables.schemas(), cure
    for schema in schemas().values():
        jsonschema.Draft202012Validator.check_schema(schema)


def test_a_damaged_document_is_refused(smid):
    smid(f"identify {COMMON} --noise-bound 0.1 --json out.json")
    document = json.loads(Path("out.json").read_text(encoding="utf-8"))
    validator = jsonschema.Draft202012Validator(schemas()["smid.identify/1"])
    assert validator.is_valid(document)
    estimate = document["estimate"]
    for damage in ({"stopped": 3}, {"colour": "red"}, {"parameters": [{"name": "a1"}]}, {"schema": "smid.estimate/2"}):
        assert not validator.is_valid({**document, "estimate": {**estimate, **damage}})
    del estimate["model"]
    assert not validator.is_valid(document)


def test_every_object_of_the_documentation_is_reached():
    linked = {m for rows in OBJECTS.values() for _, kind, _ in rows for m in re.findall(r"\[(.+?)\]", kind)}
    assert linked == {name for name in OBJECTS if not name.startswith("smid.")}
