"""The page of the arm: white model, alternating and input-error estimation, and the embedded network's minima."""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from pathlib import Path

import numpy as np

from smid.reports.chapter import chapter_page, together
from smid.reports.content import Picture, Section
from smid.reports.documents import study_document
from smid.reports.formats import write_page
from smid.signals import TABLE_F1
from smid.theses.hybrid.arm import ArmStudy, ModulatingFilter, NetworkRuns, figure_6_9, held_record
from smid.theses.hybrid.arm.embedded_arm import SPEED_UNIT, TORQUE_UNIT
from smid.theses.hybrid.arm.figures import friction_figure, response_figure

__all__ = ["arm_page"]

_NOT_COMPARED = (
    "The thesis judged good, moderate and bad from plots. Here a run is good where its free-run error over similar "
    "sines is no larger than the white model's, and bad where it is ten times larger.",
    "It does not tell the range of its random weights in every study: listing K.22 has 0 to 1, listing K.18 0 to 0.01. "
    "Both are run.",
    "Its filter program is not listed; ours is the spline of order 3 at the least width.",
    "It drew no random seeds that could be used again, and its optimiser is Matlab's of 1998.",
)
_SPEEDS = np.linspace(-75.0, 75.0, 3001)  # rad/s, what one sine visits


def arm_page(study: ArmStudy, path: str | PathLike[str], settings: Mapping[str, str] | None = None) -> Path:
    """Write the page of the arm's studies.

    Raises
    ------
    ValueError, OSError
        Where the path names no format, or cannot be written.

    Examples
    --------
    The study takes minutes and is not run here; ``smid hybrid arm --report arm.html`` does the same.

    >>> from smid.theses.hybrid.arm import arm_study
    >>> page = arm_page(arm_study(20), "arm.html")  # doctest: +SKIP
    """
    surface = figure_6_9()
    sections = (
        Section(
            "Table F.2: the white model",
            (
                "What Euler's method errs, the constants make up for. Under the exact motion all four are found, "
                "sticking too, which the thesis found at its start whatever it did.",
                study.white_table,
            ),
        ),
        Section(
            "Alternating and input error",
            (
                "Both see speed and acceleration, so that nothing has to be simulated. Their inertia is right; the "
                "networks come out with the jump at rest, without it, or with one that goes down.",
                study.network_table,
                Picture(friction_figure(_one_of_each(study.input_error), _SPEEDS), "Figure 6.11: networks by shape."),
                Picture(response_figure(ModulatingFilter(), 0.02), "The modulating filter as a differentiator."),
            ),
        ),
        Section(
            "Table 8: the embedded arm",
            (
                "From random weights most runs end in local minima. Begun at the centres of certified intervals, or at "
                "the best of a search in input error, 1/J comes out within a percent wherever the input turns the arm "
                "both ways. Six equal sines do not, and mostly let it stick: there a smooth network fails.",
                "The curve's error is a share of the largest friction. The whole step at rest is 0.86 Nm, about 7 % of "
                "13 Nm, so a small share does not show that the step is right: its own column does.",
                "Figure 6.9: one neuron without biases leaves two weights, and a narrow, bent valley, twice because "
                "both may change their signs; beside it slopes lead away from it, to plateaus of large weights.",
                study.embedded.table,
                Picture(study.embedded.plot(), "1/J of every run; the line is the plant's."),
                Picture(
                    surface.plot(),
                    "Free-run error [rad] over both weights, which have no unit; the red point is the least.",
                ),
            ),
        ),
    )
    page = chapter_page(
        "Hybrid models of a rotating arm",
        study.conclusion,
        sections,
        together({name: held_record(sines) for name, sines in TABLE_F1.items()}),
        document=study_document("hybrid-arm", study.to_dict()),
        not_compared=_NOT_COMPARED,
        settings=settings,
    )
    return write_page(page, path)


def _one_of_each(runs: NetworkRuns) -> dict[str, np.ndarray]:
    """Return the torque of the best network of each shape."""
    best: dict[str, int] = {}
    for k in np.argsort(runs.rmse).tolist():
        best.setdefault(runs.shapes[k], k)
    return {shape: TORQUE_UNIT * runs.networks[k](_SPEEDS[:, None] / SPEED_UNIT) for shape, k in best.items()}
