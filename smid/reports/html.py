"""The page of an estimate: what was found, from what, and what of it is proven."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from relaxations.hierarchy import Proof
from smid.data import Dataset
from smid.error_bound import ErrorBound
from smid.estimate import Estimate, ParameterInterval, round_down, round_up, shown_digits
from smid.models import Model, ModelError
from smid.reports import mathml
from smid.reports.figures import intervals_figure, simulation_figure
from smid.reports.page import render_page
from smid.reports.style import inline_svg
from smid.reports.writing import check_writable, write_text
from smid.validate import Score, Validation, validate


@dataclass(frozen=True)
class Run:
    """One free run as the page shows it: its score and its picture."""

    score: Score
    source: str
    picture: str


def estimate_report(
    estimate: Estimate,
    path: str | PathLike[str],
    error_bound: ErrorBound | None = None,
    validations: Sequence[Validation] = (),
    *,
    truth: Mapping[str, float] | None = None,
    notes: Sequence[str] = (),
    settings: Mapping[str, str] | None = None,
    links: Mapping[str, str] | None = None,
) -> Path:
    """Write the page of an estimate; see :func:`smid.report`."""
    check_writable(path)
    own, trouble = _own_run(estimate)
    picture = inline_svg(
        intervals_figure(estimate, truth),
        "Certified and witnessed interval and centre of each parameter",
        "intervals",
    )
    page = _render(
        title=f"{estimate.model.name[0].upper()}{estimate.model.name[1:]}: certified parameter intervals",
        sentence=_sentence(estimate),
        data=estimate.data,
        model=estimate.model,
        noise_bound=estimate.noise_bound,
        error_bound=error_bound,
        estimate=estimate,
        rows=[_interval_row(i, truth) for i in estimate.intervals],
        picture_of_intervals=picture,
        truth=truth,
        own=own,
        trouble=trouble,
        validations=_runs(validations, "validation"),
        notes=notes,
        settings=settings,
        links=links,
    )
    return write_text(path, page)


def data_report(
    path: str | PathLike[str],
    title: str,
    sentence: str,
    model: Model,
    data: Dataset | None = None,
    error_bound: ErrorBound | None = None,
    validations: Sequence[Validation] = (),
    settings: Mapping[str, str] | None = None,
) -> Path:
    """Write the page of an error bound or of validations alone; see :func:`smid.report`.

    Parameters
    ----------
    path : str or path
    title, sentence : str
        Heading, and the result in one sentence.
    model : Model
    data : Dataset, optional
    error_bound : ErrorBound, optional
    validations : sequence of Validation
    settings : mapping str -> str, optional

    Returns
    -------
    Path

    Raises
    ------
    OSError
        Where the path cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from smid.models import OutputError
    >>> page = Path(tempfile.mkdtemp()) / "validation.html"
    >>> data_report(page, "A first-order model", "No record was simulated yet.", OutputError()).name
    'validation.html'
    """
    check_writable(path)
    page = _render(
        title=title,
        sentence=sentence,
        data=data,
        model=model,
        noise_bound={},
        error_bound=error_bound,
        estimate=None,
        validations=_runs(validations, "validation"),
        notes=(),
        settings=settings,
    )
    return write_text(path, page)


def _render(*, data: Dataset | None, model: Model, error_bound: ErrorBound | None, **content: Any) -> str:
    return render_page(
        "report.html.j2",
        data=data,
        sources=[run.source for run in content["validations"]],
        model=model,
        error_bound=error_bound,
        equations=mathml.equations(model),
        priors=mathml.priors(model),
        bound_ends=None if error_bound is None else (round_down(error_bound.lower, 6), round_up(error_bound.upper, 6)),
        **content,
    )


def _own_run(estimate: Estimate) -> tuple[list[Run], str]:
    """Return the central model's free run over its own data, or why there is none."""
    if estimate.unbounded:
        return [], "There is no central model to simulate."
    try:
        return _runs([validate(estimate.model, estimate.data, estimate.noise_bound)], "identification"), ""
    except ModelError as error:
        # An unstable central model is a finding: the page must still be written.
        return [], f"The central model cannot be simulated: {error}."


def _runs(validations: Sequence[Validation], salt: str) -> list[Run]:
    return [
        Run(
            score,
            v.data.source,
            inline_svg(
                simulation_figure(v, number),
                f"Measured {score.channel} and free run over time, with the error below: {score.experiment}",
                f"{salt}-{k}-{number}",
            ),
        )
        for k, v in enumerate(validations)
        for number, score in enumerate(v.scores)
    ]


def _sentence(estimate: Estimate) -> str:
    if estimate.enclosure is None:
        return estimate.summary
    bounds = " and ".join(
        f"noise of {c} of at most {_no_larger(b)} {estimate.data.channel(c).unit}".rstrip()
        for c, b in estimate.noise_bound.items()
    )
    ranges = "; ".join(_range(i) for i in estimate.intervals)
    samples = estimate.data.n_samples
    return f"Proven: whichever parameters explain the {samples} samples with {bounds}, they satisfy {ranges}."


def _no_larger(value: float) -> str:
    """Print a noise bound: never above the number, for the statement holds up to that number only."""
    text = f"{value:.6g}"
    return text if float(text) <= value else round_down(value, 6)


def _range(i: ParameterInterval) -> str:
    digits = shown_digits(i)
    return f"{i.name} in [{round_down(i.lower, digits)}, {round_up(i.upper, digits)}] {i.unit}".rstrip()


def _interval_row(i: ParameterInterval, truth: Mapping[str, float] | None) -> dict[str, Any]:
    digits = shown_digits(i)
    known = None if truth is None else truth.get(i.name)
    return {
        "symbol": mathml.symbol(i.name),
        "unit": i.unit,
        "lower": round_down(i.lower, digits),
        "upper": round_up(i.upper, digits),
        # Rounded inwards, so that a printed inner end never claims more than its witness shows.
        "inner_lower": round_up(i.inner_lower, digits) if np.isfinite(i.inner_lower) else "none found",
        "inner_upper": round_down(i.inner_upper, digits) if np.isfinite(i.inner_upper) else "none found",
        "gap": f"{i.gap:.1e}" if np.isfinite(i.gap) else "unknown",
        "centre": f"{i.centre:.{digits}g}" if np.isfinite(i.centre) else "none",
        "ends": [("data" if p is Proof.PROVEN else "prior box") for p in (i.proof_lower, i.proof_upper)],
        "truth": None if known is None else f"{known:g}",
        "inside": None if known is None else bool(i.lower <= known <= i.upper),
    }
