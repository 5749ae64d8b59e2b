"""Descents from several starts; the one with the least validation error wins."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array
from smid.display.result import Part, Result
from smid.models import ModelError
from smid.networks.descend import Descent, ProgressCallback, Stop, descend
from smid.networks.least_squares import LeastSquares, Method

__all__ = ["MultiStart", "multistart"]


@dataclass(frozen=True, eq=False, repr=False)
class MultiStart(Result):
    """The descents of all starts, in their order."""

    descents: tuple[Descent, ...]

    @property
    def winner(self) -> int:
        """Number of the start with the least validation error."""
        return int(np.argmin([descent.best for descent in self.descents]))

    @property
    def theta(self) -> Array:
        """The best point of that start."""
        return self.descents[self.winner].theta

    def _content(self) -> Iterator[Part]:
        best = self.descents[self.winner]
        iterations = best.training.size - 1
        yield f"start {self.winner + 1} of {len(self.descents)}, {iterations} iterations: {best.stop.value}"


def multistart(
    method: Method,
    problem: LeastSquares,
    starts: Iterable[Array],
    *,
    validation: Callable[[Array], float] | None = None,
    iterations: int = 1000,
    patience: int = 6,
    progress: ProgressCallback | None = None,
) -> MultiStart:
    """Return the descents from several starts; when interrupted from the keyboard, those until then.

    Parameters
    ----------
    method, problem, validation, iterations, patience, progress
        As for `descend`.
    starts
        Shape (p,) each.

    Raises
    ------
    ModelError
        If there is no start, or the error at one is not finite.
    KeyboardInterrupt
        Only before the first error is known.

    Examples
    --------
    >>> from smid.networks import NetworkError, levenberg_marquardt
    >>> x = np.linspace(-1.0, 1.0, 20)[:, None]
    >>> problem = NetworkError((1, 1), x, np.tanh(2.0 * x[:, 0]))
    >>> starts = [np.array([1.0, 0.1, 0.5, 0.0]), np.array([-1.0, 0.2, 0.5, 0.0])]
    >>> len(multistart(levenberg_marquardt, problem, starts).descents)
    2
    """
    descents: list[Descent] = []
    try:
        for number, start in enumerate(starts):
            descents.append(
                descend(
                    method,
                    problem,
                    start,
                    validation=validation,
                    iterations=iterations,
                    patience=patience,
                    progress=progress,
                    number=number,
                )
            )
            if descents[-1].stop is Stop.INTERRUPTED:
                break
    except KeyboardInterrupt:
        if not descents:
            raise
    if not descents:
        raise ModelError("no start is given: give one or more")
    return MultiStart(tuple(descents))
