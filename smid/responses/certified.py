"""Certified lower and upper ends of many functions of the parameters that fit the data."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import check_time
from smid.responses.bounding import Bounder
from smid.responses.functions import Functions
from smid.responses.outer_set import OuterSet

BOXES = 64  # of branch and bound, for each end


@dataclass(frozen=True)
class Ends:
    """Ends of functions, each of shape (n_functions,): certified, and at verified points (NaN where none is known)."""

    lower: Array
    upper: Array
    inner_lower: Array
    inner_upper: Array


def certified_ends(outer: OuterSet, functions: Functions, tolerance: float, most: int) -> Ends:
    """Bound functions over an outer set until each gap is below ``tolerance`` times the width, as far as that goes.

    At most so many directions are added to the outer set: those in which the loosest ends lie. What is left is the
    curvature of the functions; branch and bound reduces it.
    """
    bounder = Bounder(outer, functions)
    ends = {(k, sign): 0.0 for k in range(len(bounder.model(bounder.root).value)) for sign in (1, -1)}
    for end in ends:
        ends[end] = bounder.bound(bounder.root, *end)
    values = np.array([bounder.values(p) for p in outer.points])

    def gap(k: int, sign: int) -> float:
        """Return how far an end is from its verified one, as a share of the width."""
        width = -ends[k, -1] - ends[k, 1]
        if not np.isfinite(width) or not len(values):
            return 0.0
        return float((np.min(sign * values[:, k]) - ends[k, sign]) / width) if width > 0 else 0.0

    # Push the loosest end until all are tight. A bound only improves as directions are added, so that bounds of old
    # directions tell which ends may be loose.
    left = {end for end in ends if np.isfinite(ends[end])}
    pushed = 0
    while left and pushed < most:
        check_time()
        worst = max(left, key=lambda end: gap(*end))
        if gap(*worst) <= tolerance:
            break
        fresh = max(ends[worst], bounder.bound(bounder.root, *worst))
        if fresh > ends[worst]:
            ends[worst] = fresh
            continue
        known = len(outer.witnesses)
        outer.push(bounder.direction(*worst))
        pushed += 1
        left.remove(worst)
        if len(outer.points) > known:
            values = np.vstack([values.reshape(-1, len(ends) // 2), [bounder.values(p) for p in outer.points[known:]]])
    for end, old in ends.items():
        if np.isfinite(old):
            ends[end] = max(old, bounder.bound(bounder.root, *end))
    # Cut boxes where curvature is left.
    for (k, sign), start in list(ends.items()):
        check_time()
        if gap(k, sign) > tolerance or not np.isfinite(start):
            inner = np.min(sign * values[:, k], initial=np.inf)
            width = -ends[k, -1] - ends[k, 1]
            goal = inner - tolerance * width if np.isfinite(width) else inner - tolerance * np.abs(inner)
            ends[k, sign] = bounder.search(k, sign, start, lambda goal=goal: goal, BOXES)
    count = len(ends) // 2
    lower = np.array([ends[k, 1] for k in range(count)])
    upper = np.array([-ends[k, -1] for k in range(count)])
    if not len(values):
        values = np.full((1, count), np.nan)
    return Ends(lower, upper, values.min(axis=0), values.max(axis=0))
