"""The extensions of the effect library on the demo's own model: what inversion of the free run decides of each.

The record is the demo's record of steps, whose pole varies. An extension is excluded, or a verified point fits, on the
100 samples where the base model errs most.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from benchmarks.processor_time import in_processor_time
from smid.cli.demo import NOISE_BOUND, STEPS
from smid.data.bundled import load_clutch
from smid.diagnosis.effects import EFFECTS, Site
from smid.diagnosis.proof.decide import ASSUMED, Decision, decide
from smid.diagnosis.proof.window import windows
from smid.fitting.binding import bind
from smid.fitting.fit import fit
from smid.models import Hammerstein

SAMPLES, SECONDS = 100, 60.0


def decided() -> Iterator[tuple[str, Decision]]:
    """Yield what is decided of each extension."""
    data = load_clutch(STEPS)
    model = Hammerstein(poles=1, powers=(5, 4, 3), input_scale=0.01, unit_dc_gain=True, stable=True)
    base = fit(bind(model, data), data)
    (output,) = base.model.output_channels
    residual = base.residual(data, output)
    site = Site(data, base.model.input_channels[0], output, residual)
    window = next(windows(residual, (SAMPLES,)))
    for effect in EFFECTS:
        for extension in effect.extensions(base.model, site):
            extended = extension.model
            start = {**base.model.values, **next(iter(extension.starts), {})}
            known = {p.name: start[p.name] for p in extended.parameters if p.name in start}
            with in_processor_time():
                found = decide(extended.with_values(known), data, window, {output: NOISE_BOUND}, SECONDS)
            print(effect.name, extension.label, found.status, f"{found.seconds:.1f} s", found.ground, flush=True)
            yield f"{effect.name} {extension.label}".strip(), found


def run() -> str:
    """Return the table as Markdown."""
    found = list(decided())
    counts = Counter(str(decision.status) for _, decision in found)
    settled = counts["excluded"] + counts["feasible"]
    rows = [f"| {name} | {d.status} | {d.seconds:.1f} | {d.ground} |" for name, d in found]
    return "\n".join(
        [
            "## The effect library, by inversion of the free run",
            "",
            f"Each extension of the demo's Hammerstein model on {SAMPLES} samples of its record of steps, whose pole "
            f"varies, within {NOISE_BOUND:g} bar and {SECONDS:g} s of processor time. Excluded: proven for all "
            f"parameters within their boxes; {ASSUMED}. Feasible: a verified point fits.",
            "",
            f"Decided: {settled} of {len(found)} ({', '.join(f'{n} {status}' for status, n in counts.items())}).",
            "",
            "| extension | on these samples | s | most influential samples, or why undecided |",
            "|---|---|---|---|",
            *rows,
        ]
    )
