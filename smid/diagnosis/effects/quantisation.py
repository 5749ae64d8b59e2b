"""The recorded output is rounded to whole steps q.

Rounding adds an error of RMS q / sqrt(12). The step is read off the data
(`smid.diagnosis.evidence.faults.quantisation_step`); it is a cause where rounding is most of the
residual. No model can lower the RMSE then; the noise bound must be at least half a step.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from smid.diagnosis.effects.effect import Detection, Effect, Site, on_the_noise
from smid.diagnosis.evidence.faults import quantisation_step
from smid.models import Model

_LEAST_SHARE = 0.35  # of the residual's variance; a step of 3 noise RMS gives 0.43


def _detect(model: Model, site: Site) -> Detection | None:
    step = quantisation_step(site.values(site.output))
    residual = np.concatenate(site.residual)
    variance = float(np.mean(residual**2))
    if step is None or variance == 0:
        return None
    share = step**2 / 12 / variance
    if share < _LEAST_SHARE:
        return None
    return Detection(model, {"step": step}, float(min(1.0, share)), {"share_of_residual_variance": share})


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say how large the steps are."""
    step = f"{values['step']:.4g} {site.unit(site.output)}".rstrip()
    return f"The recorded {site.output} is rounded to steps of {step}."


EFFECT = Effect(
    "quantisation",
    "the recorded output is rounded",
    on_the_noise,
    describe,
    needs="an output that takes equidistant values",
    detect=_detect,
)
