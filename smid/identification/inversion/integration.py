r"""Rates integrated from one sample to the next, the remainder of every step enclosed.

The inputs are held, so over a step of length h the states obey x' = f(x), which is enclosed as follows.

*A priori.* While x stays in a box X, its rates lie in f(X), so x lies in x0 + [0, h] f(X). Where that lies inside X, x
does not leave X. The box is found by trial, from a guess that is widened a few times.

*The step.* Along a solution, y = f_i(x) has the derivative J_ii y + r, where J is the Jacobian and r the sum of
J_ij f_j over the other states. With \phi_1(z) = (exp(z) - 1) / z and \phi_{k+1}(z) = (\phi_k(z) - 1/k!) / z, all
positive and rising,

    x_i(h)  in  x_i + h \phi_1(h J_ii(X)) f_i(x) + h^2 \phi_2(h J_ii(X)) r_i(X),                               (first)
    x_i(h)  in  x_i + h f_i(x) + h^2 \phi_2(h J_ii(X)) f'_i(x) + h^3 \phi_3(h J_ii(X)) s_i(X),                 (second)

where f' is the derivative of f in time, and s_i that of f'_i less J_ii f'_i. Both are evaluated on affine forms, and
the narrower one is taken. A state whose rate falls steeply with itself is damped as by the exponential, however long
the step is; for small h J_ii the formulas are Taylor's.

*Kinks.* Where Abs, Max or Min bend, J contains the slopes of both sides, and the first formula holds. *Jumps.* Where a
sign or a condition is not decided over X, f takes all values of both sides (Filippov). What is left is x + h f(X). The
step is halved where the jump is decided at its start, so that it ends shortly before the jump, and where a state leaves
a jump at which it was known well.

A state that jumps hold where it is (dry friction at rest) would spread by each such step. But it cannot rise above a
value beyond which its rate is not positive anywhere in X, and falls with at least the least rate there.

References
----------
N. S. Nedialkov, K. R. Jackson and G. F. Corliss, "Validated solutions of initial value problems for ordinary
differential equations", Applied Mathematics and Computation 105 (1999).
A. F. Filippov, "Differential equations with discontinuous righthand sides", Kluwer (1988).
M. Hochbruck and A. Ostermann, "Exponential integrators", Acta Numerica 19 (2010).
"""

from __future__ import annotations

import math

import numpy as np

from relaxations.algebra.affine_arithmetic import HIGH, LOW, RADIUS, add, between, copy, nothing_known
from relaxations.algebra.arrays import Array, Index, Mask
from relaxations.algebra.ball_arithmetic import EPSILON
from relaxations.algebra.compiled import compiling
from smid.identification.inversion import operations, stages, step_box
from smid.identification.inversion import phi as functions
from smid.identification.inversion.phi import phi_of
from smid.identification.inversion.stages import add_product, evaluate, fold, signs_among, taken, times
from smid.identification.inversion.step_box import BEGIN, FIRST, OTHERS, OWN, RATE, SECOND, away, stay

LEVELS = 12
"""A step is halved at most so many times."""

_ATTEMPTS = 16  # for each step between two samples, and each level
_LEAVES = 1e-3  # share of the reach of a step by which a state that jumps hold back does not spread
_HELD = 8  # values tried, beyond which a rate may lead back

compiled = compiling(operations.__file__, functions.__file__, stages.__file__, step_box.__file__)


@compiled
def _wrapped(states: Array, local: int) -> None:
    """Make what is left over of each state a symbol of its own, from one on."""
    for i in range(states.shape[0]):
        fold(states, i, local)
        if math.isfinite(states[i, RADIUS]):
            states[i, local + i], states[i, RADIUS] = states[i, RADIUS], 0.0


@compiled
def _narrowed(w: Array, a: int, low: float, high: float) -> None:
    """Narrow a form to ends that are known."""
    low, high = max(w[a, LOW], low), min(w[a, HIGH], high)
    if not w[a, RADIUS] <= 0.5 * (high - low):
        between(w, a, low, high)
    w[a, LOW], w[a, HIGH] = low, high


@compiled
def _result(
    states: Array, w: Array, places: Index, forms: Array, jumps: Mask, at_begin: Array, i: int, h: float, signs: int
) -> None:
    """Write into the first line of w where a state is after a step, from its rates at the begin and over the box."""
    n = states.shape[0]
    # Without any derivative.
    copy(w, 1, states, i)
    taken(w, 2, forms, places[i, RATE], signs)
    times(w, 3, 2, h)
    add(w, 0, 1, 3, 1.0)
    if jumps[places[i, RATE]]:
        return
    # The first formula, into the fourth line.
    taken(w, 2, forms, places[i, OWN], signs)
    times(w, 3, 2, h)
    phi_of(w, 6, 3, 1)
    phi_of(w, 7, 3, 2)
    phi_of(w, 8, 3, 3)
    copy(w, 4, states, i)
    copy(w, 5, at_begin, i)
    add_product(w, 4, 6, 5, h, 9)
    taken(w, 2, forms, places[i, OTHERS], signs)
    add_product(w, 4, 7, 2, h * h, 9)
    if w[4, RADIUS] < w[0, RADIUS]:
        copy(w, 0, w, 4)
    if jumps[places[i, FIRST]]:
        return
    # The second one.
    copy(w, 4, states, i)
    times(w, 9, 5, h)
    add(w, 2, 4, 9, 1.0)
    copy(w, 4, w, 2)
    copy(w, 5, at_begin, n + i)
    add_product(w, 4, 7, 5, h * h, 9)
    taken(w, 2, forms, places[i, SECOND], signs)
    add_product(w, 4, 8, 2, h * h * h, 9)
    if w[4, RADIUS] < w[0, RADIUS]:
        copy(w, 0, w, 4)


@compiled
def _hold(
    program: tuple[Index, Array, int, int],
    until: int,
    rate: int,
    forms: Array,
    jumps: Mask,
    stage: Array,
    known: tuple[Array, Array, Array, Array, int, bool],
    states: Array,
    held: Array,
    i: int,
    h: float,
    sign: float,
) -> None:
    """Find how far a state rises (sign 1) or falls during a step, and where it ends: where its rate leads back.

    Values ever further inside are tried: the rate must lead back anywhere beyond one.
    """
    end = HIGH if sign > 0.0 else LOW
    top, begin = sign * stage[i, end], sign * states[i, end]
    reach, during, after = states[i, HIGH] - states[i, LOW], math.inf, math.inf
    for k in range(_HELD + 1):
        value = begin + 1e-6 * (top - begin) if k == 0 else begin - reach * 0.25 ** (_HELD + 1 - k)
        between(stage, i, min(sign * value, sign * top), max(sign * value, sign * top))
        evaluate(program, until, forms, jumps, stage, known)
        most = sign * forms[rate, end]
        if not most <= 0.0:
            break
        during = min(during, max(value, begin))
        after = min(after, max(value, begin + h * most + 4.0 * EPSILON * (abs(begin) + h * abs(most))))
    if sign > 0.0:
        held[i, 1], held[i, 3] = during, after
    else:
        held[i, 0], held[i, 2] = -during, -after


@compiled
def integrate(
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
    defined_only: bool,
    interval_length: float,
    substeps: int,
) -> None:
    """Write the forms of the states at a sample into the stage, from those at the sample before.

    Parameters
    ----------
    base
        Form of the first operation.
    sections
        Ends of the operations for the rates, for f', J and r, and for s.
    places
        Shape (states, 6). Forms, see `BEGIN` and the following.
    stage
        Shape (states, width). The last symbols, `further_symbols` of them, are free on entry and exit.
    interval_length
        In seconds.
    """
    n, width = stage.shape
    signs = width - signs_among(inner)
    local = signs - n
    program = (inner, numbers, base, signs)
    known = (start, past, data, noise, now, defined_only)
    jumps = np.zeros(forms.shape[0], dtype=np.bool_)
    states, at_begin, results = np.zeros((n, width)), np.zeros((2 * n, width)), np.zeros((n, width))
    w = np.zeros((12, width))
    low, high, held = np.zeros(n), np.zeros(n), np.zeros((n, 4))
    jumped, given = np.zeros(n, dtype=np.bool_), np.zeros(n, dtype=np.bool_)
    finite = True
    for i in range(n):
        copy(states, i, forms, places[i, BEGIN])
        finite = finite and math.isfinite(states[i, HIGH] - states[i, LOW])
    whole = 1 << LEVELS
    done, size, tried = 0, whole, 0
    while finite and done < substeps * whole:
        tried += 1
        finite = tried < _ATTEMPTS * (substeps + LEVELS)
        h = interval_length * size / (substeps * whole)
        # Where the step begins.
        _wrapped(states, local)
        for i in range(n):
            copy(stage, i, states, i)
        evaluate(program, sections[1], forms, jumps, stage, known)
        for i in range(n):
            taken(at_begin, i, forms, places[i, RATE], signs)
            taken(at_begin, n + i, forms, places[i, FIRST], signs)
            jumped[i] = jumps[places[i, RATE]]
        inside = stay(program, sections[1], places, forms, jumps, stage, known, states, at_begin, given, low, high, h)
        new_jump = False
        for i in range(n):
            new_jump = new_jump or (jumps[places[i, RATE]] and not jumped[i])
        if (not inside or new_jump) and size > 1:
            size //= 2
            continue
        if not inside:
            finite = False
            break
        # The box that was found, less what jumps hold back.
        for i in range(n):
            jumped[i] = jumps[places[i, RATE]]
            away(states, stage, i, low[i], high[i], w, 0)
            held[i, 0], held[i, 1], held[i, 2], held[i, 3] = -math.inf, math.inf, -math.inf, math.inf
        for i in range(n):
            if jumped[i]:
                copy(w, 0, stage, i)
                for sign in (-1.0, 1.0):
                    _hold(program, sections[0], places[i, RATE], forms, jumps, stage, known, states, held, i, h, sign)
                    copy(stage, i, w, 0)
                _narrowed(stage, i, held[i, 0], held[i, 1])
        # The step.
        evaluate(program, sections[2], forms, jumps, stage, known)
        for i in range(n):
            _result(states, w, places, forms, jumps, at_begin, i, h, signs)
            copy(results, i, w, 0)
            _narrowed(results, i, max(stage[i, LOW], held[i, 2]), min(stage[i, HIGH], held[i, 3]))
        # A state that leaves a jump does so by a short step.
        spreads = False
        for i in range(n):
            before, after = states[i, HIGH] - states[i, LOW], results[i, HIGH] - results[i, LOW]
            spreads = spreads or (jumped[i] and after > 2.0 * before + _LEAVES * (high[i] - low[i]))
        if spreads and size > 1:
            size //= 2
            continue
        for i in range(n):
            copy(states, i, results, i)
        done += size
        if size < whole and done % (2 * size) == 0:
            size *= 2
    for i in range(n):
        if not finite:
            nothing_known(states, i)
        copy(stage, i, states, i)
        fold(stage, i, local)
