"""The printed report of a run certificate: the model and the record that the file states, then what is proven."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

from relaxations.check.forms import shown_name
from relaxations.check.report import above, counted, entries, interval
from relaxations.check.runs.read import Claim, Document
from relaxations.check.statement import shown

MOST_LINES = 20  # of parameters, and of experiments
_STATED = ("model", "noise_bounds", "first", "initial")


def report(found: Document, claim: Claim | None) -> Iterator[str]:
    """Yield the printed lines for an accepted file."""
    stated, content = found.stated, found.content
    runs = [f"{shown_name(name)} ({counted(count, 'sample')})" for name, count in stated.experiments.items()]
    yield "accepted: " + ", ".join([counted(len(stated.parameters), "parameter"), *runs[:MOST_LINES]])
    if "origin" in content:
        yield "origin, as this file states it (smid verify compares it with a model and with data):"
        yield from (f"  {line}" for line in entries(content["origin"], ""))
    else:
        yield "origin: not stated, so the proof is about the model and the samples in this file"
    yield "stated:"
    yield from (f"  {line}" for line in entries({key: content[key] for key in _STATED}, ""))
    yield "proven:"
    if claim is None:
        yield "  no parameters in the stated boxes explain the samples"
        return
    for name, (low, high) in list(claim.items())[:MOST_LINES]:
        ends = f"{shown(low)} to {above(high) if isinstance(high, Fraction) else 'no bound'}"
        yield f"  {shown_name(name)} in {interval(found.priors[name])}: {ends}"
    if len(claim) > MOST_LINES:
        yield f"  ... and {counted(len(claim) - MOST_LINES, 'further parameter')}"
