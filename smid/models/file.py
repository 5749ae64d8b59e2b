"""Models from TOML files, and back: the name of a model class and its fields."""

from __future__ import annotations

import inspect
import json
import math
import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import fields
from difflib import get_close_matches
from os import PathLike
from pathlib import Path
from typing import Any

from relaxations.writing import write_text
from smid.models.armax import Armax
from smid.models.errors import ModelError, refuse_unknown
from smid.models.errors_in_variables import ErrorsInVariables
from smid.models.expressions import TextError
from smid.models.hammerstein import Hammerstein
from smid.models.model import Model
from smid.models.output_error import OutputError
from smid.models.own_model import OwnModel, fields_of
from smid.models.priors import Priors
from smid.models.reactor import Reactor
from smid.models.rotating_arm import RotatingArm
from smid.models.wiener import Wiener

__all__ = ["MODEL_CLASSES", "load_model", "model_from_mapping", "save_model"]

MODEL_CLASSES: dict[str, Callable[..., Model]] = {
    "OutputError": OutputError,
    "ErrorsInVariables": ErrorsInVariables,
    "Armax": Armax,
    "Hammerstein": Hammerstein,
    "Wiener": Wiener,
    "Reactor": Reactor,
    "RotatingArm": RotatingArm,
    "OwnModel": OwnModel,
}
"""The model classes a file may name; a new one is one line here."""


def _is_end(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and not math.isnan(value)


def _is_number(value: Any) -> bool:
    return _is_end(value) and math.isfinite(value)


def _is_range(value: Any) -> bool:
    return isinstance(value, list | tuple) and len(value) == 2 and all(map(_is_end, value))


def _is_integer(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _list_of(accepts: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda value: isinstance(value, list | tuple) and all(map(accepts, value))


def _table_of(accepts: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda value: isinstance(value, Mapping) and all(map(accepts, value.values()))


def _any_of(*kinds: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda value: any(accepts(value) for accepts in kinds)


_KINDS: dict[str, tuple[str, Callable[[Any], bool]]] = {
    "int": ("a whole number", _is_integer),
    "int | Sequence[int]": (
        "a whole number, or a list with one for each output",
        _any_of(_is_integer, _list_of(_is_integer)),
    ),
    "Orders": (
        "a whole number, or for each output a list with one for each input",
        _any_of(_is_integer, _list_of(_is_integer), _list_of(_list_of(_is_integer))),
    ),
    "float": ("a finite number", _is_number),
    "float | None": ("a finite number", _is_number),
    "float | Sequence[float]": (
        "a finite number, or a list with one for each input",
        _any_of(_is_number, _list_of(_is_number)),
    ),
    "bool": ("true or false", lambda value: isinstance(value, bool)),
    "str": ("a string", _is_text),
    "str | Sequence[str]": ("a string, or a list of strings", _any_of(_is_text, _list_of(_is_text))),
    "Sequence[int]": ("a list of whole numbers", _list_of(_is_integer)),
    "Sequence[str]": ("a list of strings", _list_of(_is_text)),
    "Channels": ("a list of channels, or a table", lambda v: isinstance(v, list | tuple | Mapping)),
    "Mapping[str, Box]": ("a table of numbers and ranges", lambda v: isinstance(v, Mapping)),
    "Mapping[str, str]": ("a table of strings", _table_of(_is_text)),
    "Range | None": ("a range [lower, upper]", _is_range),
    "tuple[float, float] | None": ("a range [lower, upper]", _is_range),
    "float | Range | None": ("a number or a range [lower, upper]", _any_of(_is_number, _is_range)),
    "Mapping[str, float]": ("a table of numbers", _table_of(_is_number)),
    "Mapping[str, tuple[float, float]]": ("a table of ranges [lower, upper]", _table_of(_is_range)),
    "Mapping[str, Range]": ("a table of ranges [lower, upper]", _table_of(_is_range)),
}
"""What each annotation of a field means to the writer of a file."""


def fields_of_class(build: Callable[..., Model]) -> dict[str, str]:
    """Field names of a model class, priors included where it takes them, each with its annotation as text."""
    arguments = inspect.signature(build).parameters.values()
    own = {item.name: str(item.annotation) for item in arguments if item.kind is not inspect.Parameter.VAR_KEYWORD}
    priors = {item.name: str(item.type) for item in fields(Priors)}
    return own | priors if len(own) < len(arguments) else own


def model_from_mapping(content: Mapping[str, Any]) -> Model:
    """Build a model from its class and fields.

    Parameters
    ----------
    content
        ``class`` and the fields of that model function.

    Raises
    ------
    ModelError
        If class or field are unknown, or a field has the wrong type; the message says what is valid.

    Examples
    --------
    >>> model_from_mapping({"class": "OutputError", "na": 2, "stable": True}).max_lag
    2
    """
    if not isinstance(content.get("class"), str):
        raise ModelError(_no_class(content))
    refuse_unknown("class", [content["class"]], MODEL_CLASSES)
    build = MODEL_CLASSES[content["class"]]
    given = {name: value for name, value in content.items() if name != "class"}
    known = fields_of_class(build)
    refuse_unknown(f"field of {content['class']}", given, known)
    for name, value in given.items():
        expected, accepts = _KINDS[known[name]]
        if not accepts(value):
            raise ModelError(f"field {name!r} of {content['class']} is {value!r}: give {expected}")
    for name in required_fields(build):
        if name not in given:
            raise ModelError(f"{content['class']} needs {name}: give {_KINDS[known[name]][0]}")
    return build(**given)


def required_fields(build: Callable[..., Model]) -> list[str]:
    """Return the fields of a model class that have no default."""
    arguments = inspect.signature(build).parameters.values()
    return [
        item.name
        for item in arguments
        if item.default is inspect.Parameter.empty and item.kind is not inspect.Parameter.VAR_KEYWORD
    ]


def _no_class(content: Mapping[str, Any]) -> str:
    near = [name for name in content if get_close_matches("class", [name.lower()])]
    trouble = "the model names no class"
    if "class" in content:
        trouble = f"class is {content['class']!r}, no string"
    elif near:
        trouble += f", did you mean class by {near[0]!r}"
    return f'{trouble}; write class = "..." with one of {", ".join(MODEL_CLASSES)}'


def load_model(path: str | PathLike[str]) -> Model:
    """Read a model from a TOML file.

    Parameters
    ----------
    path
        A file with ``class = "Hammerstein"`` and that function's fields, say.

    Raises
    ------
    ModelError
        If the file cannot be read, is not valid TOML, or does not describe a model.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "model.toml"
    ...     _ = file.write_text('class = "OutputError"')
    ...     load_model(file).name
    'output error'
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
        content = tomllib.loads(text)
    except OSError as error:
        raise ModelError(f"cannot read the model file {path}: {error.strerror}; check the path") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ModelError(f"{path} is not valid TOML: {error}; correct it there") from None
    except RecursionError:
        raise ModelError(f"{path} has too many brackets inside each other: remove some") from None
    try:
        return model_from_mapping(content)
    except TextError as error:
        raise ModelError(f"{path}{_place(error, text)}: {error.why}") from None
    except ModelError as error:
        raise ModelError(f"{path}: {error}") from None


def _place(error: TextError, text: str) -> str:
    """Return line and column of an error in the text of a file; in its equation, where that is written with escapes."""
    start = text.find(error.text) if error.text else -1
    if start < 0:
        return f", column {error.column} of {error.text!r}"
    before = text[: start + error.column - 1]
    return f", line {before.count(chr(10)) + 1}, column {len(before) - before.rfind(chr(10))}"


def save_model(model: Model, path: str | PathLike[str]) -> Path:
    """Write any model as a TOML file that `load_model` reads back as an equal model; return the path.

    Parameters
    ----------
    model
        It is written as an ``OwnModel``, with its equations as text.

    Raises
    ------
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = save_model(OutputError(stable=True), Path(folder) / "model.toml")
    ...     load_model(file) == OutputError(stable=True)
    True
    """
    tables = list[str]()
    lines = ['class = "OwnModel"']
    for name, value in fields_of(model).items():
        if isinstance(value, dict):
            tables += ["", f"[{name}]", *(f"{_key(key)} = {_toml(item)}" for key, item in value.items())]
        elif isinstance(value, list):
            lines += [f"{name} = [", *(f"    {_toml(item)}," for item in value), "]"]
        else:
            lines.append(f"{name} = {_toml(value)}")
    return write_text(path, "\n".join([*lines, *tables]) + "\n")


def _toml(value: Any) -> str:
    """Return a value as TOML on one line."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_key(key)} = {_toml(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        # A string of JSON is one of TOML, apart from DEL.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    # A float of NumPy prints its type.
    return str(value) if isinstance(value, int) else repr(float(value))


def _key(name: str) -> str:
    return name if re.fullmatch("[A-Za-z0-9_-]+", name) else _toml(name)
