"""The lines of a model in groups that are computed one after another, each over all samples at once.

A group is one line, or all the lines on a common loop through time (see `smid.models.structure.groups`).
Arrays have shape (n,), or (B, n) when parameters are batched.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from relaxations.algebra.arrays import Array
from smid.models.machine_code import Loop, compile_loop
from smid.models.parts import Line
from smid.models.structure import first_samples, groups

__all__ = ["Group", "compile_lines"]


@dataclass(frozen=True)
class Group:
    """Lines that are computed together.

    Attributes
    ----------
    lines
        In causal order.
    first
        First sample that inputs and initial states determine.
    recursive
        Whether the group reads its own past.
    """

    lines: tuple[Line, ...]
    first: int
    recursive: bool

    @property
    def signals(self) -> tuple[str, ...]:
        """Signals the group defines, in causal order."""
        return tuple(line.signal for line in self.lines)

    def warm_up(self, known: dict[str, Array], values: Mapping[str, Any], given: set[str], until: int) -> None:
        """Fill the samples before `until`: given ones stay, computable ones follow, else zero."""
        for now in range(until):
            # Line by line: a later line of the group may read a given sample of an earlier one at the same
            # time.
            for line in self.lines:
                if line.signal not in given:
                    reads = line.reads
                    depth = max((lag for _, lag in reads), default=0)
                    before = np.full((*known[line.signal].shape[:-1], depth), np.nan)
                    seen = {
                        name: np.concatenate([before, known[name][..., : now + 1]], axis=-1)
                        for name in {line.signal, *(name for name, _ in reads)}
                    }
                    compile_loop((line,)).run(seen, values, now + depth)
                    value = seen[line.signal][..., now + depth]
                    known[line.signal][..., now] = np.where(np.isfinite(value), value, 0.0)

    def evaluate(self, known: dict[str, Array], values: Mapping[str, Any], start: int) -> None:
        """Compute all samples from `start` on, in place."""
        self._loop.run(known, values, start)

    @cached_property
    def _loop(self) -> Loop:
        return compile_loop(self.lines)


@lru_cache(maxsize=256)
def compile_lines(lines: tuple[Line, ...]) -> tuple[Group, ...]:
    """Arrange lines in groups to be evaluated one after another.

    Examples
    --------
    >>> from smid.models.symbols import signal, t
    >>> w, u = signal("w"), signal("u")
    >>> [group.recursive for group in compile_lines((Line(w[t], w[t - 1] / 2 + u[t]),))]
    [True]
    """
    first = first_samples(lines)
    return tuple(Group(group, first[group[0].signal], recursive) for group, recursive in groups(lines))
