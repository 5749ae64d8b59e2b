"""Every named problem with a finite box: how near the certified bound comes to the known optimum."""

from __future__ import annotations

from relaxations.library import load, names
from relaxations.search.minimum import minimise

CLOSE = 1e-6
SECONDS = 900.0  # a problem at most


def run() -> str:
    """Return the table as Markdown."""
    lines = [
        "## Named problems",
        "",
        f"`relaxations.search.minimise` runs with its defaults, and at most {SECONDS:g} s for each problem. "
        "Differences are divided by the magnitude of the optimum, or by one if that is larger.",
        "",
        "| problem | variables | optimum - bound | point - optimum | order | branches | s | stopped |",
        "|---|---|---|---|---|---|---|---|",
    ]
    bounded = [name for name in names() if load(name).is_bounded]
    near = above = 0
    for name in bounded:
        case = load(name)
        found = minimise(case.problem, case.objective, seconds=SECONDS)
        size = max(1.0, abs(case.optimum))
        gap = (case.optimum - found.lower) / size
        near += gap < CLOSE
        above += gap < -CLOSE
        lines.append(
            f"| {name} | {case.problem.n_variables} | {gap:.1e} | {(found.upper - case.optimum) / size:.1e} "
            f"| {found.order} | {found.nodes} | {found.seconds:.1f} | {found.reason.name.lower()} |"
        )
        print(lines[-1], flush=True)
    lines += [
        "",
        f"Within {CLOSE:g}: {near} of {len(bounded)}; above the optimum by more than that: {above}. The other "
        f"{len(names()) - len(bounded)} problems are stated without a finite box for some variables.",
    ]
    return "\n".join(lines)
