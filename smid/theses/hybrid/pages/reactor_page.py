"""The page of the first-order process: tables 5 and 6, and the time constant beside a network."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path

from smid.hybrid.estimate import ERRORS
from smid.reports.chapter import chapter_page, together
from smid.reports.content import Picture, Section
from smid.reports.documents import study_document
from smid.reports.formats import write_page
from smid.theses.hybrid.reactor import ReactorStudy, reactor_record

__all__ = ["reactor_page"]

_NOT_COMPARED = (
    "The numbers of the thesis's table 5 are lost in the copy that is left of it. Only its figure 6.7 tells that all "
    "models that are drawn there err by less than 0.25.",
    "It trains each model with the signal that served it best, sine or noisy staircase; ours are all trained with the "
    "staircase. Its random numbers are not told.",
    "It samples the impulse response to find what a network has to learn; ours is sampled as the plant is, with the "
    "input held. In parallel that asks for one past input more.",
    "It prints the balances of mass, component and energy and simplifies them at once. The constants of the full "
    "balances are ours.",
)


def reactor_page(study: ReactorStudy, path: str | PathLike[str], settings: Mapping[str, str] | None = None) -> Path:
    """Write the page of the reactor's studies.

    Raises
    ------
    ValueError, OSError
        Where the path names no format, or cannot be written.

    Examples
    --------
    The study takes minutes and is not run here; ``smid hybrid reactor --report reactor.html`` does the same.

    >>> from smid.theses.hybrid.reactor import reactor_study
    >>> page = reactor_page(reactor_study(), "reactor.html")  # doctest: +SKIP
    """
    sections = (
        Section(
            "Table 5: largest output errors",
            (
                study.errors.conclusion,
                "A series network with simple back couplings cannot undo the model's dynamics: it lacks the model's "
                "past output. A parallel one lacks more.",
                *(study.errors.table(error) for error in ERRORS),
                Picture(study.errors.plot(), "Figure 6.7: largest output errors; the line is where its axis ends."),
            ),
        ),
        Section(
            "Table 6: what the networks learned",
            (
                "A network with as many back couplings as the analysis asks for learns what it has to.",
                study.requirements.transfers,
                study.requirements.table,
                Picture(study.requirements.plot(), "Learned and required responses to a constant."),
            ),
        ),
        Section(
            "A time constant and a network at once",
            (
                study.time_constants.conclusion,
                study.time_constants.table,
            ),
        ),
    )
    page = chapter_page(
        "Hybrid models of a reactor",
        study.conclusion,
        sections,
        together({plant: reactor_record(plant) for plant in study.errors.plants}),
        document=study_document("hybrid-reactor", study.to_dict()),
        not_compared=_NOT_COMPARED,
        settings=settings,
    )
    return write_page(page, path)
