"""Fifteen small problems of mixed kind, certified to 1e-6, beside SCIP in the same run.

Both get the problem as it is stated. smid's time counts presolve, relaxations, the certified bound and the verified
point. SCIP works in floating point and proves nothing; it stops at the same gap. Each is run three times, and the least
processor time counts.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np

from benchmarks.frontier.small_problems import SMALL
from benchmarks.scip import scip_minimum
from relaxations import check
from relaxations.search.minimum import minimise

GAP = 1e-6
LIMIT = 10.0  # s a problem, for SCIP
TIMES = 3

Found = TypeVar("Found")


def run() -> str:
    """Return the table as Markdown."""
    lines = [
        "## Fifteen small problems",
        "",
        f"`relaxations.search.minimise` with its defaults, to {GAP:g} of max(1, abs(minimum)), and SCIP to the same "
        f"gap on the same statement, at most {LIMIT:g} s. Least processor time of {TIMES} runs. The bound of smid is "
        "certified, its point is verified, and its certificate is accepted by the checker in the time of the last "
        "column. SCIP works in floating point, without a proof.",
        "",
        "| problem | variables | certified bound | gap | order | branches | s | SCIP gap | SCIP s | check s |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    ours, theirs, open_ = list[float](), list[float](), 0
    for name, make in SMALL.items():
        problem, objective = make()
        found, seconds = least(lambda: minimise(problem, objective, tolerance=GAP))  # noqa: B023
        scip = scip_minimum(problem, objective, GAP, LIMIT)
        if scip.seconds < LIMIT / TIMES:
            others = [scip_minimum(problem, objective, GAP, LIMIT).seconds for _ in range(TIMES - 1)]
        else:
            others = []
        ours.append(seconds)
        theirs.append(min([scip.seconds, *others]))
        size = max(1.0, abs(found.upper))
        open_ += scip.gap > GAP * size
        lines.append(
            f"| {name} | {problem.n_variables} | {found.lower:.9g} | {found.gap / size:.1e} | {found.order} "
            f"| {found.nodes} | {seconds:.3f} | {scip.gap / size:.1e} | {theirs[-1]:.3f} "
            f"| {checked(problem, objective):.3f} |"
        )
        print(lines[-1], flush=True)
    lines += [
        "",
        f"In all: smid {sum(ours):.2f} s, SCIP {sum(theirs):.2f} s with {open_} not closed. Geometric mean: "
        f"smid {mean(ours):.3f} s, SCIP {mean(theirs):.3f} s.",
    ]
    return "\n".join(lines)


def least(act: Callable[[], Found]) -> tuple[Found, float]:
    """Return a result and the least processor time of some runs."""
    taken = []
    for _ in range(TIMES):
        started = time.process_time()
        found = act()
        taken.append(time.process_time() - started)
    return found, min(taken)


def checked(problem: object, objective: object) -> float:
    """Return the seconds that the checker takes to accept the certificate."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "proof.json"
        minimise(problem, objective, tolerance=GAP, certificate=file)
        started = time.process_time()
        check.check(check.read(file))
        return time.process_time() - started


def mean(seconds: list[float]) -> float:
    """Return the geometric mean."""
    return float(np.exp(np.mean(np.log(seconds))))
