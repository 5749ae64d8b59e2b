"""What every result offers: text to print, HTML for a notebook, plain data, and rows for pandas.

A result states its content once, from top to bottom: words, tables and further results. Text and HTML follow from it.
The HTML names no colour, so that it reads on light and dark pages, and a figure takes its ink from the page.
"""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from html import escape
from importlib import import_module
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import sympy

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure


LARGEST_PICTURE = 150_000
"""Largest number of SVG characters that a notebook shows by itself; `plot` draws larger figures."""


class Shown(Protocol):
    """An object with a text and an HTML of its own."""

    def _repr_html_(self) -> str: ...


Part = str | Shown


@dataclass(frozen=True)
class Heading:
    """A title above what follows."""

    title: str

    def __str__(self) -> str:
        return f"{self.title}\n{'-' * len(self.title)}"

    def _repr_html_(self) -> str:
        return f"<h4>{escape(self.title)}</h4>"


class Result(ABC):
    """A result that prints, shows itself in a notebook, and becomes plain data. Equal plain data make equal results.

    Examples
    --------
    >>> from smid.display.table import Table
    >>> @dataclass(frozen=True, repr=False)
    ... class Errors(Result):
    ...     rmse: float
    ...
    ...     def _content(self):
    ...         return Table("", ("record", "RMSE"), (("one", f"{self.rmse:g}"),), "lr"), "It is < 1."
    >>> Errors(0.5)
    record  RMSE
    one      0.5
    It is < 1.
    >>> Errors(float("nan")).to_dict()
    {'rmse': None}
    """

    @abstractmethod
    def _content(self) -> Iterable[Part]:
        """Return the parts that are shown, from top to bottom."""

    def _picture(self) -> Figure | None:
        """Return the figure for notebooks; None for no figure."""
        return None

    def __str__(self) -> str:
        text, before = "", None
        for part in self._content():
            # A blank line separates a table from what is above it, but not from its own heading.
            close = isinstance(part, str) or isinstance(before, Heading)
            text += ("\n" if close else "\n\n") * bool(text) + str(part)
            before = part
        return text

    def __repr__(self) -> str:
        return str(self)  # the generated one would print every sample

    def __eq__(self, other: object) -> bool:
        # By the plain data: fields may hold arrays, and a result that was written and loaded is the same.
        return isinstance(other, Result) and type(self) is type(other) and self.to_dict() == other.to_dict()

    def __hash__(self) -> int:
        return hash(json.dumps(self.to_dict(), sort_keys=True))

    def _repr_html_(self) -> str:
        return "".join(map(_html, self._content())) + self._drawn()

    def _drawn(self) -> str:
        figure = self._picture()
        if figure is None:
            return ""
        from smid.display.style import notebook_svg

        picture = notebook_svg(figure, type(self).__name__)
        return picture if len(picture) < LARGEST_PICTURE else ""

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, field by field; numbers that are not finite become None."""
        return _fields(self)


class Tabular(Result):
    """A result that is a table: its rows make a pandas frame.

    Examples
    --------
    >>> @dataclass(frozen=True, repr=False)
    ... class Errors(Tabular):
    ...     rmse: tuple[float, ...]
    ...
    ...     def _content(self):
    ...         return (f"{len(self.rmse)} errors",)
    ...
    ...     def _rows(self):
    ...         return ({"record": k, "RMSE": error} for k, error in enumerate(self.rmse))
    >>> float(Errors((0.5, 0.25)).to_pandas()["RMSE"].max())
    0.5
    """

    @abstractmethod
    def _rows(self) -> Iterable[Mapping[str, Any]]:
        """Return the rows of the table, with all digits."""

    def to_pandas(self) -> pandas.DataFrame:
        """Return the rows of the table, with all digits, as a frame."""
        import pandas as pd

        return pd.DataFrame(list(self._rows()))


def optional(package: str, wanted_by: str) -> Any:
    """Import a package that an extra of the same name installs; ImportError names the command that installs it."""
    try:
        return import_module(package)
    except ImportError:
        raise ImportError(f"{wanted_by} needs {package}; install it with: pip install smid[{package}]") from None


def plain(value: Any) -> Any:
    """Return numbers, words, lists and dictionaries, ready for JSON.

    Enumerations become their names, expressions their text, numbers that are not finite None, and results their
    `to_dict`.

    Raises
    ------
    TypeError
        For a value without a plain form.

    Examples
    --------
    >>> plain({"gap": np.float64("nan"), "ends": (np.array([1.0, 2.0]), True)})
    {'gap': None, 'ends': [[1.0, 2.0], True]}
    """
    if isinstance(value, Enum):
        return value.name.lower()
    if value is None or isinstance(value, str | bool | int):
        return value
    if isinstance(value, float):
        return float(value) if np.isfinite(value) else None
    if isinstance(value, np.generic | np.ndarray):
        return plain(value.tolist())
    if isinstance(value, Mapping):
        return {str(name): plain(item) for name, item in value.items()}
    if isinstance(value, tuple | list):
        return [plain(item) for item in value]
    if hasattr(value, "to_dict"):
        return value.to_dict()
    if isinstance(value, sympy.Basic):
        return str(value)
    if is_dataclass(value):
        return _fields(value)
    raise TypeError(f"{type(value).__name__} has no plain form: give it a method to_dict")


def _fields(record: Any) -> dict[str, Any]:
    return {field.name: plain(getattr(record, field.name)) for field in fields(record)}


def _html(part: Part) -> str:
    return f"<p>{escape(part)}</p>" if isinstance(part, str) else part._repr_html_()
