"""The JSON Schemas of the documents that this package writes; their files are in the folder ``schemas``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

_FOLDER = Path(__file__).with_name("schemas")


def schemas() -> dict[str, dict[str, Any]]:
    """Return the JSON Schema (draft 2020-12) of each document, by the name that the document states.

    Examples
    --------
    >>> schemas()["smid.validate/1"]["required"]
    ['schema', 'validations', 'versions']
    """
    read = (json.loads(file.read_text(encoding="utf-8")) for file in sorted(_FOLDER.glob("*.json")))
    return {schema["title"]: schema for schema in read}
