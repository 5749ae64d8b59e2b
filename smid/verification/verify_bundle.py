"""Verify a bundle: that each of its certificates is about the model on the samples of its part.

The outputs of spoilt stretches are left out, as the checker assumes of all later parts: a polynomial that reads one of
them is not the model's. Inputs are read anywhere, because outliers are samples of outputs.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from relaxations.check import bundle
from relaxations.check.read import document
from relaxations.check.runs.read import document as document_of_run
from relaxations.check.runs.read import is_run
from smid.data import Dataset
from smid.data.window import Window, cut_all, part_of
from smid.verification.implied import NotProvenError, check_implied, prior_of
from smid.verification.origin import exact_samples
from smid.verification.verify_run import check_statement

_NOT_RESTATED = ("name", "parameters")  # the checker compares the boxes of parameters
Model = Mapping[str, Any]


def check_bundle(found: bundle.Document, origin: Mapping[str, Any], data: Dataset) -> int:
    """Return the number of equations in all certificates; NotProvenError names what is not of the model or the data."""
    model = origin["model"]
    outputs = {m["channel"] for m in model["measurements"] if m["signal"] in model["lines"]}
    if found.outliers < origin["outliers"] * len(outputs):
        raise NotProvenError(
            f"the proof allows {found.outliers} outliers, not {origin['outliers']} in each of {len(outputs)} outputs"
        )
    if found.box != {name: prior_of(ends) for name, ends in model["parameters"].items()}:
        raise NotProvenError("the boxes of the parameters in the proof are not those of the model")
    equations = 0
    for part, content, samples in _about(found, outputs, data):
        try:
            equations += _check(content, origin, samples)
        except NotProvenError as error:
            raise NotProvenError(f"{part}: {error}") from None
    return equations


def _about(found: bundle.Document, outputs: set[str], data: Dataset) -> Iterator[tuple[str, Any, Dataset]]:
    """Yield every certificate with its place in the file and the samples that it may read."""
    spoilt: list[Window] = []
    for number, one in enumerate(found.rounds, start=1):
        for kind, parts in (("part", one.parts), ("stretch", one.spoilt)):
            for k, part in enumerate(parts, start=1):
                windows = [Window(w.experiment, w.first, w.last) for w in part.windows]
                own = part_of(_without(data, spoilt, outputs), _inside(windows, data))
                for n, content in enumerate(part.certificates, start=1):
                    yield f"round {number}, {kind} {k}, certificate {n}", content, own
        spoilt += [Window(w.experiment, w.first, w.last) for part in one.spoilt for w in part.windows]


def _check(content: Any, origin: Mapping[str, Any], samples: Dataset) -> int:
    """Return the number of equations in a certificate, which are those of the model on some samples."""
    model, bounds = origin["model"], origin["noise_bounds"]
    if is_run(content):
        run = document_of_run(content)
        stated = run.content["model"]
        names = {*stated, *model} - {*_NOT_RESTATED}
        if any(stated.get(name) != model.get(name) for name in names) or run.content["noise_bounds"] != bounds:
            raise NotProvenError("the certificate is about another model or other noise bounds")
        return check_statement(run, samples)
    polynomials = document(content)
    within = [Window.from_dict(told) for told in (polynomials.origin or {}).get("windows", ())]
    if within:
        samples = cut_all(samples, _inside(within, samples))
    boxes = dict(zip(polynomials.stated.names, content["box"], strict=True))
    # The checker compares the boxes of the parameters with what was proven before.
    own = {**model, "parameters": {name: boxes.get(name, ends) for name, ends in model["parameters"].items()}}
    return check_implied(polynomials, own, exact_samples(samples, origin["data"]["sample_digests"]), bounds)


def _inside(windows: Sequence[Window], data: Dataset) -> Sequence[Window]:
    for w in windows:
        if not (
            0 <= w.experiment < len(data.experiments)
            and 0 <= w.first <= w.last < data.experiments[w.experiment].n_samples
        ):
            raise NotProvenError(f"the proof is about samples {w.first} to {w.last}, which the data lack")
    return windows


def _without(data: Dataset, spoilt: Sequence[Window], outputs: set[str]) -> Dataset:
    """Return the record without the outputs of some stretches."""
    runs = []
    for e, run in enumerate(data.experiments):
        gone = np.zeros(run.n_samples, bool)
        for w in spoilt:
            gone[w.first : w.last + 1] |= w.experiment == e
        own = {c: np.where(gone, np.nan, v) if c in outputs else v for c, v in run.values.items()}
        runs.append(replace(run, values=own))
    return data.with_experiments(runs)
