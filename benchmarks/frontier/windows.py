"""Long records: intervals proven on windows, against the number of samples.

Every end is certified, and met by parameters that are verified on all samples. The linear programs are those of
`growth`: each end at the true poles, over the whole record. Each record runs in a process of its own.
"""

from __future__ import annotations

import resource
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

from benchmarks.frontier.growth import KINDS, apart, linear_programs
from smid import identify, verify

GAP = 1e-3
MODELS = ("output error", "Hammerstein", "errors in variables")
SIZES = (10_000, 20_000, 100_000, 1_000_000)
WITH_PROGRAMS = 20_000  # beyond, the problem of the whole record does not fit the memory


@dataclass(frozen=True)
class Run:
    """One record: seconds of processor time, peak MB, gap / width; the certificate's kB and seconds to check it."""

    held: int
    seconds: float
    memory: float
    gap: float
    size: float
    checked: float
    programs: float | None


def one(kind: str, n_samples: int) -> Run:
    """Identify one record, and check its certificate."""
    known = KINDS[kind](n_samples)
    started = time.process_time()
    estimate = identify(known.model, known.data, known.noise_bound, tolerance=GAP)
    seconds = time.process_time() - started
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    assert all(i.lower <= t <= i.upper for i, t in zip(estimate, known.truth, strict=True)), "the truth lies outside"
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "proof.json"
        identify(known.model, known.data, known.noise_bound, tolerance=GAP, certificate=file)
        size = file.stat().st_size / 1e3
        started = time.process_time()
        verify(file, known.data, known.model, known.noise_bound)
        checked = time.process_time() - started
    programs = linear_programs(known) if n_samples <= WITH_PROGRAMS else None
    held = sum(map(len, estimate.windows))
    return Run(held, seconds, memory, max(i.gap / i.width for i in estimate), size, checked, programs)


def run(sizes: tuple[int, ...] = SIZES) -> str:
    """Return the table as Markdown."""
    lines = [
        "## Long records on windows",
        "",
        f"Asked for is a gap of {GAP:g} of the width of each interval, or 1e-8 of the value, which counts as tight. "
        "The gap is measured to parameters that are verified on all samples. Times are processor times, without the "
        "certificate. "
        "Ratio: s / s of the linear programs of each end at the true poles, HiGHS over the whole record.",
        "",
        "| model | N | samples in windows | s | gap / width | peak MB | certificate kB | its check s | ratio |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    growth = []
    for kind in MODELS:
        done: dict[int, Run] = {}
        for n in sizes:
            r = done[n] = apart(one, kind, n)
            ratio = "" if r.programs is None else f"{r.seconds / r.programs:.1f}"
            lines.append(
                f"| {kind} | {n} | {r.held} | {r.seconds:.1f} | {r.gap:.1e} | {r.memory:.0f} | {r.size:.0f} | "
                f"{r.checked:.1f} | {ratio} |"
            )
            print(lines[-1], flush=True)
        growth.append(f"{kind} {done[sizes[-1]].seconds / done[sizes[0]].seconds:.1f}")
    lines += ["", f"Time at N = {sizes[-1]} over time at N = {sizes[0]}: {', '.join(growth)}."]
    return "\n".join(lines)
