"""Counts of the answers by kind, as Markdown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

__all__ = ["FALSE", "CaseResult", "markdown", "table"]

FALSE = ("truth outside", "witness outside", "called empty", "called feasible")


@dataclass(frozen=True)
class CaseResult:
    """What became of one case.

    Parameters
    ----------
    kind : str
    construction : {"feasible", "outlier", "small bound"}
    seed : int
    samples : int
    verdict : str
        A feasible set: "inside", "inside, no box" (no finite interval could be proven), "truth outside",
        "witness outside" or "called empty". An empty one: "certified empty", "undecided" or "called feasible". Either:
        "failed", with the error in ``message``.
    seconds : float
    message : str
    """

    kind: str
    construction: str
    seed: int
    samples: int
    verdict: str
    seconds: float
    message: str = ""

    @property
    def is_feasible(self) -> bool:
        """Tell whether the set holds a point."""
        return self.construction == "feasible"

    @property
    def is_false(self) -> bool:
        """Tell whether something was stated that is not so."""
        return self.verdict in FALSE


def markdown(results: Sequence[CaseResult], seconds: float, new: bool = False) -> str:
    """Return the section: two tables, and every false statement or failure with its seed."""
    feasible = [r for r in results if r.is_feasible]
    empty = [r for r in results if not r.is_feasible]
    false = [r for r in results if r.is_false]
    failed = [r for r in results if r.verdict == "failed"]
    spent = sum(r.seconds for r in results)
    parts = [
        "## Soundness: random "
        + ("sets on windows, with noisy curves, hidden states and outliers" if new else "feasible and empty sets"),
        f"`python -m benchmarks.soundness sets{' --new' if new else ''}`: "
        f"{len(feasible)} sets contain known true parameters, and "
        f"{len(empty)} sets are empty by construction. Either an outlier cannot be explained by any parameters "
        "in their boxes, or the noise bound is too small. Linear programs over sub-boxes of the poles prove that it is "
        "too small. "
        f"False statements: {len(false)}. Errors: {len(failed)}. {spent / 60:.0f} minutes of one core, "
        f"{seconds / 60:.0f} in this run."
        + (f" On windows: {sum(r.message == 'windows' for r in results)}." if new else ""),
    ]
    if feasible:
        parts.append(table("feasible sets", feasible, ("inside", "inside, no box"), lambda r: r.kind))
    if empty:
        verdicts = ("certified empty", "undecided")
        parts.append(table("empty sets", empty, verdicts, lambda r: f"{r.kind}, {r.construction}"))
    parts += [f"- {r.verdict}, {r.kind}, {r.construction}, seed {r.seed}: {r.message}" for r in false + failed]
    return "\n\n".join(parts) + "\n"


def table(
    title: str, results: Sequence[CaseResult], verdicts: Sequence[str], group: Callable[[CaseResult], str]
) -> str:
    """Return counts of verdicts and times, one row a group and one of all."""
    lines = [
        f"| {title} | runs | {' | '.join(verdicts)} | false | failed | median s | longest s |",
        "|---" * (len(verdicts) + 6) + "|",
    ]
    groups = sorted({group(r) for r in results})
    for name in [*groups, "all"]:
        mine = [r for r in results if name == "all" or group(r) == name]
        count = Counter(r.verdict for r in mine)
        times = sorted(r.seconds for r in mine)
        lines.append(
            f"| {name} | {len(mine)} | {' | '.join(str(count[v]) for v in verdicts)} | {sum(r.is_false for r in mine)} "
            f"| {count['failed']} | {times[len(times) // 2]:.2f} | {times[-1]:.1f} |"
        )
    return "\n".join(lines)
