"""Certified lower and upper ends of many functions of the parameters that fit the data."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import STOPS, check_time
from smid.responses.bounding import Bounder
from smid.responses.functions import Functions
from smid.responses.outer_set import OuterSet

TOLERANCE = 0.02  # gap at an end, as a share of the width, that counts as tight
BOXES = 32  # of branch and bound, for each end
PUSHES = 4  # directions, for each parameter
End = tuple[int, int]  # a function, and 1 for its lower end or -1 for its upper one


@dataclass(frozen=True)
class Ends:
    """Ends of functions, each of shape (n_functions,): certified, and at verified points (NaN where none is known).

    They are certified also where the work is not complete, because it was stopped.
    """

    lower: Array
    upper: Array
    inner_lower: Array
    inner_upper: Array
    complete: bool


def certified_ends(outer: OuterSet, functions: Functions) -> Ends:
    """Bound functions over the parameters that fit, until each gap to a verified point is small, as far as that goes.

    First the outer set is tightened in the directions in which the loosest ends lie. What is left is the curvature of
    the functions; branch and bound reduces it.
    """
    search = _Search(Bounder(outer, functions))
    try:
        search.begin()
        for _ in range(PUSHES * len(outer.names)):
            if not search.push():
                break
        search.branch()
    except STOPS:
        return search.ends(complete=False)
    return search.ends(complete=True)


@dataclass
class _Search:
    """The ends so far: ``bounds[k, 0]`` is below function k, and ``bounds[k, 1]`` below minus function k."""

    bounder: Bounder
    bounds: Array = field(init=False)
    values: Array = field(init=False)  # shape (n_points, n_functions)
    pushed: set[End] = field(init=False, default_factory=set)

    def __post_init__(self) -> None:
        count = len(self.bounder.model(self.bounder.root).value)
        self.bounds = np.full((count, 2), -np.inf)
        self.values = np.zeros((0, count))

    def begin(self) -> None:
        """Bound all ends on the whole box."""
        self._take_points()
        for end in self._ends():
            self._bound(end)

    def ends(self, complete: bool) -> Ends:
        """Return what is proven so far."""
        values = self.values if len(self.values) else np.full((1, len(self.bounds)), np.nan)
        return Ends(self.bounds[:, 0] + 0.0, 0.0 - self.bounds[:, 1], values.min(axis=0), values.max(axis=0), complete)

    def push(self) -> bool:
        """Tighten the outer set where the loosest end lies; return whether there was one."""
        while True:
            left = [end for end in self._ends() if end not in self.pushed and np.isfinite(self.bounds[_place(end)])]
            worst = max(left, key=self._gap, default=None)
            if worst is None or self._gap(worst) <= TOLERANCE:
                return False
            # Directions that were added since this end was bounded may have tightened it.
            if not self._bound(worst):
                break
        self.pushed.add(worst)
        self.bounder.outer.push(self.bounder.direction(*worst))
        self._take_points()
        return True

    def branch(self) -> None:
        """Bound all ends anew, and cut the box where an end is loose."""
        for end in self._ends():
            self._bound(end)
        for end in self._ends():
            place, (k, sign) = _place(end), end
            if self._gap(end) > TOLERANCE or np.isinf(self.bounds[place]):
                inner = float(np.min(sign * self.values[:, k], initial=np.inf))
                width = -self.bounds[k].sum()
                goal = inner - TOLERANCE * (width if np.isfinite(width) else abs(inner))
                self.bounds[place] = self.bounder.search(k, sign, float(self.bounds[place]), goal, BOXES)

    def _ends(self) -> list[End]:
        return [(k, sign) for k in range(len(self.bounds)) for sign in (1, -1)]

    def _bound(self, end: End) -> bool:
        """Bound an end on the whole box; return whether that tightened it."""
        check_time()
        found = self.bounder.bound(self.bounder.root, *end)
        better = found > self.bounds[_place(end)]
        if better:
            self.bounds[_place(end)] = found
        return bool(better)

    def _gap(self, end: End) -> float:
        """Return how far an end is from the verified points, as a share of the width; zero where unknown."""
        width = -self.bounds[end[0]].sum()
        if not (len(self.values) and np.isfinite(width) and width > 0):
            return 0.0
        return float((np.min(end[1] * self.values[:, end[0]]) - self.bounds[_place(end)]) / width)

    def _take_points(self) -> None:
        """Compute the functions at the verified points that are new."""
        points = self.bounder.outer.points[len(self.values) :]
        self.values = np.vstack([self.values, *(self.bounder.values(p)[None] for p in points)])


def _place(end: End) -> tuple[int, int]:
    return end[0], (1 - end[1]) // 2
