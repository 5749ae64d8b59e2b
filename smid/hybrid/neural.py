"""Tanh network as an expression over a model's signals; its weights are parameters of the model.

    NN = w a_L + b,    a_l = tanh(W_l a_{l-1} + b_l),    a_0 = the inputs

The expression is an ordinary part of the model's lines, so simulation, sensitivities, fit, prediction and diagnosis
work without change. The lines define the topology and the fed-back samples.

Without hidden layers the term is the affine function ``w a_0 + b``, the "linear neuron" of the thesis. The thesis
prints some biases of (4.10)-(4.13) and (h.19)-(h.23) outside the tanh. Here all are inside, as in (3.4).

Reference: hybrid thesis, (3.4)-(3.6), sections 4.3.1 to 4.3.4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import sympy

from smid.models import Model, ModelError, Parameter
from smid.models.symbols import canonical
from smid.networks import TanhNetwork

__all__ = ["NeuralTerm", "network_of", "with_network"]


@dataclass(frozen=True)
class NeuralTerm:
    """Tanh network of some signals, as an expression with its parameters.

    Parameters
    ----------
    name
        Prefix of the weights' names: ``w{layer}_{neuron}_{input}`` and ``b{layer}_{neuron}``, counted from 1.
    inputs
        Expressions over the model's signals at t, t - 1, ...
    hidden
        Neurons of each hidden layer; with no layer the term is affine.
    limit
        Box of each weight: [-limit, limit], in the units of the inputs and of the output.

    Raises
    ------
    ModelError
        If there is no input, a layer has no neuron, or the limit is not a positive number.

    Examples
    --------
    >>> from smid.models import signal, t
    >>> term = NeuralTerm("N", (signal("speed")[t],), (1,))
    >>> term.expression
    N_b2_1 + N_w2_1_1*tanh(N_b1_1 + N_w1_1_1*speed[t])
    >>> [parameter.name for parameter in term.parameters]
    ['N_w1_1_1', 'N_b1_1', 'N_w2_1_1', 'N_b2_1']
    """

    name: str
    inputs: tuple[sympy.Expr, ...]
    hidden: tuple[int, ...]
    limit: float = 100.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "inputs", tuple(canonical(item) for item in self.inputs))
        object.__setattr__(self, "hidden", tuple(self.hidden))
        if not self.inputs or min(self.hidden, default=1) < 1:
            raise ModelError(
                f"the network {self.name!r} has {len(self.inputs)} inputs and hidden layers {self.hidden}: "
                "give at least one input, and at least one neuron in each layer"
            )
        if not (math.isfinite(self.limit) and self.limit > 0):
            raise ModelError(f"limit = {self.limit} is not valid: give a positive number as the largest weight")

    @property
    def sizes(self) -> tuple[int, ...]:
        """Return the number of inputs, then of neurons in each hidden layer."""
        return (len(self.inputs), *self.hidden)

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Return weights and biases, in the order of `TanhNetwork.weights`."""
        names = []
        for layer, (k, m) in enumerate(zip(self.sizes, (*self.hidden, 1), strict=True), start=1):
            names += [f"{self.name}_w{layer}_{i}_{j}" for i in range(1, m + 1) for j in range(1, k + 1)]
            names += [f"{self.name}_b{layer}_{i}" for i in range(1, m + 1)]
        return tuple(Parameter(name, -self.limit, self.limit) for name in names)

    @cached_property
    def expression(self) -> sympy.Expr:
        """Return the network's output."""
        symbols = iter([parameter.symbol for parameter in self.parameters])
        signals = list(self.inputs)
        for layer, m in enumerate((*self.hidden, 1), start=1):
            rows = [[next(symbols) for _ in signals] for _ in range(m)]
            sums = [sympy.Add(next(symbols), *(w * a for w, a in zip(row, signals, strict=True))) for row in rows]
            signals = sums if layer > len(self.hidden) else [sympy.tanh(item) for item in sums]
        return signals[0]


def network_of(model: Model, term: NeuralTerm) -> TanhNetwork:
    """Return the network of a term, with the weights of a model.

    Raises
    ------
    ModelError
        If a weight has no value in the model, or the term has no hidden layer.

    Examples
    --------
    >>> from smid.models import OutputError, signal, t
    >>> term = NeuralTerm("N", (signal("u")[t],), (1,))
    >>> model = OutputError().with_parameter(*term.parameters).add_term("w", term.expression)
    >>> network = TanhNetwork((1, 1), np.array([1.0, 0.0, 2.0, 3.0]))
    >>> network_of(with_network(model, term, network), term)([[0.0], [100.0]])
    array([3., 5.])
    """
    values = {p.name: p.lower for p in model.parameters if p.lower == p.upper} | dict(model.values)
    missing = [parameter.name for parameter in term.parameters if parameter.name not in values]
    if missing:
        raise ModelError(f"the model has no value for {missing[0]}: fit the model, or use with_network")
    return TanhNetwork(term.sizes, np.array([values[parameter.name] for parameter in term.parameters]))


def with_network(model: Model, term: NeuralTerm, network: TanhNetwork) -> Model:
    """Return a model with the weights of a network.

    Raises
    ------
    ModelError
        If the sizes differ, there are several networks, or a weight exceeds the term's limit.

    Examples
    --------
    >>> from smid.models import OutputError, signal, t
    >>> term = NeuralTerm("N", (signal("u")[t],), (1,))
    >>> model = OutputError().with_parameter(*term.parameters).add_term("w", term.expression)
    >>> with_network(model, term, TanhNetwork((1, 1), np.array([1.0, 0.0, 2.0, 3.0]))).values["N_w2_1_1"]
    2.0
    """
    if network.sizes != term.sizes or network.weights.ndim != 1:
        raise ModelError(
            f"the network of sizes {network.sizes} with weights of shape {network.weights.shape} does not fit "
            f"{term.name!r} of sizes {term.sizes}: give one network of these sizes"
        )
    largest = float(np.abs(network.weights).max())
    if not largest <= term.limit:
        raise ModelError(
            f"a weight of {largest:g} is beyond the limit {term.limit:g} of {term.name!r}: raise the limit"
        )
    names = (parameter.name for parameter in term.parameters)
    return model.with_values(dict(zip(names, network.weights.tolist(), strict=True)))
