"""Counts of the answers by kind, as Markdown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

__all__ = ["FALSE", "Outcome", "markdown", "table"]

FALSE = ("truth outside", "witness outside", "called empty", "called feasible")


@dataclass(frozen=True)
class Outcome:
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


def markdown(outcomes: Sequence[Outcome], seconds: float) -> str:
    """Return the section: two tables, and every false statement or failure with its seed."""
    feasible = [o for o in outcomes if o.is_feasible]
    empty = [o for o in outcomes if not o.is_feasible]
    false = [o for o in outcomes if o.is_false]
    failed = [o for o in outcomes if o.verdict == "failed"]
    spent = sum(o.seconds for o in outcomes)
    parts = [
        "## Soundness: random feasible and empty sets",
        f"`python -m benchmarks.soundness sets`: {len(feasible)} sets contain known true parameters, and "
        f"{len(empty)} sets are empty by construction. Either an outlier cannot be explained by any parameters "
        "in their boxes, or the noise bound is too small. Linear programs over sub-boxes of the poles prove that it is "
        "too small. "
        f"False statements: {len(false)}. Errors: {len(failed)}. {spent / 60:.0f} minutes of one core, "
        f"{seconds / 60:.0f} in this run.",
    ]
    if feasible:
        parts.append(table("feasible sets", feasible, ("inside", "inside, no box"), lambda o: o.kind))
    if empty:
        verdicts = ("certified empty", "undecided")
        parts.append(table("empty sets", empty, verdicts, lambda o: f"{o.kind}, {o.construction}"))
    parts += [f"- {o.verdict}, {o.kind}, {o.construction}, seed {o.seed}: {o.message}" for o in false + failed]
    return "\n\n".join(parts) + "\n"


def table(title: str, outcomes: Sequence[Outcome], verdicts: Sequence[str], group: Callable[[Outcome], str]) -> str:
    """Return counts of verdicts and times, one row a group and one of all."""
    lines = [
        f"| {title} | runs | {' | '.join(verdicts)} | false | failed | median s | longest s |",
        "|---" * (len(verdicts) + 6) + "|",
    ]
    groups = sorted({group(o) for o in outcomes})
    for name in [*groups, "all"]:
        mine = [o for o in outcomes if name == "all" or group(o) == name]
        count = Counter(o.verdict for o in mine)
        times = sorted(o.seconds for o in mine)
        lines.append(
            f"| {name} | {len(mine)} | {' | '.join(str(count[v]) for v in verdicts)} | {sum(o.is_false for o in mine)} "
            f"| {count['failed']} | {times[len(times) // 2]:.2f} | {times[-1]:.1f} |"
        )
    return "\n".join(lines)
