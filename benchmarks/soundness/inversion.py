"""Invert free runs of random models and count what is false: ``python -m benchmarks.soundness inversion``.

The models are those of the effect library (:mod:`.library_cases`). Intervals must hold the truth, the set must not be
called empty where the truth fits, and an empty one must have no verified point. Each case has some seconds for
intervals, and as many for a decision in turned coordinates.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from benchmarks.pages import merged
from benchmarks.resumable import kept, run
from benchmarks.soundness.check_case import check_inversion
from benchmarks.soundness.score import CaseResult, table

SECONDS = 4.0


def main(arguments: list[str]) -> int:
    """Run what is not in the cache, print (and write) the section, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.soundness inversion", description=__doc__)
    parser.add_argument("--feasible", type=int, default=1000, help="number of sets that hold the truth")
    parser.add_argument("--infeasible", type=int, default=300, help="number of empty sets")
    parser.add_argument("--seconds", type=float, default=SECONDS, help="of each case")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--output", type=Path, help="Markdown page that gets the section")
    parser.add_argument("--cache", type=Path, default=Path(".cache/soundness-inversion.jsonl"))
    given = parser.parse_args(arguments)
    wanted = [(True, seed) for seed in range(given.feasible)] + [(False, seed) for seed in range(given.infeasible)]
    wanted.sort(key=lambda case: case[1])
    known = {(r.is_feasible, r.seed): r for r in (CaseResult(**entry) for entry in kept(given.cache))}
    results = [known[key] for key in wanted if key in known]
    missing = [(*key, given.seconds) for key in wanted if key not in known]
    print(f"{len(wanted)} sets, {len(results)} of them in {given.cache}", flush=True)
    started = time.perf_counter()
    for result in run(given.cache, check_inversion, missing, given.workers):
        results.append(result)
        if result.is_false or result.verdict == "failed" or len(results) % 50 == 0:
            print(f"{len(results):4d}/{len(wanted)} {_line(result)}", flush=True)
    section = _markdown(results, given.seconds, time.perf_counter() - started)
    print(f"\n{section}", flush=True)
    if given.output:
        page = given.output.read_text(encoding="utf-8") if given.output.exists() else ""
        given.output.write_text(merged(page, section), encoding="utf-8")
    return int(any(r.is_false for r in results))


def _line(r: CaseResult) -> str:
    return f"{r.verdict}, {r.kind}, {r.construction}, seed {r.seed} ({r.seconds:.1f} s): {r.message}"


def _markdown(results: list[CaseResult], limit: float, seconds: float) -> str:
    """Return the section: a table of the feasible and one of the empty sets, and what is false or failed."""
    feasible, empty = ([r for r in results if r.is_feasible is is_feasible] for is_feasible in (True, False))
    false, failed = [r for r in results if r.is_false], [r for r in results if r.verdict == "failed"]
    effects = {r.kind.rsplit(", ", 1)[1] for r in results}
    verdicts = (("inside", "inside, no box"), ("certified empty", "undecided"))
    tables = [
        table(title, own, shown, lambda r: r.kind.rsplit(", ", 1)[0])
        for title, own, shown in zip(("feasible sets", "empty sets"), (feasible, empty), verdicts, strict=True)
        if own
    ]
    return (
        "\n\n".join(
            [
                "## Soundness: inversion of the free run",
                f"`python -m benchmarks.soundness inversion`: models of {len(effects)} effects, twice {limit:g} s for "
                f"each. {len(feasible)} sets contain known true parameters. {len(empty)} sets are empty: "
                "two channels contradict each other at this noise bound. "
                f"False statements: {len(false)}. Errors: {len(failed)}. {sum(r.seconds for r in results) / 60:.0f} "
                f"minutes of one core, {seconds / 60:.0f} in this run.",
                *tables,
                *(f"- {_line(r)}" for r in false + failed),
            ]
        )
        + "\n"
    )
