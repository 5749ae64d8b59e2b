"""A sensor as a program: steps that each compute one signal from others and from a memory of fixed size.

All that a sensor can do follows from its steps: whole records, samples one by one, a state that is saved, ranges where
samples were lost, certified ranges over the trained inputs, and C. A block of samples and single samples give the same
result to the last bit.

To add a block, subclass `Block` as a frozen dataclass with `rest` and `advance`. With `enclose` it bridges lost
samples, with `code` and `range_code` it can be exported to C, with `onnx` to ONNX.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array
from smid.models import ModelError
from smid.sensors.ranges import Range
from smid.sensors.tensor import Tensor

__all__ = ["Block", "Code", "Memory", "Program", "Samples", "Step", "both_ends"]

Samples = Mapping[str, Array]
"""Channel name to samples, shape (n,), in the units of the training records."""

Memory = Mapping[str, Array]
"""Name of a signal to the memory of the step that computes it, shape (m,)."""

Ranges = Mapping[str, Range]

CELLS = 16
"""Into so many cells a curve's arguments are split for the range of its values, with each lost sample."""


@dataclass(frozen=True)
class Code:
    """C99 of a step.

    Parameters
    ----------
    update
        Statements that read the signals, set the variable of the step's own name, and renew the memory ``m``.
    constants
        Tables before all functions.
    size
        Number of doubles in the memory.
    rest
        Statements that set the memory ``m`` from the first samples.

    Examples
    --------
    >>> Code("twice = 2.0 * u;").size
    0
    """

    update: str
    constants: str = ""
    size: int = 0
    rest: str = ""


class Block(ABC):
    """What a step computes. It is frozen; its memory is passed and returned.

    Examples
    --------
    >>> class Doubled(Block):
    ...     def rest(self, first):
    ...         return np.zeros(0)
    ...     def advance(self, signals, memory):
    ...         return 2.0 * signals[0], memory
    >>> program = Program().then(Doubled(), "u")
    >>> program.advance({"u": np.array([1.0, 3.0])})[0][program.output]
    array([2., 6.])
    """

    causal = True
    """Whether it needs no future samples."""

    @abstractmethod
    def rest(self, first: Sequence[Array]) -> Array:
        """Return the memory, shape (m,), of a plant at rest at these first samples, shape () each.

        It must not fall where a sample rises.
        """

    @abstractmethod
    def advance(self, signals: Sequence[Array], memory: Array) -> tuple[Array, Array]:
        """Return the next n values and the memory after them, from signals of shape (n,) each."""

    def enclose(self, signals: Sequence[Range], memory: Range, cells: int) -> tuple[Range, Range]:  # noqa: ARG002
        """Return the range of the next value and of the memory after it, from ranges of shape () each."""
        raise ModelError(
            f"{type(self).__name__} cannot bridge a lost sample: give every sample, or give the class a method enclose"
        )

    def past(self, signals: Sequence[Range]) -> Range:
        """Return the range of the memory after any samples in these ranges; here each holds samples."""
        return Range(self.rest([s.lower for s in signals]), self.rest([s.upper for s in signals]))

    def code(self, name: str, signals: Sequence[str]) -> Code:  # noqa: ARG002
        """Return C99 that computes a variable of this name from variables.

        Raises
        ------
        ModelError
            If C cannot hold the block.
        """
        raise ModelError(f"{type(self).__name__} cannot be exported to C: give the class a method code")

    def range_code(self, name: str, signals: Sequence[str]) -> Code:  # noqa: ARG002
        """Return C99 of `enclose`, with the functions of `smid.sensors.c_ranges`.

        It sets a range of this name from ranges, and renews the ends ``low`` and ``high`` of the memory.

        Raises
        ------
        ModelError
            If C cannot hold the block.
        """
        raise ModelError(f"{type(self).__name__} cannot be exported to C: give the class a method range_code")

    def onnx(self, signals: Sequence[Tensor], memory: Tensor) -> tuple[Tensor, Tensor]:  # noqa: ARG002
        """Return the next value and the memory after it, as `advance`; a memory that is NaN is at rest.

        Raises
        ------
        ModelError
            If ONNX cannot hold the block.
        """
        raise ModelError(f"{type(self).__name__} cannot be exported to ONNX: export C, or give the class a method onnx")


def both_ends(block: Block, name: str, signals: Sequence[str]) -> Code:
    """Return the `Block.range_code` of a block that rises with its signals and its memory, without rounding."""
    updates = list[str]()
    for end, memory in (("lower", "low"), ("upper", "high")):
        update = block.code(f"{name}.{end}", [f"{signal}.{end}" for signal in signals]).update
        updates.append(f"{{ double *m = {memory};\n{update} }}")
    return Code("\n".join(updates))


@dataclass(frozen=True, eq=False)
class Step:
    """A block, the signals that it reads, and the name of the signal that it computes."""

    signal: str
    block: Block
    reads: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Program:
    """The steps of a sensor, in the order in which they are computed.

    Parameters
    ----------
    output
        Signal of the sensor's value.
    half_width
        Signal of half the width of its interval; None without an error bound.

    Examples
    --------
    >>> from smid.sensors.lag import Lag
    >>> program = Program().then(Lag(0.002, 0.002), "u")
    >>> signals, memory = program.advance({"u": np.array([1.0, 0.0])})
    >>> signals[program.output].round(3)
    array([1.   , 0.368])
    """

    steps: tuple[Step, ...] = ()
    output: str = ""
    half_width: str | None = None

    def then(self, block: Block, *reads: str) -> Program:
        """Return the program with a further step, whose signal is now the output."""
        signal = f"s{len(self.steps) + 1}"
        return Program((*self.steps, Step(signal, block, reads)), signal)

    def bounded(self, block: Block) -> Program:
        """Return the program with a block that computes half the width of the interval from the output."""
        longer = self.then(block, self.output)
        return Program(longer.steps, self.output, longer.output)

    def advance(self, samples: Samples, memory: Memory | None = None) -> tuple[dict[str, Array], dict[str, Array]]:
        """Return all signals of the next n samples, and the memory after them; without memory, from rest."""
        signals, after = dict(samples), dict[str, Array]()
        for step in self.steps:
            read = [signals[name] for name in step.reads]
            before = step.block.rest([s[0] for s in read]) if memory is None else memory[step.signal]
            signals[step.signal], after[step.signal] = step.block.advance(read, before)
        return signals, after

    def enclose(
        self, inputs: Ranges, memory: Ranges | None = None, cells: int = CELLS
    ) -> tuple[dict[str, Range], dict[str, Range]]:
        """Return the ranges of all signals at the next sample, and of the memory after it.

        Without memory: for any past whose samples lay in these ranges too.
        """
        signals, after = dict(inputs), dict[str, Range]()
        for step in self.steps:
            read = [signals[name] for name in step.reads]
            before = step.block.past(read) if memory is None else memory[step.signal]
            signals[step.signal], after[step.signal] = step.block.enclose(read, before, cells)
        return signals, after

    def require_causal(self) -> None:
        """Raise a `ModelError` if a step needs future samples."""
        if not all(step.block.causal for step in self.steps):
            raise ModelError("a centred median needs future samples: take causal=True, which has a delay")


def exact(memory: Memory) -> dict[str, Range]:
    """Return a memory as ranges."""
    return {name: Range.exact(values) for name, values in memory.items()}


def is_known(memory: Ranges, tolerance: float = 1e-12) -> bool:
    """Tell whether ranges are no wider than rounding makes them."""
    return all(bool(np.all(r.width <= tolerance * (1.0 + np.abs(r.lower)))) for r in memory.values())
