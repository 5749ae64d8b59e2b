"""Noisy curves: intervals of Wiener, Hammerstein and LPV models whose noises pass a curve or multiply each other.

Every end is certified, and met by parameters and noises that are verified.
"""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from benchmarks.soundness.curve_problems import KINDS, curve_problem
from smid import identify, verify

SIZES = (50, 100, 200)
SEED = 4
TOLERANCE = 0.01
CERTIFIED = 50  # samples, at most, of the record whose certificate is written


@dataclass(frozen=True)
class Run:
    """One record: seconds, the largest gap / width, whether the truth is inside, and how the bounds were found."""

    seconds: float
    gap: float
    inside: bool
    how: str


def one(kind: str, n_samples: int) -> Run:
    """Identify one record."""
    known = curve_problem(SEED, kind, n_samples, inside=True)
    started = time.perf_counter()
    estimate = identify(known.model, known.data, known.noise_bound, tolerance=TOLERANCE)
    seconds = time.perf_counter() - started
    inside = all(i.lower <= known.truth[i.name] <= i.upper for i in estimate.intervals)
    assert estimate.enclosure is not None
    return Run(seconds, max(i.gap / i.width for i in estimate.intervals), inside, estimate.enclosure.how)


def certificate(kind: str) -> tuple[float, float]:
    """Return the size of a certificate in MB, and the seconds that `smid verify` takes."""
    known = curve_problem(SEED, kind, CERTIFIED, inside=True)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "proof.json"
        identify(known.model, known.data, known.noise_bound, tolerance=TOLERANCE, certificate=file)
        started = time.perf_counter()
        verify(file, known.data, known.model, known.noise_bound)
        return file.stat().st_size / 1e6, time.perf_counter() - started


def run() -> str:
    """Return the table as Markdown."""
    lines = [
        "## Noisy curves",
        "",
        f"Random problems of `benchmarks.soundness.curve_problems`, seed {SEED}. Asked for is a gap of {TOLERANCE:g} "
        "of the width of each interval. The gap is measured to verified points, noises included.",
        "",
        "| model | N | s | gap / width | truth inside | method |",
        "|---|---|---|---|---|---|",
    ]
    for kind in KINDS:
        for n in SIZES:
            r = one(kind, n)
            lines.append(f"| {kind} | {n} | {r.seconds:.1f} | {r.gap:.1e} | {'yes' if r.inside else 'NO'} | {r.how} |")
            print(lines[-1], flush=True)
    sizes = [(kind, *certificate(kind)) for kind in KINDS]
    told = "; ".join(f"{kind} {size:.1f} MB, {seconds:.0f} s" for kind, size, seconds in sizes)
    lines += ["", f"Certificates at N = {CERTIFIED}, and the time of `smid verify`: {told}."]
    return "\n".join(lines)
