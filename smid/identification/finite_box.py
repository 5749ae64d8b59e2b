"""A finite, certified box for every parameter that the model leaves unbounded.

The general derivation is :mod:`relaxations.search.boxes`. It fails where a parameter occurs only in a product with a
factor that can vanish, as in ``(1 + alpha) gamma`` of a Hammerstein model with unit DC gain: at alpha = -1 every gamma
fits. There the product delta = q gamma is bounded first, then q away from zero, and gamma = delta / q follows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import sympy

from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem, polynomials_from_sympy
from relaxations.proof.bounding import relax
from relaxations.proof.proof_steps import Bound, Quotient, Recorder
from relaxations.search.boxes import derive_box
from relaxations.search.enclosure import contracted, uninterrupted
from relaxations.search.hierarchy import intervals
from relaxations.search.plan import Plan
from relaxations.solvers import Solver
from smid.feasible.feasible_set import FeasibleSet
from smid.feasible.template import flat_lines
from smid.identification.first_guess import equation_error_fit, magnitudes
from smid.models import Model, Parameter


@dataclass(frozen=True)
class Boxed:
    """A feasible set with the box that was proven for it.

    Parameters
    ----------
    derived, unbounded
        Parameters whose box was proven from the data, and those for which none could be proven.
    stated
        What a proof of the box states (:mod:`relaxations.proof.proof_steps`): without the box; with the products that
        were bounded first, where there are any, and with the missing samples.
    """

    feasible: FeasibleSet
    derived: tuple[str, ...]
    unbounded: tuple[str, ...]
    stated: PolynomialProblem


def with_finite_box(
    feasible: FeasibleSet,
    solver: Solver = "clarabel",
    progress: Callable[[str], None] | None = None,
    record: Recorder | None = None,
) -> Boxed:
    """Return a feasible set with a proven finite box for its unbounded variables, or name those without one.

    It does without the missing samples and the equations that read them (:mod:`smid.identification.missing`).
    """
    whole, feasible = feasible.problem, feasible.without(feasible.missing)
    problem = feasible.problem
    names = problem.unbounded
    if not names:
        return Boxed(feasible, (), (), whole)
    if set(names) - {p.name for p in feasible.model.parameters}:
        # A latent signal without a box gets one from the boxes of the parameters that define it.
        return Boxed(feasible, (), names, whole)
    factors = vanishing_factors(feasible.model, names)
    if not factors:
        box = derive_box(problem, _guess(feasible), solver, progress, record)
        return Boxed(feasible.with_problem(box.problem), box.derived, box.unbounded, whole)

    # Prove a box for the products delta = q gamma first.
    products = _in_products(feasible, factors)
    stated = _stated(feasible.model, whole, products.problem, factors)
    box = derive_box(products.problem, _guess(products), solver, progress, record)
    if box.unbounded:
        return Boxed(feasible, (), names, whole)
    # Bound q away from zero, and divide.
    reach = _reach(products, box.problem, factors, solver, record)
    if reach is None:
        return Boxed(feasible, (), names, whole)
    if record:
        for row, name in enumerate(factors, start=stated.equalities.n_rows - len(factors)):
            record(Quotient(stated, row, stated.names.index(name)))
    # Intersect with the box that is known.
    lower, upper = problem.lower.copy(), problem.upper.copy()
    place = {name: k for k, name in enumerate(problem.names)}
    for name, limit in reach.items():
        lower[place[name]] = max(lower[place[name]], -limit)
        upper[place[name]] = min(upper[place[name]], limit)
    # Parameters that were loose beside the products carry the box that was proven for them there.
    shared = {n: k for k, n in enumerate(box.problem.names)}
    for name in names:
        if name not in reach:
            lower[place[name]], upper[place[name]] = box.problem.lower[shared[name]], box.problem.upper[shared[name]]
    return Boxed(feasible.with_problem(problem.with_box(lower, upper)), names, (), stated)


def vanishing_factors(model: Model, names: tuple[str, ...]) -> dict[str, sympy.Expr]:
    """Return the factor q of every parameter that occurs only times a factor q of other parameters.

    Examples
    --------
    >>> from smid.models import Hammerstein
    >>> vanishing_factors(Hammerstein(powers=(3,), stable=True), ("gamma1",))
    {'gamma1': alpha + 1}
    """
    symbols = {p.symbol for p in model.parameters}
    found: dict[str, sympy.Expr] = {}
    for parameter in model.parameters:
        if parameter.name not in names:
            continue
        common: sympy.Expr | None = None
        for line in flat_lines(model):
            if parameter.symbol not in line.free_symbols:
                continue
            _, factors = sympy.factor_list(sympy.expand(sympy.diff(line, parameter.symbol)))
            own = sympy.Mul(*(f**e for f, e in factors if f.free_symbols and f.free_symbols <= symbols))
            common = own if common is None else sympy.gcd(common, own)
        if common is not None and common.free_symbols:
            found[parameter.name] = common
    return found


def _in_products(feasible: FeasibleSet, factors: dict[str, sympy.Expr]) -> FeasibleSet:
    """Return the feasible set in delta = q gamma; leaving out the priors on gamma only enlarges it."""
    model = feasible.model
    gone = {model.parameter(name).symbol for name in factors}
    model = replace(model, constraints=tuple(c for c in model.constraints if not c.free_symbols & gone), values={})
    for name, factor in factors.items():
        product = Parameter(f"{name}_product")
        model = model.substitute(name, product.symbol / factor, [product])
    products = FeasibleSet(model, feasible.data, feasible.noise_bound, feasible.free_channel)
    products = products.without(products.missing)
    # The box of the latents (and of a free noise bound) is the one that the caller has by now.
    old = {name: k for k, name in enumerate(feasible.problem.names)}
    lower, upper = products.problem.lower.copy(), products.problem.upper.copy()
    for k, name in enumerate(products.problem.names):
        if name in old:
            lower[k], upper[k] = feasible.problem.lower[old[name]], feasible.problem.upper[old[name]]
    return products.with_problem(products.problem.with_box(lower, upper))


def _stated(
    model: Model, problem: PolynomialProblem, other: PolynomialProblem, factors: dict[str, sympy.Expr]
) -> PolynomialProblem:
    """Return the set in gamma and in delta together, with ``delta = q gamma`` as the last equalities."""
    new = tuple(name for name in other.names if name not in problem.names)
    names = (*problem.names, *new)
    symbols = {name: sympy.Symbol(name, real=True) for name in (*(p.name for p in model.parameters), *new)}
    definitions = polynomials_from_sympy(
        [symbols[f"{name}_product"] - factor * symbols[name] for name, factor in factors.items()],
        list(symbols.values()),
    )
    numbers = {name: k for k, name in enumerate(names)}
    of_products = np.array([numbers[name] for name in other.names])
    of_definitions = np.array([numbers[name] for name in symbols])
    k = [other.names.index(name) for name in new]
    return PolynomialProblem(
        names,
        np.append(problem.lower, other.lower[k]),
        np.append(problem.upper, other.upper[k]),
        Polynomials.join(
            [problem.equalities, other.equalities.renumbered(of_products), definitions.renumbered(of_definitions)]
        ),
        Polynomials.join([problem.inequalities, other.inequalities.renumbered(of_products)]),
    )


def _reach(
    products: FeasibleSet,
    boxed: PolynomialProblem,
    factors: dict[str, sympy.Expr],
    solver: Solver,
    record: Recorder | None,
) -> dict[str, float] | None:
    """Bound every q away from zero, contract the box on the way, and divide."""
    place = {name: k for k, name in enumerate(boxed.names)}
    plan = Plan.of(boxed)
    names = boxed.names[: len(products.model.parameters)]
    distinct = list(dict.fromkeys(factors.values()))
    both = [sign * factor for factor in distinct for sign in (1, -1)]
    polynomials = polynomials_from_sympy(both, [sympy.Symbol(name, real=True) for name in names])

    def away(problem: PolynomialProblem, order: int) -> list[float]:
        """Return for each q how far it is proven to stay from zero: q >= forward, or q <= -backward."""
        relaxed = relax(problem, plan.method, order, solver)
        distances = []
        for objectives in np.arange(polynomials.n_rows).reshape(-1, 2):
            best = -np.inf
            for k in objectives:
                objective = polynomials.take(np.array([k]))
                certified = relaxed.bound(objective)
                best = max(best, certified.bound)
                if certified.bound > 0:
                    if record:
                        record(Bound.of(relaxed, objective, certified))
                    break
            distances.append(best)
        return distances

    # Try the least order on the given box, then the highest one on a contracted box.
    problem = boxed
    distances = away(problem, plan.least)
    if min(distances) <= 0:
        targets = [place[p.name] for p in products.model.parameters]
        enclosure = uninterrupted(intervals(boxed, targets, solver=solver, rounds=4, witnesses=False, record=record))
        problem = contracted(boxed, enclosure) if enclosure.empty is None else boxed
        distances = away(problem, plan.order)
    if min(distances) <= 0:
        return None
    reach = {}
    for name, factor in factors.items():
        away_from_zero = distances[distinct.index(factor)]
        k = place[f"{name}_product"]
        largest = max(abs(problem.lower[k]), abs(problem.upper[k]))
        # An empty set is bounded by anything; the caller will prove it empty.
        reach[name] = (
            float(np.nextafter(largest / away_from_zero * (1 + 1e-15), np.inf))
            if np.isfinite(away_from_zero)
            else largest
        )
    return reach


def _guess(feasible: FeasibleSet) -> np.ndarray:
    """Return a guess of the size of every variable."""
    parameters, rms = equation_error_fit(feasible)
    return magnitudes(feasible, parameters, rms)
