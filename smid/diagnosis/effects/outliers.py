"""Glitches: a few wrong samples of the output.

They are found in the residual, where a step of the input makes no jump (`smid.diagnosis.evidence.faults.outlier_mask`),
and left out of every fit.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from smid.diagnosis.effects.effect import Detection, Effect, Site, on_the_noise
from smid.diagnosis.evidence.faults import outlier_mask
from smid.models import Model

_MOST = 0.1  # share of the samples; more are no glitches


def _detect(model: Model, site: Site) -> Detection | None:
    masks = tuple(outlier_mask(r) for r in site.residual)
    count = sum(int(m.sum()) for m in masks)
    total = sum(len(m) for m in masks)
    if not 0 < count <= _MOST * total:
        return None
    sizes = np.concatenate([np.abs(r[m]) for r, m in zip(site.residual, masks, strict=True)])
    rest = np.concatenate([r[~m] for r, m in zip(site.residual, masks, strict=True)])
    size = float(np.median(sizes))
    return Detection(
        model,
        {"count": float(count), "share": count / total, "size": size},
        0.99,
        {"size_over_rest": size / (float(np.std(rest)) or 1.0)},
        glitches=masks,
    )


def _sentence(values: Mapping[str, float], site: Site) -> str:
    size = f"{values['size']:.3g} {site.unit(site.output)}".rstrip()
    if values["count"] == 1:
        return f"One sample of {site.output} is a glitch of {size}."
    return f"{values['count']:.0f} samples of {site.output} ({values['share']:.1%}) are glitches of about {size}."


EFFECT = Effect(
    "outliers",
    "a few recorded samples are glitches",
    on_the_noise,
    _sentence,
    detect=_detect,
    marks_glitches=True,
)
