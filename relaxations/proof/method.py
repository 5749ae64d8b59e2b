"""Methods that bound polynomial problems, as objects; their short names are what ``method="..."`` takes.

A relaxation method builds the moment relaxation of a scaled problem. Any object that fulfils :class:`Method` can be
given in place of a short name. A package adds a short name of its own by an entry point in the group
``relaxations.methods`` that leads to such an object.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.metadata import entry_points
from typing import ClassVar, Protocol

from relaxations.algebra.polynomial import Polynomials
from relaxations.errors import ProblemError
from relaxations.moments.lasserre_hierarchy import lasserre, plan
from relaxations.moments.moment import Relaxation
from relaxations.moments.parametric_lift import complicating_variables, least_order, lift, lifted_variables
from relaxations.problem.problem import PolynomialProblem
from relaxations.reductions.products import with_products

Order = int | tuple[int, ...]  # a tuple: one for each clique of the sparse hierarchy


class Method(Protocol):
    """A relaxation method: ``name`` is shown in results, ``order`` is the highest one (None for the usual one)."""

    @property
    def name(self) -> str:
        """Return the name that results show."""

    @property
    def order(self) -> int | None:
        """Return the highest order asked for."""

    def orders(self, problem: PolynomialProblem) -> tuple[int, int]:
        """Return the least order that the degrees allow, and the usual highest one."""

    def check(self, problem: PolynomialProblem, order: int) -> None:
        """Refuse a scaled problem whose relaxation would not fit the memory."""

    def build(self, problem: PolynomialProblem, order: Order, objective: Polynomials | None, steps: int) -> Relaxation:
        """Return the relaxation of a problem that is scaled to [-1, 1]."""


@dataclass(frozen=True)
class _OfLift:
    """The methods of :mod:`relaxations.moments.parametric_lift`."""

    order: int | None = None
    name: ClassVar[str]

    def orders(self, problem: PolynomialProblem) -> tuple[int, int]:
        """Return the least order, and one that has all inequalities.

        That is 2 for at most two complicating variables; more would cost minutes.
        """
        complicating = complicating_variables(problem)
        if complicating is None:
            raise ProblemError("the parametric lift does not apply to this problem: choose method='sparse'")
        least = least_order([problem.equalities], complicating)
        whole = least_order([problem.equalities, problem.inequalities], complicating)
        return least, max(whole, 1 if len(complicating) > 2 else 2)

    def check(self, problem: PolynomialProblem, order: int) -> None:
        """Refuse a lift that does not apply or does not fit the memory."""
        lifted_variables(problem, order, self.name)

    def build(self, problem: PolynomialProblem, order: Order, objective: Polynomials | None, _: int) -> Relaxation:
        """Return the lift; it serves every linear objective, and the one that is given."""
        if not isinstance(order, int):
            raise ProblemError(f"the {self.name} has one order: {order} are {len(order)}")
        return lift(problem, order, self.name, objective)


@dataclass(frozen=True)
class _OfLasserre:
    """The methods of :mod:`relaxations.moments.lasserre_hierarchy`.

    With ``products``, order 1 contains products of linear constraints (:mod:`relaxations.reductions.products`).
    """

    order: int | None = None
    products: bool = False
    name: ClassVar[str]

    def orders(self, problem: PolynomialProblem) -> tuple[int, int]:
        """Return half of the highest degree, and 2 where that is less."""
        least = max(1, -(-problem.degree // 2))
        return least, max(least, 2)

    def check(self, problem: PolynomialProblem, order: int) -> None:
        """Refuse a relaxation that does not fit the memory."""
        plan(problem, order, self.name)

    def build(self, problem: PolynomialProblem, order: Order, objective: Polynomials | None, steps: int) -> Relaxation:
        """Return the relaxation; it serves the objective alone where one is given."""
        multiplied = with_products(problem, objective) if self.products and order == 1 else problem
        return lasserre(multiplied, order, self.name, objective, steps)


class Lift(_OfLift):
    """The parametric lift: moments in few complicating variables.

    Examples
    --------
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> from relaxations.search import intervals
    >>> x, y = variables("x y")
    >>> problem, _ = problem_of(x, [x * y == 1, x >= 0, x <= 2, y >= 0, y <= 4])
    >>> found = intervals(problem, [0], method=Lift(order=2))  # as method="lift", order=2
    >>> found.method, round(found.intervals[0].lower, 4)
    ('lift', 0.25)
    """

    name = "lift"


class Rlt(_OfLift):
    """Reformulation-linearisation: the lift as a linear program."""

    name = "rlt"


class Sparse(_OfLasserre):
    """Lasserre's hierarchy on cliques of variables.

    Examples
    --------
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> x, y = variables("x y")
    >>> problem, _ = problem_of(x, [x**4 * y == 1])
    >>> Sparse().orders(problem)
    (3, 3)
    """

    name = "sparse"


class Dense(_OfLasserre):
    """Lasserre's hierarchy on all variables together."""

    name = "dense"


class Terms(_OfLasserre):
    """Lasserre's hierarchy with term sparsity, by blocks."""

    name = "terms"


class Chordal(_OfLasserre):
    """Lasserre's hierarchy with term sparsity, by chordal extension."""

    name = "chordal"


class Textbook(_OfLasserre):
    """Lasserre's hierarchy without facial reduction; it breaks down on equalities."""

    name = "textbook"


@dataclass(frozen=True)
class Cuts:
    """Generalised Benders cuts (:mod:`relaxations.search.benders`); no relaxation.

    Examples
    --------
    >>> Cuts().name
    'benders'
    """

    name: ClassVar[str] = "benders"
    order: ClassVar[None] = None


LIFTS = (Lift, Rlt)
LASSERRE = (Sparse, Dense, Terms, Chordal, Textbook)
_BY_NAME: dict[str, Method] = {kind.name: kind() for kind in (*LIFTS, *LASSERRE)}
_NEEDED = ("name", "order", "orders", "check", "build")


@cache
def _entry_points() -> dict[str, Method]:
    """Return the methods that other packages name."""
    return {point.name: point.load() for point in entry_points(group="relaxations.methods")}


def method_names() -> tuple[str, ...]:
    """Return what ``method=`` takes: the built-in short names, then those of other packages.

    Examples
    --------
    >>> method_names()[:4]
    ('auto', 'benders', 'lift', 'rlt')
    """
    return ("auto", Cuts.name, *_BY_NAME, *(point.name for point in entry_points(group="relaxations.methods")))


def relaxation_method(method: str | Method | Cuts, others: tuple[str, ...] = ("auto",)) -> Method:
    """Return the relaxation method that a short name means, or the object itself; ProblemError where it is none.

    The error lists `others` too: what the caller takes besides relaxations.
    """
    if not isinstance(method, str):
        if isinstance(method, type | Cuts) or not all(hasattr(method, own) for own in _NEEDED):
            raise ProblemError(
                f"{method!r} is no relaxation method: give a short name, or an object with {', '.join(_NEEDED)}"
            )
        return method
    found = _BY_NAME.get(method) or _entry_points().get(method)
    if found is None:
        raise ProblemError(f"unknown method {method!r}: choose {', '.join((*others, *_BY_NAME, *_entry_points()))}")
    return found


def method_of(method: str | Method | Cuts) -> Method | Cuts | None:
    """Return the method that a short name means, cuts among them, None for ``"auto"``; ProblemError if unknown."""
    if isinstance(method, Cuts) or method == Cuts.name:
        return Cuts()
    return None if method == "auto" else relaxation_method(method, ("auto", Cuts.name))
