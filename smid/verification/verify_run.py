"""Check that a run certificate is about a model and data: what it states is compared with them, part by part.

A run certificate states the model's lines as text and the samples themselves, so there are no equations to derive.
"""

from __future__ import annotations

from typing import Any

from relaxations.check.forms import shown_name
from relaxations.check.runs.read import Document
from smid.data import Dataset
from smid.models import Model
from smid.models.discretise import read_by
from smid.models.distribute import as_inverted
from smid.models.expressions import from_text
from smid.models.parts import Line
from smid.models.running import at_sampling_time
from smid.models.structure import causal_order, first_samples, is_clock
from smid.models.symbols import signal, t
from smid.verification.implied import NotProvenError
from smid.verification.origin import plain_statement, samples_as_text


def statement_of(model: Model, data: Dataset) -> dict[str, Any]:
    """Return a model (bound to the data) as a run certificate states it."""
    return plain_statement(as_inverted(at_sampling_time(model, data.sampling_time)))


def check_statement(found: Document, data: Dataset) -> int:
    """Return the number of equations in the certificate; NotProvenError names what is not of the model or the data."""
    content = found.content
    model = content["model"]
    rates = (read_by(name, from_text(text)) for name, text in model.get("rates", {}).items())
    plain = (Line(signal(name)[t], from_text(text)) for name, text in model["lines"].items())
    lines = causal_order((*rates, *plain))
    # The samples.
    channels = [m["channel"] for m in model["measurements"]]
    for stated, run in zip(content["experiments"], data.experiments, strict=True):
        for name, samples in stated["channels"].items():
            if samples != samples_as_text(run.values[name]):
                raise NotProvenError(f"the samples of {shown_name(name)} in the proof are not those of the data")
        missing = [name for name in channels if name not in stated["channels"]]
        if missing:
            raise NotProvenError(f"the proof has no samples of {shown_name(missing[0])}")
    # Where each line begins, and what is known before.
    first = first_samples(lines)
    for name, begins in content["first"].items():
        if begins != first[name]:
            raise NotProvenError(
                f"the line of {shown_name(name)} holds from sample {first[name]} on, not from {begins} as in the proof"
            )
    clocks = {line.signal for line in lines if is_clock(line)}
    for _, name, sample, *ends in content["initial"]:
        if name not in clocks or ends != [0, 0]:
            raise NotProvenError(f"the proof states {shown_name(name)} at sample {sample}, of which nothing is known")
    return sum(run.n_samples - begins for run in data.experiments for begins in first.values())


def origin_of_run(found: Document) -> dict[str, Any] | None:
    """Return the origin of a run certificate, with what the file itself states of model and noise bounds."""
    origin = found.content.get("origin")
    stated = {key: found.content[key] for key in ("model", "noise_bounds")}
    return {**origin, **stated} if isinstance(origin, dict) else None
