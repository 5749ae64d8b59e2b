"""Glitches that a residual shows: samples to leave out of every fit.

A limit that is reached briefly looks like one until it is in the model, so they are looked for before and after the
search.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from smid.diagnosis.effects.effect import Detection, Effect, Site
from smid.diagnosis.search.guarded import Failure, guarded
from smid.diagnosis.search.record import Record
from smid.fitting.problem import Fit
from smid.models import Model

__all__ = ["Glitches", "adds_none", "glitches_in", "glitches_of", "without_glitches"]

Glitches = tuple[Effect, Detection]
"""The effect that marks glitches, and what it found."""


def glitches_of(record: Record, fitted: Fit, effects: Sequence[Effect]) -> Glitches | None:
    """Return the glitches that a fit shows; None where there are none, or no effect detects them."""
    # Samples that do not count may be the glitches.
    site = Site(record.data, record.input, record.output, record.residual(fitted))
    found = glitches_in(site, fitted.model, effects)
    return None if isinstance(found, Failure) else found


def glitches_in(site: Site, model: Model, effects: Sequence[Effect]) -> Glitches | Failure | None:
    """Return the glitches in the residual of a site, or why the effect that detects them failed."""
    effect = next((e for e in effects if e.marks_glitches), None)
    if effect is None or effect.detect is None or not all(np.isfinite(r).all() for r in site.residual):
        return None
    detection = guarded(effect.name, effect.detect, model, site)
    if isinstance(detection, Failure):
        return detection
    return None if detection is None or detection.glitches is None else (effect, detection)


def without_glitches(record: Record, glitches: Glitches | None) -> Record:
    """Return the record without glitches among the samples that count."""
    masks = glitches[1].glitches if glitches else None
    if masks is None:
        return record
    return replace(record, used=tuple(u & ~g for u, g in zip(record.used, masks, strict=True)))


def adds_none(found: Glitches, before: Glitches | None) -> bool:
    """Return whether all glitches were known before."""
    new, old = found[1].glitches, before[1].glitches if before else None
    return new is None or (old is not None and not any((n & ~o).any() for n, o in zip(new, old, strict=True)))
