"""Free-run error over two parameters, with all others fixed.

Reference: hybrid thesis, section 6.3.2, figure 6.9.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from smid.display.result import Part, Result
from smid.hybrid.free_run_error import FreeRunError
from smid.models import ModelError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["CostSurface", "cost_surface"]

BATCH = 500  # simulated runs per call


@dataclass(frozen=True, eq=False, repr=False)
class CostSurface(Result):
    """Free-run error over two parameters.

    Parameters
    ----------
    first, second
        Shapes (n,) and (m,). Values of the two parameters.
    rmse
        Shape (n, m). RMSE in the output's unit; infinite where the run diverges.
    """

    names: tuple[str, str]
    first: Array
    second: Array
    rmse: Array

    @property
    def least(self) -> tuple[float, float]:
        """Return the parameter values of the smallest error."""
        row, column = np.unravel_index(int(np.argmin(self.rmse)), self.rmse.shape)
        return float(self.first[row]), float(self.second[column])

    def _content(self) -> Iterator[Part]:
        where = ", ".join(f"{name} = {value:.4g}" for name, value in zip(self.names, self.least, strict=True))
        yield f"Free-run error at {self.rmse.size} points: RMSE is smallest, {self.rmse.min():.3g}, at {where}."

    def _picture(self) -> Figure:
        return self.plot()

    def plot(self) -> Figure:
        """Return a figure of the surface, with contours and the smallest error."""
        from smid.hybrid.figures import surface_figure

        return surface_figure(self)


def cost_surface(problem: FreeRunError, values: Mapping[str, float], grid: Mapping[str, ArrayLike]) -> CostSurface:
    """Return the free-run error over a grid of two parameters.

    Parameters
    ----------
    values
        Values of the other free parameters, in the model's units.
    grid
        Two parameters and their values, finite and increasing.

    Raises
    ------
    ModelError
        If the grid does not have two free parameters, a value is missing, or grid values are not finite and increasing.

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
        raise ModelError(f"the grid has {', '.join(series) or 'no parameters'}: give two of {', '.join(free)}")
    for name, samples in series.items():
        if samples.ndim != 1 or not np.isfinite(samples).all() or not (np.diff(samples) > 0).all():
            raise ModelError(f"the values of {name} are not finite and increasing: use for example np.linspace")
    missing = [name for name in free if name not in series and name not in values]
    if missing:
        raise ModelError(f"no value for {', '.join(missing)}: give one for every free parameter outside the grid")
    # All grid points as scaled vectors theta.
    (one, first), (two, second) = series.items()
    points = np.tile(problem.theta({**values, one: 0.0, two: 0.0}), (first.size * second.size, 1))
    points[:, free.index(one)] = np.repeat(first, second.size) / problem.units[free.index(one)]
    points[:, free.index(two)] = np.tile(second, first.size) / problem.units[free.index(two)]
    errors = [problem.errors(points[k : k + BATCH]) for k in range(0, len(points), BATCH)]
    return CostSurface((one, two), first, second, np.sqrt(np.concatenate(errors)).reshape(first.size, second.size))
