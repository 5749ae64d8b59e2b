"""The counts as Markdown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from benchmarks.soundness.mutations.mutate import KINDS
from benchmarks.soundness.mutations.run import MEGABYTES, SECONDS, VERDICTS, Batch

__all__ = ["markdown"]


def markdown(batches: Sequence[Batch], files: int, seed: int) -> str:
    """Return the section: counts, the strength of the oracle, the limits, and every reason of a failure.

    Parameters
    ----------
    batches : sequence of Batch
    files : int
        Number of genuine files.
    seed : int
    """
    total: Counter[str] = Counter()
    for batch in batches:
        for counts in batch.verdicts.values():
            total.update(counts)
    count = sum(batch.count for batch in batches)
    judged, without = (sum(getattr(b, name) for b in batches) for name in ("judged", "without_points"))
    given_up, programs = (sum(getattr(b, name) for b in batches) for name in ("given_up", "programs"))
    failures = [failure for batch in batches for failure in batch.failures]
    slowest = max(batches, key=lambda batch: batch.slowest)
    reasons = Counter(_reason(failure["reason"]) for failure in failures)
    lines = [
        "## Soundness: changed certificates",
        "",
        f"`python -m benchmarks.soundness checker --seed {seed} --count {count}`: {count} changes of {files} genuine "
        f"certificate files of every kind. Failures: {len(failures)}.",
        "",
        "An accepted claim is a failure if a feasible point of the changed problem refutes it. Feasibility is decided "
        "in fractions. A check is also a failure if it takes more than "
        f"{SECONDS:g} s or {MEGABYTES} MB, or ends in a traceback.",
        "",
        f"- Accepted files for which the oracle had a feasible point: {judged} of {judged + without + given_up} "
        f"({_percent(judged, judged + without + given_up)}); without any: {without} (most are empty sets); not decided "
        f"in time: {given_up}.",
        f"- Longest check: {slowest.slowest:.2f} s (number {slowest.slowest_number}). "
        f"Largest memory: {max(batch.largest for batch in batches):.0f} MB.",
        f"- Runs of the program `python -m relaxations.check` on such files: {programs}.",
        f"- Processor time: {sum(batch.seconds for batch in batches) / 60:.0f} minutes.",
        "",
        f"| change | files | {' | '.join(VERDICTS)} |",
        "|---" * (len(VERDICTS) + 2) + "|",
    ]
    for kind in (*KINDS, "all"):
        own: Counter[str] = Counter()
        for batch in batches:
            for name, counts in batch.verdicts.items():
                own.update(counts if kind in (name, "all") else {})
        size = sum(own.values())
        shares = " | ".join(f"{own[v]} ({_percent(own[v], size)})" for v in VERDICTS)
        lines.append(f"| {kind} | {size} | {shares} |")
    lines += ["", *(f"- {number} x {reason}" for reason, number in reasons.most_common())] if reasons else []
    return "\n".join(lines) + "\n"


def _reason(text: str) -> str:
    """Leave out what differs from failure to failure."""
    return text.split(":")[0][:80]


def _percent(part: int, whole: int) -> str:
    return f"{100 * part / whole:.1f} %" if whole else "none"
