"""The operations of a tape on affine forms."""

from __future__ import annotations

import math
from enum import IntEnum

from relaxations.algebra.affine_arithmetic import HIGH, LOW, add, copy, hull, interval, linear, multiply, nothing_known
from relaxations.algebra.affine_functions import Function, apply, larger
from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.compiled import compiled
from smid.identification.inversion.phi import phi_of


class Operation(IntEnum):
    """What a line of the tape does to the forms it names."""

    NUMBER = 0  # number, its error
    PARAMETER = 1  # place of the parameter
    CHANNEL = 2  # place of the channel, lag
    PAST = 3  # place of the signal, lag
    ADD = 4
    SUBTRACT = 5
    MULTIPLY = 6
    SCALE = 7  # form; number
    APPLY = 8  # form, function, 1 for a logarithm that is in no power; exponent
    CHOOSE = 9  # condition, form where it is not negative, form elsewhere; 1 if zero is elsewhere, too
    LARGER = 10
    DEFINE = 11  # form; one for each signal, so that its initial samples can take its place
    STAGE = 12  # place of the state: its value during a step of integration
    SOLUTION = 13  # place of the state: its value where the integration ends
    PHI = 14  # form: (exp(z) - 1) / z


_UNDEFINED_BELOW_ZERO = (int(Function.ROOT), int(Function.LOG), int(Function.POWER))
_RECIPROCAL = int(Function.RECIPROCAL)
_NUMBER, _PARAMETER, _CHANNEL, _PAST = map(int, tuple(Operation)[:4])
_ADD, _SUBTRACT, _MULTIPLY, _SCALE, _APPLY, _CHOOSE = map(int, tuple(Operation)[4:10])
_LARGER, _DEFINE, _STAGE, _SOLUTION, _PHI = map(int, tuple(Operation)[10:])


@compiled
def _unknown(forms: Array, a: int) -> bool:
    """Return whether neither end of a form is known."""
    return bool(forms[a, LOW] == -math.inf and forms[a, HIGH] == math.inf)


@compiled
def may_be_undefined(entry: Index, forms: Array) -> bool:
    """Return whether an operation reads a number that may not be real, or may give one."""
    operation, a, b, must_be_finite = entry
    if operation == _APPLY:
        if b == _RECIPROCAL and forms[a, LOW] <= 0.0 <= forms[a, HIGH]:
            return True
        if must_be_finite and forms[a, LOW] <= 0.0:
            return True
        return _unknown(forms, a) or (b in _UNDEFINED_BELOW_ZERO and forms[a, LOW] < 0.0)
    if operation == _MULTIPLY:
        return _unknown(forms, a) or _unknown(forms, b)
    return operation in (_CHOOSE, _PHI) and _unknown(forms, a)


@compiled
def operate(
    entry: Index,
    number: Array,
    to: int,
    forms: Array,
    start: Array,
    past: Array,
    stage: Array,
    data: Array,
    noise: Array,
    now: int,
    defined_only: bool,
    products: Index,
) -> None:
    """Write one form of the tape; nothing is known where it must be defined and may not be."""
    operation, a, b, c = entry[0], entry[1], entry[2], entry[3]
    if defined_only and may_be_undefined(entry, forms):
        nothing_known(forms, to)
    elif operation == _NUMBER:
        interval(forms, to, number[0], number[1])
    elif operation == _PARAMETER:
        copy(forms, to, start, a)
    elif operation == _CHANNEL:
        if now >= b and math.isfinite(data[a, now - b]):
            interval(forms, to, data[a, now - b], noise[a])
        else:
            nothing_known(forms, to)
    elif operation == _PAST:
        if now >= b:
            copy(forms, to, past[a], (now - b) % past.shape[1])
        else:
            nothing_known(forms, to)
    elif operation == _ADD:
        add(forms, to, a, b, 1.0)
    elif operation == _SUBTRACT:
        add(forms, to, a, b, -1.0)
    elif operation == _MULTIPLY:
        multiply(forms, to, a, b, products)
    elif operation == _LARGER:
        larger(forms, to, a, b)
    elif operation == _SCALE:
        linear(forms, to, a, number[0], 0.0, 0.0)
    elif operation == _DEFINE:
        copy(forms, to, forms, a)
    elif operation in (_STAGE, _SOLUTION):
        copy(forms, to, stage, a)
    elif operation == _APPLY:
        apply(forms, to, a, b, number[0])
    elif operation == _PHI:
        phi_of(forms, to, a, 1)
    elif forms[a, LOW] > 0.0 or (forms[a, LOW] == 0.0 and number[0] == 0.0):
        copy(forms, to, forms, b)
    elif forms[a, HIGH] < 0.0 or (forms[a, HIGH] == 0.0 and number[0] == 1.0):
        copy(forms, to, forms, c)
    else:
        hull(forms, to, b, c)
