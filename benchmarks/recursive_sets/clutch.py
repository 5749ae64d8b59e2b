"""The Hammerstein model on the records of the clutch thesis."""

from __future__ import annotations

import time

from benchmarks.recursive_sets.section import section
from smid.data.bundled import load_clutch
from smid.recursive import Arx
from smid.recursive.set_membership import RecursiveSet


def clutch() -> str:
    """Return what the sets say on records of the clutch."""
    began = time.perf_counter()
    rows = []
    arx = Arx(powers=(5, 4, 3), input_scale=0.01)
    for name in ("hammerstein_20C_ramp_a", "hammerstein_20C_ramp_b", "varying_pole_20C_steps"):
        data = load_clutch(name)
        run = data.experiments[0].values
        estimator = RecursiveSet(arx, 0.3, {name: (-1.0, 1.0) for name in arx.names[1:]})
        for sample in zip(run[data.inputs[0]].tolist(), run[data.outputs[0]].tolist(), strict=True):
            estimator.update(*sample)
        changes = estimator.history.changes
        rows.append(
            [
                name,
                str(data.n_samples),
                "" if changes else f"[{estimator.lower[0]:.5f}, {estimator.upper[0]:.5f}]",
                str(len(changes)),
                str(changes[0]) if changes else "",
            ]
        )
    head = ["record", "samples", "alpha", "empty sets", "the first"]
    return section("Clutch, Hammerstein model of powers 5, 4, 3, noise bound 0.3 bar", head, rows, began)
