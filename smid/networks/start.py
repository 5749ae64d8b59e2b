"""Random initial weights after Nguyen and Widrow, which spread the neurons over the range of the inputs.

In a layer of m neurons with k inputs in [-1, 1], each row of weights has a random direction and the length
``beta = 0.7 m^(1/k)``. Biases are uniform within beta, the weights of the output within 0.5.

Reference: Nguyen, Widrow, "Improving the learning speed of 2-layer neural networks by choosing initial values of the
adaptive weights", IJCNN 1990.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from smid.networks.network import TanhNetwork

__all__ = ["nguyen_widrow"]

OUTPUT = 0.5


def nguyen_widrow(sizes: tuple[int, ...], seed: int | np.random.Generator) -> TanhNetwork:
    """Return a random network for inputs and outputs in [-1, 1].

    Parameters
    ----------
    sizes
        Number of inputs, then of neurons in each hidden layer.

    Raises
    ------
    ModelError
        If a size is not positive.

    Examples
    --------
    >>> matrix, bias = nguyen_widrow((2, 9), seed=1).layers()[0]
    >>> np.linalg.norm(matrix, axis=1).round(3).tolist() == [2.1] * 9, bool(np.all(np.abs(bias) <= 2.1))
    (True, True)
    """
    generator = np.random.default_rng(seed)
    parts = []
    for k, m in pairwise(sizes):
        beta = 0.7 * m ** (1.0 / k)
        direction = generator.uniform(-1.0, 1.0, (m, k))
        rows = beta * direction / np.linalg.norm(direction, axis=1, keepdims=True)
        parts += [rows.reshape(-1), generator.uniform(-beta, beta, m)]
    parts.append(generator.uniform(-OUTPUT, OUTPUT, sizes[-1] + 1))
    return TanhNetwork(sizes, np.concatenate(parts))
