"""Find classes by name: subclasses that are imported, or that another package offers as an entry point."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib.metadata import entry_points
from typing import TypeVar

__all__ = ["find_subclass", "subclass_names"]

T = TypeVar("T")


def find_subclass(base: type[T], name: str, group: str, key: Callable[[type[T]], str]) -> type[T] | None:
    """Return the subclass whose key is the name, or None; an entry point is loaded only if no such class is imported.

    Parameters
    ----------
    group
        Of the entry points. The name of an entry point is the key of its class.
    """
    found = next((item for item in _subclasses(base) if key(item) == name), None)
    if found is None:
        for point in entry_points(group=group, name=name):
            point.load()
            return next((item for item in _subclasses(base) if key(item) == name), None)
    return found


def subclass_names(base: type[T], group: str, key: Callable[[type[T]], str]) -> tuple[str, ...]:
    """Return the names that `find_subclass` knows."""
    imported = [key(item) for item in _subclasses(base)]
    return tuple(dict.fromkeys([*imported, *(point.name for point in entry_points(group=group))]))


def _subclasses(base: type[T]) -> Iterator[type[T]]:
    """Yield all subclasses, the oldest first."""
    for item in base.__subclasses__():
        yield item
        yield from _subclasses(item)
