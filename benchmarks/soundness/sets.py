"""Identify random sets and count what is false: ``python -m benchmarks.soundness sets``.

Each result is appended to the cache as soon as it is there, so a run that was interrupted goes on where it stopped.
Delete the cache when the bounds have changed. The command fails where a statement was false.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from benchmarks.pages import merged
from benchmarks.resumable import kept, run
from benchmarks.soundness.check_case import check_case, check_new
from benchmarks.soundness.score import CaseResult, markdown


def main(arguments: list[str]) -> int:
    """Run what is not in the cache, print (and write) the section, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.soundness sets", description=__doc__)
    parser.add_argument("--feasible", type=int, default=2000, help="number of sets that hold the truth")
    parser.add_argument("--infeasible", type=int, default=500, help="number of empty sets")
    parser.add_argument("--first", type=int, default=0, metavar="SEED", help="first seed of both")
    parser.add_argument("--method", default="auto", help="of the smooth models")
    parser.add_argument("--new", action="store_true", help="windows, noisy curves, hidden states, outliers")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--output", type=Path, help="Markdown page that gets the section")
    parser.add_argument("--cache", type=Path)
    given = parser.parse_args(arguments)
    cache = given.cache or Path(f".cache/soundness{'-new' if given.new else ''}.jsonl")

    wanted = [(True, seed) for seed in range(given.first, given.first + given.feasible)]
    wanted += [(False, seed) for seed in range(given.first, given.first + given.infeasible)]
    known = {(r.is_feasible, r.seed): r for r in (CaseResult(**entry) for entry in kept(cache))}
    results = [known[key] for key in wanted if key in known]
    missing = [(*key, *(() if given.new else (given.method,))) for key in wanted if key not in known]
    print(f"{len(wanted)} sets, {len(results)} of them in {cache}", flush=True)
    started = time.perf_counter()
    for result in run(cache, check_new if given.new else check_case, missing, given.workers):
        results.append(result)
        if result.is_false or result.verdict == "failed" or len(results) % 50 == 0:
            print(
                f"{len(results):4d}/{len(wanted)} {result.verdict}: {result.kind}, {result.construction}, "
                f"seed {result.seed} ({result.seconds:.1f} s) {result.message}",
                flush=True,
            )
    section = markdown(results, time.perf_counter() - started, given.new)
    print(f"\n{section}", flush=True)
    if given.output:
        page = given.output.read_text(encoding="utf-8") if given.output.exists() else ""
        given.output.write_text(merged(page, section), encoding="utf-8")
    return int(any(r.is_false for r in results))
