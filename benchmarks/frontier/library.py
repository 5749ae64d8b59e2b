"""The extensions of the effect library on the demo's own model: what inversion of the free run decides of each.

The record is the demo's record of steps, whose pole varies. An extension is excluded, or a verified point fits, on the
100 samples where the base model errs most.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np

from smid.cli.demo import NOISE_BOUND, STEPS
from smid.data.bundled import load_clutch
from smid.diagnosis.effects import EFFECTS, Site
from smid.diagnosis.proof.decide import Decision, decide
from smid.diagnosis.proof.window import windows
from smid.fitting.binding import bind
from smid.fitting.fit import fit
from smid.models import Hammerstein, Model

SAMPLES, SECONDS = 100, 60.0


def cases() -> Iterator[tuple[str, Model]]:
    """Yield the name and the model of each extension."""
    data = load_clutch(STEPS)
    base = bind(Hammerstein(poles=1, powers=(5, 4, 3), input_scale=0.01, unit_dc_gain=True, stable=True), data)
    begun = fit(base, data)
    (output,) = base.output_channels
    site = Site(data, base.input_channels[0], output, begun.residual(data, output))
    for effect in EFFECTS:
        for extension in effect.extensions(begun.model, site):
            values = {**begun.model.values, **(extension.starts[0] if extension.starts else {})}
            inside = {p.name for p in extension.model.parameters}
            yield (
                f"{effect.name} {extension.label}".strip(),
                extension.model.with_values({k: v for k, v in values.items() if k in inside}),
            )


def decided() -> Iterator[tuple[str, Decision]]:
    """Yield what is decided of each extension."""
    data = load_clutch(STEPS)
    base = bind(Hammerstein(poles=1, powers=(5, 4, 3), input_scale=0.01, unit_dc_gain=True, stable=True), data)
    begun = fit(base, data)
    (output,) = base.output_channels
    window = next(windows(begun.residual(data, output), (SAMPLES,)))
    for name, model in cases():
        yield name, decide(model, data, window, {output: NOISE_BOUND}, SECONDS)
