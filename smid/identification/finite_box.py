"""A finite, certified box for every parameter that the model leaves unbounded.

The general derivation is :mod:`relaxations.search.boxes`. Where parameters without a box multiply each other, or a
factor that can vanish, a box is derived for such products first (:mod:`smid.identification.products`). A parameter
follows by division: with ``delta = q gamma`` and q bounded away from zero, gamma = delta / q. Then gamma may be the
factor of another parameter.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import sympy

from relaxations.algebra.arrays import Array
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
from smid.identification.first_guess import equation_error_fit, magnitudes
from smid.identification.products import in_products, products_needed
from smid.models import Model


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
    definitions = products_needed(feasible.model, names)
    if not definitions:
        box = derive_box(problem, _guess(feasible), solver, progress, record)
        return Boxed(feasible.with_problem(box.problem), box.derived, box.unbounded, whole)

    # Prove a box for the products first.
    products = _in_products(feasible, definitions)
    if products.openings:
        return Boxed(feasible, (), names, whole)
    stated = _stated(feasible.model, whole, products.problem, definitions)
    box = derive_box(products.problem, _guess(products), solver, progress, record)
    if box.unbounded:
        return Boxed(feasible, (), names, whole)
    # Divide, and intersect with the box that is known.
    count = len(feasible.model.parameters)
    divided = _divided(box.problem, stated, problem.names[:count], definitions, solver, record)
    if divided is None:
        return Boxed(feasible, (), names, whole)
    lower, upper = problem.lower.copy(), problem.upper.copy()
    place = {name: k for k, name in enumerate(divided.names)}
    for k, name in enumerate(problem.names):
        if name in names:
            lower[k] = max(lower[k], divided.lower[place[name]])
            upper[k] = min(upper[k], divided.upper[place[name]])
    return Boxed(feasible.with_problem(problem.with_box(lower, upper)), names, (), stated)


def _in_products(feasible: FeasibleSet, definitions: dict[str, sympy.Expr]) -> FeasibleSet:
    """Return the feasible set in the products."""
    model = in_products(feasible.model, definitions)
    products = FeasibleSet(model, feasible.data, feasible.noise_bound, feasible.free_channel)
    if products.openings:
        # The box that the caller has by now may decide the kinks.
        count = len(model.parameters)
        lower, upper = (ends[:count] for ends in _known_box(products.problem, feasible.problem))
        products = products.on_box(lower, upper)
    products = products.without(products.missing)
    return products.with_problem(products.problem.with_box(*_known_box(products.problem, feasible.problem)))


def _known_box(problem: PolynomialProblem, other: PolynomialProblem) -> tuple[Array, Array]:
    """Return the box of a problem, with the ends of another one for the variables of both."""
    place = {name: k for k, name in enumerate(other.names)}
    lower, upper = problem.lower.copy(), problem.upper.copy()
    for k, name in enumerate(problem.names):
        if name in place:
            lower[k], upper[k] = other.lower[place[name]], other.upper[place[name]]
    return lower, upper


def _stated(
    model: Model, problem: PolynomialProblem, other: PolynomialProblem, definitions: dict[str, sympy.Expr]
) -> PolynomialProblem:
    """Return the set in parameters and in products together, with the definitions as the last equalities."""
    names = (*problem.names, *definitions)
    numbers = {name: k for k, name in enumerate(names)}
    k = [other.names.index(name) for name in definitions]
    of_products = np.array([numbers[name] for name in other.names])
    return PolynomialProblem(
        names,
        np.append(problem.lower, other.lower[k]),
        np.append(problem.upper, other.upper[k]),
        Polynomials.join(
            [
                problem.equalities,
                other.equalities.renumbered(of_products),
                _of_parameters(
                    [sympy.Symbol(name, real=True) - own for name, own in definitions.items()],
                    [*(p.name for p in model.parameters), *definitions],
                    names,
                ),
            ]
        ),
        Polynomials.join([problem.inequalities, other.inequalities.renumbered(of_products)]),
    )


def _divided(
    known: PolynomialProblem,
    stated: PolynomialProblem,
    parameters: Sequence[str],
    definitions: dict[str, sympy.Expr],
    solver: Solver,
    record: Recorder | None,
) -> PolynomialProblem | None:
    """Return the problem in products with the other parameters and their boxes; None where one gets no box."""
    first = stated.equalities.n_rows - len(definitions)
    while left := [name for name in parameters if name not in known.names]:
        # Bound every factor of a parameter, in parameters that have a box, away from zero.
        factors = {
            (name, product): factor
            for name in left
            for product, own in definitions.items()
            if (factor := _factor(own, name)) is not None and {str(s) for s in factor.free_symbols} <= {*known.names}
        }
        distinct = list(dict.fromkeys(factors.values()))
        distances = dict(zip(distinct, _away_from_zero(known, distinct, parameters, solver, record), strict=True))
        boxes: dict[str, float] = {}
        for (name, product), factor in factors.items():
            if distances[factor] <= 0:
                continue
            k = known.names.index(product)
            largest = max(abs(known.lower[k]), abs(known.upper[k]))
            # An empty set is bounded by anything; the caller will prove it empty.
            reach = largest if np.isinf(distances[factor]) else largest / distances[factor] * (1 + 1e-15)
            boxes[name] = min(boxes.get(name, np.inf), float(np.nextafter(reach, np.inf)))
            if record:
                record(Quotient(stated, first + list(definitions).index(product), stated.names.index(name)))
        if not boxes:
            return None
        known = _with_parameters(known, boxes, definitions)
    return known


def _factor(product: sympy.Expr, name: str) -> sympy.Expr | None:
    """Return the factor of a parameter in a product; None where the product is not the parameter times one."""
    own = sympy.Poly(product, sympy.Symbol(name, real=True))
    return own.LC() if own.monoms() == [(1,)] else None


def _with_parameters(
    known: PolynomialProblem, boxes: dict[str, float], definitions: dict[str, sympy.Expr]
) -> PolynomialProblem:
    """Return the problem with further parameters, and the definitions that read them and no unknown ones."""
    names = (*known.names, *boxes)
    reach = np.array([*boxes.values()])
    whole = [
        sympy.Symbol(name, real=True) - own
        for name, own in definitions.items()
        if {str(s) for s in own.free_symbols} <= {*names} and {str(s) for s in own.free_symbols} & {*boxes}
    ]
    read = sorted({str(s) for row in whole for s in row.free_symbols})
    return replace(
        known,
        names=names,
        lower=np.append(known.lower, -reach),
        upper=np.append(known.upper, reach),
        equalities=Polynomials.join([known.equalities, _of_parameters(whole, read, names)]),
    )


def _of_parameters(expressions: Sequence[sympy.Expr], read: Sequence[str], names: Sequence[str]) -> Polynomials:
    """Return polynomials in some of the variables with these names."""
    own = polynomials_from_sympy(expressions, [sympy.Symbol(name, real=True) for name in read])
    return own.renumbered(np.array([names.index(name) for name in read], dtype=np.int64))


def _away_from_zero(
    known: PolynomialProblem,
    factors: Sequence[sympy.Expr],
    parameters: Sequence[str],
    solver: Solver,
    record: Recorder | None,
) -> list[float]:
    """Return for each q how far it is proven to stay from zero: q >= distance, or q <= -distance."""
    if not factors:
        return []
    plan = Plan.of(known)
    read = sorted({str(s) for factor in factors for s in factor.free_symbols})
    polynomials = _of_parameters([sign * factor for factor in factors for sign in (1, -1)], read, known.names)

    def away(problem: PolynomialProblem, order: int) -> list[float]:
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
    distances = away(known, plan.least)
    if min(distances) <= 0:
        targets = [k for k, name in enumerate(known.names) if name in parameters]
        enclosure = uninterrupted(intervals(known, targets, solver=solver, rounds=4, witnesses=False, record=record))
        if enclosure.empty is None:
            known = contracted(known, enclosure)
        distances = away(known, plan.order)
    return distances


def _guess(feasible: FeasibleSet) -> np.ndarray:
    """Return a guess of the size of every variable."""
    parameters, rms = equation_error_fit(feasible)
    return magnitudes(feasible, parameters, rms)
