"""A sub-box: a box of the parameters on which some kinks are decided and the others are replaced by their hulls.

A sub-box is contracted by certified bounds and built anew while this shrinks it, because a smaller box decides more
kinks. It is split at a threshold where a sample changes sides, so that finitely many splits decide all samples. Where
an argument holds noise, one sample's kink is taken on each of its two sides (a positive part only: a sign that is zero
belongs to neither side).

While a parameter has no finite box, the equalities that read it are left out. The rest may contract the thresholds or
prove the sub-box empty: a threshold beyond the largest input sample would allow any gain, but the output contradicts
it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.polynomial import Polynomials
from relaxations.points.witness import find_witness
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.bounding import Emptiness, Relaxed, relax
from relaxations.proof.proof_steps import Bound, Recorder
from relaxations.search.boxes import derive_box
from relaxations.search.interval_state import Ends, shrinkage
from relaxations.search.plan import Plan
from relaxations.solvers import Solver
from smid.data import Dataset
from smid.feasible.assemble import CONSTANT, Opening, Sides
from smid.feasible.feasible_set import FeasibleSet
from smid.feasible.piecewise_functions import Kind
from smid.feasible.regimes import Side
from smid.identification.finite_box import with_finite_box
from smid.identification.first_guess import equation_error_fit, magnitudes
from smid.identification.piecewise_proof import Trail
from smid.identification.products import products_needed
from smid.models import ModelError

ROUNDS = 4  # contractions of one sub-box
WORTH = 0.1  # a contraction that takes less off every width is the last one
Points = Mapping[tuple[int, int], Array]
NARROW = 1e-3  # a threshold below this share of its first width is no longer split


@dataclass(frozen=True)
class Region:
    """The place of a sub-box: a box of the parameters, shape (n_parameters,), and the sides of the kinks split off.

    ``trail`` keeps the proof.
    """

    lower: Array
    upper: Array
    choose: Sides
    trail: Trail = field(default_factory=Trail)


@dataclass(frozen=True)
class SubBox:
    """A contracted region: no feasible parameter of the region lies outside the sub-box's box (certified).

    ``feasible`` is the set on that box. ``points`` are the set's points where the relaxation attains each end (+1:
    lower, -1: upper). A settled sub-box can be improved no further.
    """

    region: Region
    feasible: FeasibleSet
    points: Points
    solves: int = 0
    largest_block: int = 0
    n_moments: int = 0
    settled: bool = False

    def end(self, k: int, sign: int) -> float:
        """Return ``sign`` times an outer end, to be minimised."""
        return float(self.region.lower[k] if sign > 0 else -self.region.upper[k])


def contract(feasible: FeasibleSet, region: Region, solver: Solver) -> SubBox | Emptiness:
    """Contract a region with a finite box, or prove it empty; ModelError where the lift does not apply."""
    sub_box = SubBox(region, feasible.on_box(region.lower, region.upper, region.choose), {})
    for _ in range(ROUNDS):
        with region.trail.on(sub_box.feasible) as record:
            found = _bounds(sub_box.feasible, sub_box.feasible.problem, solver, record)
        if isinstance(found, Emptiness):
            return found
        ends, points, relaxed = found
        width = sub_box.region.upper - sub_box.region.lower
        smaller = feasible.on_box(ends.lower, ends.upper, region.choose)
        sub_box = SubBox(
            replace(region, lower=ends.lower, upper=ends.upper),
            smaller,
            {end: _carried(point, sub_box.feasible, smaller) for end, point in points.items()},
            sub_box.solves + ends.solves,
            relaxed.relaxation.largest_block,
            relaxed.relaxation.n_moments,
        )
        if shrinkage(width, ends.upper - ends.lower) < WORTH:
            break
    return sub_box


def boxed(feasible: FeasibleSet, region: Region, solver: Solver) -> Region | Emptiness | tuple[str, ...]:
    """Give every parameter of a region a finite box, or prove the region empty, or name parameters without one."""
    lower, upper = region.lower.copy(), region.upper.copy()
    loose = np.flatnonzero(~np.isfinite(upper - lower))
    if not len(loose):
        return region
    for _ in range(ROUNDS):
        stamped = feasible.on_box(lower, upper, region.choose)
        problem, equalities = stamped.problem.without(loose)
        with region.trail.on(stamped) as record:
            found = _bounds(stamped, problem, solver, record)
        if isinstance(found, Emptiness):
            weights = np.zeros(stamped.problem.equalities.n_rows)
            weights[equalities] = found.weights
            return Emptiness(found.margin, weights)
        fixed = np.isfinite(upper - lower)
        before = (upper - lower)[fixed]
        lower[fixed], upper[fixed] = found[0].lower[fixed], found[0].upper[fixed]
        if shrinkage(before, (upper - lower)[fixed]) < WORTH:
            break
    stamped = feasible.on_box(lower, upper, region.choose)
    if products_needed(stamped.model, stamped.problem.unbounded):
        box = with_finite_box(stamped, solver)
        problem, unbounded = box.feasible.problem, box.unbounded
    else:
        with region.trail.on(stamped) as record:
            derived = derive_box(stamped.problem, _guess(stamped), solver, record=record)
        problem, unbounded = derived.problem, derived.unbounded
    if unbounded:
        return unbounded
    count = len(lower)
    return replace(region, lower=problem.lower[:count], upper=problem.upper[:count])


def lifted(name: str, problem: PolynomialProblem) -> Plan:
    """Return the plan of the parametric lift; ModelError where it does not apply to the kinks."""
    plan = Plan.of(problem)
    if not plan.lifts:
        raise ModelError(
            f"Max, Min, Abs or sign in the model {name!r} are raised to a power, or multiply too many unknowns: only "
            "their products with a few parameters can be bounded; put them where they enter linearly, or fix parameters"
        )
    return plan


def _bounds(
    stamped: FeasibleSet, problem: PolynomialProblem, solver: Solver, record: Recorder | None
) -> tuple[Ends, Points, Relaxed] | Emptiness:
    """Bound the parameters of a problem once; return the ends, the points that attain them, and the relaxation."""
    plan = lifted(stamped.model.name, problem)
    relaxed = relax(problem, plan.method, plan.least, solver)
    count = len(stamped.model.parameters)
    lower, upper = stamped.problem.lower[:count], stamped.problem.upper[:count]
    ends = Ends(lower.copy(), upper.copy(), 0.0, 0.0, [])
    place = {name: k for k, name in enumerate(problem.names)}
    points: dict[tuple[int, int], Array] = {}
    for k, name in enumerate(stamped.problem.names[:count]):
        if name not in place or lower[k] == upper[k]:
            continue
        for sign in (1, -1):
            objective = problem.variable(place[name], sign)
            certified = relaxed.bound(objective)
            ends.solves += 1
            if certified.certificate is None:
                continue
            if ends.tighten(k, sign, certified.bound) > 0 and record:
                record(Bound.of(relaxed, objective, certified))
            if certified.bound == np.inf or ends.lower[k] > ends.upper[k]:
                return relaxed.emptiness(certified.certificate)
            if certified.point is not None:
                points[k, sign] = certified.point
    return ends, points, relaxed


def _guess(stamped: FeasibleSet) -> Array:
    """Return a guess of magnitudes, with every kink on its side in the middle of the box."""
    count = len(stamped.model.parameters)
    lower, upper = stamped.problem.lower[:count], stamped.problem.upper[:count]
    parameters, rms = equation_error_fit(
        stamped.on_box(lower, upper, sides_at(stamped.openings, stamped.data, middle(stamped)))
    )
    return magnitudes(stamped, parameters, rms)


def middle(stamped: FeasibleSet) -> Array:
    """Return the middle of the box, zero where it has none."""
    lower, upper = stamped.problem.lower, stamped.problem.upper
    loose = ~np.isfinite(upper - lower)
    return np.where(loose, 0.0, 0.5 * np.where(loose, 0.0, lower) + 0.5 * np.where(loose, 0.0, upper))


def _carried(point: Array, source: FeasibleSet, target: FeasibleSet) -> Array:
    """Return a point of one set by the variables of another; new variables are in the middle of their range."""
    values = dict(zip(source.problem.names, point.tolist(), strict=True))
    inside = middle(target)
    return np.array([values.get(name, inside[k]) for k, name in enumerate(target.problem.names)])


def sides_at(openings: Sequence[Opening], data: Dataset, point: Array) -> dict[tuple[str, int], Index]:
    """Return the side of every open kink at a point; the kinks' own values are computed from their arguments."""
    point = np.nan_to_num(point)
    sides: dict[tuple[str, int], Index] = {}
    for opening in openings:
        arguments = opening.arguments.evaluate(point)
        positive = opening.hinge.kink.kind is Kind.POSITIVE_PART
        point[opening.variables] = np.maximum(arguments, 0.0) if positive else np.sign(arguments)
        sides[opening.hinge.kink.name, opening.experiment] = _table(
            data, opening, opening.times, np.where(arguments >= 0, Side.POSITIVE, Side.NEGATIVE)
        )
    return sides


def _table(data: Dataset, opening: Opening, times: Index, sides: Index) -> Index:
    """Return the sides of one opening, open but for the given times."""
    n = 1 if opening.experiment == CONSTANT else data.experiments[opening.experiment].n_samples
    table = np.full(n, Side.OPEN, dtype=np.int64)
    table[times] = sides
    return table


def witness(sub_box: SubBox, k: int, sign: int) -> Array | None:
    """Return verified parameters near one end of a sub-box, with every kink on its side in the relaxation."""
    point = sub_box.points.get((k, sign))
    return None if point is None else witness_near(sub_box.feasible, sub_box.region, point, k, sign)


def witness_near(feasible: FeasibleSet, region: Region, point: Array, k: int, sign: int) -> Array | None:
    """Return verified parameters that push one end outwards, by a search from a point; None if not found."""
    chosen = (
        {**region.choose, **sides_at(feasible.openings, feasible.data, point)} if feasible.openings else region.choose
    )
    exact = feasible.on_box(region.lower, region.upper, chosen)
    problem = exact.problem
    start = _carried(point, feasible, exact)
    found = find_witness(problem, problem, problem.variable(k, sign), Plan.of(problem).complicating, start)
    return None if found is None else found.point[: len(region.lower)]


def split(sub_box: SubBox, first_width: Array) -> tuple[Region, ...]:
    """Cut a sub-box with open kinks in two regions that cover it; empty where no cut helps."""
    region, openings = sub_box.region, sub_box.feasible.openings
    count = len(region.lower)
    read = np.unique(np.concatenate([o.arguments.occurring() for o in openings]))
    width = region.upper - region.lower
    share = np.where(first_width > 0, width / np.where(first_width > 0, first_width, 1.0), 0.0)
    share[np.setdiff1d(np.arange(count), read)] = 0.0
    cut = int(np.argmax(share))
    if share[cut] > NARROW:
        low, high = region.lower.copy(), region.upper.copy()
        low[cut] = high[cut] = _breakpoint(openings, cut, region)
        name, where = sub_box.feasible.problem.names[cut], float(low[cut])
        return (
            Region(region.lower, high, region.choose, region.trail.part(name, float(region.lower[cut]), where)),
            Region(low, region.upper, region.choose, region.trail.part(name, where, float(region.upper[cut]))),
        )
    return _by_side(sub_box)


def _breakpoint(openings: tuple[Opening, ...], cut: int, region: Region) -> float:
    """Return where to cut a threshold: at a sample's change of sides if one lies in the middle half."""
    low, high = region.lower[cut], region.upper[cut]
    centre = float(0.5 * low + 0.5 * high)
    roots = np.concatenate([_roots(o.arguments, cut) for o in openings])
    inside = roots[np.abs(roots - centre) < 0.25 * (high - low)]
    return float(inside[np.argmin(np.abs(inside - centre))]) if len(inside) else centre


def _roots(arguments: Polynomials, variable: int) -> Array:
    """Return where those arguments vanish that read nothing but one variable, linearly."""
    degrees, factors, mid = arguments.term_degrees, arguments.factors, arguments.coefficients.mid
    own = (degrees == 1) & (factors.max(axis=1, initial=-1) == variable)
    slope = np.bincount(arguments.rows, np.where(own, mid, 0.0), arguments.n_rows)
    constant = np.bincount(arguments.rows, np.where(degrees == 0, mid, 0.0), arguments.n_rows)
    others = np.bincount(arguments.rows, ~own & (degrees > 0), arguments.n_rows)
    usable = (others == 0) & (slope != 0)
    return np.asarray(-constant[usable] / slope[usable], dtype=np.float64)


def _by_side(sub_box: SubBox) -> tuple[Region, ...]:
    """Take the positive part with the loosest hull on each of its sides."""
    candidates = [o for o in sub_box.feasible.openings if o.hinge.kink.kind is Kind.POSITIVE_PART]
    if not candidates:
        return ()
    # The hull's largest error is U / (1 - U / L), at zero; both are open, so that L < 0 < U.
    errors = [o.within.high / (1 - o.within.high / o.within.low) for o in candidates]
    worst = int(np.argmax([e.max() for e in errors]))
    opening = candidates[worst]
    place = int(np.argmax(errors[worst]))
    at = opening.times[place]
    key = (opening.hinge.kink.name, opening.experiment)
    parts = []
    for side in (Side.NEGATIVE, Side.POSITIVE):
        nothing = np.zeros(0, dtype=np.int64)
        table = sub_box.region.choose.get(key, _table(sub_box.feasible.data, opening, nothing, nothing)).copy()
        table[at] = side
        trail = sub_box.region.trail.part(sub_box.feasible.problem.names[opening.variables[place]], side=int(side))
        parts.append(Region(sub_box.region.lower, sub_box.region.upper, {**sub_box.region.choose, key: table}, trail))
    return tuple(parts)
