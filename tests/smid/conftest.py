"""Every document that a test writes is validated against the schema that ships."""

import json
from functools import lru_cache
from types import SimpleNamespace

import jsonschema
import pytest

from smid.reports import documents, schemas


@lru_cache
def validators():
    return {name: jsonschema.Draft202012Validator(schema) for name, schema in schemas().items()}


def checked(document, **options):
    text = json.dumps(document, **options)
    if document["schema"] in validators():  # those of the theses are told in words
        validators()[document["schema"]].validate(json.loads(text))
    return text


@pytest.fixture(autouse=True)
def valid_documents(monkeypatch):
    monkeypatch.setattr(documents, "json", SimpleNamespace(dumps=checked))
