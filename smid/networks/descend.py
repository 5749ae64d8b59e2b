"""One descent of any method, watched: it stops early when the validation error rises, and keeps the best when stopped.

Reference: Prechelt, "Early stopping - but when?", in "Neural Networks: Tricks of the Trade" (1998).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np

from smid.display.result import Part, Result
from smid.models import ModelError
from smid.networks.least_squares import LeastSquares, Method
from smid.networks.network import Array

__all__ = ["Descent", "Progress", "ProgressCallback", "Stop", "descend"]

SLOW, WINDOW = 1e-4, 20


class Stop(Enum):
    """Why a descent ended.

    Examples
    --------
    >>> Stop.CONVERGED.value
    'the error falls no more'
    """

    CONVERGED = "the error falls no more"
    VALIDATION = "the validation error no longer fell"
    ITERATIONS = "the limit of iterations was reached"
    INTERRUPTED = "interrupted: this is the best so far"


@dataclass(frozen=True)
class Progress:
    """How far a descent has come.

    Parameters
    ----------
    start
        Which of several starts, from 0.
    iteration
        Accepted steps so far.
    training, validation
        Mean squared errors; without a validation part both are the same.

    Examples
    --------
    >>> def tell(progress: Progress) -> None:
    ...     print(f"step {progress.iteration}: {progress.training:.3g}")
    >>> tell(Progress(start=0, iteration=3, training=0.25, validation=0.3))
    step 3: 0.25
    """

    start: int
    iteration: int
    training: float
    validation: float


ProgressCallback = Callable[[Progress], None]


@dataclass(frozen=True, eq=False, repr=False)
class Descent(Result):
    """The best point of one descent, and how it was reached.

    Parameters
    ----------
    theta
        Shape (p,). Of the least validation error.
    training, validation
        Shape (n_iterations + 1,). Mean squared errors at the start and after each accepted step.
    stop
        Why it ended.
    """

    theta: Array
    training: Array
    validation: Array
    stop: Stop

    @property
    def best(self) -> float:
        """The least validation error."""
        return float(self.validation.min())

    def _content(self) -> Iterator[Part]:
        yield f"{self.training.size - 1} iterations, mean squared error {self.best:.4g}: {self.stop.value}"


def descend(
    method: Method,
    problem: LeastSquares,
    start: Array,
    *,
    validation: Callable[[Array], float] | None = None,
    iterations: int = 1000,
    patience: int = 6,
    progress: ProgressCallback | None = None,
    number: int = 0,
) -> Descent:
    """Run a method until it, the validation error, the limit or the user says stop.

    Parameters
    ----------
    method
        Such as `levenberg_marquardt`.
    problem
        What is minimised.
    start
        Shape (p,). Where to begin.
    validation
        Mean squared error on samples apart; by default the error that is minimised.
    iterations
        Most accepted steps.
    patience
        Accepted steps in a row without a new least validation error, after which it stops.
    progress
        Called at the start and after each accepted step.
    number
        Of the start, for the progress.

    Raises
    ------
    ModelError
        If the error at the start is not finite.
    KeyboardInterrupt
        Only if the error at the start is not known yet; later, the best so far is returned.

    Examples
    --------
    >>> from smid.networks import NetworkError, levenberg_marquardt
    >>> x = np.linspace(-1.0, 1.0, 20)[:, None]
    >>> problem = NetworkError((1, 1), x, np.tanh(2.0 * x[:, 0]))
    >>> found = descend(levenberg_marquardt, problem, np.array([1.0, 0.1, 0.5, 0.0]))
    >>> bool(problem.error(found.theta) < 1e-12)
    True
    """
    training: list[float] = []
    validated: list[float] = []
    best, stop = start, Stop.CONVERGED
    try:
        for iterate in method(problem, start):
            error = iterate.error if validation is None else validation(iterate.theta)
            if not training and not np.isfinite(iterate.error):
                raise ModelError("the error at the start is not finite: start from other values")
            if not validated or error < min(validated):
                best = iterate.theta
            training.append(iterate.error)
            validated.append(error)
            if progress is not None:
                progress(Progress(number, len(training) - 1, iterate.error, error))
            if len(validated) - 1 - int(np.argmin(validated)) >= patience:
                stop = Stop.VALIDATION
                break
            if len(training) > WINDOW and training[-1] > (1.0 - SLOW) * training[-1 - WINDOW]:
                break
            if len(training) > iterations:
                stop = Stop.ITERATIONS
                break
    except KeyboardInterrupt:
        if not training:
            raise
        stop = Stop.INTERRUPTED
    return Descent(best, np.array(training), np.array(validated), stop)
