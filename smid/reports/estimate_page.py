"""The report of an estimate: the intervals, the data, and what is proven."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path

import numpy as np

from relaxations.search.enclosure import Proof
from smid.data import Dataset
from smid.display.table import Table, figure
from smid.identification.error_bound import ErrorBound
from smid.identification.estimate import Estimate, ParameterInterval, round_down, round_up, shown_digits
from smid.identification.identify import EmptyFeasibleSetError
from smid.models import Model, ModelError
from smid.reports.content import Block, Facts, Heading, Items, Page, Picture, Remark, Section, coloured, joined
from smid.reports.documents import Document, empty_document, identify_document
from smid.reports.formats import write_page
from smid.reports.page import capitalised, data_section, equations, is_simulated, parameter, priors
from smid.validation.scores import Score, Validation
from smid.validation.validate import validate

_CERTIFICATE = (
    'For each bound, a convex program gives multipliers. They write "parameter minus bound" as a sum of squares plus '
    "multiples of the constraints. The solver is not trusted: ball arithmetic evaluates the identity again and "
    "encloses every rounding error. The error of the identity is subtracted from the bound. So each certified bound is "
    "proven for the model and the data, even if the solver stopped early or was wrong."
)
_WITNESS = (
    "A witness is one set of parameters and noises that satisfies every equation and every bound, verified with "
    "interval arithmetic. So the certified interval cannot be smaller than the witnessed interval."
)
_NOT_PROVEN = (
    "The structure of the model. The intervals show which parameters of this model are consistent with the data.",
    "The noise bound. If the true noise exceeded it at one sample, the true parameters may lie outside the intervals.",
    "The model on other records. Validation shows examples; it proves nothing about the next record.",
    "Each value in an interval. Some values, and some combinations of values, may be impossible.",
)


def estimate_page(
    estimate: Estimate,
    error_bound: ErrorBound | None = None,
    validations: Sequence[Validation] = (),
    *,
    truth: Mapping[str, float] | None = None,
    notes: Sequence[str] = (),
    settings: Mapping[str, str] | None = None,
    links: Mapping[str, str] | None = None,
) -> Page:
    """Return the report of an estimate; see :func:`smid.report`."""
    sections = (
        Section("Parameter intervals", tuple(_intervals(estimate, truth))),
        *_least_bound(error_bound),
        Section("Simulation over the data", tuple(_own_run(estimate))),
        Section("Validation on other records", (*notes, *run_blocks(validations))),
        model_section(estimate.model, noise_bounds(estimate)),
        data_section(estimate.data, drawn=True),
        _proof(estimate),
    )
    return Page(
        f"{capitalised(estimate.model.name)}: certified parameter intervals",
        (_sentence(estimate),),
        sections,
        identify_document(estimate, error_bound, validations),
        is_simulated([estimate.data.source, *(v.data.source for v in validations)]),
        settings or {},
        links or {},
    )


def data_report(
    path: str | PathLike[str],
    title: str,
    sentence: str,
    model: Model,
    data: Dataset | None = None,
    error_bound: ErrorBound | None = None,
    validations: Sequence[Validation] = (),
    settings: Mapping[str, str] | None = None,
    *,
    document: Document,
) -> Path:
    """Write the report of a noise bound or of validations alone; see :func:`smid.report`.

    Parameters
    ----------
    sentence
        The result in one sentence.
    document
        The result as plain data.

    Raises
    ------
    ValueError, OSError
        See :func:`check_report`.

    Examples
    --------
    >>> import tempfile
    >>> from smid.models import OutputError
    >>> path = Path(tempfile.mkdtemp()) / "validation.html"
    >>> data_report(path, "A first-order model", "No record was simulated yet.", OutputError(), document={}).name
    'validation.html'
    """
    sections = [*_least_bound(error_bound)]
    if validations:
        sections.append(Section("Validation on other records", tuple(run_blocks(validations))))
    sections.append(model_section(model))
    if data is not None:
        sections.append(data_section(data, drawn=True))
    if error_bound is not None:
        sections.append(_proof(None))
    sources = [v.data.source for v in validations] + ([] if data is None else [data.source])
    page = Page(title, (sentence,), tuple(sections), document, is_simulated(sources), settings or {})
    return write_page(page, path)


def empty_report(
    path: str | PathLike[str],
    proof: EmptyFeasibleSetError,
    model: Model,
    data: Dataset,
    error_bound: ErrorBound | None = None,
    settings: Mapping[str, str] | None = None,
) -> Path:
    """Write the report of a proof that no parameters explain the data; see :func:`data_report`."""
    title, document = "No parameters explain the data", empty_document(proof, error_bound)
    return data_report(path, title, str(proof), model, data, error_bound, settings=settings, document=document)


def _sentence(estimate: Estimate) -> str:
    if estimate.enclosure is None:
        return estimate.summary
    bounds = " and ".join(
        f"noise of {c} of at most {_no_larger(b)} {estimate.data.channel(c).unit}".rstrip()
        for c, b in estimate.noise_bound.items()
    )
    ranges = "; ".join(_range(i) for i in estimate.intervals)
    samples = estimate.data.n_samples
    return f"Proven: all parameters that explain the {samples} samples with {bounds} satisfy {ranges}."


def _no_larger(value: float) -> str:
    """Return a noise bound in print: never above the number, because the proof holds up to that number only."""
    text = f"{value:.6g}"
    return text if float(text) <= value else round_down(value, 6)


def _range(i: ParameterInterval) -> str:
    digits = shown_digits(i)
    return f"{i.name} in [{round_down(i.lower, digits)}, {round_up(i.upper, digits)}] {i.unit}".rstrip()


def _intervals(estimate: Estimate, truth: Mapping[str, float] | None) -> Iterator[Block]:
    from smid.identification.figures import intervals_figure  # needs matplotlib

    yield Picture(
        intervals_figure(estimate, truth),
        "All rows have one scale, in percent of the centre. Printed bounds are rounded outwards.",
        "Certified and witnessed interval and centre of each parameter",
    )
    header = (
        *("parameter", "certified lower", "certified upper", "witnessed lower", "witnessed upper"),
        *("width %", "gap", "centre"),
        *(("true value",) if truth else ()),
        "set by",
    )
    yield Table(
        "Certified: no parameter outside fits the data. Witnessed: verified parameters attain these values. Gap: the "
        "undecided part between certified and witnessed bounds.",
        header,
        tuple(_interval_row(i, truth) for i in estimate.intervals),
        "l" + "r" * (len(header) - 2) + "l",
    )
    derived = f" The model has no box for {', '.join(estimate.derived)}; a box was proven from the data."
    yield estimate.centre_text + (derived if estimate.derived else "")
    if estimate.nearest:
        nearest = ", ".join(f"{name} = {value:.8g}" for name, value in estimate.nearest.items())
        yield f"Parameters of the central model: {nearest}."


def _interval_row(i: ParameterInterval, truth: Mapping[str, float] | None) -> tuple[str, ...]:
    digits = shown_digits(i)
    lower, upper = (("data" if p is Proof.PROVEN else "prior box") for p in (i.proof_lower, i.proof_upper))
    ends = lower if lower == upper else f"lower: {lower}, upper: {upper}"
    return (
        parameter(i.name, i.unit),
        round_down(i.lower, digits),
        round_up(i.upper, digits),
        # Rounded inwards: a printed bound must not exceed the value of its witness.
        round_up(i.inner_lower, digits) if np.isfinite(i.inner_lower) else "none found",
        round_down(i.inner_upper, digits) if np.isfinite(i.inner_upper) else "none found",
        figure(i.width_percent),
        f"{i.gap:.1e}" if np.isfinite(i.gap) else "unknown",
        f"{i.centre:.{digits}g}" if np.isfinite(i.centre) else "none",
        *((_true_value(i, truth),) if truth else ()),
        coloured(ends, "bad") if "prior box" in (lower, upper) else ends,
    )


def _true_value(i: ParameterInterval, truth: Mapping[str, float]) -> str:
    if i.name not in truth:
        return "unknown"
    inside = i.lower <= truth[i.name] <= i.upper
    return joined(f"{truth[i.name]:g} ", coloured("inside", "good") if inside else coloured("outside", "bad"))


def _least_bound(bound: ErrorBound | None) -> Iterator[Section]:
    if bound is None:
        return
    ends = f"[{round_down(bound.lower, 6)}, {round_up(bound.upper, 6)}] {bound.unit}".rstrip()
    yield Section(
        "Least noise bound",
        (
            f"The least noise bound of {bound.channel} with which the model explains the data lies in {ends}. With a "
            "noise bound below the lower value, no parameters explain the data (certified). With the upper value, some "
            "parameters explain the data (witnessed).",
            *(f"Noise bound of {channel}: {given:.6g}." for channel, given in bound.fixed.items()),
            Remark(
                "With the least noise bound, the feasible set is a single point for any data. So the intervals are "
                "computed with a larger noise bound."
            ),
        ),
    )


def _own_run(estimate: Estimate) -> Iterator[Block]:
    if estimate.unbounded:
        yield "There is no central model to simulate."
        return
    try:
        run = validate(estimate.model, estimate.data, estimate.noise_bound)
    except ModelError as error:
        # The central model may be unstable; the report must still be written.
        yield f"The central model cannot be simulated: {error}."
        return
    noisy = [m.channel for m in estimate.model.measurements if m.noise and m.signal in estimate.model.inputs]
    also = f" and is driven by {' and '.join(noisy)} as measured" if noisy else ""
    many = "many" if noisy else "a few"
    yield _scores(
        [run],
        "The central model over the data of the identification. The run starts from the first measured outputs"
        f"{also}, noise included. So {many} errors may exceed the noise bound although the model is consistent with "
        "the data.",
    )
    for number in range(len(run.scores)):
        yield _simulation(run, number)


def run_blocks(validations: Sequence[Validation]) -> Iterator[Block]:
    """Yield the scores of free runs, and a figure of each."""
    if not validations:
        yield "No other record was given, so this report does not show how well the model predicts."
        return
    yield _scores(
        validations,
        "Free runs of the central model. The measured output gives the first samples only; these are not scored.",
    )
    for run in validations:
        for number, score in enumerate(run.scores):
            yield Heading(score.experiment)
            yield _simulation(run, number)


def _scores(runs: Sequence[Validation], caption: str) -> Table:
    header = ("record", "output", "samples", "RMSE", "fit [%]", "largest error", "outside noise bound")
    return Table(caption, header, tuple(_score_row(score) for run in runs for score in run.scores), "llrrrrr")


def _score_row(s: Score) -> tuple[str, ...]:
    return (
        s.experiment,
        s.channel,
        str(s.samples),
        f"{s.rmse:.4g} {s.unit}".rstrip(),
        f"{s.fit_percent:.2f}",
        f"{s.largest:.4g} {s.unit}".rstrip(),
        "no bound given" if s.violations is None else f"{s.violations} ({100 * s.violations / s.samples:.1f} %)",
    )


def _simulation(run: Validation, number: int) -> Picture:
    from smid.validation.figures import simulation_figure  # needs matplotlib

    score = run.scores[number]
    bound = (
        ""
        if score.noise_bound is None
        else f"; band and dashed lines: noise bound of {score.noise_bound:.6g} {score.unit}".rstrip()
    )
    # With several experiments, the source of the data names them all: take the name of this one.
    record = score.experiment if len(run.data.experiments) > 1 else run.data.source or score.experiment
    return Picture(
        simulation_figure(run, number),
        f"{record}: {score.channel} measured (points), free run from the first samples (line){bound}. Bottom: error.",
        f"Measured {score.channel} and free run over time, with the error below: {score.experiment}",
    )


def noise_bounds(estimate: Estimate) -> str:
    """Return the sentence on the noise bounds."""
    bounds = (f"{b:.8g} {estimate.data.channel(c).unit}".rstrip() + f" on {c}" for c, b in estimate.noise_bound.items())
    return f"Noise bounds: {', '.join(bounds)}."


def model_section(model: Model, noise_bounds: str = "") -> Section:
    """Return the section on a model: its lines, its noise bounds and its priors."""
    name = f"{capitalised(model.name)}: {model.description}" if model.description else capitalised(model.name)
    return Section(
        "Model",
        (
            f"{name}. The subscript t is the sample number.",
            equations(model),
            *((noise_bounds,) if noise_bounds else ()),
            Heading("Prior knowledge"),
            priors(model),
        ),
    )


def _proof(estimate: Estimate | None) -> Section:
    return Section(
        "What is proven, and how",
        (
            *(() if estimate is None else (_work(estimate),)),
            Heading("Certificate"),
            _CERTIFICATE,
            Heading("Witness"),
            _WITNESS,
            Heading("Not proven"),
            Items(_NOT_PROVEN),
        ),
    )


def _work(estimate: Estimate) -> Block:
    e = estimate.enclosure
    if e is None:
        return f"{estimate.summary} Nothing else is proven."
    size = f"{e.n_moments} moments, largest block {e.largest_block}"
    rounds = f" in {e.rounds} rounds" if e.rounds else ""
    return Facts(
        (
            ("method", e.how),
            ("complicating variables", ", ".join(e.complicating) or "none"),
            *((("proven on", estimate.proven_part),) if estimate.windows else ()),
            *((("size", size),) if e.n_moments else ()),
            ("work", f"{e.work}{rounds}, {e.seconds:.3g} s"),
            ("stopped because", e.reason.value),
        )
    )
