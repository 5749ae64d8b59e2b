"""Read back what `smid.display.result.plain` wrote, as the types that the classes declare."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import lru_cache
from math import nan
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np

Plain = dict[str, Any]
"""An object of JSON."""


class NotPlainError(ValueError):
    """A key that is missing, or a value that is not what its class declares.

    Attributes
    ----------
    place
        The key, after those of the objects around it.
    """

    def __init__(self, place: str, problem: str) -> None:
        super().__init__(f"{place}: {problem}" if place else problem)
        self.place, self.problem = place, problem

    def inside(self, name: str) -> NotPlainError:
        """Return the error as the object around it tells it."""
        joint = "." if self.place and not self.place.startswith("[") else ""
        return NotPlainError(f"{name}{joint}{self.place}", self.problem)


def from_plain(kind: Any, value: Any) -> Any:
    """Return plain data as the declared type; a missing number becomes NaN, or None where None is allowed.

    A class with a method ``from_dict`` reads itself; another dataclass is read field by field.

    Raises
    ------
    NotPlainError
        If a key is missing or a value has another type.

    Examples
    --------
    >>> from_plain(tuple[float, ...], [1, None])
    (1.0, nan)
    >>> from_plain(Mapping[str, int], {"samples": "many"})
    Traceback (most recent call last):
    ...
    smid.display.from_plain.NotPlainError: samples: 'many' is not an int
    """
    made, parts = get_origin(kind) or kind, get_args(kind)
    if made in (UnionType, Union):
        if value is None:
            return None
        return from_plain(next(part for part in parts if part is not NoneType), value)
    if made is Literal or not isinstance(made, type):
        return value
    if made in (float, int, str, bool):
        return _word(made, value)
    if issubclass(made, Enum):
        members = {name.lower(): member for name, member in made.__members__.items()}
        if value not in members:
            raise NotPlainError("", f"{value!r} is none of {', '.join(members)}")
        return members[value]
    if issubclass(made, np.ndarray):
        return np.array(_checked(list, value), dtype=get_args(parts[1])[0] if parts else None)
    if issubclass(made, tuple):
        items = _checked(list, value)
        kinds = parts[:1] * len(items) if parts[-1] is Ellipsis else parts
        return tuple(_at(f"[{k}]", *pair) for k, pair in enumerate(zip(kinds, items, strict=True)))
    if issubclass(made, Mapping):
        return {name: _at(name, parts[1], item) for name, item in _checked(dict, value).items()}
    if hasattr(made, "from_dict"):
        return made.from_dict(_checked(dict, value))
    return fields_from_plain(made, value) if is_dataclass(made) else value


def fields_from_plain(made: Any, content: Mapping[str, Any], **known: Any) -> Any:
    """Return the object of a dataclass whose fields are plain data, but for those that are known.

    Examples
    --------
    >>> from smid.data import Channel
    >>> fields_from_plain(Channel, {"name": "pressure", "estimate_of": ""}, unit="bar")
    Channel(name='pressure', unit='bar', estimate_of='')
    """
    kinds = _kinds(made)
    asked = (field.name for field in fields(made) if field.init and field.name not in known)
    return made(**{name: read(content, name, kinds[name]) for name in asked}, **known)


def read(content: Mapping[str, Any], name: str, kind: Any) -> Any:
    """Return the value of a key as its type; NotPlainError names the key.

    Examples
    --------
    >>> read({"rmse": None}, "rmse", float | None)
    """
    if name not in _checked(dict, content):
        raise NotPlainError(name, "the key is missing")
    return _at(name, kind, content[name])


@lru_cache
def _kinds(made: type) -> dict[str, Any]:
    return get_type_hints(made)


def _at(place: str, kind: Any, value: Any) -> Any:
    """Return a value as its type; errors begin with its place."""
    try:
        return from_plain(kind, value)
    except NotPlainError as error:
        raise error.inside(place) from None


def _word(kind: type, value: Any) -> Any:
    if kind is float and value is None:
        return nan
    numbers = (float, int) if kind is float else kind
    if not isinstance(value, numbers) or isinstance(value, bool) != (kind is bool):
        article = "an" if kind is int else "a"
        raise NotPlainError("", f"{value!r} is not {article} {kind.__name__}")
    return kind(value)


def _checked(kind: type, value: Any) -> Any:
    if not isinstance(value, kind):
        raise NotPlainError("", f"{value!r:.40} is not {'a list' if kind is list else 'an object'}")
    return value
