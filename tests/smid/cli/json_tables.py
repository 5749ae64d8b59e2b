"""The tables of docs/json.md as JSON Schema. ``python -m tests.smid.cli.json_tables`` writes the files that ship."""

import json
import re
from pathlib import Path

ROOT = Path(__file__).parents[3]
DOCUMENTATION = ROOT / "docs" / "json.md"
FOLDER = ROOT / "smid" / "reports" / "schemas"
ROW = re.compile(r"^\| `(\w+)` \| (.+?) \| (.*?) ?\|$", flags=re.MULTILINE)
WORDS = {
    "number": {"type": "number"},
    "integer": {"type": "integer"},
    "string": {"type": "string"},
    "boolean": {"type": "boolean"},
    "object": {"type": "object"},
    "pair": {"type": "array", "minItems": 2, "maxItems": 2},
}


def objects():
    """Return heading -> rows of field, type and meaning."""
    found = {}
    for section in DOCUMENTATION.read_text(encoding="utf-8").split("\n## ")[1:]:
        heading, body = section.split("\n", 1)
        if "| Schema | Fields |" not in body:  # a list of documents, told in words
            found[heading] = ROW.findall(body)
            assert found[heading], f"no fields under {heading}"
    return found


OBJECTS = objects()


def of_type(kind):
    """Return the schema of a type in the words of the tables."""
    if kind.endswith(" or null"):
        inner = of_type(kind.removesuffix(" or null"))
        if "additionalProperties" in inner:  # a map of things that may be null, and may be null itself
            inner = {**inner, "additionalProperties": {"anyOf": [inner["additionalProperties"], {"type": "null"}]}}
        return {"anyOf": [inner, {"type": "null"}]}
    if kind.startswith("list of "):
        return {"type": "array", "items": of_type(kind.removeprefix("list of "))}
    if kind.startswith("map of "):
        return {"type": "object", "additionalProperties": of_type(kind.removeprefix("map of "))}
    link = re.fullmatch(r"\[(.+)\]\(#.+\)", kind)
    return {"$ref": f"#/$defs/{link[1].replace(' ', '-')}"} if link else WORDS[kind]


def of_object(heading):
    """Return the schema of the object under a heading; every field is required unless it is optional."""
    properties, required = {}, []
    for field, kind, meaning in OBJECTS[heading]:
        properties[field] = {**of_type(kind.removesuffix(", optional")), "description": meaning}
        if field == "schema":
            properties[field]["const"] = meaning.strip("`")
        if not kind.endswith(", optional"):
            required.append(field)
    return {"type": "object", "properties": properties, "required": required, "additionalProperties": False}


def reached(schema):
    """Return the objects that a schema refers to, also through others."""
    found, left = {}, [schema]
    while left:
        for name in re.findall(r'"#/\$defs/(.+?)"', json.dumps(left.pop())):
            if name not in found:
                found[name] = of_object(name.replace("-", " ") if name not in OBJECTS else name)
                left.append(found[name])
    return dict(sorted(found.items()))


def schemas():
    """Return the schema of each document that the tables describe, by its name."""
    by_name = {}
    for heading, rows in OBJECTS.items():
        if rows[0][0] == "schema":
            by_name.setdefault(rows[0][2].strip("`"), []).append(of_object(heading))
    return {
        name: {
            "$schema": "https://json-schema.org/draft/2020-12/schema",
            "title": name,
            **(forms[0] if len(forms) == 1 else {"anyOf": forms}),
            "$defs": reached(forms),
        }
        for name, forms in by_name.items()
    }


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name, schema in schemas().items():
        text = json.dumps(schema, indent=1, ensure_ascii=False) + "\n"
        (FOLDER / f"{name.replace('/', '-')}.json").write_text(text, encoding="utf-8")
