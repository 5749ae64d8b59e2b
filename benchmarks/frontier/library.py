"""The extensions of the effect library on the demo's own model: what inversion of the free run decides of each.

The record is the demo's record of steps, whose pole varies. An extension is excluded, or a verified point fits, on the
100 samples where the base model errs most. Each decision is kept at once (:mod:`benchmarks.resumable`); what is
undecided is tried again where more time is allowed. Delete the cache when the proofs have changed.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from benchmarks.processor_time import in_processor_time
from benchmarks.resumable import kept
from benchmarks.resumable import run as kept_run
from smid.cli.demo import NOISE_BOUND, STEPS
from smid.data import Dataset
from smid.data.bundled import load_clutch
from smid.data.window import Window
from smid.diagnosis.effects import EFFECTS, Site
from smid.diagnosis.proof.decide import decide
from smid.diagnosis.proof.posed import ASSUMED
from smid.diagnosis.proof.window import windows
from smid.fitting.binding import bind
from smid.fitting.fit import fit
from smid.models import Hammerstein, Model

SAMPLES, SECONDS = 100, 60.0
CACHE = Path(".cache/library.jsonl")


@dataclass(frozen=True)
class Extended:
    """What is decided of an extension, within so many seconds allowed."""

    name: str
    status: str
    ground: str
    seconds: float
    allowed: float


@lru_cache
def cases() -> tuple[Dataset, Window, str, dict[str, Model]]:
    """Return the record, the window, the output, and the models by name, each with a first start of its fit."""
    data = load_clutch(STEPS)
    model = Hammerstein(poles=1, powers=(5, 4, 3), input_scale=0.01, unit_dc_gain=True, stable=True)
    base = fit(bind(model, data), data)
    (output,) = base.model.output_channels
    residual = base.residual(data, output)
    site = Site(data, base.model.input_channels[0], output, residual)
    models: dict[str, Model] = {}
    for effect in EFFECTS:
        for extension in effect.extensions(base.model, site):
            start = {**base.model.values, **next(iter(extension.starts), {})}
            known = {p.name: start[p.name] for p in extension.model.parameters if p.name in start}
            models[f"{effect.name} {extension.label}".strip()] = extension.model.with_values(known)
    return data, next(windows(residual, (SAMPLES,))), output, models


def decided(name: str, seconds: float) -> Extended:
    """Decide an extension within some seconds of processor time."""
    data, window, output, models = cases()
    with in_processor_time():
        found = decide(models[name], data, window, {output: NOISE_BOUND}, seconds)
    return Extended(name, str(found.status), found.ground, found.seconds, seconds)


def run(seconds: float = SECONDS) -> str:
    """Return the table as Markdown."""
    known = {entry["name"]: Extended(**entry) for entry in kept(CACHE)}
    names = list(cases()[3])
    less = {one.name for one in known.values() if one.status == "undecided" and one.allowed < seconds}
    missing = [name for name in names if name not in known or name in less]
    for one in kept_run(CACHE, decided, [(name, seconds) for name in missing], 1):
        known[one.name] = one
        print(one, flush=True)
    return section([known[name] for name in names if name in known])


def section(found: list[Extended]) -> str:
    """Return the section of some decisions."""
    counts = Counter(one.status for one in found)
    settled, allowed = counts["excluded"] + counts["feasible"], max(one.allowed for one in found)
    rows = [f"| {one.name} | {one.status} | {one.seconds:.1f} | {one.ground} |" for one in found]
    return "\n".join(
        [
            "## The effect library, by inversion of the free run",
            "",
            f"Each extension of the demo's Hammerstein model on {SAMPLES} samples of its record of steps, whose pole "
            f"varies, within {NOISE_BOUND:g} bar and {allowed:g} s of processor time. Excluded: proven for all "
            f"parameters within their boxes; {ASSUMED}. Feasible: a verified point fits.",
            "",
            f"Decided: {settled} of {len(found)} ({', '.join(f'{n} {status}' for status, n in counts.items())}).",
            "",
            "| extension | on these samples | s | most influential samples, or why undecided |",
            "|---|---|---|---|",
            *rows,
        ]
    )
