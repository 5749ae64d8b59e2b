"""How a model passes on noise at its input, which serves models of any kind: by small white perturbations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from relaxations.algebra.arrays import Array
from smid.models import Model
from smid.models.simulate import simulate

__all__ = ["passed_noise"]

_PERTURBATIONS = 48
_SMALL = 1e-3  # of the standard deviation of the input
_SEED = 7


def passed_noise(model: Model, values: Mapping[str, Array], channels: Sequence[str], output: str) -> Array:
    """Return answers of an output to white noise of variance one in an input, to first order, shape (48, n).

    Parameters
    ----------
    channels
        The input, and those that estimate it: the plant is driven by one signal.
    """
    generator = np.random.default_rng(_SEED)
    size = _SMALL * (float(np.std(values[channels[0]])) or 1.0)
    plain = simulate(model, values, check=False)[output]
    noise = size * generator.normal(size=(_PERTURBATIONS, len(plain)))
    moved = [
        simulate(model, {**values, **{name: values[name] + one for name in channels}}, check=False)[output]
        for one in noise
    ]
    return (np.array(moved) - plain) / size
