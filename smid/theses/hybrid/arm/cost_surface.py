"""The cost over any two parameters, all others held: figure 6.9.

A network of one neuron without biases leaves two weights.  With them the thesis drew the free-run error of the
embedded arm, to see why its estimates got stuck.

Reference: hybrid thesis, section 6.3.2, figure 6.9.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from smid.display.result import Part, Result
from smid.models import ModelError
from smid.signals import TABLE_F1
from smid.theses.hybrid.arm.embedded_arm import embedded_arm, embedded_error
from smid.theses.hybrid.arm.exact_motion import ARM
from smid.theses.hybrid.arm.free_run_error import FreeRunError
from smid.theses.hybrid.arm.records import held_record

__all__ = ["CostSurface", "cost_surface", "figure_6_9"]

Array = NDArray[np.float64]

BATCH = 500  # runs at once


@dataclass(frozen=True, eq=False, repr=False)
class CostSurface(Result):
    """Free-run error over two parameters.

    Parameters
    ----------
    names
        Of the parameters.
    first, second
        Shape (n,) and (m,). Their values.
    rmse
        Shape (n, m). Free-run error, infinite where the run leaves the finite range.
    """

    names: tuple[str, str]
    first: Array
    second: Array
    rmse: Array

    @property
    def least(self) -> tuple[float, float]:
        """Where the error is least."""
        row, column = np.unravel_index(int(np.argmin(self.rmse)), self.rmse.shape)
        return float(self.first[row]), float(self.second[column])

    def _content(self) -> Iterator[Part]:
        where = ", ".join(f"{name} = {value:.4g}" for name, value in zip(self.names, self.least, strict=True))
        yield f"Free-run error at {self.rmse.size} points: least at {where}, {self.rmse.min():.3g} rad RMS."

    def _picture(self) -> Figure:
        return self.plot()

    def plot(self) -> Figure:
        """Draw the surface, and its contours with the least point."""
        from smid.theses.hybrid.arm.figures import surface_figure  # the figures know the results

        return surface_figure(self)


def cost_surface(problem: FreeRunError, values: Mapping[str, float], grid: Mapping[str, ArrayLike]) -> CostSurface:
    """Evaluate the free-run error over a grid of two parameters.

    Parameters
    ----------
    problem
        Model and data.
    values
        The other free parameters of the model, in its units.
    grid
        Two parameters and their values.

    Raises
    ------
    ModelError
        If there are not two parameters, one is unknown or not free, a value is missing, or a series is not finite or
        not rising.

    Examples
    --------
    >>> from smid.data import Dataset
    >>> from smid.models import OutputError
    >>> data = Dataset.from_arrays(input={"u": [1.0, 1, 1]}, output={"y": [0.0, 1.0, 1.5]}, sampling_time=1.0)
    >>> problem = FreeRunError(OutputError(), data, np.ones(2))
    >>> cost_surface(problem, {}, {"a1": [-0.75, -0.5, -0.25], "b0": [0.5, 1.0, 2.0]}).least
    (-0.5, 1.0)
    """
    free = problem.run.parameters
    series = {name: np.asarray(samples, dtype=np.float64) for name, samples in grid.items()}
    if len(series) != 2 or not set(series) <= set(free):
        raise ModelError(f"a grid of {', '.join(series) or 'nothing'}: give two of {', '.join(free)}")
    for name, samples in series.items():
        if samples.ndim != 1 or not np.isfinite(samples).all() or not (np.diff(samples) > 0).all():
            raise ModelError(f"the values of {name} are no rising, finite series: give one, by np.linspace for example")
    missing = [name for name in free if name not in series and name not in values]
    if missing:
        raise ModelError(f"no value for {', '.join(missing)}: give one for every free parameter beside the grid's two")
    (one, first), (two, second) = series.items()
    points = np.tile(problem.theta({**values, one: 0.0, two: 0.0}), (first.size * second.size, 1))
    points[:, free.index(one)] = np.repeat(first, second.size) / problem.units[free.index(one)]
    points[:, free.index(two)] = np.tile(second, first.size) / problem.units[free.index(two)]
    errors = [problem.errors(points[k : k + BATCH]) for k in range(0, len(points), BATCH)]
    return CostSurface((one, two), first, second, np.sqrt(np.concatenate(errors)).reshape(first.size, second.size))


def figure_6_9(points: int = 81) -> CostSurface:
    """Evaluate the thesis's surface: one neuron without biases, the plant's inertia, one sine.

    Parameters
    ----------
    points
        Of each weight.

    Returns
    -------
    CostSurface
        Over the neuron's weight, for speed in 80 rad/s, and the output's, for torque in 16 Nm.

    Examples
    --------
    >>> figure_6_9(11).rmse.shape
    (11, 11)
    """
    hybrid = embedded_arm((1,))
    neuron, bias, output, offset = (parameter.name for parameter in hybrid.term.parameters)
    problem = embedded_error(hybrid, held_record(TABLE_F1["one_sine"]))
    grid = {neuron: np.linspace(-8.0, 8.0, points), output: np.linspace(-4.0, 4.0, points)}
    return cost_surface(problem, {"theta": ARM["theta"], bias: 0.0, offset: 0.0}, grid)
