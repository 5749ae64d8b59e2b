"""The steps of a proof, recorded for a certificate file (:mod:`relaxations.proof.certificate_file`).

A step holds on the box that the steps before it prove. Functions that bound, branch or derive a box take ``record`` and
call it with each step in this order: ``steps = []`` and ``record=steps.append`` keep the whole proof.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.polynomial import Polynomials
from relaxations.problem.problem import PolynomialProblem
from relaxations.proof.bounding import CertifiedBound, Relaxed
from relaxations.proof.certificate import Certificate
from relaxations.reductions.projection import Projected


@dataclass(frozen=True)
class Bound:
    """A certified bound: of one variable, it tightens the box for the steps after it.

    Parameters
    ----------
    relaxed
        The relaxation on which the bound was found.
    objective
        One row, in the problem's own variables. For a proof of emptiness (where the bound is infinite) the
        constant zero, ``Polynomials.from_terms([{}])``.

    Examples
    --------
    >>> from relaxations.formats.expressions import problem_of, variables
    >>> from relaxations.search.hierarchy import intervals
    >>> x, y = variables("x y")
    >>> problem, _ = problem_of(x, [x * y == 1, x >= 0, x <= 2, y >= 0, y <= 4])
    >>> steps = []
    >>> (found,) = intervals(problem, [0], witnesses=False, rounds=1, record=steps.append).intervals
    >>> [step.certificate.bound == found.lower for step in steps]  # x <= 2 was known
    [True]
    """

    relaxed: Relaxed
    objective: Polynomials
    certificate: Certificate

    @property
    def bound(self) -> float:
        """Return what is proven of the objective."""
        return self.certificate.bound

    @staticmethod
    def of(relaxed: Relaxed, objective: Polynomials, certified: CertifiedBound) -> Bound:
        """Return what a bound with a certificate proves of an objective, or of the set where it is empty."""
        assert certified.certificate is not None
        proven = objective if certified.bound < np.inf else Polynomials.from_terms([{}])
        return Bound(relaxed, proven, certified.certificate)


@dataclass(frozen=True)
class Cut:
    """A bound on the outer variables that follows from cuts (:mod:`relaxations.search.benders`).

    The constraints are affine in all variables but the outer ones. ``weights``, shape (n_cuts,), are nonnegative;
    ``multipliers`` have shape (n_cuts, n_equalities + n_inequalities).
    """

    problem: PolynomialProblem
    objective: Polynomials
    bound: float
    outer: Index
    weights: Array
    multipliers: Array


@dataclass(frozen=True)
class Part:
    """One part of a box: the variable that was cut, its range, and steps that prove the bound or an empty part.

    There are no steps where the box alone proves it. Where the variable is a kink (:class:`Kinks`), ``side`` is the
    side of zero on which the part takes its argument, in place of a range.
    """

    variable: int
    lower: float
    upper: float
    steps: tuple[Step, ...]
    side: int = 0


@dataclass(frozen=True)
class Branches:
    """A bound that holds on every part of a box; the objective is the constant zero where every part is empty.

    The parts are ranges of one variable, or the cases of a vanishing monomial
    (:mod:`relaxations.reductions.vanishing`), whose variables are ``product``.
    """

    problem: PolynomialProblem
    objective: Polynomials
    bound: float
    parts: tuple[Part, ...]
    product: tuple[int, ...] = ()


@dataclass(frozen=True)
class Quotient:
    """A box for the variable x of an equality ``A + B x = 0``: earlier steps bound A, and B away from zero."""

    problem: PolynomialProblem
    equality: int
    variable: int


@dataclass(frozen=True)
class Square:
    """``weight`` times the sum over columns f of ``factor`` of the square of ``sum_i f_i basis_i``."""

    weight: Fraction
    basis: tuple[tuple[int, ...], ...]
    factor: tuple[tuple[Fraction, ...], ...]


@dataclass(frozen=True)
class Consequence:
    """A bound that follows from one row: ``objective >= bound + weight * row + ends + squares`` on the box.

    Parameters
    ----------
    objective
        One row, in the problem's own variables.
    centre, scale
        Shape (n_variables,). The squares are in t, where ``x = centre + scale t``. Variables without a box occur in no
        other term of the difference: their terms cancel.
    equality, row
        Whether the row is an equality, and its number.
    ends
        Variable, side (1 for ``1 + t``, -1 for ``1 - t``) and weight of further terms.
    """

    problem: PolynomialProblem
    objective: Polynomials
    bound: float
    centre: Array
    scale: Array
    equality: bool
    row: int
    weight: Fraction
    ends: tuple[tuple[int, int, Fraction], ...]
    squares: tuple[Square, ...]


@dataclass(frozen=True)
class Reach:
    """A box for variables that have none (:mod:`relaxations.search.boxes`).

    Parameters
    ----------
    cone
        The rows of the problem times s, with s as the last variable.
    loose, riding
        The variables that get a box, and those that were multiplied by s.
    scale
        Shape (n_loose,).
    equalities, inequalities
        The rows that were kept.
    faces
        Variable, side (1 or -1), and the steps that bound s on this face.
    """

    problem: PolynomialProblem
    cone: PolynomialProblem
    loose: Index
    riding: Index
    scale: Array
    equalities: Index
    inequalities: Index
    faces: tuple[tuple[int, int, tuple[Step, ...]], ...]


@dataclass(frozen=True)
class Kinks:
    """Variables that are the positive part ``max(0, x)`` of an argument x, or its sign where ``signs`` says so.

    There is one row of ``arguments`` for each variable; it reads only kinks before its own.
    """

    variables: Index
    signs: Array
    arguments: Polynomials


@dataclass(frozen=True)
class Row:
    """An inequality between an open kink and its argument, as :mod:`relaxations.check` names and proves it.

    ``kind`` is one of {"above", "chord", "low", "high", "side"}. ``ends`` are those of the argument: both for a chord,
    one for the hull of a sign.
    """

    kind: str
    kink: str
    ends: tuple[float, ...] = ()


@dataclass(frozen=True)
class Sides:
    """Steps on rows with the values of the kinks that the box decides.

    Parameters
    ----------
    problem
        Its equalities and first inequalities are those stated, in their order, with the values of the known kinks; the
        last inequalities are the rows.
    known
        Kink, by its variable, and side.
    defined
        Equality, and a variable that it gives: the box of the others bounds it.
    """

    problem: PolynomialProblem
    known: tuple[tuple[str, int], ...]
    rows: tuple[Row, ...]
    defined: tuple[tuple[int, str], ...]
    steps: tuple[Step, ...]


@dataclass(frozen=True)
class Fixed:
    """Steps on the outer rows of a projection (:mod:`relaxations.reductions.projection`)."""

    projected: Projected
    steps: tuple[Step, ...]


@dataclass(frozen=True)
class Hull:
    """Some variables lie in the hull of the boxes that the steps of the parts prove."""

    problem: PolynomialProblem
    variables: Index
    parts: tuple[Part, ...]


@dataclass(frozen=True)
class Level:
    """A bound that the steps prove only for points whose objective is at most a level.

    ``problem`` has ``level - objective >= 0`` as its last inequality; the bound is at most the level.
    """

    problem: PolynomialProblem
    objective: Polynomials
    bound: float
    level: float
    steps: tuple[Step, ...]


Step = Bound | Cut | Branches | Quotient | Consequence | Reach | Sides | Fixed | Hull | Level
Recorder = Callable[[Step], None]
