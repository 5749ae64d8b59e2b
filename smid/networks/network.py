"""A feedforward network of tanh layers with one linear output, and its derivatives.

    a_0 = x,    a_l = tanh(W_l a_{l-1} + b_l)   for l = 1..L,    y = w a_L + b

Backwards, with ``delta_L = w (1 - a_L^2)`` and ``delta_{l-1} = (delta_l W_l) (1 - a_{l-1}^2)``:

    dy/dW_l = delta_l a_{l-1}',    dy/db_l = delta_l,    dy/dw = a_L,    dy/db = 1,    dy/dx = delta_1 W_1

All weights are in one vector, layer by layer: ``W_1`` row by row, ``b_1``, ..., ``w``, ``b``. Leading axes of the
weights hold several networks, which are evaluated at once.

Reference: Hagan, Menhaj, "Training feedforward networks with the Marquardt algorithm", IEEE Trans. Neural Networks 5
(1994), equations (1)-(9); clutch thesis, (5.2)-(5.5).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from smid.models import ModelError

__all__ = ["Array", "Linearisation", "TanhNetwork", "weight_count"]


@dataclass(frozen=True, eq=False)
class Linearisation:
    """The outputs of a network and their derivatives.

    Parameters
    ----------
    outputs
        Shape (..., n).
    by_weights
        Shape (..., n, p), in the order of `TanhNetwork.weights`.
    by_inputs
        Shape (..., n, k).

    Examples
    --------
    >>> network = TanhNetwork((1, 1), np.array([1.0, 0.0, 2.0, 3.0]))
    >>> there = network.linearise(np.array([[0.0]]))
    >>> there.outputs, there.by_inputs
    (array([3.]), array([[2.]]))
    """

    outputs: Array
    by_weights: Array
    by_inputs: Array


def weight_count(sizes: tuple[int, ...]) -> int:
    """Return the number of weights and biases of a network.

    Parameters
    ----------
    sizes
        Number of inputs, then of neurons in each hidden layer.

    Examples
    --------
    >>> weight_count((4, 10))
    61
    """
    return sum(m * (k + 1) for k, m in zip(sizes, (*sizes[1:], 1), strict=True))


@dataclass(frozen=True, eq=False)
class TanhNetwork:
    """Hidden tanh layers and one linear output.

    Parameters
    ----------
    sizes
        Number of inputs, then of neurons in each hidden layer.
    weights
        Shape (..., p). All weights and biases, layer by layer.

    Raises
    ------
    ModelError
        If a size is not positive, or the weights do not fit the sizes.

    Examples
    --------
    >>> network = TanhNetwork((1, 1), np.array([1.0, 0.0, 2.0, 3.0]))
    >>> network([[0.0], [100.0]])
    array([3., 5.])
    """

    sizes: tuple[int, ...]
    weights: Array

    def __post_init__(self) -> None:
        if len(self.sizes) < 2 or min(self.sizes) < 1:
            raise ModelError(f"sizes = {self.sizes}: give the number of inputs, then the neurons of each hidden layer")
        weights = np.array(self.weights, dtype=np.float64)
        if not weights.ndim or weights.shape[-1] != weight_count(self.sizes):
            raise ModelError(
                f"weights of shape {weights.shape} do not fit the sizes {self.sizes}: "
                f"give {weight_count(self.sizes)} along the last axis"
            )
        weights.setflags(write=False)
        object.__setattr__(self, "weights", weights)

    def layers(self) -> list[tuple[Array, Array]]:
        """Return the matrix, shape (..., m, k), and the biases, shape (..., m), of each layer, the output last."""
        result, position, lead = [], 0, self.weights.shape[:-1]
        for k, m in zip(self.sizes, (*self.sizes[1:], 1), strict=True):
            matrix = self.weights[..., position : position + m * k].reshape(*lead, m, k)
            result.append((matrix, self.weights[..., position + m * k : position + m * (k + 1)]))
            position += m * (k + 1)
        return result

    def __call__(self, inputs: ArrayLike) -> Array:
        """Return the outputs, shape (..., n), of inputs of shape (..., n, k).

        The output of a sample does not depend on the other samples, to the last bit.

        Raises
        ------
        ModelError
            If the samples do not have k inputs.
        """
        layers = self.layers()
        signal = np.swapaxes(self._checked(inputs), -1, -2)
        for matrix, bias in layers[:-1]:
            signal = np.tanh(_ordered_sum(matrix, bias, signal))
        return _ordered_sum(*layers[-1], signal)[..., 0, :]

    def linearise(self, inputs: ArrayLike) -> Linearisation:
        """Return outputs and derivatives at inputs of shape (..., n, k).

        Raises
        ------
        ModelError
            If the samples do not have k inputs.
        """
        # Forward: samples are along the last axis, which is contiguous in memory; the results are transposed views.
        layers = self.layers()
        signals = [np.swapaxes(self._checked(inputs), -1, -2)]
        for matrix, bias in layers[:-1]:
            signals.append(np.tanh(matrix @ signals[-1] + bias[..., :, None]))
        matrix, bias = layers[-1]
        outputs = (matrix @ signals[-1])[..., 0, :] + bias
        # Backward, layer by layer: the derivatives go into their places in the weight vector.
        by_weights = np.empty((*outputs.shape[:-1], self.weights.shape[-1], outputs.shape[-1]))
        delta = np.ones((*outputs.shape[:-1], 1, outputs.shape[-1]))
        end = by_weights.shape[-2]
        for (matrix, _), signal in zip(reversed(layers), reversed(signals), strict=True):
            m, k = matrix.shape[-2:]
            by_weights[..., end - m : end, :] = delta
            end -= m * (k + 1)
            block = by_weights[..., end : end + m * k, :].reshape(*outputs.shape[:-1], m, k, outputs.shape[-1])
            np.multiply(delta[..., :, None, :], signal[..., None, :, :], out=block)
            delta = np.swapaxes(matrix, -1, -2) @ delta
            if end:
                delta *= 1.0 - signal**2
        return Linearisation(outputs, np.swapaxes(by_weights, -1, -2), np.swapaxes(delta, -1, -2))

    def _checked(self, inputs: ArrayLike) -> Array:
        x = np.asarray(inputs, dtype=np.float64)
        if x.ndim < 2 or x.shape[-1] != self.sizes[0]:
            raise ModelError(f"inputs of shape {x.shape}: give one row per sample with {self.sizes[0]} columns")
        return x

    def to_dict(self) -> dict[str, Any]:
        """Return sizes and weights as plain numbers, exactly."""
        return {"sizes": list(self.sizes), "weights": self.weights.tolist()}

    @classmethod
    def from_dict(cls, record: dict[str, Any]) -> TanhNetwork:
        """Return the network that `to_dict` described."""
        return cls(tuple(record["sizes"]), np.array(record["weights"]))


def _ordered_sum(matrix: Array, bias: Array, signal: Array) -> Array:
    """Return ``matrix signal + bias``, shape (..., m, n), summed term by term.

    The order of the terms in a matrix product depends on the number of samples. Here it does not, so a sensor gives the
    same result sample by sample as for a whole record.
    """
    total = bias[..., :, None]
    for k in range(matrix.shape[-1]):
        total = total + matrix[..., :, k, None] * signal[..., k, None, :]
    return total
