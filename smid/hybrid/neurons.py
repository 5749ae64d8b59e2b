"""Kinds of neurons: what one computes from its inputs a, weights w and bias b, and where a fit may start.

    tanh      tanh(w a + b)
    linear    w a + b
    relu      max(0, w a + b),        written as (z + |z|) / 2
    softplus  log(1 + exp(w a + b)),  written as (z + |z|) / 2 + log(1 + exp(-|z|)), which does not overflow
    logistic  1 / (1 + exp(-w a - b)),  written as (1 + tanh((w a + b) / 2)) / 2, which does not overflow
    radial    exp(-b^2 |a - w|^2),      w is the centre, 1/b the width

The step and bipolar functions, (4.2) and (4.3) of the clutch thesis, have slope zero wherever they have one, so no
descent can train weights before them: `refuse_neuron` says so.

Starts are for inputs in [-1, 1]: after Nguyen and Widrow; radial centres are spread at random over
the range, with widths that overlap.

References: hybrid thesis, section 3.2; clutch thesis, (4.2) to (4.8); Broomhead, Lowe, "Multivariable functional
interpolation and adaptive networks", Complex Systems 2 (1988).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import sympy

from relaxations.algebra.arrays import Array
from smid.models import ModelError
from smid.models.errors import refuse_unknown
from smid.networks import nguyen_widrow, weight_count

__all__ = ["NEURONS", "RECURRENT", "Neuron", "refuse_neuron"]

RECURRENT = "recurrent"
"""Topology of neurons that are fed back: their weights start at random, not at zero."""

_OVERLAP = 0.7


@dataclass(frozen=True)
class Neuron:
    """A kind of neuron.

    Parameters
    ----------
    output
        Maps weights, bias and inputs of a neuron to its output.
    start
        Maps sizes and a random generator to all weights of a network, shape (p,), for inputs in [-1, 1].
    most_layers
        Largest number of hidden layers.
    """

    output: Callable[[Sequence[sympy.Expr], sympy.Expr, Sequence[sympy.Expr]], sympy.Expr]
    start: Callable[[tuple[int, ...], np.random.Generator], Array]
    most_layers: float = np.inf


def _sum(weights: Sequence[sympy.Expr], bias: sympy.Expr, inputs: Sequence[sympy.Expr]) -> sympy.Expr:
    return sympy.Add(bias, *(w * a for w, a in zip(weights, inputs, strict=True)))


def _tanh(weights: Sequence[sympy.Expr], bias: sympy.Expr, inputs: Sequence[sympy.Expr]) -> sympy.Expr:
    return sympy.tanh(_sum(weights, bias, inputs))


def _logistic(weights: Sequence[sympy.Expr], bias: sympy.Expr, inputs: Sequence[sympy.Expr]) -> sympy.Expr:
    return (1 + sympy.tanh(_sum(weights, bias, inputs) / 2)) / 2


def _rectified(z: sympy.Expr) -> sympy.Expr:
    return (z + sympy.Abs(z)) / 2


def _relu(weights: Sequence[sympy.Expr], bias: sympy.Expr, inputs: Sequence[sympy.Expr]) -> sympy.Expr:
    return _rectified(_sum(weights, bias, inputs))


def _softplus(weights: Sequence[sympy.Expr], bias: sympy.Expr, inputs: Sequence[sympy.Expr]) -> sympy.Expr:
    z = _sum(weights, bias, inputs)
    return _rectified(z) + sympy.log(1 + sympy.exp(-sympy.Abs(z)))


def _radial(weights: Sequence[sympy.Expr], bias: sympy.Expr, inputs: Sequence[sympy.Expr]) -> sympy.Expr:
    return sympy.exp(-(bias**2) * sympy.Add(*((a - w) ** 2 for w, a in zip(weights, inputs, strict=True))))


def _spread(sizes: tuple[int, ...], generator: np.random.Generator) -> Array:
    return np.array(nguyen_widrow(sizes, generator).weights)


def _spread_twice(sizes: tuple[int, ...], generator: np.random.Generator) -> Array:
    return 2.0 * _spread(sizes, generator)


def _centres(sizes: tuple[int, ...], generator: np.random.Generator) -> Array:
    k, m = sizes
    weights = np.zeros(weight_count(sizes))
    # One centre in each of m strips, in another order for each input.
    strips = np.stack([generator.permutation(m) for _ in range(k)], axis=1)
    weights[: m * k] = (2.0 * (strips + generator.uniform(size=(m, k))) / m - 1.0).reshape(-1)
    weights[m * k : m * (k + 1)] = _OVERLAP * m ** (1.0 / k)
    return weights


NEURONS: Mapping[str, Neuron] = {
    "tanh": Neuron(_tanh, _spread),
    "logistic": Neuron(_logistic, _spread_twice),
    "linear": Neuron(_sum, _spread),
    "relu": Neuron(_relu, _spread),
    "softplus": Neuron(_softplus, _spread_twice),
    "radial": Neuron(_radial, _centres, most_layers=1),
}
"""By name; a new kind is one line here."""


def refuse_neuron(kind: str) -> None:
    """Raise a `ModelError` if a kind of neuron is unknown, or no descent can train it.

    Examples
    --------
    >>> refuse_neuron("step")
    Traceback (most recent call last):
    ...
    smid.models.errors.ModelError: step neurons have slope zero, so their weights cannot be trained: take logistic
    """
    if smooth := {"step": "logistic", "bipolar": "tanh"}.get(kind):
        raise ModelError(f"{kind} neurons have slope zero, so their weights cannot be trained: take {smooth}")
    refuse_unknown("neuron", [kind], NEURONS)
