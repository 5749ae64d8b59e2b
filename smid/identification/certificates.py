"""Write what enclosers prove as one file: a certificate, or a bundle of several."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from relaxations.check import bundle
from relaxations.check.runs.read import is_run
from relaxations.proof.certificate_file import write_content
from smid.data import Dataset
from smid.data.window import Window, cut_all, whole
from smid.models import Model
from smid.verification.origin import origin_of, source_of
from smid.verification.verify_run import statement_of

Content = dict[str, Any]


@dataclass(frozen=True)
class ProvenPart:
    """Windows of the record, and the certificates about their samples."""

    windows: Sequence[Window]
    certificates: Sequence[Content]

    def content(self) -> Content:
        """Return the part as a bundle states it."""
        return {
            "windows": [[w.experiment, w.first, w.last] for w in self.windows],
            "certificates": list(self.certificates),
        }


@dataclass(frozen=True)
class Round:
    """Parts of which one has no outlier, and stretches of which each has one."""

    parts: Sequence[ProvenPart]
    spoilt: Sequence[ProvenPart] = ()


def bundle_of(model: Model, outliers: int, rounds: Sequence[Round]) -> Content:
    """Return the content of a bundle (:mod:`relaxations.check.bundle`) about the parameters of a model."""
    return {
        "format": bundle.FORMAT,
        "version": bundle.VERSION,
        "variables": [p.name for p in model.parameters],
        "box": [[_end(p.lower), _end(p.upper)] for p in model.parameters],
        "outliers": outliers,
        "rounds": [
            {"parts": [p.content() for p in one.parts], "spoilt": [p.content() for p in one.spoilt]} for one in rounds
        ],
    }


def write_certificates(
    path: str | Path,
    contents: Sequence[Content],
    model: Model,
    data: Dataset,
    bounds: Mapping[str, float],
    windows: Sequence[Window],
    outliers: int,
) -> None:
    """Write certificates that hold together, with their origin; several become a bundle.

    Parameters
    ----------
    windows
        What they are about of the record, unless they say so themselves; all where there are none.
    outliers
        At most so many of each output.
    """
    first, *others = contents
    if is_run(first) and not others:  # it states model and noise bounds itself
        origin = source_of(cut_all(data, windows) if windows else data, model.channels)
        origin |= {"windows": [window.to_dict() for window in windows]} if windows else {}
    elif bundle.is_bundle(first) or others:
        if others:
            first = bundle_of(model, 0, [Round([ProvenPart(whole(data), contents)])])
        origin = origin_of(model, data, bounds, windows) | {"outliers": outliers}
        if any(map(is_run, bundle.certificates(first))):
            origin["model"] = statement_of(model, data)
    else:
        own = [Window.from_dict(told) for told in first.get("origin", {}).get("windows", ())]
        origin = origin_of(model, data, bounds, own or windows)
    write_content(path, {**first, "origin": origin})


def _end(value: float) -> str | None:
    return float(value).hex() if np.isfinite(value) else None
