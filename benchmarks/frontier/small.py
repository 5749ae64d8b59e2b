"""Fifteen small problems of mixed kind, certified to 1e-6, beside SCIP, MAiNGO and discopt in the same run.

All get the problem as it is stated; those that need boxes get wide ones where there are none. smid's time counts
presolve, relaxations, the certified bound and the verified point. The others work in floating point and prove nothing;
they stop at the same gap. Each is run three times, and the least processor time counts.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from benchmarks.frontier.small_problems import SMALL
from benchmarks.rivals.discopt import discopt_minimum
from benchmarks.rivals.maingo import maingo_minimum
from benchmarks.rivals.scip import scip_minimum
from benchmarks.rivals.stated import REACH, RivalEnd
from relaxations import check
from relaxations.search.minimum import minimise

GAP = 1e-6
LIMIT = 10.0  # s a problem, for the others
TIMES = 3

RIVALS = {"SCIP": scip_minimum, "MAiNGO": maingo_minimum, "discopt": discopt_minimum}

Found = TypeVar("Found")


def run() -> str:
    """Return the table as Markdown."""
    lines = [
        "## Fifteen small problems",
        "",
        f"`relaxations.search.minimise` with its defaults, to {GAP:g} of max(1, abs(minimum)), and SCIP, MAiNGO and "
        f"discopt to the same gap on the same statement, at most {LIMIT:g} s. MAiNGO and discopt need boxes: where "
        f"there are none, they get {REACH:g} to both sides. Least processor time of {TIMES} runs. The bound of smid is "
        "certified, its point is verified, and its certificate is accepted by the checker in the time of the last "
        "column. The others work in floating point, without a proof.",
        "",
        f"| problem | variables | certified bound | gap | order | branches | s "
        f"{' '.join(f'| {name} gap | s' for name in RIVALS)} | check s |",
        "|---" * (8 + 2 * len(RIVALS)) + "|",
    ]
    ours, theirs = list[float](), {name: list[RivalEnd]() for name in RIVALS}
    for name, make in SMALL.items():
        problem, objective = make()
        found, seconds = least(lambda: minimise(problem, objective, tolerance=GAP))  # noqa: B023
        ours.append(seconds)
        size = max(1.0, abs(found.upper))
        for rival, solve in RIVALS.items():
            end = fastest(lambda: solve(problem, objective, GAP, LIMIT))  # noqa: B023
            theirs[rival].append(replace(end, gap=max(end.gap, 0.0) / size))
        lines.append(
            f"| {name} | {problem.n_variables} | {found.lower:.9g} | {found.gap / size:.1e} | {found.order} "
            f"| {found.nodes} | {seconds:.3f} "
            + " ".join(f"| {ends[-1].gap:.1e} | {ends[-1].seconds:.3f}" for ends in theirs.values())
            + f" | {checked(problem, objective):.3f} |"
        )
        print(lines[-1], flush=True)
    totals = [f"smid {sum(ours):.2f} s"]
    means = [f"smid {mean(ours):.3f} s"]
    for rival, ends in theirs.items():
        spent = [end.seconds for end in ends]
        totals.append(f"{rival} {sum(spent):.2f} s with {sum(end.gap > GAP for end in ends)} not closed")
        means.append(f"{rival} {mean(spent):.3f} s")
    lines += ["", f"In all: {', '.join(totals)}. Geometric mean: {', '.join(means)}."]
    return "\n".join(lines)


def least(act: Callable[[], Found]) -> tuple[Found, float]:
    """Return a result and the least processor time of some runs."""
    taken = []
    for _ in range(TIMES):
        started = time.process_time()
        found = act()
        taken.append(time.process_time() - started)
    return found, min(taken)


def fastest(solve: Callable[[], RivalEnd]) -> RivalEnd:
    """Return the run of least processor time; a long one is not repeated."""
    first = solve()
    others = (solve() for _ in range(TIMES - 1)) if first.seconds < LIMIT / TIMES else ()
    return min([first, *others], key=lambda end: end.seconds)


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
