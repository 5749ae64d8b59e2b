"""Fixed-point intervals enclose the exact rational result."""

from fractions import Fraction
from math import ceil, floor

from hypothesis import given
from hypothesis import strategies as st

from relaxations.algebra import fixed_point as fp

floats = st.floats(-1e6, 1e6, allow_nan=False)
precisions = st.sampled_from([8, 80, 640])


def exact(value: fp.Interval, bits: int) -> tuple[Fraction, Fraction]:
    return Fraction(value[0], 1 << bits), Fraction(value[1], 1 << bits)


def inside(number: Fraction, value: fp.Interval, bits: int) -> bool:
    low, high = exact(value, bits)
    return low <= number <= high


@given(floats, precisions)
def test_a_float_is_enclosed_within_one_unit(x: float, bits: int) -> None:
    value = fp.from_float(x, bits)
    assert inside(Fraction(x), value, bits)
    assert value[1] - value[0] <= 1


@given(floats, floats, st.floats(0, 10), st.floats(-1, 1), precisions)
def test_products_and_quotients_enclose(x: float, y: float, radius: float, share: float, bits: int) -> None:
    wide = fp.widened(fp.from_float(x, bits), radius, bits)
    member = Fraction(x) + Fraction(radius) * Fraction(share)
    other = fp.from_float(y, bits)
    assert inside(member * Fraction(y), fp.multiply(wide, other, bits), bits)
    quotient = fp.divide(wide, other, bits)
    if quotient is None:
        assert other[0] <= 0 <= other[1]
    else:
        assert inside(member / Fraction(y), quotient, bits)


@given(floats, st.floats(0, 10), precisions)
def test_floats_come_back_outwards(x: float, radius: float, bits: int) -> None:
    value = fp.widened(fp.from_float(x, bits), radius, bits)
    low, high = fp.to_floats(value, bits)
    exact_low, exact_high = exact(value, bits)
    assert (
        Fraction(low)
        <= exact_low
        <= Fraction(fp.middle(value, bits)) + Fraction(1, 1 << bits) + abs(Fraction(x)) / 2**50
    )
    assert exact_high <= Fraction(high)


small = st.integers(-(2**40), 2**40)


@given(small, st.integers(0, 700), small, st.integers(0, 2**30), precisions)
def test_products_and_quotients_lose_less_than_one_unit(a: int, zeros: int, c: int, width: int, bits: int) -> None:
    few, wide = (a << zeros, a << zeros), (c, c + width)
    products = [Fraction(a << zeros) * end / 2**bits for end in wide]
    for found in (fp.multiply(few, wide, bits), fp.multiply(wide, few, bits)):
        assert found == (floor(min(products)), ceil(max(products)))
    if a:
        quotients = [Fraction(end * 2**bits, a << zeros) for end in wide]
        assert fp.divide(wide, few, bits) == (floor(min(quotients)), ceil(max(quotients)))
