"""Sign symmetry and term sparsity beside the plain and the sparse relaxation: blocks, moments, CPU seconds, bounds.

First three quartic problems of which correlative sparsity sees nothing, or little:

- wells pushed by a dense quadratic form: all signs may change at once, and every variable meets every other;
- the Rosenbrock function of n variables on a ball, which joins all of them in one constraint (minimum 0 at all ones);
- double wells on a torus with couplings of random sign, a spin glass of soft spins.

Then a chain of easy cliques with one hard problem at its end, where an order for each clique pays.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from itertools import combinations

import numpy as np

from relaxations.algebra.polynomial import Polynomials
from relaxations.errors import ProblemError
from relaxations.library import load
from relaxations.moments.lasserre_hierarchy import groups
from relaxations.points.local_search import local_minimum
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.bounding import relax
from relaxations.search.orders import not_flat

ORDER = 2
STARTS = 20
LENGTH, CHAINED = 10, 4
Terms = dict[tuple[int, ...], float]
Stated = tuple[str, PolynomialProblem, Polynomials]


def _stated(name: str, n: int, reach: float, objective: Terms, inequalities: Sequence[Terms] = ()) -> Stated:
    problem = PolynomialProblem(
        tuple(f"x{k}" for k in range(n)),
        np.full(n, -reach),
        np.full(n, reach),
        Polynomials.empty(),
        Polynomials.from_terms(inequalities),
    )
    return f"{name}, {n} variables", problem, Polynomials.from_terms([objective])


def wells(n: int) -> Stated:
    """Return ``sum x_i^4 + x' Q x`` with a random Q."""
    rng = np.random.default_rng(0)
    objective: Terms = {(i,) * 4: 1.0 for i in range(n)}
    objective |= {(j, i): float(rng.normal()) for i in range(n) for j in range(i + 1)}
    return _stated("wells", n, 2.0, objective)


def rosenbrock(n: int) -> Stated:
    """Return ``sum 10 (x_i - x_(i-1)^2)^2 + (1 - x_i)^2`` on the ball of radius ``sqrt(n)``."""
    objective: Terms = {(): n - 1.0}
    for i in range(1, n):
        p = i - 1
        own = {(i, i): 11.0, (p, p, i): -20.0, (p,) * 4: 10.0, (i,): -2.0}
        objective |= {m: objective.get(m, 0.0) + c for m, c in own.items()}
    return _stated("Rosenbrock on a ball", n, 1.5, objective, [{(): float(n)} | {(k, k): -1.0 for k in range(n)}])


def torus(side: int) -> Stated:
    """Return ``sum x_i^4 - x_i^2 + sum c_ij x_i x_j`` over the edges of a torus, every c one half or minus that."""
    rng = np.random.default_rng(0)
    objective: Terms = {}
    for a in range(side):
        for b in range(side):
            i = a * side + b
            objective |= {(i,) * 4: 1.0, (i, i): -1.0}
            for j in (((a + 1) % side) * side + b, a * side + (b + 1) % side):
                objective[min(i, j), max(i, j)] = float(rng.choice([-0.5, 0.5]))
    return _stated("torus", side * side, 1.5, objective)


def chain() -> Stated:
    """Return quartics over any four variables in a row, ten in all, and gms_Bex3_1_4 joined to the last of them."""
    rng = np.random.default_rng(0)
    objective: Counter[tuple[int, ...]] = Counter()
    for first in range(LENGTH - CHAINED + 1):
        own = range(first, first + CHAINED)
        objective.update({m: 1.0 for i in own for m in ((i,) * 4, (i, i))})
        objective.update({(i,): float(rng.normal()) for i in own})
        objective.update({m: 0.3 * float(rng.normal()) for m in combinations(own, 2)})
    case = load("gms_Bex3_1_4")
    last = case.problem
    objective.update(_moved(case.objective, 0))
    objective[LENGTH - 1, LENGTH] += 0.05
    problem = PolynomialProblem(
        tuple(f"x{k}" for k in range(LENGTH + last.n_variables)),
        np.r_[np.full(LENGTH, -1.5), last.lower],
        np.r_[np.full(LENGTH, 1.5), last.upper],
        Polynomials.empty(),
        Polynomials.from_terms([_moved(last.inequalities, row) for row in range(last.inequalities.n_rows)]),
    )
    return f"a chain of {LENGTH} variables and gms_Bex3_1_4", problem, Polynomials.from_terms([objective])


def _moved(polynomials: Polynomials, row: int) -> Terms:
    own = polynomials.take(np.array([row]))
    pairs = zip(own.factors.tolist(), own.coefficients.mid.tolist(), strict=True)
    return {tuple(v + LENGTH for v in factors if v >= 0): c for factors, c in pairs}


PLAIN, SPARSE = ("textbook", 1), ("sparse", 1)
CASES = (
    (wells(10), (PLAIN, SPARSE, ("chordal", 1), ("chordal", 2))),
    (rosenbrock(10), (PLAIN, SPARSE, ("terms", 1), ("chordal", 1), ("chordal", 2))),
    (rosenbrock(20), (SPARSE, ("chordal", 1), ("chordal", 2))),
    (rosenbrock(40), (SPARSE, ("chordal", 1))),
    (torus(4), (PLAIN, SPARSE, ("terms", 1), ("terms", 2), ("chordal", 1))),
    (torus(6), (("terms", 1), ("chordal", 1))),
)


def run() -> str:
    """Return the table as Markdown."""
    lines = [
        "## Sign symmetry and term sparsity",
        "",
        f"All rows have order {ORDER}, and each bound is computed once. All methods use cliques of variables. `sparse` "
        "also splits by sign symmetry; `terms` and `chordal` split by terms, with the stated number of steps. The best "
        f"value is the best of {STARTS} local searches.",
        "",
        "| problem | method | steps | largest block | moments | CPU s | certified bound | best value |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for (name, problem, objective), ways in CASES:
        best = _best(problem, objective)
        for method, steps in ways:
            lines.append(
                f"| {name} | {method} | {steps} | {_measured(problem, objective, method, steps)} | {best:.6f} |"
            )
            print(lines[-1], flush=True)
    return "\n".join([*lines, *_own_orders()])


def _own_orders() -> list[str]:
    """Return a second table: order 3 everywhere, beside order 3 where the moments of order 2 are not flat."""
    name, problem, objective = chain()
    lines = [
        "",
        f"One order for each clique, which `minimise` tries first. Problem: {name}, "
        f"cliques of at most {CHAINED} variables.",
        "",
        "| order | cliques of order 3 | moments | CPU s | certified bound | best value |",
        "|---|---|---|---|---|---|",
    ]
    best = _best(problem, objective)
    cliques = range(len(groups(problem, ORDER, "sparse", objective)))
    raised: set[int] = set()
    for title in ("2", "3 where not flat", "3"):
        order = tuple(ORDER + (k in raised) for k in cliques)
        started = time.process_time()
        relaxed = relax(problem, "sparse", order, objective=objective)
        certified = relaxed.bound(objective)
        seconds = time.process_time() - started
        lines.append(
            f"| {title} | {len(raised)} of {len(cliques)} | {relaxed.relaxation.n_moments} | {seconds:.1f} "
            f"| {certified.bound:.6f} | {best:.6f} |"
        )
        raised = set(cliques) if raised else not_flat(relaxed, objective, certified, order)
        print(lines[-1], flush=True)
    return lines


def _measured(problem: PolynomialProblem, objective: Polynomials, method: str, steps: int) -> str:
    started = time.process_time()
    try:
        relaxed = relax(problem, method, ORDER, objective=objective, steps=steps)
    except ProblemError:
        return "refused: beyond the memory | | |"
    bound = relaxed.bound(objective).bound
    seconds = time.process_time() - started
    return f"{relaxed.relaxation.largest_block} | {relaxed.relaxation.n_moments} | {seconds:.1f} | {bound:.6f}"


def _best(problem: PolynomialProblem, objective: Polynomials) -> float:
    starts = np.random.default_rng(0).uniform(problem.lower, problem.upper, (STARTS, problem.n_variables))
    points = [local_minimum(problem, objective, start) for start in starts]
    return round(min(float(objective.evaluate(point)[0]) for point in points if point is not None), 6) + 0.0
