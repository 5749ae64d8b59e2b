"""What is written has exactly the fields and types that docs/json.md gives."""

import json
import re
from pathlib import Path

import pytest

DOCUMENTATION = Path(__file__).parents[3] / "docs" / "json.md"
TYPES = {"number": (int, float), "integer": int, "string": str, "pair": list, "boolean": bool}


def documented():
    """Return heading -> field -> type, from the tables."""
    objects = {}
    for section in DOCUMENTATION.read_text(encoding="utf-8").split("\n## ")[1:]:
        heading, body = section.split("\n", 1)
        if "| Schema | Fields |" in body:  # a list of documents, told in words
            continue
        objects[heading] = dict(re.findall(r"^\| `(\w+)` \| (.+?) \|", body, flags=re.MULTILINE))
        assert objects[heading], f"no fields under {heading}"
    return objects


OBJECTS = documented()


def check_object(value, name, place):
    assert list(value) == list(OBJECTS[name]), f"{place}: fields of {name}"
    for field, kind in OBJECTS[name].items():
        check(value[field], kind, f"{place}.{field}")


def check(value, kind, place):
    if kind.endswith(" or null"):
        kind = kind.removesuffix(" or null")
        if value is None:
            return
        if kind.startswith("map of ") and None in value.values():
            value = {k: v for k, v in value.items() if v is not None}
    if kind.startswith("list of "):
        assert isinstance(value, list), place
        for k, item in enumerate(value):
            check(item, kind.removeprefix("list of "), f"{place}[{k}]")
    elif kind.startswith("map of "):
        assert isinstance(value, dict), place
        for key, item in value.items():
            check(item, kind.removeprefix("map of "), f"{place}[{key}]")
    elif match := re.fullmatch(r"\[(.+)\]\(#.+\)", kind):
        check_object(value, match[1], place)
    else:
        assert isinstance(value, TYPES[kind]), f"{place} is {value!r}, documented as {kind}"
        assert isinstance(value, bool) == (kind == "boolean"), place


COMMON = "run.csv --input u --output y --model model.toml"


@pytest.mark.parametrize(
    ("line", "name"),
    [
        (f"identify {COMMON} --validate other.csv", "smid.identify/1"),
        (f"identify {COMMON} --noise-bound 0.1", "smid.identify/1"),
        (f"identify {COMMON} --noise-bound 0.01", "smid.identify/1, empty"),
        (f"error-bound {COMMON}", "smid.error-bound/1"),
        (f"response {COMMON} --noise-bound 0.1 --samples 3", "smid.response/1"),
        ("validate estimate.json other.csv", "smid.validate/1"),
        ("compare estimate.json other.csv", "smid.compare/1"),
        ("residuals estimate.json long.csv", "smid.residuals/1"),
        ("show run.csv", "smid.show/1"),
        ("doctor", "smid.doctor/1"),
        (f"study {COMMON} --noise-bounds 0.1 --orders 1", "smid.study/1"),
    ],
)
def test_documents_are_as_documented(smid, line, name):
    if "estimate.json" in line:
        smid(f"identify {COMMON} --noise-bound 0.1 --json estimate.json")
    smid(f"{line} --json out.json")
    document = json.loads(Path("out.json").read_text(encoding="utf-8"))
    check_object(document, name, name)
    assert document["schema"] == name.split(",")[0]


def test_every_object_of_the_documentation_is_reached():
    linked = {m for fields in OBJECTS.values() for kind in fields.values() for m in re.findall(r"\[(.+?)\]", kind)}
    assert linked == {name for name in OBJECTS if not name.startswith("smid.")}
