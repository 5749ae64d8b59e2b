"""The built-in models as forms: fields from the signature of each model, with the words of its docstring."""

from __future__ import annotations

import inspect
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cache
from typing import Any

from smid.models import ModelError
from smid.models.file import MODEL_CLASSES, fields_of_class, model_from_mapping
from smid.models.priors import Priors
from smid.models.schema import model_schema

__all__ = ["BUILT_IN", "ModelField", "asked_model", "model_fields", "own_model_text", "prior_fields"]

BUILT_IN: Mapping[str, str] = {
    "OutputError": "Output error: linear, noisy output",
    "ErrorsInVariables": "Errors in variables: linear, noisy input and output",
    "Armax": "ARMAX: linear, the noise a moving average",
    "Hammerstein": "Hammerstein: a polynomial, then linear",
    "Wiener": "Wiener: linear, then a curve",
}
"""Model class -> its line in the list; any other model is given as a model file."""

_PRIORS = tuple(one.name for one in fields(Priors))
# Channels are those of the record: `smid.bind` renames them.
_NOT_ASKED = ("input", "output")


@dataclass(frozen=True)
class ModelField:
    """A field of a form.

    Parameters
    ----------
    kind
        "yes" for a check box, otherwise what the field holds, in words.
    usual
        Its default as text; empty for none.
    """

    name: str
    kind: str
    usual: str
    help: str


_KINDS = {
    "int": "Whole number",
    "int | Sequence[int]": "Whole number; for several outputs as in 2, 1",
    "Orders": "Whole number; for several paths as in [1, 3], [2, 1]",
    "float": "Number",
    "float | None": "Number",
    "float | Sequence[float]": "Number; for several inputs as in 1, 0.1",
    "bool": "yes",
    "Sequence[int]": "Whole numbers, as in 5, 4, 3",
    "Range | None": "Range, as in 0, 1",
    "tuple[float, float] | None": "Range, as in 0, 1",
    "float | Range | None": "Number, or range as in 0, 1",
    "Mapping[str, float]": "Numbers by name, as in a1 = -0.5, b0 = 1",
    "Mapping[str, Range]": "Ranges by name, as in a1 = [-1, 0], b0 = [0, inf]",
}
"""What each annotation of a field means to the writer of a form."""


@cache
def model_fields(of: str) -> tuple[ModelField, ...]:
    """Return the fields of a model class, without its channels and priors."""
    return tuple(one for one in _fields(of) if one.name not in _PRIORS)


@cache
def prior_fields() -> tuple[ModelField, ...]:
    """Return the priors, which all built-in models take."""
    return tuple(one for one in _fields("OutputError") if one.name in _PRIORS)


def _fields(of: str) -> list[ModelField]:
    said = next(one["properties"] for one in model_schema()["oneOf"] if one["title"] == of)
    usual = {item.name: item.default for item in inspect.signature(MODEL_CLASSES[of]).parameters.values()}
    return [
        ModelField(
            name,
            _KINDS[kind],
            _text(usual.get(name)),
            said[name].get("description", "").replace("``", "").replace("`", ""),
        )
        for name, kind in fields_of_class(MODEL_CLASSES[of]).items()
        if name not in _NOT_ASKED
    ]


def _text(value: Any) -> str:
    if value is None or isinstance(value, bool):
        return "yes" if value else ""
    return ", ".join(map(str, value)) if isinstance(value, Sequence) else str(value)


def asked_model(of: str, given: Mapping[str, str], channels: Mapping[str, Sequence[str]] = {}) -> dict[str, Any]:
    """Return the fields of a model that differ from their defaults.

    Parameters
    ----------
    given
        A field of the class is named ``Hammerstein.poles``, say, and a prior ``prior.stable``.
    channels
        Of the record, as ``input`` and ``output``; they are stated where there are several.

    Raises
    ------
    ModelError
        If a field does not hold what its kind says, or the model function refuses it.

    Examples
    --------
    >>> asked_model("OutputError", {"OutputError.na": "2", "OutputError.nb": "0", "prior.pole_range": "0, 1"})
    {'na': 2, 'pole_range': [0, 1]}
    """
    asked = [(f"{of}.{one.name}", one) for one in model_fields(of)]
    asked += [(f"prior.{one.name}", one) for one in prior_fields()]
    several = any(len(names) > 1 for names in channels.values())
    found: dict[str, Any] = {role: list(names) for role, names in channels.items()} if several else {}
    for key, one in asked:
        text = given.get(key, "")
        if text == one.usual or (not text and one.kind != "yes"):
            continue
        found[one.name] = bool(text) if one.kind == "yes" else _value(one, text)
    model_from_mapping({"class": of, **found})  # refuses what is wrong, and names it
    return found


def _value(field: ModelField, text: str) -> Any:
    """Return the value of a field; brackets around lists and tables may be left out."""
    for left, right in (("", ""), ("[", "]"), ("{", "}")):
        try:
            value = tomllib.loads(f"x = {left}{text}{right}")["x"]
        except tomllib.TOMLDecodeError:
            continue
        return [value] if field.kind.startswith("Whole numbers") and isinstance(value, int) else value
    raise ModelError(f"field {field.name!r} is {text!r}: give a {field.kind.lower()}")


def own_model_text(inputs: Sequence[str], outputs: Sequence[str]) -> str:
    """Return the text of a model file to begin with: each output is a lag of first order behind all inputs.

    Examples
    --------
    >>> print(own_model_text(["flow", "power"], ["T"]))
    # Your own equations. t counts the samples; d/dt T = ... is a rate in 1/s.
    class = "OwnModel"
    equations = ["w1[t] = -a1*w1[t-1] + b11*flow[t-1] + b12*power[t-1] + c1"]
    inputs = ["flow", "power"]
    outputs = { T = "w1" }
    <BLANKLINE>
    [parameters]
    a1 = [-1, 0]
    b11 = [-inf, inf]
    b12 = [-inf, inf]
    c1 = [-inf, inf]
    """
    numbered = list(enumerate(outputs, 1))
    equations = [
        f"w{k}[t] = -a{k}*w{k}[t-1] + {''.join(f'b{k}{j}*{u}[t-1] + ' for j, u in enumerate(inputs, 1))}c{k}"
        for k, _ in numbered
    ]
    boxes = [
        line
        for k, _ in numbered
        for line in (
            f"a{k} = [-1, 0]",
            *(f"b{k}{j} = [-inf, inf]" for j in range(1, len(inputs) + 1)),
            f"c{k} = [-inf, inf]",
        )
    ]
    measured = ", ".join(f'{y} = "w{k}"' for k, y in numbered)
    lines = [
        "# Your own equations. t counts the samples; d/dt T = ... is a rate in 1/s.",
        'class = "OwnModel"',
        f"equations = [{', '.join(map(_quoted, equations))}]",
        f"inputs = [{', '.join(map(_quoted, inputs))}]",
        f"outputs = {{ {measured} }}",
        "",
        "[parameters]",
        *boxes,
    ]
    return "\n".join(lines)


def _quoted(text: str) -> str:
    return f'"{text}"'
