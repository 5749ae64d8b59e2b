"""Diagnose blind cases and score it: ``python -m benchmarks.blind``.

Each result is appended to the cache as soon as it is there, so a run that was interrupted goes on where it stopped.
The diagnoses are kept in a folder.  Delete both when the diagnosis has changed.
"""

from __future__ import annotations

import argparse
from itertools import cycle
from pathlib import Path

from benchmarks.blind.calibration import draw
from benchmarks.blind.diagnose_case import KINDS, diagnose_case
from benchmarks.blind.score import CaseResult, markdown
from benchmarks.resumable import kept, run

# Half the cases hide one effect, a quarter two, an eighth three, and an eighth none.
_EIGHTH = ("single", "pair", "single", "triple", "single", "pair", "single")
ROUND = (*_EIGHTH, "none", *_EIGHTH, "none, bound withheld")


def _cached(path: Path, samples: int) -> list[CaseResult]:
    """Read results of records of a length."""
    results = []
    for entry in kept(path):
        if entry.pop("samples") == samples:
            doubts = tuple((name, p) for name, p in entry.pop("doubts", ()))
            lists = {name: tuple(entry[name]) for name in ("truth", "named", "rivals", "probabilities")}
            results.append(CaseResult(**entry | lists, doubts=doubts))
    return results


def main() -> None:
    """Read the arguments, run what is not in the cache, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.blind", description=__doc__)
    parser.add_argument("--seeds", type=int, default=208, help="number of cases")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--kind", choices=[*KINDS, "all"], default="all")
    parser.add_argument("--samples", type=int, default=1000)
    parser.add_argument("--output", type=Path, default=Path("docs/diagnosis.md"))
    parser.add_argument("--cache", type=Path, default=Path(".cache/blind.jsonl"))
    parser.add_argument("--diagnoses", type=Path, default=Path(".cache/diagnoses"))
    given = parser.parse_args()
    given.diagnoses.mkdir(parents=True, exist_ok=True)

    kinds = ROUND if given.kind == "all" else (given.kind,)
    seeds = range(given.first, given.first + given.seeds)
    wanted = list(zip(cycle(kinds), seeds, strict=False))
    known = {(o.kind, o.seed): o for o in _cached(given.cache, given.samples)}
    results = [known[key] for key in wanted if key in known]
    missing = [(*key, given.samples, given.diagnoses) for key in wanted if key not in known]
    print(f"{len(wanted)} cases, {len(results)} of them in {given.cache}", flush=True)
    for result in run(given.cache, diagnose_case, missing, given.workers, {"samples": given.samples}):
        results.append(result)
        hidden = ", ".join(result.truth) or "-"
        mark = "ok   " if result.is_right else "WRONG"
        print(
            f"{len(results):4d}/{len(wanted)} {mark} {result.kind} {result.seed}: {hidden}"
            f" -> {result.verdict} {', '.join(result.named)} {result.message}"
            f" ({result.ratio:.2f}, {result.seconds:.1f} s)",
            flush=True,
        )
    page = markdown(results)
    given.output.write_text(page, encoding="utf-8")
    draw(results, given.output.parent / "pictures" / "calibration.svg")
    print(f"\n{page}", flush=True)


if __name__ == "__main__":
    main()
