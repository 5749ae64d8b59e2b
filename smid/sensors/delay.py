"""A delay line: the sample of some instants ago. Before the first sample, the signal has its first value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array
from smid.sensors.program import Block, Code, both_ends
from smid.sensors.ranges import Range, joined
from smid.sensors.tensor import Tensor

__all__ = ["Delay"]


@dataclass(frozen=True)
class Delay(Block):
    """A delay of one or more samples."""

    samples: int

    def rest(self, first: Sequence[Array]) -> Array:
        """Return the first sample, repeated; see `Block.rest`."""
        return np.repeat(first[0], self.samples)

    def advance(self, signals: Sequence[Array], memory: Array) -> tuple[Array, Array]:
        """Return delayed samples, and the last ones; see `Block.advance`."""
        line = np.concatenate([memory, signals[0]])
        return line[: signals[0].size], line[signals[0].size :]

    def enclose(self, signals: Sequence[Range], memory: Range, cells: int) -> tuple[Range, Range]:  # noqa: ARG002
        """Return the delayed range; see `Block.enclose`."""
        line = joined([memory, signals[0][None]])
        return line[0], line[1:]

    def onnx(self, signals: Sequence[Tensor], memory: Tensor) -> tuple[Tensor, Tensor]:
        """Return the delayed sample, and the last ones; see `Block.onnx`."""
        line = memory.begun(signals[0]).graph.join(memory.begun(signals[0]), signals[0])
        return line[:1], line[1 : self.samples + 1]

    def code(self, name: str, signals: Sequence[str]) -> Code:
        """Return a shift of the memory; see `Block.code`."""
        n = self.samples
        shift = f"for (int k = 0; k < {n - 1}; k++) m[k] = m[k + 1];\n" if n > 1 else ""
        return Code(
            update=f"{name} = m[0];\n{shift}m[{n - 1}] = {signals[0]};",
            size=n,
            rest=f"for (int k = 0; k < {n}; k++) m[k] = {signals[0]};",
        )

    def range_code(self, name: str, signals: Sequence[str]) -> Code:
        """Return the shift of both ends; see `Block.range_code`."""
        return both_ends(self, name, signals)
