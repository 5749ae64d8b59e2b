"""Diagnose measured records, and compare the extended models with published figures.

    python -m benchmarks.measured_diagnosis FOLDER [--output docs/measured.md] [--only RECORD ...]

FOLDER holds the records, one folder each; they are not part of the project. Every record is diagnosed in the same
way: a base model of low order, all effects of the library, no noise bound. The test part is the last 20 % of every
run, or the runs of the published split. No fit and no choice uses it; both models are simulated on it once, at the
end. Of a whole test run, the first 50 samples (or as many as the record gives) tell the initial states and do not
count. Every record is diagnosed twice, with the kernel of OpenBLAS that suits this processor and with that of an
older one. The search ends after 480 s of processor time in one process. Each result is kept in the cache, so an
interrupted run goes on where it stopped; delete the cache when the diagnosis has changed.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.kernels import OLDER, with_kernel
from benchmarks.machine import described
from benchmarks.measured_cases import CASES, Case
from benchmarks.processor_time import in_processor_time
from benchmarks.resumable import kept
from benchmarks.resumable import run as kept_run
from smid import Dataset, Model
from smid.diagnosis import Diagnosis, diagnose
from smid.diagnosis.parts import free_run_of_new
from smid.diagnosis.search.compare import rms
from smid.fitting.binding import bind

SECONDS = 480.0  # processor time of a diagnosis
START = 50  # samples of a test run that its initial states are fitted to


@dataclass(frozen=True)
class CaseResult:
    """What was found on a record with a kernel of OpenBLAS (empty: that of the processor).

    The RMSEs of `rmse` are on the test part of the diagnosis, in `unit`; those of `published`, if any, on the published
    test part, in the unit of the published figures; first of the base model, then of the extended one.
    """

    record: str
    kernel: str
    named: tuple[str, ...]
    alternatives: tuple[str, ...]
    rmse: tuple[float, float]
    unit: str
    published: tuple[float, float] | None
    conclusion: str
    sentences: tuple[str, ...]
    unexplained: bool
    interrupted: bool
    seconds: float


def tested(
    model: Model, simulated: tuple[NDArray[np.float64], ...], case: Case, found: Diagnosis, full: Dataset
) -> float:
    """Return the RMSE of a free run on the test part, in the unit of the published figures."""
    names = [r.name for r in found.data.experiments]
    if case.test in names and found.test[names.index(case.test)].any():
        e = names.index(case.test)
        held = found.test[e]
        error = (found.data.experiments[e].values[found.output] - simulated[e])[held]
        return rms([error]) * case.factor
    part = full.select(case.test)
    free = free_run_of_new(model, part, START)[found.output]
    error = part.experiments[0].values[found.output] - free
    return rms([error[part.n_init :]]) * case.factor


def diagnosed(record: str, kernel: str, folder: Path) -> CaseResult:
    """Diagnose one record with a kernel of OpenBLAS."""
    return with_kernel(kernel, _diagnosed, record, kernel, folder)


def _diagnosed(record: str, kernel: str, folder: Path) -> CaseResult:
    (case,) = (case for case in CASES if case.record == record)
    full = case.whole(folder)
    data = case.load(full)
    began = time.process_time()
    with in_processor_time():
        found = diagnose(bind(case.model, data), data, test=case.share, workers=1, seconds=SECONDS)
    seconds = time.process_time() - began
    published = None
    if case.test:
        pairs = ((found.base, found.simulated), (found.model, found.extended))
        before, after = (tested(model, simulated, case, found, full) for model, simulated in pairs)
        published = (before, after)
    return CaseResult(
        record,
        kernel,
        tuple(f"`{c.effect}`" + (f" ({c.label})" if c.label else "") for c in found.causes),
        found.alternatives,
        (found.gain.rmse_before, found.gain.rmse_after),
        found.unit,
        published,
        found.conclusion,
        tuple(f"{c.sentence} ({c.confidence:.0%})" for c in found.causes),
        found.unexplained,
        found.interrupted,
        seconds,
    )


HEAD = """# Diagnosis of measured records

This page shows which effects `smid.diagnose` names on public measured records, and the RMSE before and after.
`python -m benchmarks.measured_diagnosis FOLDER --output docs/measured.md` writes the page. The records are
not part of the project. {}

| record | known to be missing | named, in order | test RMSE: base | extended | s |
|---|---|---|---|---|---|
"""
TEST_HEAD = """
## Against published figures

Free-run RMSE on the published test part.

| record | linear model | extended model | published |
|---|---|---|---|
"""
KERNEL_HEAD = """
## With the arithmetic of an older processor

Kernels of OpenBLAS add in another order, so that the last digits differ. Here the kernel {} replaced that of the
processor.

| record | named with it | test RMSE over that of the first table |
|---|---|---|
"""


def page(results: Sequence[CaseResult]) -> str:
    """Return the tables, and the sentences of each diagnosis, as Markdown."""
    about = " ".join((__doc__ or "").split("not part of the project. ", 1)[-1].split())
    cases = {case.record: case for case in CASES}
    found = {(r.record, r.kernel): r for r in results}
    first = [found[name, ""] for name in cases if (name, "") in found]
    pairs = [(r, found[r.record, OLDER]) for r in first if (r.record, OLDER) in found]
    lines = [HEAD.format(about).rstrip("\n")]
    for r in first:
        verdict = f" (ambiguous: {' or '.join(r.alternatives)})" if r.alternatives else ""
        before, after = f"{r.rmse[0]:.4g}", f"{r.rmse[1]:.4g} {r.unit}".rstrip()
        names = ", ".join(r.named) or "nothing"
        seconds = f"{r.seconds:.0f}" + ", ended by time" * r.interrupted
        cells = (r.record, cases[r.record].known, names + verdict, before, after, seconds)
        lines.append("| " + " | ".join(cells) + " |")
    lines.append(TEST_HEAD.rstrip("\n"))
    for r in first:
        if r.published is not None:
            case = cases[r.record]
            before, after = (f"{value:.3g} {case.unit}".rstrip() for value in r.published)
            lines.append(f"| {r.record} | {before} | {after} | {case.published or '-'} |")
    if pairs:
        lines.append(KERNEL_HEAD.format(OLDER).rstrip("\n"))
        for r, other in pairs:
            names = "the same" if other.named == r.named else ", ".join(other.named) or "nothing"
            lines.append(f"| {r.record} | {names} | {other.rmse[1] / r.rmse[1]:.4f} |")
    lines.append(
        "\n## Sentences of the diagnosis\n\nThe percentage after a sentence is the probability of the cause.\n"
    )
    for r in first:
        case = cases[r.record]
        part = f" ({case.how})" if case.how else ""
        lines.append(f"**{r.record}**{part}; base: {case.base}. {r.conclusion}")
        lines += [f"- {sentence}" for sentence in r.sentences]
        unexplained = "The remaining error is more than noise: no effect of the library explains it."
        left = unexplained if r.unexplained else "The remaining error is no more than noise."
        lines.append(f"- {left}\n")
    return "\n".join([*lines, described(("numpy", "scipy"))]) + "\n"


def main() -> None:
    """Print each record as it comes, and write the tables."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.measured_diagnosis", description=(__doc__ or "").splitlines()[0]
    )
    known = [case.record for case in CASES]
    parser.add_argument("folder", type=Path, help="folder of the measured records")
    parser.add_argument("--output", type=Path, help="Markdown file to write")
    parser.add_argument("--only", nargs="+", choices=known, default=known, metavar="RECORD", help="these records only")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--cache", type=Path, default=Path(".cache/measured_diagnosis.jsonl"))
    given = parser.parse_args()
    there = [name for name in given.only if (given.folder / name).is_dir()]
    for name in sorted(set(given.only) - set(there)):
        print(f"{name}: skipped, it is not in the folder", flush=True)
    results = [restored(entry) for entry in kept(given.cache) if entry["record"] in there]
    done = {(r.record, r.kernel) for r in results}
    missing = [(name, kernel, given.folder) for kernel in ("", OLDER) for name in there if (name, kernel) not in done]
    for result in kept_run(given.cache, diagnosed, missing, given.workers):
        results.append(result)
        print(f"\n{result}", flush=True)
    if given.output:
        given.output.write_text(page(results), encoding="utf-8")


def restored(entry: dict[str, Any]) -> CaseResult:
    """Return a result that was kept as JSON, which knows no tuples."""
    return CaseResult(**{name: tuple(value) if isinstance(value, list) else value for name, value in entry.items()})


if __name__ == "__main__":
    main()
