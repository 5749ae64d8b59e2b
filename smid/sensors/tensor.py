"""Numbers of an ONNX graph: each operation on a tensor adds a node, so that a block's update reads as its formula.

Reference: the operators of ONNX, opset 17, https://onnx.ai/onnx/operators/.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Graph", "Tensor"]


@dataclass(frozen=True, eq=False)
class Graph:
    """The nodes of an ONNX graph, and its constants by name."""

    nodes: list[tuple[str, tuple[str, ...], str, dict[str, Any]]] = field(default_factory=list)
    constants: dict[str, NDArray[Any]] = field(default_factory=dict)

    def add(self, operator: str, *inputs: Tensor | ArrayLike, **attributes: Any) -> Tensor:
        """Return the tensor that a new node computes."""
        names = tuple(self.tensor(item).name for item in inputs)
        name = f"t{len(self.nodes)}"
        self.nodes.append((operator, names, name, attributes))
        return Tensor(self, name)

    def tensor(self, value: Tensor | ArrayLike) -> Tensor:
        """Return a tensor as it is, and an array or a number as a constant with at least one axis."""
        if isinstance(value, Tensor):
            return value
        name = f"c{len(self.constants)}"
        self.constants[name] = np.atleast_1d(np.asarray(value))
        return Tensor(self, name)

    def join(self, *parts: Tensor) -> Tensor:
        """Return vectors, one behind the other."""
        return parts[0] if len(parts) == 1 else self.add("Concat", *parts, axis=0)


@dataclass(frozen=True, eq=False)
class Tensor:
    """A vector in an ONNX graph.

    Examples
    --------
    >>> graph = Graph()
    >>> doubled = 2.0 * Tensor(graph, "u")
    >>> graph.nodes
    [('Mul', ('u', 'c0'), 't0', {})]
    """

    graph: Graph
    name: str

    def __add__(self, other: Tensor | float) -> Tensor:
        return self.graph.add("Add", self, other)

    def __sub__(self, other: Tensor | float) -> Tensor:
        return self.graph.add("Sub", self, other)

    def __mul__(self, other: Tensor | float) -> Tensor:
        return self.graph.add("Mul", self, other)

    def __truediv__(self, other: Tensor | float) -> Tensor:
        return self.graph.add("Div", self, other)

    __rmul__ = __mul__

    def __rtruediv__(self, other: float) -> Tensor:
        return self.graph.add("Div", other, self)

    def __abs__(self) -> Tensor:
        return self.graph.add("Abs", self)

    def __getitem__(self, part: slice) -> Tensor:
        ends = [np.array([end], dtype=np.int64) for end in (part.start or 0, part.stop)]
        return self.graph.add("Slice", self, *ends)

    def begun(self, first: Tensor | float) -> Tensor:
        """Return a memory, with its first value where it is NaN: before the first sample."""
        return self.graph.add("Where", self.graph.add("IsNaN", self), first, self)

    def clip(self, lower: Tensor | float, upper: Tensor | float) -> Tensor:
        """Return the values, held within two ends."""
        return self.graph.add("Min", self.graph.add("Max", self, lower), upper)

    def exp(self) -> Tensor:
        """Return the exponentials."""
        return self.graph.add("Exp", self)

    def tanh(self) -> Tensor:
        """Return the hyperbolic tangents."""
        return self.graph.add("Tanh", self)
