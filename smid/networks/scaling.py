"""Scaling of channels to [-1, 1] for training, and back to the units of the channels.

With ``z = (x - c) / s`` and ``y = c_y + s_y v``, a network ``v = f(z)`` of weights W_1, b_1, ..., w, b is the network
``y = g(x)`` of weights ``W_1 / s``, ``b_1 - W_1 (c / s)``, ..., ``s_y w``, ``s_y b + c_y``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import DataError
from smid.networks.network import TanhNetwork

__all__ = ["Scaling", "scaling_of"]


@dataclass(frozen=True, eq=False)
class Scaling:
    """Centre and half the range of each column, shape (k,), in the columns' units."""

    centre: Array
    half_range: Array

    def apply(self, columns: Array) -> Array:
        """Return columns, shape (..., k), scaled to [-1, 1]."""
        return np.asarray((columns - self.centre) / self.half_range)


def scaling_of(columns: Array, names: Sequence[str]) -> Scaling:
    """Return the scaling of columns, shape (n, k).

    Parameters
    ----------
    names
        Of the columns, for the error message.

    Raises
    ------
    DataError
        If a column does not vary.

    Examples
    --------
    >>> scaling_of(np.array([[0.0], [4.0]]), ["input"]).apply(np.array([[1.0]]))
    array([[-0.5]])
    """
    low, high = columns.min(axis=0), columns.max(axis=0)
    flat = np.flatnonzero(high == low)
    if flat.size:
        raise DataError(
            f"{names[flat[0]]} is {low[flat[0]]:g} in every sample: leave it out, "
            "or train on samples in which it varies"
        )
    return Scaling((high + low) / 2.0, (high - low) / 2.0)


def fold(network: TanhNetwork, inputs: Scaling, output: Scaling) -> TanhNetwork:
    """Return the network of the channels' units, from a network of scaled inputs and output.

    Examples
    --------
    >>> scaled = TanhNetwork((1, 1), np.array([1.0, 0.5, 2.0, 3.0]))
    >>> ranges = Scaling(np.array([10.0]), np.array([5.0])), Scaling(np.array([1.0]), np.array([2.0]))
    >>> np.allclose(fold(scaled, *ranges)([[12.0]]), 1.0 + 2.0 * scaled([[0.4]]))
    True
    """
    weights = network.weights.copy()
    k, m, last = network.sizes[0], network.sizes[1], network.sizes[-1]
    first = weights[: m * k].reshape(m, k)
    weights[m * k : m * (k + 1)] -= first @ (inputs.centre / inputs.half_range)
    first /= inputs.half_range
    weights[-1 - last :] *= output.half_range
    weights[-1] += output.centre[0]
    return TanhNetwork(network.sizes, weights)
