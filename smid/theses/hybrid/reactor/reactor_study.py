"""The studies of the reactor: tables 5 and 6, and the time constant estimated together with a network."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

from relaxations.deadline import Progress
from smid.data import Dataset
from smid.display.result import plain
from smid.models import ModelError
from smid.theses.chapter import Chapter, Drawing, Topic
from smid.theses.hybrid.reactor.conditions import OtherConditions, other_conditions
from smid.theses.hybrid.reactor.figures import records_figure
from smid.theses.hybrid.reactor.output_errors import OutputErrors, output_errors
from smid.theses.hybrid.reactor.records import reactor_record
from smid.theses.hybrid.reactor.requirements import RequirementStudy, requirement_study
from smid.theses.hybrid.reactor.time_constant import TimeConstants, time_constant_study

__all__ = ["ReactorStudy", "reactor_study"]


@dataclass(frozen=True, eq=False, repr=False)
class ReactorStudy(Chapter):
    """The studies of the reactor: table 5, also under other conditions, table 6 and section 6.2.4."""

    title = "Hybrid models of a reactor"
    command = "hybrid reactor"
    not_compared = (
        "The numbers of the thesis's table 5 are missing in the copy that we have. Its figure 6.7 shows only that all "
        "models drawn there have errors below 0.25.",
        "The thesis trains each model with its best signal, sine or noisy staircase. Our table 5 has the staircase for "
        "all models, and a further table has the sine. The thesis does not state its random numbers.",
        "The thesis samples the impulse response to find the transfer function of the network. Ours is sampled as the "
        "plant is, with the input held. In parallel this needs one more past input.",
        "The thesis prints the balances of mass, component and energy and simplifies them at once. The constants of "
        "the full balances are ours.",
    )

    errors: OutputErrors
    conditions: OtherConditions
    requirements: RequirementStudy
    time_constants: TimeConstants

    @property
    def conclusion(self) -> str:
        """Return the conclusions of table 5 and of section 6.2.4."""
        return f"{self.errors.conclusion} {self.time_constants.conclusion}"

    def records(self) -> Dataset:
        """Return the training records of all plants."""
        from smid.reports.chapter import together

        return together({plant: reactor_record(plant) for plant in self.errors.plants})

    def topics(self) -> Iterator[Topic]:
        """Return one section per study."""
        plant = self.errors.plants[0]
        yield Topic(
            "The inputs",
            "Each input, and what the concentration does under it.",
            Drawing(partial(records_figure, plant), f"Figure 6.1: the plant '{plant}' under each input."),
        )
        yield Topic(
            "Table 5: largest output errors",
            "A series network with simple back couplings cannot compensate the model's dynamics, because it does not "
            "read the model's past output. A parallel network lacks further past values.",
            self.errors,
            Drawing(self.errors.plot, "Figure 6.7: largest output errors; the line is the end of the thesis's axis."),
            Drawing(
                self.errors.plot_runs, "Appendices A and C: each mismatch under the constant, trained in free run."
            ),
        )
        yield Topic(
            "Table 5 under other conditions",
            "A model that is right under one constant can be wrong at another level.",
            self.conditions,
            *(
                [
                    Drawing(
                        self.conditions.plot,
                        "Figure 6.2: simple parallel network, two tanks in succession, by training record.",
                    )
                ]
                if self.conditions.runs
                else []
            ),
        )
        yield Topic(
            "Table 6: what the networks learned",
            "A network with as many back couplings as the analysis requires learns the required response.",
            self.requirements,
            Drawing(self.requirements.plot, "Learned and required responses to a constant."),
        )
        yield Topic("A time constant and a network at once", self.time_constants)

    def to_dict(self) -> dict[str, object]:
        """Return plain data."""
        return {
            "output_errors": plain(self.errors),
            "other_conditions": plain(self.conditions),
            "requirements": plain(self.requirements),
            "time_constants": plain(self.time_constants),
            "conclusion": self.conclusion,
        }


def reactor_study(
    *, starts: int = 3, iterations: int = 300, seed: int = 1, progress: Progress | None = None
) -> ReactorStudy:
    """Run all studies of the reactor; it takes some minutes.

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
        other_conditions(starts=starts, iterations=iterations, seed=seed, progress=progress),
        requirement_study(starts=starts, iterations=iterations, seed=seed, progress=progress),
        time_constant_study(starts=starts, iterations=iterations, seed=seed, progress=progress),
    )
