"""All four parameters of the clutch thesis's Hammerstein model on the bundled ramp, N = 200: smid beside SCIP."""

from __future__ import annotations

from benchmarks.frontier.beside_scip import table
from benchmarks.frontier.records import CLUTCH, Known
from smid import Hammerstein
from smid.records import load_clutch


def run() -> str:
    """Return the comparison as Markdown."""
    data = load_clutch("clutch_20C_ramp_a").crop(0, 200)
    model = Hammerstein(poles=1, powers=(5, 4, 3), input_scale=0.01, stable=True)
    known = Known("Hammerstein of the clutch, bundled ramp", model, data, {data.output: 0.3}, CLUTCH)
    return f"## Beside SCIP\n\n{table(known, limit=120.0)}"
