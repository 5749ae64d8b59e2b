"""Dead time: the input acts d samples later, whole or fractional.

One continuous parameter: ``u[t] + sum_k clip(d - k) (u[t-k-1] - u[t-k])``, with ``clip(x)`` = x within [0, 1], is
sample d, or interpolates linearly between two. In this form an interval of d keeps an input within its own values,
which proofs need. It acts behind a static curve of the input, for a held input is half a sample late when the curve of
it is.
Reference: Laakso et al., IEEE Signal Processing Magazine 13 (1996) 30-60, first-order interpolation.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
import sympy

from smid.diagnosis.effects.effect import Effect, Extension, Site
from smid.diagnosis.effects.parts.extremes import larger, smaller
from smid.diagnosis.effects.parts.naming import find, free_name, fresh, quantity
from smid.diagnosis.effects.parts.plant import static_end
from smid.models import Model, signal, t

__all__ = ["EFFECT"]

_USUAL, _LONGEST = 12, 30


def extend(model: Model, site: Site) -> Iterator[Extension]:
    """Put it before the input."""
    shortest = min(run.n_samples for run in site.data.experiments)
    likely = _likely(site)
    longest = min(max(_USUAL, likely + 4), _LONGEST, shortest // 4)
    if longest < 1:
        return
    delay = fresh(model, "delay_samples", (0, longest), "samples", 0.0)

    def late(u: sympy.Expr) -> sympy.Expr:
        past = signal(str(u.base.label))
        clips = (larger(0, smaller(1, delay.symbol - k)) for k in range(longest))
        return sum((clip * (past[t - k - 1] - past[t - k]) for k, clip in enumerate(clips)), past[t])

    starts = [d for d in (1.0, 2.0, 3.0, 5.0, 8.0, 0.5, float(likely)) if 0 < d <= longest]
    bent = static_end(model, site.input)
    yield Extension(
        model.insert_before(bent, late, [delay], new_name=free_name(model, f"{bent}_delayed")),
        tuple({delay.name: d} for d in dict.fromkeys(starts)),
    )


def _likely(site: Site) -> int:
    """Return the lag of the largest correlation between the steps of the input and the residual."""
    best, lag = 0.0, 0
    for run, residual in zip(site.data.experiments, site.residual, strict=False):
        steps = np.diff(run.values[site.input])
        rest = residual[1:] - residual.mean()
        for k in range(min(_LONGEST, len(steps) // 4) + 1):
            correlation = abs(float(np.dot(steps[: len(steps) - k], rest[k:])))
            if correlation > best:
                best, lag = correlation, k
    return lag


def describe(values: Mapping[str, float], site: Site) -> str:
    """Say how much later, in seconds and samples."""
    delay = find(values, "delay_samples") or 0.0
    return f"{site.input} acts {quantity(delay * site.sampling_time, 's')} ({delay:.3g} samples) later."


EFFECT = Effect(
    "input_delay",
    "the input acts later",
    extend,
    describe,
    needs="at least four samples",
)
