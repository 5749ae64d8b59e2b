"""Training of a network: scaling, split, several starts, early stopping.

Inputs and output are scaled to [-1, 1]. From each start a method descends on the training part until the validation
error no longer falls. The start of the least validation error wins; the test part is not used.

Reference: clutch thesis, 5.2.2.1; Hagan, Menhaj (1994).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from smid.data import DataError
from smid.display.result import Part, Result
from smid.models import ModelError
from smid.networks.descend import ProgressCallback
from smid.networks.least_squares import Method, NormalEquations, sum_normal_equations
from smid.networks.levenberg_marquardt import levenberg_marquardt
from smid.networks.multistart import MultiStart, multistart
from smid.networks.network import TanhNetwork, weight_count
from smid.networks.scaling import fold, scaling_of
from smid.networks.split import Split, random_split
from smid.networks.start import nguyen_widrow

__all__ = ["NetworkError", "Training", "train"]

BLOCK = 4096


@dataclass(frozen=True, eq=False)
class NetworkError:
    """The error of a network on samples, as a least-squares problem in its weights.

    Parameters
    ----------
    sizes
        Number of inputs, then of neurons in each hidden layer.
    inputs
        Shape (n, k).
    targets
        Shape (n,).

    Examples
    --------
    >>> x = np.linspace(-1.0, 1.0, 20)[:, None]
    >>> NetworkError((1, 1), x, np.tanh(x[:, 0])).error(np.array([1.0, 0.0, 1.0, 0.0]))
    0.0
    """

    sizes: tuple[int, ...]
    inputs: Array
    targets: Array

    def error(self, theta: Array) -> float:
        """Return the mean squared error."""
        network = TanhNetwork(self.sizes, theta)
        return sum(float(np.sum((network(x) - y) ** 2)) for x, y in self._blocks()) / self.targets.size

    def normal_equations(self, theta: Array) -> NormalEquations:
        """Return the normal equations."""
        network = TanhNetwork(self.sizes, theta)
        parts = ((network.linearise(x), y) for x, y in self._blocks())
        return sum_normal_equations((part.outputs - y, part.by_weights) for part, y in parts)

    def _blocks(self) -> Iterator[tuple[Array, Array]]:
        for k in range(0, self.targets.size, BLOCK):
            yield self.inputs[k : k + BLOCK], self.targets[k : k + BLOCK]


@dataclass(frozen=True, eq=False, repr=False)
class Training(Result):
    """A trained network.

    Parameters
    ----------
    network
        From the units of the inputs to the unit of the target.
    training, validation, test
        Mean squared error of each part, in the target's unit squared.
    search
        The descents, in scaled weights and errors.
    """

    network: TanhNetwork
    split: Split
    training: float
    validation: float
    test: float
    search: MultiStart

    def _content(self) -> Iterator[Part]:
        shape = " - ".join(map(str, (*self.network.sizes, 1)))
        errors = {"training": self.training, "validation": self.validation, "test": self.test}
        yield f"Network {shape}, {self.network.weights.size} weights; {self.search}"
        yield f"mean squared error: {', '.join(f'{part} {error:.4g}' for part, error in errors.items())}"


def train(
    inputs: ArrayLike,
    targets: ArrayLike,
    *,
    hidden: tuple[int, ...] = (10,),
    seed: int | np.random.Generator,
    method: Method = levenberg_marquardt,
    starts: int = 5,
    iterations: int = 1000,
    patience: int = 6,
    progress: ProgressCallback | None = None,
) -> Training:
    """Return a network trained on samples; also when interrupted, once there is an error to compare.

    Parameters
    ----------
    inputs
        Shape (n, k).
    targets
        Shape (n,).
    hidden
        Neurons of each hidden layer.
    seed
        Of split and starts.
    method
        `levenberg_marquardt`, `gauss_newton` or `gradient_descent`.
    starts
        Number of random starts.
    iterations
        Largest number of steps from each start.
    patience
        Steps without a lower validation error after which a descent stops.
    progress
        Called after each step.

    Raises
    ------
    DataError
        If a sample is not finite, a column or the target does not vary, or there are more weights than training
        samples.
    ModelError
        If there are no neurons or no starts.

    Examples
    --------
    >>> x = np.linspace(-2.0, 2.0, 200)[:, None]
    >>> result = train(x, np.abs(x[:, 0]), hidden=(4,), seed=1)
    >>> result.test < 1e-3
    True
    """
    # Check samples and options before the long work.
    x, y = np.asarray(inputs, dtype=np.float64), np.asarray(targets, dtype=np.float64)
    if x.ndim != 2 or y.shape != x.shape[:1]:
        raise DataError(
            f"inputs of shape {x.shape} and targets of shape {y.shape}: give one row and one target a sample"
        )
    for name, array in (("inputs", x), ("targets", y)):
        bad = np.argwhere(~np.isfinite(array))
        if bad.size:
            raise DataError(f"the {name} of sample {bad[0][0]} are not finite: correct them, or leave the sample out")
    if starts < 1 or iterations < 1 or patience < 1:
        raise ModelError(f"starts = {starts}, iterations = {iterations}, patience = {patience}: give positive numbers")
    sizes = (x.shape[1], *hidden)
    if len(sizes) < 2 or min(sizes) < 1:
        raise ModelError(f"hidden = {hidden}: give at least one neuron in each of one or more layers")
    # Split, then scale.
    generator = np.random.default_rng(seed)
    split = random_split(y.size, generator)
    if weight_count(sizes) > split.training.size:
        raise DataError(
            f"{weight_count(sizes)} weights but {split.training.size} training samples of {y.size}: "
            "give more samples, or fewer neurons"
        )
    x_scaling, y_scaling = (
        scaling_of(x, [f"input {k}" for k in range(x.shape[1])]),
        scaling_of(y[:, None], ["the target"]),
    )
    scaled_x, scaled_y = x_scaling.apply(x), y_scaling.apply(y[:, None])[:, 0]
    learning, checking = (
        NetworkError(sizes, scaled_x[part], scaled_y[part]) for part in (split.training, split.validation)
    )
    # Train from all starts, and take the winner back to the units of the channels.
    search = multistart(
        method,
        learning,
        [nguyen_widrow(sizes, generator).weights for _ in range(starts)],
        validation=checking.error,
        iterations=iterations,
        patience=patience,
        progress=progress,
    )
    network = fold(TanhNetwork(sizes, search.theta), x_scaling, y_scaling)
    training, validation, test = (
        float(np.mean((network(x[part]) - y[part]) ** 2)) for part in (split.training, split.validation, split.test)
    )
    return Training(network, split, training, validation, test, search)
