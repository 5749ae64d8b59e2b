"""Recursive set-membership: does the truth stay inside, how long does an update take, when is a change seen, how wide.

    python -m benchmarks.recursive_sets                        all of it, some ten minutes on two cores
    python -m benchmarks.recursive_sets time changes           some of it

- truth: 200 seeded runs of 5000 samples over random plants; the noise is uniform, or at its bound with random sign, or
  at its bound for long stretches.  (At the bound less one part in 10^12: the simulated output is rounded.)
- time: one update of models of 6 parameters, beside an ellipsoid, a zonotope and padasip's RLS (pip install padasip);
  processor time on the same samples.
- drift: 200 seeded runs of 2000 samples whose parameters change slowly within a stated bound; also with noisy inputs
  and with two inputs.
- changes: a pole that changes in the middle of 600 samples, 100 seeds, and the same seeds without a change.
- widths: before and after a refinement, beside the batch intervals of `smid.identify` on the same samples, and for
  equation errors beside linear programs over all samples, an ellipsoid and a zonotope.
- window: the exact intervals over a sliding window, and what they cost.
- clutch: the Hammerstein model on the thesis's records, ramps (which it made) and steps (which it cannot explain).
"""

from __future__ import annotations

import os

# Before NumPy is imported: matrices this small gain nothing from threads, and threads make timings useless.
os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"

from benchmarks.recursive_sets.changes import changes
from benchmarks.recursive_sets.clutch import clutch
from benchmarks.recursive_sets.drift import drift
from benchmarks.recursive_sets.timing import timing
from benchmarks.recursive_sets.truth import truth
from benchmarks.recursive_sets.widths import widths, window

SECTIONS = {
    "truth": truth,
    "time": timing,
    "drift": drift,
    "changes": changes,
    "widths": widths,
    "window": window,
    "clutch": clutch,
}
