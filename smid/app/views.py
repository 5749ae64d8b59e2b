"""What a step has found, as parts of the page: the tables, sentences and figures of the reports."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from relaxations.search.enclosure import Reason
from relaxations.writing import write_text
from smid.app.model_forms import own_model_text
from smid.data import Dataset
from smid.data.overview import Overview
from smid.diagnosis.diagnosis import Diagnosis
from smid.diagnosis.evidence.faults import sample_faults
from smid.fitting.binding import bind_whole
from smid.identification.error_bound import ErrorBound
from smid.identification.estimate import Estimate
from smid.identification.identify import EmptyFeasibleSetError
from smid.models import Model
from smid.reports.content import Block, Facts, Folded, Items, Page, Picture, Section
from smid.reports.diagnosis_page import diagnosis_page
from smid.reports.documents import as_text, empty_document
from smid.reports.estimate_page import empty_report, estimate_page, run_blocks
from smid.reports.html import as_fragment
from smid.reports.page import capitalised, data_section, equations, priors
from smid.reports.residuals_page import residuals_page

__all__ = ["Answer", "answer", "empty_answer"]

ABOVE_LEAST = 1.2
"""The offered noise bound, in least noise bounds: next to the least one the intervals are narrow for any data."""


@dataclass(frozen=True)
class Answer:
    """What the page shows of a step, and what the forms of the next steps need.

    Parameters
    ----------
    html
        The result.
    channels
        Name, and what it is in words, of each channel of the record.
    noisy
        Name and unit of each noisy channel of the model.
    values
        Field of a form -> value to offer.
    """

    html: str
    channels: list[tuple[str, str]] = field(default_factory=list)
    noisy: list[tuple[str, str]] = field(default_factory=list)
    values: dict[str, str] = field(default_factory=dict)


def answer(step: str, names: Mapping[str, Any]) -> Answer:
    """Return the answer of a step from the names that its code defined."""
    return _ANSWER[step](names)


def empty_answer(proof: EmptyFeasibleSetError, names: Mapping[str, Any]) -> Answer:
    """Return the answer of a step that proved that no parameters fit, and write its report and its JSON."""
    empty_report("intervals.html", proof, names["model"], names["train"], names.get("least"))
    write_text("intervals.json", as_text(empty_document(proof, names.get("least"))))
    advice = "The steps 5 and 6 work without intervals: they fit the model by least squares, and search for the cause."
    return _shown("intervals", [capitalised(str(proof)) + ".", advice])


def _data(names: Mapping[str, Any]) -> Answer:
    found: Overview = names["overview"]
    picture = Picture(found.plot(), "The samples; a line ends where samples are missing.", "The samples over time")
    ranges = [(one.channel, f"{one.channel} [{one.unit}]" if one.unit else one.channel) for one in found.channels]
    half = min(found.samples // 2, 200)
    parts = {"train_start": "0", "train_stop": str(half), "test_start": str(half), "test_stop": ""}
    return _shown("data", [found.table, Items(found.notes), picture], channels=ranges, values=parts)


def _channels(names: Mapping[str, Any]) -> Answer:
    record: Dataset = names["record"]
    warnings = [fault.sentence for fault in sample_faults(record) if fault.severity == "warning"]
    blocks = [*([Items(tuple(warnings))] if warnings else []), *data_section(record, drawn=True).blocks]
    parts = f"{names['train'].n_samples} samples to estimate from, {names['test'].n_samples} samples to test on."
    text = own_model_text(record.inputs, record.outputs)
    return _shown("channels", [parts, *blocks], values={"toml": text})


def _model(names: Mapping[str, Any]) -> Answer:
    record: Dataset = names["record"]
    model: Model = bind_whole(names["model"], record)
    noisy = [m.channel for m in model.measurements if m.noise is not None]
    blocks: list[Block] = [
        f"{capitalised(model.name)}. The subscript t is the sample number.",
        equations(model),
        priors(model),
    ]
    return _shown("model", blocks, noisy=[(name, record.channel(name).unit) for name in noisy])


def _least(names: Mapping[str, Any]) -> Answer:
    least: ErrorBound = names["least"]
    blocks = [f"{capitalised(str(least))}."]
    if not math.isfinite(least.upper):
        return _shown("least", blocks)
    offered = ABOVE_LEAST * least.upper
    text = f"{offered:.3g}" if float(f"{offered:.3g}") > least.upper else repr(offered)
    blocks.append(
        f"{ABOVE_LEAST:g} times the least noise bound, {text} {least.unit}".rstrip()
        + ", is now in the field above. At the least noise bound itself the intervals shrink to a point for any data. "
        "Prefer the bound of your sensor, if you know it."
    )
    return _shown("least", blocks, values={f"bound:{least.channel}": text})


def _intervals(names: Mapping[str, Any]) -> Answer:
    estimate: Estimate = names["estimate"]
    ended = () if estimate.reason is Reason.TIGHT else (f"Why the work ended: {estimate.reason.value}.",)
    return _shown("intervals", [*ended, *_of_page(estimate_page(estimate, names.get("least")))])


def _misfit(names: Mapping[str, Any]) -> Answer:
    blocks: list[Block] = []
    if "estimate" not in names and "fitted" in names:
        values = tuple((name, f"{value:.6g}") for name, value in names["fitted"].model.values.items())
        blocks += [
            "There are no intervals: the model was fitted to the estimation part by least squares.",
            Facts(values),
        ]
    if "run" in names:
        blocks += run_blocks([names["run"]])
    if "tested" in names:
        page = residuals_page(names["tested"])
        blocks += [*page.result, *page.sections[0].blocks, *page.sections[1].blocks, _folded(page.sections[2])]
    return _shown("misfit", blocks)


def _cause(names: Mapping[str, Any]) -> Answer:
    diagnosis: Diagnosis = names["diagnosis"]
    extended = Path("extended.toml")
    values = {"extended": extended.read_text("utf-8")} if diagnosis.causes and extended.exists() else {}
    return _shown("cause", list(_of_page(diagnosis_page(diagnosis))), values=values)


_ANSWER: Mapping[str, Callable[[Mapping[str, Any]], Answer]] = {
    "data": _data,
    "channels": _channels,
    "model": _model,
    "least": _least,
    "intervals": _intervals,
    "misfit": _misfit,
    "cause": _cause,
}


def _of_page(page: Page) -> Iterator[Block]:
    """Yield the result of a report and its first section, and the other sections behind their titles."""
    yield from page.result
    yield from page.lead
    yield from page.sections[0].blocks
    yield from map(_folded, page.sections[1:])


def _folded(section: Section) -> Folded:
    return Folded(section.title, section.blocks)


def _shown(step: str, blocks: Sequence[Block], **more: Any) -> Answer:
    return Answer(as_fragment(blocks, step), **more)
