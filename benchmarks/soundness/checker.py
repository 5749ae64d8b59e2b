"""Change genuine certificates and count false statements that are accepted: ``python -m benchmarks.soundness checker``.

Each batch of mutants is appended to the cache as soon as it is done, so a run that was interrupted goes on where it
stopped; another checker or other genuine files begin anew. Every failure is a file in the cache, with its reason. The
command fails where there is one.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

from benchmarks.pages import merged
from benchmarks.resumable import kept, run
from benchmarks.soundness.mutations.library import digest, library
from benchmarks.soundness.mutations.mutate import KINDS, mutant
from benchmarks.soundness.mutations.run import KILL_SECONDS, VERDICTS, Batch, run_batch
from benchmarks.soundness.mutations.section import markdown

BATCH = 250


def main(arguments: list[str]) -> int:
    """Run what is not in the cache, print (and write) the section, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.soundness checker", description=__doc__)
    parser.add_argument("--count", type=int, default=100_000, help="number of mutants")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--output", type=Path, help="Markdown page that gets the section")
    parser.add_argument("--cache", type=Path, default=Path(".cache/mutations"))
    given = parser.parse_args(arguments)

    folder = given.cache / "genuine"
    genuine = library(folder)
    print(f"{len(genuine)} genuine files in {folder}", flush=True)
    batches: list[Batch] = []
    for batch in _batches(given, digest(genuine)):
        batches.append(batch)
        for failure in batch.failures:
            path = given.cache / f"failure_{batch.seed}_{failure['number']}.json"
            path.write_text(failure["text"], encoding="utf-8")
            print(f"{path}: {failure['reason'][:200]} ({', '.join(failure['changes'])})", flush=True)
        if len(batches) % 20 == 0:
            print(f"{sum(b.count for b in batches)} mutants", flush=True)
    section = markdown(batches, len(genuine), given.seed)
    print(f"\n{section}", flush=True)
    if given.output:
        page = given.output.read_text(encoding="utf-8") if given.output.exists() else ""
        given.output.write_text(merged(page, section), encoding="utf-8")
    return int(any(batch.failures for batch in batches))


def _batches(given: argparse.Namespace, fingerprint: str) -> Iterator[Batch]:
    cache = given.cache / "batches.jsonl"
    also = {"fingerprint": fingerprint}
    known = {}
    for entry in kept(cache):
        if entry.pop("fingerprint") == fingerprint and entry["seed"] == given.seed:
            known[entry["first"], entry["count"]] = Batch(**entry)
    wanted = [(first, min(BATCH, given.count - first)) for first in range(0, given.count, BATCH)]
    yield from (known[key] for key in wanted if key in known)
    missing = {key for key in wanted if key not in known}
    folder = given.cache / "genuine"
    while missing:
        for stale in folder.glob("under_way.*"):
            stale.unlink()
        cases = [(str(folder), given.seed, *key) for key in sorted(missing)]
        try:
            for batch in run(cache, run_batch, cases, given.workers, also):
                missing.discard((batch.first, batch.count))
                yield batch
        except BrokenProcessPool:
            # The process that hangs has announced its mutant first of all.
            path = min(folder.glob("under_way.*"), key=lambda path: path.stat().st_mtime)
            number = int(path.read_text(encoding="utf-8"))
            missing = {key for key in missing if not key[0] <= number < sum(key)}
            yield _endless(given.seed, number, folder)


def _endless(seed: int, number: int, folder: Path) -> Batch:
    """Return a batch of the one mutant that ended its process; the others of its batch are not run."""
    one = mutant(seed, number, library(folder))
    verdicts = {kind: dict.fromkeys(VERDICTS, 0) for kind in KINDS}
    verdicts[one.kind]["failure"] = 1
    reason = f"nothing stops the check within {KILL_SECONDS} s"
    failure = {"number": number, "reason": reason, "changes": list(one.changes), "text": one.text}
    return Batch(seed, number, 1, verdicts, {}, slowest=float(KILL_SECONDS), failures=[failure])
