"""The forms of rates at a stage of their integration."""

from __future__ import annotations

import math

import numpy as np

from relaxations.algebra.affine_arithmetic import (
    HIGH,
    LOW,
    NO_PRODUCTS,
    RADIUS,
    add,
    between,
    copy,
    hull,
    interval,
    linear,
    multiply,
    nothing_known,
)
from relaxations.algebra.affine_functions import Function
from relaxations.algebra.arrays import Array, Index, Mask
from relaxations.algebra.ball_arithmetic import EPSILON
from relaxations.algebra.compiled import compiling
from smid.identification.inversion import operations
from smid.identification.inversion.operations import Operation, may_be_undefined, operate

_ADD, _SUBTRACT, _MULTIPLY = int(Operation.ADD), int(Operation.SUBTRACT), int(Operation.MULTIPLY)
_SCALE, _APPLY, _CHOOSE = int(Operation.SCALE), int(Operation.APPLY), int(Operation.CHOOSE)
_SIGN, _FLOOR = int(Function.SIGN), int(Function.FLOOR)

compiled = compiling(operations.__file__)


@compiled
def signs_among(inner: Index) -> int:
    """Return the number of signs among operations."""
    count = 0
    for k in range(inner.shape[0]):
        count += inner[k, 0] == _APPLY and inner[k, 2] == _SIGN
    return count


@compiled
def further_symbols(inner: Index, states: int) -> int:
    """Return how many symbols integration needs for itself."""
    return states + signs_among(inner)


@compiled
def fold(forms: Array, a: int, symbol: int) -> None:
    """Move the shares of all symbols from one on into the radius of a form."""
    total = forms[a, RADIUS]
    for k in range(symbol, forms.shape[1]):
        total += abs(forms[a, k])
        forms[a, k] = 0.0
    forms[a, RADIUS] = total * (1.0 + (forms.shape[1] - symbol + 2) * EPSILON)


@compiled
def taken(target: Array, to: int, forms: Array, a: int, signs: int) -> None:
    """Copy a form without its signs, which change in time: each factor of a product has its own."""
    copy(target, to, forms, a)
    fold(target, to, signs)


@compiled
def _exact(forms: Array, a: int) -> bool:
    """Return whether a form is one number."""
    return bool(forms[a, LOW] == forms[a, HIGH])


@compiled
def evaluate(
    program: tuple[Index, Array, int, int],
    until: int,
    forms: Array,
    jumps: Mask,
    stage: Array,
    known: tuple[Array, Array, Array, Array, int, bool],
) -> None:
    """Write forms of the rates at a stage, and whether each may jump there.

    A sign that is not decided is a symbol. A jump counts where its argument may be zero, whatever the value at zero is.
    What is multiplied by zero does not jump: friction of sliding where the mass sticks.
    """
    inner, numbers, base, signs = program
    start, past, data, noise, now, defined_only = known
    symbol = signs
    for k in range(until):
        to = base + k
        operation, a, b, c = inner[k, 0], inner[k, 1], inner[k, 2], inner[k, 3]
        jumps[to] = False
        if defined_only and may_be_undefined(inner[k], forms):
            nothing_known(forms, to)
            jumps[to] = True
        elif operation == _CHOOSE:
            decided = forms[a, LOW] > 0.0 or forms[a, HIGH] < 0.0
            if decided:
                chosen = b if forms[a, LOW] > 0.0 else c
                copy(forms, to, forms, chosen)
                jumps[to] = jumps[chosen]
            else:
                hull(forms, to, b, c)
                jumps[to] = True
        elif operation == _APPLY and b == _SIGN:
            low, high = forms[a, LOW], forms[a, HIGH]
            interval(forms, to, 1.0 if low > 0.0 else -1.0 if high < 0.0 else 0.0, 0.0)
            if not (low > 0.0 or high < 0.0):
                forms[to, symbol], forms[to, LOW], forms[to, HIGH] = 1.0, -1.0, 1.0
                jumps[to] = True
            symbol += 1
        elif operation == _APPLY and b == _FLOOR:
            low, high = np.ceil(forms[a, LOW]) - 1.0, np.floor(forms[a, HIGH])
            between(forms, to, low, high)
            jumps[to] = low != high
        elif operation == _MULTIPLY:
            # Zero times any number is zero.
            if (forms[a, LOW] == 0.0 and forms[a, HIGH] == 0.0) or (forms[b, LOW] == 0.0 and forms[b, HIGH] == 0.0):
                interval(forms, to, 0.0, 0.0)
            else:
                multiply(forms, to, a, b, NO_PRODUCTS)
                jumps[to] = jumps[a] or jumps[b]
        else:
            operate(inner[k], numbers[to], to, forms, start, past, stage, data, noise, now, defined_only, NO_PRODUCTS)
            if operation in (_APPLY, _SCALE):
                jumps[to] = jumps[a]
                # Signs are often halved, and summed with halves: these sums are kept exact.
                if operation == _SCALE and _exact(forms, a) and abs(forms[a, LOW]) == 1.0:
                    interval(forms, to, numbers[to, 0] * forms[a, LOW], 0.0)
            elif operation in (_ADD, _SUBTRACT):
                jumps[to] = jumps[a] or jumps[b]
                if _exact(forms, a) and _exact(forms, b):
                    one, other = forms[a, LOW], forms[b, LOW] if operation == _ADD else -forms[b, LOW]
                    total = one + other
                    part = total - one
                    if one - (total - part) == 0.0 and other - part == 0.0:
                        interval(forms, to, total, 0.0)


@compiled
def times(w: Array, to: int, a: int, factor: float) -> None:
    """Write a form times a factor that is known within a few roundings."""
    size = max(abs(w[a, LOW]), abs(w[a, HIGH]))
    linear(w, to, a, factor, 0.0, 16.0 * EPSILON * abs(factor) * size if math.isfinite(size) else 0.0)


@compiled
def add_product(w: Array, to: int, a: int, b: int, factor: float, spare: int) -> None:
    """Add ``factor a b`` to a form."""
    multiply(w, spare, a, b, NO_PRODUCTS)
    times(w, spare + 1, spare, factor)
    add(w, spare, to, spare + 1, 1.0)
    copy(w, to, w, spare)
