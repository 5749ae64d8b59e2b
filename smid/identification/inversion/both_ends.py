r"""What an interval states of the rates, where a state is known at both of its ends.

Over wide boxes of the parameters a step from one end reaches anywhere. But the differences between samples are known
well, whatever the parameters are. With J, r and \phi as in :mod:`.integration`, the first formula there, divided by
\phi_1, which is positive, is

    (x_i(h) - x_i) / \phi_1(h J_ii(X))  in  h f_i(x) + h^2 (\phi_2 / \phi_1)(h J_ii(X)) r_i(X).

So what \phi_1 is in doubt by multiplies a known difference. The right-hand side is linear in parameters that the rates
are linear in.

A rate that reads no other state has one sign in the whole interval: where it is zero the state rests, and where it
jumps through zero the state stays. So such a state is never outside its values at both ends. For the other states a
box is found by trial.
"""

from __future__ import annotations

import math

import numpy as np

from relaxations.algebra.affine_arithmetic import HIGH, LOW, NO_PRODUCTS, add, between, copy, multiply, nothing_known
from relaxations.algebra.affine_functions import Function, apply
from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.compiled import compiling
from smid.identification.inversion import operations, stages, step_box
from smid.identification.inversion import phi as functions
from smid.identification.inversion.phi import phi_of
from smid.identification.inversion.stages import add_product, evaluate, signs_among, taken, times
from smid.identification.inversion.step_box import BEGIN, OTHERS, OWN, RATE, stay

_RECIPROCAL = int(Function.RECIPROCAL)

compiled = compiling(operations.__file__, functions.__file__, stages.__file__, step_box.__file__)


@compiled
def mean_rates(
    inner: Index,
    numbers: Array,
    base: int,
    sections: Index,
    places: Index,
    forms: Array,
    start: Array,
    past: Array,
    stage: Array,
    data: Array,
    noise: Array,
    now: int,
    ends: Array,
    h: float,
    found: Array,
) -> bool:
    """Write for each state a form that is zero: the difference between both ends, less what its rate makes of it.

    Return whether anything is known of all: of a box for the states, and of each end.

    Parameters
    ----------
    base, sections, places, stage
        As in :func:`.integration.integrate`.
    ends
        Least and largest value of each state at the end of the interval, shape (states, 2); infinite: not known.
    found
        Shape (states, width).
    """
    n, width = stage.shape
    signs = width - signs_among(inner)
    program = (inner, numbers, base, signs)
    known = (start, past, data, noise, now, False)
    jumps, given = np.zeros(forms.shape[0], dtype=np.bool_), np.zeros(n, dtype=np.bool_)
    states, at_begin = np.zeros((n, width)), np.zeros((n, width))
    low, high = np.zeros(n), np.zeros(n)
    w = np.zeros((8, width))
    for i in range(n):
        copy(states, i, forms, places[i, BEGIN])
        copy(stage, i, states, i)
    evaluate(program, sections[1], forms, jumps, stage, known)
    for i in range(n):
        taken(at_begin, i, forms, places[i, RATE], signs)
        least, most = min(states[i, LOW], ends[i, 0]), max(states[i, HIGH], ends[i, 1])
        # Others' rates that no operation during the interval writes are the same in all of it.
        alone = places[i, OTHERS] < base and forms[places[i, OTHERS], LOW] == 0.0 == forms[places[i, OTHERS], HIGH]
        given[i] = alone and math.isfinite(most - least)
        if given[i]:
            between(stage, i, least, most)
    inside = stay(program, sections[1], places, forms, jumps, stage, known, states, at_begin, given, low, high, h)
    for i in range(n):
        inside = inside and math.isfinite(ends[i, 1] - ends[i, 0])
    for i in range(n):
        if not inside:
            nothing_known(found, i)
            continue
        between(w, 1, ends[i, 0], ends[i, 1])
        copy(w, 2, states, i)
        add(w, 0, 1, 2, -1.0)
        if jumps[places[i, RATE]]:
            taken(w, 1, forms, places[i, RATE], signs)
        else:
            taken(w, 1, forms, places[i, OWN], signs)
            times(w, 2, 1, h)
            phi_of(w, 3, 2, 1)
            phi_of(w, 4, 2, 2)
            apply(w, 5, 3, _RECIPROCAL, 0.0)
            multiply(w, 1, 0, 5, NO_PRODUCTS)
            copy(w, 0, w, 1)
            # What the other states say.
            taken(w, 1, forms, places[i, OTHERS], signs)
            if w[1, LOW] < 0.0 or w[1, HIGH] > 0.0:
                multiply(w, 2, 4, 5, NO_PRODUCTS)
                add_product(w, 0, 2, 1, -h * h, 6)
            copy(w, 1, at_begin, i)
        times(w, 2, 1, h)
        add(w, 3, 0, 2, -1.0)
        copy(found, i, w, 3)
    return inside
