"""The certified ends of a polytope hold for each of its points, exactly, and are those of linear programs."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from smid.models import ModelError
from smid.recursive.polytope import Polytope


def unit_box(n, capacity=300):
    return Polytope.box(-np.ones(n), np.ones(n), capacity)


def strips(generator, n, count, inside, width=0.5):
    normals = generator.normal(size=(count, n))
    value = normals @ inside + generator.uniform(-width, width, count)
    return np.stack([normals, -normals], 1), np.stack([value + width, width - value], 1)


def ends_by_programs(directions, normals, offsets, n):
    box = [(-1, 1)] * n
    return np.array([-linprog(-c, normals, offsets, bounds=box).fun for c in directions])


def test_the_ends_are_those_of_linear_programs():
    for n in (1, 2, 4, 6):
        generator = np.random.default_rng(n)
        inside = generator.uniform(-0.5, 0.5, n)
        normals, offsets = strips(generator, n, 120, inside)
        polytope = unit_box(n).along(np.eye(n)[:1] + 0.5)
        for row, right in zip(normals, offsets, strict=True):
            polytope = polytope.cut(row, right)
        for _ in range(20):  # the pivots of one cut are limited
            polytope = polytope.cut(normals[-1], offsets[-1])
        expected = ends_by_programs(polytope.directions, normals.reshape(-1, n), offsets.ravel(), n)
        np.testing.assert_allclose(polytope.ends, expected, atol=1e-7)
        assert not polytope.empty


def test_few_rows_are_kept_and_the_ends_stay_outer():
    n, generator = 3, np.random.default_rng(5)
    inside = np.array([0.3, -0.2, 0.1])
    normals, offsets = strips(generator, n, 400, inside)
    small, large = unit_box(n, 2 * n * n + 4), unit_box(n, 1000)
    shape = small.normals.shape
    for row, right in zip(normals, offsets, strict=True):
        before = small.ends
        small, large = small.cut(row, right), large.cut(row, right)
        assert (small.ends <= before).all()
        assert (small.lower <= inside).all()
        assert (inside <= small.upper).all()
    assert small.normals.shape == shape
    assert (small.ends >= large.ends - 1e-9).all()
    # What was forgotten costs little.
    np.testing.assert_allclose(small.upper - small.lower, large.upper - large.lower, rtol=0.05)


def holds(point, normals, offsets):
    exact = [Fraction(x) for x in point.tolist()]
    return all(
        sum(Fraction(a) * x for a, x in zip(row, exact, strict=True)) <= Fraction(b)
        for row, b in zip(normals.tolist(), offsets.tolist(), strict=True)
    )


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), n=st.integers(1, 4), scale=st.integers(-12, 12))
def test_every_point_that_satisfies_all_rows_exactly_is_inside(seed, n, scale):
    generator = np.random.default_rng(seed)
    inside = generator.uniform(-0.9, 0.9, n)
    normals, offsets = strips(generator, n, 25, inside, width=10.0**-scale if scale > 0 else 0.3)
    rows, right = normals.reshape(-1, n) * 10.0**scale, offsets.ravel() * 10.0**scale
    polytope = unit_box(n)
    for k in range(0, len(rows), 2):
        polytope = polytope.cut(rows[k : k + 2], right[k : k + 2])
    corners = np.clip(polytope.vertices, -1, 1)
    tried = np.concatenate([[inside], inside + (corners - inside) * (1 - 1e-9), corners])
    for point in tried:
        if holds(point, rows, right):
            assert not polytope.empty
            assert (polytope.lower <= point).all()
            assert (point <= polytope.upper).all()


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6), n=st.integers(1, 5))
def test_a_set_of_one_point_is_never_called_empty(seed, n):
    """Whole numbers: products and sums are exact, and every strip has width zero and holds the point."""
    generator = np.random.default_rng(seed)
    point = generator.integers(-9, 10, n).astype(float)
    polytope = Polytope.box(np.full(n, -10.0), np.full(n, 10.0), 200)
    for normal in generator.integers(-50, 51, (30, n)).astype(float):
        polytope = polytope.cut(np.array([normal, -normal]), np.array([normal @ point, -(normal @ point)]))
    assert not polytope.empty
    assert (polytope.lower <= point).all()
    assert (point <= polytope.upper).all()
    # Strips that are nearly parallel magnify the rounding of what they leave, outwards: 3e-8 has been seen.
    assert (polytope.upper - polytope.lower < 1e-6).all()


@pytest.mark.parametrize("gap", [1e-3, 1e-8])
def test_a_contradiction_is_certified(gap):
    square = unit_box(2)
    normals = np.array([[1.0, 2.0], [-1.0, -2.0]])
    assert square.cut(normals, np.array([0.25, -0.25 - gap])).empty
    assert not square.cut(normals, np.array([0.25, -0.25])).empty
    assert square.cut(np.zeros((1, 2)), np.array([-gap])).empty
    assert square.cut(np.zeros((1, 2)), np.array([0.0])) is square


def test_a_contradiction_of_many_rows_is_certified():
    """n + 1 half-spaces that leave no point, while any n of them do."""
    n = 4
    normals = np.concatenate([np.eye(n), -np.ones((1, n))])
    polytope = unit_box(n).cut(normals, np.append(np.zeros(n), -0.01))
    assert polytope.empty


def test_units_of_the_parameters_and_rows_do_not_matter():
    n, generator = 4, np.random.default_rng(3)
    inside = generator.uniform(-0.5, 0.5, n)
    normals, offsets = strips(generator, n, 200, inside)
    units = 2.0 ** np.array([0, 20, -20, 7])
    plain, scaled = unit_box(n), Polytope.box(-units, units, 300)
    for k, (row, right) in enumerate(zip(normals, offsets, strict=True)):
        size = 2.0 ** (10 * (k % 5))
        plain, scaled = plain.cut(row, right), scaled.cut(row / units * size, right * size)
    np.testing.assert_allclose(scaled.ends, plain.ends * np.tile(units, 2), rtol=1e-9)


def test_ends_along_other_directions():
    generator = np.random.default_rng(4)
    normals, offsets = strips(generator, 3, 60, np.zeros(3))
    polytope = unit_box(3)
    for row, right in zip(normals, offsets, strict=True):
        polytope = polytope.cut(row, right)
    others = generator.normal(size=(2, 3))
    turned = polytope.along(others)
    for _ in range(20):
        turned = turned.cut(normals[0], offsets[0])
    expected = ends_by_programs(np.concatenate([others, -others]), normals.reshape(-1, 3), offsets.ravel(), 3)
    np.testing.assert_allclose(turned.ends[6:], expected, atol=1e-7)
    np.testing.assert_allclose(turned.widths[3:], expected[:2] + expected[2:], atol=1e-7)
    np.testing.assert_array_equal(turned.lower, polytope.lower)
    again = turned.along(others[:1])
    assert again.ends[6] <= turned.ends[6] + 1e-9
    assert len(again.ends) == 8


def test_bad_boxes_and_too_little_room():
    for lower, upper in (([0.0], [-1.0]), ([0.0], [np.inf]), ([np.nan], [1.0])):
        with pytest.raises(ModelError, match="empty or not finite: give finite ends"):
            Polytope.box(np.array(lower), np.array(upper))
    with pytest.raises(ModelError, match="capacity = 8 is too small"):
        unit_box(2, 8)
    with pytest.raises(ModelError, match="raise the capacity"):
        unit_box(2, 10).along(np.eye(2))
