"""Identify random models with priors whose truth is rational: ``python -m benchmarks.soundness priors``.

Each result is appended to the cache as soon as it is there, so a run that was interrupted goes on where it stopped.
Delete the cache when the bounds have changed. The command fails where a statement was false.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections import Counter
from collections.abc import Sequence
from itertools import count, islice
from pathlib import Path

from benchmarks.pages import merged
from benchmarks.resumable import kept, run
from benchmarks.soundness.check_case import inside
from benchmarks.soundness.prior_cases import PriorCase, prior_case
from benchmarks.soundness.score import CaseResult, table
from smid import EmptyFeasibleSetError, identify

__all__ = ["check_prior_case", "main", "markdown"]


def main(arguments: list[str]) -> int:
    """Run what is not in the cache, print (and write) the section, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.soundness priors", description=__doc__)
    parser.add_argument("--count", type=int, default=2000, help="number of sets that hold their truth")
    parser.add_argument("--first", type=int, default=0, metavar="SEED")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--output", type=Path, help="Markdown page that gets the section")
    parser.add_argument("--cache", type=Path, default=Path(".cache/soundness_priors.jsonl"))
    given = parser.parse_args(arguments)

    drawn = (prior_case(seed) for seed in count(given.first))
    cases = list(islice((case for case in drawn if case.is_feasible), given.count))
    known = {r.seed: r for r in (CaseResult(**entry) for entry in kept(given.cache))}
    results = [known[case.seed] for case in cases if case.seed in known]
    missing = [(case.seed,) for case in cases if case.seed not in known]
    print(f"{len(cases)} sets from seed {given.first} on, {len(results)} of them in {given.cache}", flush=True)
    for result in run(given.cache, check_prior_case, missing, given.workers):
        results.append(result)
        if result.is_false or result.verdict == "failed" or len(results) % 50 == 0:
            print(f"{len(results):4d}/{len(cases)} {result.verdict}: seed {result.seed} {result.message}", flush=True)
    section = markdown(results, cases)
    print(f"\n{section}", flush=True)
    if given.output:
        page = given.output.read_text(encoding="utf-8") if given.output.exists() else ""
        given.output.write_text(merged(page, section), encoding="utf-8")
    return int(any(r.is_false for r in results))


def check_prior_case(seed: int) -> CaseResult:
    """Identify a case whose truth meets its priors, and judge the answer; the order varies with the seed."""
    case = prior_case(seed)
    started = time.process_time()
    message = ""
    try:
        with warnings.catch_warnings(action="error"):
            estimate = identify(
                case.model(),
                case.data,
                case.noise_bound,
                order=1 if seed % 8 else None,
                rounds=1,
                tolerance=0.5,
            )
    except EmptyFeasibleSetError as error:
        verdict, message = "called empty", str(error)[:200]
    except Exception as error:  # one broken case must not end a long run; it is reported
        verdict, message = "failed", f"{type(error).__name__}: {error}".replace("\n", " ").replace("|", "/")[:300]
    else:
        verdict, message = inside(estimate, case.truth)
    samples = len(case.data.values("y"))
    return CaseResult(case.kind, "feasible", seed, samples, verdict, time.process_time() - started, message)


def markdown(results: Sequence[CaseResult], cases: Sequence[PriorCase]) -> str:
    """Return the section: a table, and every false statement or failure with its seed."""
    false = [r for r in results if r.is_false]
    failed = [r for r in results if r.verdict == "failed"]
    verdicts = Counter(r.verdict for r in results)
    stated = Counter(option for case in cases for option in case.priors)
    lengths = [len(case.data.values("y")) for case in cases]
    parts = [
        "## Soundness: random priors with a rational truth",
        f"`python -m benchmarks.soundness priors`: {len(results)} models of one or two poles and up to three "
        f"numerator coefficients, of {min(lengths)} to {max(lengths)} samples, seeds {cases[0].seed} to "
        f"{cases[-1].seed}. The true parameters are rational and meet the priors and the noise bounds, as decided in "
        f"fractions. In {sum(case.is_at_an_end for case in cases)} models they lie exactly on the limit of a prior. "
        f"Priors stated: {', '.join(f'{option} {times}' for option, times in stated.most_common())}. "
        f"Falsely called empty: {verdicts['called empty']}. Truth excluded: {verdicts['truth outside']}. "
        f"Errors: {len(failed)}. "
        f"{sum(r.seconds for r in results) / 60:.0f} minutes of processor time.",
        table("models with priors", results, ("inside", "inside, no box"), lambda r: r.kind),
    ]
    parts += [f"- {r.verdict}, {r.kind}, seed {r.seed}: {r.message}" for r in false + failed]
    return "\n\n".join(parts) + "\n"
