"""All of the first-order process: tables 5 and 6, and the time constant beside a network."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from smid.display.result import Heading, Part, Result
from smid.models import ModelError
from smid.theses.hybrid.reactor.output_errors import OutputErrors, output_errors
from smid.theses.hybrid.reactor.requirements import RequirementStudy, requirement_study
from smid.theses.hybrid.reactor.time_constant import TimeConstants, time_constant_study

__all__ = ["ReactorStudy", "reactor_study"]


@dataclass(frozen=True, eq=False, repr=False)
class ReactorStudy(Result):
    """The three studies of the reactor.

    Parameters
    ----------
    errors
        Table 5.
    requirements
        Table 6.
    time_constants
        Section 6.2.4.
    """

    errors: OutputErrors
    requirements: RequirementStudy
    time_constants: TimeConstants

    @property
    def conclusion(self) -> str:
        """Return in a few sentences what the three gave."""
        return f"{self.errors.conclusion} {self.time_constants.conclusion}"

    def _content(self) -> Iterator[Part]:
        yield Heading("Table 5: largest output errors")
        yield self.errors
        yield Heading("Table 6: what the networks learned")
        yield self.requirements
        yield Heading("A time constant and a network at once")
        yield self.time_constants

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "output_errors": self.errors.to_dict(),
            "requirements": self.requirements.to_dict(),
            "time_constants": self.time_constants.to_dict(),
            "conclusion": self.conclusion,
        }


def reactor_study(
    *, starts: int = 3, iterations: int = 300, seed: int = 1, progress: Callable[[str], None] | None = None
) -> ReactorStudy:
    """Run all of the reactor's studies: some minutes.

    Parameters
    ----------
    starts
        For each model.
    iterations
        Most steps from each start.
    seed
        Of the input's noise and of the starts.
    progress
        Called with a line of text for each model.

    Raises
    ------
    ModelError
        If there is no start or no step.

    Examples
    --------
    >>> try:
    ...     reactor_study(starts=0)
    ... except ModelError as error:
    ...     print(error)
    starts = 0, iterations = 300: give positive numbers
    """
    if starts < 1 or iterations < 1:
        raise ModelError(f"starts = {starts}, iterations = {iterations}: give positive numbers")
    return ReactorStudy(
        output_errors(starts=starts, iterations=iterations, seed=seed, progress=progress),
        requirement_study(starts=starts, iterations=iterations, seed=seed, progress=progress),
        time_constant_study(starts=starts, iterations=iterations, seed=seed, progress=progress),
    )
