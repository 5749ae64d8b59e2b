"""The JSON Schema of model files, by which an editor completes and checks them."""

from __future__ import annotations

import inspect
import json
import re
from pathlib import Path
from typing import Any

from smid.models.file import MODEL_CLASSES, fields_of_class, required_fields
from smid.models.priors import Priors

__all__ = ["SCHEMA_FILE", "model_schema"]

SCHEMA_FILE = Path(__file__).with_name("model.schema.json")
"""What `model_schema` returns, as a file of the package."""

_NUMBER = {"type": "number"}
_RANGE = {"type": "array", "items": _NUMBER, "minItems": 2, "maxItems": 2}
_TEXT = {"type": "string"}
_TEXTS = {"type": "array", "items": _TEXT}
_COUNT = {"type": "integer"}
_CHANNEL = {
    "type": "object",
    "properties": {"signal": _TEXT, "noise": {"type": ["boolean", "string"]}, "inverse": _TEXT},
    "additionalProperties": False,
}
_BOX = {
    "type": "object",
    "properties": {"range": {"anyOf": [_NUMBER, _RANGE]}, "unit": _TEXT, "null": _NUMBER},
    "additionalProperties": False,
}


def _list(entry: dict[str, Any]) -> dict[str, Any]:
    return {"type": "array", "items": entry}


def _table(entry: dict[str, Any]) -> dict[str, Any]:
    return {"type": "object", "additionalProperties": entry}


_KINDS: dict[str, dict[str, Any]] = {
    "int": _COUNT,
    "int | Sequence[int]": {"anyOf": [_COUNT, _list(_COUNT)]},
    "Orders": {"anyOf": [_COUNT, _list(_COUNT), _list(_list(_COUNT))]},
    "float": _NUMBER,
    "float | Sequence[float]": {"anyOf": [_NUMBER, _list(_NUMBER)]},
    "float | None": _NUMBER,
    "bool": {"type": "boolean"},
    "str": _TEXT,
    "str | Sequence[str]": {"anyOf": [_TEXT, _TEXTS]},
    "Sequence[int]": _list(_COUNT),
    "Sequence[str]": _TEXTS,
    "Range | None": _RANGE,
    "tuple[float, float] | None": _RANGE,
    "float | Range | None": {"anyOf": [_NUMBER, _RANGE]},
    "Mapping[str, float]": _table(_NUMBER),
    "Mapping[str, Range]": _table(_RANGE),
    "Mapping[str, tuple[float, float]]": _table(_RANGE),
    "Mapping[str, str]": _table(_TEXT),
    "Mapping[str, Box]": _table({"anyOf": [_NUMBER, _RANGE, _BOX]}),
    "Channels": {"anyOf": [_TEXTS, _table({"anyOf": [_TEXT, _CHANNEL, {"type": "array", "items": _CHANNEL}]})]},
}
"""The schema of each annotation of a field."""


def model_schema() -> dict[str, Any]:
    """Return the JSON Schema of model files: one alternative for each class, with the text of its docstring.

    Examples
    --------
    >>> [one["title"] for one in model_schema()["oneOf"]][:2]
    ['OutputError', 'ErrorsInVariables']
    """
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "Model file of smid",
        "type": "object",
        "oneOf": [_alternative(name) for name in MODEL_CLASSES],
    }


def _alternative(name: str) -> dict[str, Any]:
    build = MODEL_CLASSES[name]
    text = inspect.getdoc(build) or ""
    said = {**_said(inspect.getdoc(Priors) or ""), **_said(text)}
    fields = {
        field: {**_KINDS[kind], "description": said[field]} if field in said else _KINDS[kind]
        for field, kind in fields_of_class(build).items()
    }
    return {
        "title": name,
        "description": text.split("\n")[0],
        "properties": {"class": {"const": name, "description": text.split("\n")[0]}, **fields},
        "required": ["class", *required_fields(build)],
        "additionalProperties": False,
    }


def _said(docstring: str) -> dict[str, str]:
    """Return what a docstring says of each parameter or attribute."""
    entries = re.findall(r"^(\w+(?:, \w+)*)\n((?: {4}.*\n?|\n(?= {4}))+)", docstring, flags=re.MULTILINE)
    return {name: " ".join(text.split()) for names, text in entries for name in names.split(", ")}


if __name__ == "__main__":
    SCHEMA_FILE.write_text(json.dumps(model_schema(), indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
