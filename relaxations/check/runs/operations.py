"""The operations of a tape on affine forms."""

from __future__ import annotations

from relaxations.check.runs.affine import NONE, Form, Products, add, hull, multiply, narrowed, negative, number
from relaxations.check.runs.functions import FUNCTIONS, geometric, power, raised
from relaxations.check.runs.tape import Entry


def cost_of(entry: Entry) -> int:
    """Return about how long an operation takes without its slopes, of which each takes one."""
    return 100 if entry[0] in FUNCTIONS or entry[0] in ("power", "raise", "geometric") else 10


def operate(entry: Entry, forms: list[Form], starts: list[Form], products: Products = NONE) -> Form:
    """Return the result of an operation."""
    match entry:
        case ("+", a, b):
            return add(forms[a], forms[b])
        case ("*", a, b):
            return multiply(forms[a], forms[b], products)
        case ("larger", a, b):
            one, other = forms[a], forms[b]
            form = add(other, FUNCTIONS["positive"](add(one, negative(other))))
            return narrowed(form, max(one.low, other.low), max(one.high, other.high))
        case ("number", value):
            return number(value)
        case ("parameter", k):
            return starts[k]
        case ("choose", over, a, b, strict):
            condition = forms[over]
            if condition.low > 0 or (condition.low == 0 and not strict):
                return forms[a]
            if condition.high < 0 or (condition.high == 0 and strict):
                return forms[b]
            return hull(forms[a], forms[b])
        case ("power", a, exponent):
            return power(forms[a], exponent)
        case ("raise", a, exponent):
            return raised(forms[a], forms[exponent], products)
        case ("geometric", base, count):
            return geometric(forms[base], forms[count])
        case (name, a):
            return FUNCTIONS[name](forms[a])
    raise AssertionError(entry)
