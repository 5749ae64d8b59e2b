"""The figures of all peers on one record, and those of smid."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.measured_cases import Case
from benchmarks.measured_diagnosis import HEAD, TEST_HEAD
from benchmarks.peers.protocol import Peer, identified, rmse, run_of
from smid.diagnosis.parts import STARTING, split
from smid.fitting.binding import bind

SMID = "python -m benchmarks.measured_diagnosis FOLDER --output FILE"


@dataclass(frozen=True)
class Row:
    """One test part: its label, its unit, and per peer RMSE, settings and seconds."""

    record: str
    part: str
    unit: str
    rmse: tuple[float | None, ...]
    settings: tuple[str, ...]
    seconds: tuple[float, ...]


def rows(case: Case, folder: Path, peers: Sequence[Peer]) -> list[Row]:
    """Fit the peers to one record and simulate them on its test parts."""
    full = case.whole(folder)
    data = case.load(full)
    parts = split(bind(case.model, data), data, case.share)
    seen = [run_of(data, run) for run in parts.seen.experiments]
    pairs = zip(data.experiments, parts.test, strict=True)
    tested = {run.name: (run_of(data, run), int(mask.argmax())) for run, mask in pairs if mask.any()}
    label = f"last {case.share:.0%} of each run" if isinstance(case.share, float) else ", ".join(case.share)
    tests = [(label, list(tested.values()), 1.0, data.channel(data.output).unit)]
    if case.test and list(tested) != [case.test]:
        part = full.select(case.test)
        alone = tested.get(case.test) or (run_of(part, part.experiments[0]), part.n_init or STARTING)
        tests.append((case.test, [alone], case.factor, case.unit))
    figures = []
    for peer in peers:
        began = time.perf_counter()
        settings, free_run = identified(peer, seen)
        errors = [rmse(free_run, runs) for _, runs, _, _ in tests]
        figures.append((errors, ", ".join(map("{} {}".format, peer.meaning, settings)), time.perf_counter() - began))
    return [
        Row(
            case.record,
            part,
            unit,
            tuple(None if errors[k] is None else errors[k] * factor for errors, _, _ in figures),
            tuple(chosen for _, chosen, _ in figures),
            tuple(seconds for _, _, seconds in figures),
        )
        for k, (part, _, factor, unit) in enumerate(tests)
    ]


def smid_figures(page: str) -> dict[tuple[str, bool], tuple[str, str]]:
    """Return base and extended RMSE by record, and whether they are of the published test part (second table)."""
    first, second = (head.strip().splitlines()[-2] for head in (HEAD, TEST_HEAD))
    if first not in page.splitlines():
        raise SystemExit(f"--smid: no line {first!r}; write the file with {SMID}")
    found, published, base = {}, False, 0
    for line in page.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line in (first, second):
            published, base = line == second, 3 if line == first else 1
        elif not line.startswith("|"):
            base = 0
        elif base and line.startswith("| "):
            found[cells[0], published] = (cells[base], cells[base + 1])
    return found
