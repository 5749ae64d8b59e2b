"""Diagnose blind cases and score it: ``python -m benchmarks.blind``.

Each result is appended to the cache as soon as it is there, so a run that was interrupted goes on where it stopped.
Delete the cache when the diagnosis has changed.
"""

from __future__ import annotations

import argparse
import json
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from pathlib import Path

from benchmarks.blind.diagnose_case import KINDS, diagnose_case
from benchmarks.blind.score import Outcome, markdown


def _cached(path: Path) -> list[tuple[int, Outcome]]:
    """Read record lengths and outcomes."""
    if not path.exists():
        return []
    outcomes = []
    for line in path.read_text(encoding="utf-8").splitlines():
        try:
            entry = json.loads(line)
        except json.JSONDecodeError:  # an empty line, or what an interrupted run left unfinished
            continue
        samples = entry.pop("samples")
        entry |= {name: tuple(entry[name]) for name in ("truth", "named", "rivals")}
        outcomes.append((samples, Outcome(**entry)))
    return outcomes


def main() -> None:
    """Read the arguments, run what is not in the cache, and write the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.blind", description=__doc__)
    parser.add_argument("--seeds", type=int, default=240, help="number of cases of each kind")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--kind", choices=[*KINDS, "all"], default="all")
    parser.add_argument("--samples", type=int, default=1000)
    parser.add_argument("--output", type=Path, default=Path("docs/diagnosis.md"))
    parser.add_argument("--cache", type=Path, default=Path(".cache/blind.jsonl"))
    given = parser.parse_args()

    kinds = list(KINDS) if given.kind == "all" else [given.kind]
    wanted = [(kind, seed) for kind in kinds for seed in range(given.first, given.first + given.seeds)]
    known = {(o.kind, o.seed): o for samples, o in _cached(given.cache) if samples == given.samples}
    outcomes = [known[key] for key in wanted if key in known]
    missing = [key for key in wanted if key not in known]
    print(f"{len(wanted)} cases, {len(outcomes)} of them in {given.cache}", flush=True)
    given.cache.parent.mkdir(parents=True, exist_ok=True)
    started = time.perf_counter()
    with (
        ProcessPoolExecutor(given.workers) as pool,
        given.cache.open("a", encoding="utf-8") as cache,
    ):
        cache.write("\n")  # ends a line that an interrupted run left unfinished; empty lines are skipped
        futures = [pool.submit(diagnose_case, kind, seed, given.samples) for kind, seed in missing]
        for future in as_completed(futures):
            outcome = future.result()
            outcomes.append(outcome)
            cache.write(json.dumps(asdict(outcome) | {"samples": given.samples}) + "\n")
            cache.flush()
            hidden = ", ".join(outcome.truth) or "-"
            mark = "ok   " if outcome.is_right else "WRONG"
            print(
                f"{len(outcomes):4d}/{len(wanted)} {mark} {outcome.kind} {outcome.seed}: {hidden}"
                f" -> {outcome.verdict} {', '.join(outcome.named)} {outcome.message}"
                f" ({outcome.ratio:.2f}, {outcome.seconds:.1f} s)",
                flush=True,
            )
    page = markdown(outcomes, time.perf_counter() - started)
    given.output.write_text(page, encoding="utf-8")
    print(f"\n{page}", flush=True)


if __name__ == "__main__":
    main()
