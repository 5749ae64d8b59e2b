"""One descent of a method with early stopping: it ends when the validation error no longer falls.

Reference: Prechelt, "Early stopping - but when?", in "Neural Networks: Tricks of the Trade" (1998).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np

from relaxations.algebra.arrays import Array
from smid.display.result import Part, Result
from smid.models import ModelError
from smid.networks.least_squares import LeastSquares, Method, box_of, held

__all__ = ["Descent", "Progress", "ProgressCallback", "Stop", "descend"]

SLOW, WINDOW = 1e-4, 20
STEEP = 1e-2  # share of the error that a Gauss-Newton step promises where a descent has not converged
ROUNDING = 1e-16  # share of the first error


class Stop(Enum):
    """Why a descent ended.

    Examples
    --------
    >>> Stop.CONVERGED.value
    'the error falls no more'
    """

    CONVERGED = "the error falls no more"
    STALLED = "stalled: a step should lower the error, but none does"
    VALIDATION = "the validation error no longer fell"
    ITERATIONS = "the limit of iterations was reached"
    INTERRUPTED = "interrupted: this is the best so far"


@dataclass(frozen=True)
class Progress:
    """State of a descent, for a progress display.

    Parameters
    ----------
    start
        Number of the start, from 0.
    iteration
        Accepted steps so far.
    training, validation
        Mean squared errors; equal without a validation part.

    Examples
    --------
    >>> def show(progress: Progress) -> None:
    ...     print(f"step {progress.iteration}: {progress.training:.3g}")
    >>> show(Progress(start=0, iteration=3, training=0.25, validation=0.3))
    step 3: 0.25
    """

    start: int
    iteration: int
    training: float
    validation: float


ProgressCallback = Callable[[Progress], None]


@dataclass(frozen=True, eq=False, repr=False)
class Descent(Result):
    """The best point of one descent, and its errors.

    Parameters
    ----------
    theta
        Shape (p,). Point of the least validation error.
    training, validation
        Shape (n_iterations + 1,). Mean squared errors at the start and after each accepted step.
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
    """Return the best point of a descent, also when it is interrupted from the keyboard.

    Parameters
    ----------
    start
        Shape (p,).
    validation
        Returns the mean squared error on other samples; by default the error that is minimised.
    iterations
        Largest number of accepted steps.
    patience
        Accepted steps without a new least validation error after which the descent stops.
    progress
        Called at the start and after each accepted step.
    number
        Number of the start, for the progress.

    Raises
    ------
    ModelError
        If the error at the start is not finite.
    KeyboardInterrupt
        Only before the error at the start is known.

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
            # Keep the point if its validation error is the least so far.
            error = iterate.error if validation is None else validation(iterate.theta)
            if not training and not np.isfinite(iterate.error):
                raise ModelError("the error at the start is not finite: start from other values")
            if not validated or error < min(validated):
                best = iterate.theta
            training.append(iterate.error)
            validated.append(error)
            if progress is not None:
                progress(Progress(number, len(training) - 1, iterate.error, error))
            # Stop by the validation error, by a slow fall, or at the limit.
            if len(validated) - 1 - int(np.argmin(validated)) >= patience:
                stop = Stop.VALIDATION
                break
            if len(training) > WINDOW and training[-1] > (1.0 - SLOW) * training[-1 - WINDOW]:
                break
            if len(training) > iterations:
                stop = Stop.ITERATIONS
                break
        else:
            least = max(min(training), ROUNDING * training[0])
            if validation is None and _promised(problem, best) > STEEP * least:
                stop = Stop.STALLED
    except KeyboardInterrupt:
        if not training:
            raise
        stop = Stop.INTERRUPTED
    return Descent(best, np.array(training), np.array(validated), stop)


def _promised(problem: LeastSquares, theta: Array) -> float:
    """Return how much a Gauss-Newton step within the box lowers the error, in the linear approximation."""
    system = problem.normal_equations(theta)
    moves = ~held(theta, system.gradient, *box_of(problem, theta))
    gradient = system.gradient[moves]
    step = np.linalg.lstsq(system.gram[np.ix_(moves, moves)], gradient, rcond=1e-8)[0]
    return float(gradient @ step)
