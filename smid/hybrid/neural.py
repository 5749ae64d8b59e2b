"""Network as an expression over a model's signals; its weights are parameters of the model.

    NN = S (w a_L + b),    a_l = neuron(W_l a_{l-1} + b_l),    a_0 = (inputs - c) / s

The expression is an ordinary part of the model's lines, so simulation, sensitivities, fit, prediction and diagnosis
work without change. The lines define the topology and the fed-back samples. Centre c, half range s and unit S are
numbers that `smid.hybrid.estimate` takes from the data, so the units of channels and parameters do not matter.

Without hidden layers the term is the affine function ``w a_0 + b``, the "linear neuron" of the thesis. The thesis
prints some biases of (4.10)-(4.13) and (h.19)-(h.23) outside the tanh. Here all are inside, as in (3.4).

Reference: hybrid thesis, (3.4)-(3.6), sections 4.3.1 to 4.3.4.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import sympy
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from smid.hybrid.neurons import NEURONS, refuse_neuron
from smid.models import Model, ModelError, Parameter
from smid.models.symbols import as_written, canonical, number, rewritten, unevaluated
from smid.networks import Scaling, TanhNetwork, fold

__all__ = ["NeuralTerm", "network_of", "network_output", "with_network", "without_network"]


@dataclass(frozen=True)
class NeuralTerm:
    """Network of some signals, as an expression with its parameters.

    Parameters
    ----------
    name
        Prefix of the weights' names: ``w{layer}_{neuron}_{input}`` and ``b{layer}_{neuron}``, counted from 1.
    inputs
        Expressions over the model's signals at t, t - 1, ...
    hidden
        Neurons of each hidden layer; with no layer the term is affine.
    limit
        Box of each hidden weight: [-limit, limit], for scaled inputs. The weights of the output have no box.
    neuron
        "tanh", "logistic", "linear", "relu", "softplus" or "radial".
    centre, half_range
        Of each input, in its unit; empty for 0 and 1.
    unit
        Unit of the output's weights.

    Raises
    ------
    ModelError
        If there is no input, a layer has no neuron, the kind of neuron is unknown or has fewer layers, or a number is
        not valid.

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
    neuron: str = "tanh"
    centre: tuple[float, ...] = ()
    half_range: tuple[float, ...] = ()
    unit: float = 1.0

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
        refuse_neuron(self.neuron)
        if len(self.hidden) > NEURONS[self.neuron].most_layers:
            raise ModelError(f"{self.neuron} neurons in {len(self.hidden)} hidden layers: give one layer, or tanh")
        ends = (*self.centre, *self.half_range, self.unit)
        if {len(self.centre), len(self.half_range)} - {0, len(self.inputs)} or not (
            all(map(math.isfinite, ends)) and min(self.half_range, default=1.0) > 0 and self.unit > 0
        ):
            raise ModelError(
                f"centre = {self.centre}, half_range = {self.half_range}, unit = {self.unit}: give one finite centre "
                "and one positive half range for each input, and a positive unit"
            )

    @property
    def sizes(self) -> tuple[int, ...]:
        """Return the number of inputs, then of neurons in each hidden layer."""
        return (len(self.inputs), *self.hidden)

    @property
    def scaling(self) -> Scaling:
        """Return centre and half range of the inputs."""
        k = len(self.inputs)
        return Scaling(np.array(self.centre or (0.0,) * k), np.array(self.half_range or (1.0,) * k))

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Return weights and biases, in the order of `TanhNetwork.weights`."""
        found = []
        for layer, (k, m) in enumerate(zip(self.sizes, (*self.hidden, 1), strict=True), start=1):
            names = [f"{self.name}_w{layer}_{i}_{j}" for i in range(1, m + 1) for j in range(1, k + 1)]
            names += [f"{self.name}_b{layer}_{i}" for i in range(1, m + 1)]
            end = math.inf if layer > len(self.hidden) else self.limit
            found += [Parameter(name, -end, end) for name in names]
        return tuple(found)

    @property
    def output_weights(self) -> tuple[Parameter, ...]:
        """Return the weights of the output, its bias last."""
        return self.parameters[-self.sizes[-1] - 1 :]

    @cached_property
    def expression(self) -> sympy.Expr:
        """Return the network's output."""
        return self.of(self.inputs)

    def of(self, inputs: Sequence[sympy.Expr]) -> sympy.Expr:
        """Return the network's output for other inputs."""
        symbols = iter([parameter.symbol for parameter in self.parameters])
        scaling, neuron = self.scaling, NEURONS[self.neuron].output
        signals = [
            (item - number(c)) / number(s)
            for item, c, s in zip(inputs, scaling.centre.tolist(), scaling.half_range.tolist(), strict=True)
        ]
        for layer, m in enumerate((*self.hidden, 1), start=1):
            rows = [[next(symbols) for _ in signals] for _ in range(m)]
            biases = [next(symbols) for _ in range(m)]
            if layer > len(self.hidden):
                total = sympy.Add(biases[0], *(w * a for w, a in zip(rows[0], signals, strict=True)))
                return total if self.unit == 1 else number(self.unit) * total
            signals = [neuron(row, bias, signals) for row, bias in zip(rows, biases, strict=True)]
        raise AssertionError("the last layer returns")


def without_network(model: Model, term: NeuralTerm, instead: sympy.Expr, parameters: Sequence[Parameter]) -> Model:
    """Return a model with another expression in the place of a network, and other parameters.

    A network is affine in the weights of its output. So its bias becomes the expression, and the other weights zero.

    Examples
    --------
    >>> from smid.models import OutputError, signal, t
    >>> term = NeuralTerm("N", (signal("u")[t],), (1,))
    >>> model = OutputError().with_parameter(*term.parameters).add_term("w", term.expression)
    >>> k = Parameter("k", 0, 1)
    >>> without_network(model, term, k.symbol * signal("u")[t], [k]).lines[0].expression
    -a1*w[t - 1] + b0*u[t - 1] + k*u[t]
    """
    *weights, bias = term.output_weights
    zero = dict.fromkeys((item.symbol for item in weights), sympy.Integer(0))
    swap = {**zero, bias.symbol: canonical(instead) / number(term.unit)}
    names = {item.name for item in term.parameters}
    return replace(
        model,
        parameters=(*(item for item in model.parameters if item.name not in names), *parameters),
        lines=tuple(replace(line, expression=rewritten(line.expression, dict(swap), _cut)) for line in model.lines),
        values={name: value for name, value in model.values.items() if name not in names},
    )


def _cut(node: sympy.Expr, arguments: list[sympy.Expr]) -> sympy.Expr:
    """Return a node without terms of zero, so that nothing is left of the neurons."""
    if node.is_Mul and 0 in arguments:
        return sympy.Integer(0)
    kept = [item for item in arguments if item != 0] if node.is_Add else arguments
    if len(kept) == len(arguments):
        return as_written(node, arguments)
    return unevaluated(sympy.Add, kept) if len(kept) > 1 else sum(kept, sympy.Integer(0))


def network_output(model: Model, term: NeuralTerm, inputs: ArrayLike) -> Array:
    """Return the output of a network in a model, shape (n,), for inputs of shape (n, k), in their units.

    Raises
    ------
    ModelError
        If a weight has no value in the model.

    Examples
    --------
    >>> from smid.models import OutputError, signal, t
    >>> term = NeuralTerm("N", (signal("u")[t],), (1,), neuron="radial")
    >>> model = OutputError().with_parameter(*term.parameters).add_term("w", term.expression)
    >>> values = {"N_w1_1_1": 1.0, "N_b1_1": 1.0, "N_w2_1_1": 2.0, "N_b2_1": 3.0}
    >>> network_output(model.with_values(values), term, [[1.0], [100.0]])
    array([5., 3.])
    """
    x = np.asarray(inputs, dtype=np.float64)
    given = sympy.symbols(f"x:{len(term.inputs)}", cls=sympy.Dummy)
    weights = [parameter.symbol for parameter in term.parameters]
    function = sympy.lambdify([*given, *weights], term.of(given), "numpy")
    return np.asarray(np.broadcast_to(function(*x.T, *_weights(model, term)), len(x)), dtype=np.float64)


def _weights(model: Model, term: NeuralTerm) -> list[float]:
    values = {p.name: p.lower for p in model.parameters if p.lower == p.upper} | dict(model.values)
    missing = [parameter.name for parameter in term.parameters if parameter.name not in values]
    if missing:
        raise ModelError(f"the model has no value for {missing[0]}: fit the model, or use with_network")
    return [values[parameter.name] for parameter in term.parameters]


def network_of(model: Model, term: NeuralTerm) -> TanhNetwork:
    """Return the network of a term, with the weights of a model, for inputs and output in their units.

    Raises
    ------
    ModelError
        If a weight has no value in the model, or the term has no hidden layer or other neurons than tanh.

    Examples
    --------
    >>> from smid.models import OutputError, signal, t
    >>> term = NeuralTerm("N", (signal("u")[t],), (1,))
    >>> model = OutputError().with_parameter(*term.parameters).add_term("w", term.expression)
    >>> network = TanhNetwork((1, 1), np.array([1.0, 0.0, 2.0, 3.0]))
    >>> network_of(with_network(model, term, network), term)([[0.0], [100.0]])
    array([3., 5.])
    """
    _check_tanh(term)
    scaled = TanhNetwork(term.sizes, np.array(_weights(model, term)))
    return fold(scaled, term.scaling, Scaling(np.zeros(1), np.array([term.unit])))


def with_network(model: Model, term: NeuralTerm, network: TanhNetwork) -> Model:
    """Return a model with the weights of a network, whose inputs and output are in their units.

    Raises
    ------
    ModelError
        If the sizes differ, there are several networks, the neurons are no tanh, or a weight exceeds the term's limit.

    Examples
    --------
    >>> from smid.models import OutputError, signal, t
    >>> term = NeuralTerm("N", (signal("u")[t],), (1,))
    >>> model = OutputError().with_parameter(*term.parameters).add_term("w", term.expression)
    >>> with_network(model, term, TanhNetwork((1, 1), np.array([1.0, 0.0, 2.0, 3.0]))).values["N_w2_1_1"]
    2.0
    """
    _check_tanh(term)
    if network.sizes != term.sizes or network.weights.ndim != 1:
        raise ModelError(
            f"the network of sizes {network.sizes} with weights of shape {network.weights.shape} does not fit "
            f"{term.name!r} of sizes {term.sizes}: give one network of these sizes"
        )
    scaling = term.scaling
    back = Scaling(-scaling.centre / scaling.half_range, 1.0 / scaling.half_range)
    weights = fold(network, back, Scaling(np.zeros(1), np.array([1.0 / term.unit]))).weights
    largest = float(np.abs(weights[: -term.sizes[-1] - 1]).max())
    if not largest <= term.limit:
        raise ModelError(
            f"a weight of {largest:g} is beyond the limit {term.limit:g} of {term.name!r}: raise the limit"
        )
    names = (parameter.name for parameter in term.parameters)
    return model.with_values(dict(zip(names, weights.tolist(), strict=True)))


def _check_tanh(term: NeuralTerm) -> None:
    if term.neuron != "tanh":
        raise ModelError(f"{term.name!r} has {term.neuron} neurons, which no TanhNetwork has: use network_output")
