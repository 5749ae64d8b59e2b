"""What a recursive set-membership estimator found: intervals in time, and the changes of the plant that it proved."""

from __future__ import annotations

from dataclasses import dataclass

from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from relaxations.balls import Array

__all__ = ["Change", "SetHistory"]


@dataclass(frozen=True)
class Change:
    """A certified change of the plant: no constant parameters explain a stretch of samples.

    That is proven.  That the plant changed follows where the model's structure, its first box and the noise bound hold.

    Parameters
    ----------
    after : int
        Number of the first sample of the stretch: the parameters were not the same ever since.
    sample : int
        Number of its last sample, with which the set became empty: the change had happened by then.

    Examples
    --------
    >>> print(Change(120, 131))
    no constant parameters explain samples 120 to 131: the plant changed in between
    """

    after: int
    sample: int

    def __str__(self) -> str:
        return f"no constant parameters explain samples {self.after} to {self.sample}: the plant changed in between"


@dataclass(frozen=True, eq=False)
class SetHistory:
    """Certified intervals of the parameters, sample by sample.

    Parameters
    ----------
    names : tuple of str
        Of the n parameters.
    lower, upper : ndarray, shape (N, n)
        After each sample.
    changes : tuple of Change

    Examples
    --------
    >>> import numpy as np
    >>> history = SetHistory(("a1",), np.array([[-1.0], [-0.6]]), np.array([[1.0], [-0.4]]), ())
    >>> history.upper[-1] - history.lower[-1]
    array([0.2])
    """

    names: tuple[str, ...]
    lower: Array
    upper: Array
    changes: tuple[Change, ...]

    def plot(self, truth: ArrayLike | None = None, sampling_time: float | None = None) -> Figure:
        """Return a figure of the intervals in time.

        Parameters
        ----------
        truth : array_like, shape (n,) or (N, n), optional
            The parameters that made the data, where they are known.
        sampling_time : float, optional
            In seconds; without it the axis counts samples.

        Returns
        -------
        Figure
            One panel for each parameter, certified changes marked.

        Raises
        ------
        DataError
            If the truth has another shape.
        """
        from smid.recursive.set_figure import set_figure

        return set_figure(self, truth, sampling_time)
