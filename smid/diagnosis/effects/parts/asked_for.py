"""Starts that take time to find: an effect that is fitted again from known values needs none of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import overload

__all__ = ["AskedFor", "Start"]

Start = Mapping[str, float]


@dataclass(frozen=True, eq=False)
class AskedFor(Sequence[Start]):
    """Starts that are found when they are first asked for."""

    find: Callable[[], tuple[Start, ...]]

    @cached_property
    def _found(self) -> tuple[Start, ...]:
        return self.find()

    @overload
    def __getitem__(self, which: int) -> Start: ...
    @overload
    def __getitem__(self, which: slice) -> tuple[Start, ...]: ...
    def __getitem__(self, which: int | slice) -> Start | tuple[Start, ...]:
        return self._found[which]

    def __len__(self) -> int:
        return len(self._found)

    def __reduce__(self) -> tuple[type[tuple[Start, ...]], tuple[tuple[Start, ...]]]:
        """Return what was found alone, which is all that another process needs."""
        return tuple, (self._found,)
