"""SDPA's sparse format: files come back as they were, published optima are found, relaxations mean the same in it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from relaxations.errors import ProblemError
from relaxations.formats.expressions import problem_of, variables
from relaxations.formats.sdpa import SDPProblem, conic_of, parse_sdpa, read_sdpa, sdp_of, write_sdpa
from relaxations.proof.bounding import relax
from relaxations.solvers import Stop, solve

# The first example of SDPA's manual, optimum -41.9.
MANUAL = """"Example 1: mDim = 3, nBLOCK = 1, {2}"
   3  =  mDIM
   1  =  nBLOCK
   2  = bLOCKsTRUCT
{48, -8, 20}
0 1 1 1 -11
0 1 2 2 23
1 1 1 1 10
1 1 1 2 4
2 1 2 2 -8
3 1 1 2 -8
3 1 2 2 -2
"""
# The example in the description of SDPLIB, optimum 30.
SDPLIB = """"A sample problem.
2 =mdim
2 =nblocks
{2, 2}
10.0 20.0
0 1 1 1 1.0
0 1 2 2 2.0
0 2 1 1 3.0
0 2 2 2 4.0
1 1 1 1 1.0
1 1 2 2 1.0
2 1 2 2 1.0
2 2 1 1 5.0
2 2 1 2 2.0
2 2 2 2 6.0
"""


@pytest.mark.parametrize(("text", "optimum"), [(MANUAL, -41.9), (SDPLIB, 30.0)])
def test_published_optima_are_found(text, optimum):
    problem = parse_sdpa(text)
    found = problem.solve()
    assert found.stop in (Stop.SOLVED, Stop.INEXACT)
    assert problem.cost @ found.moments[1:] == pytest.approx(optimum, abs=1e-5)


def test_blocks_wider_than_two_and_diagonal_ones():
    # The largest eigenvalue of a symmetric matrix, and a bound from a diagonal block that is not active.
    rng = np.random.default_rng(3)
    matrix = rng.normal(size=(4, 4))
    matrix = matrix + matrix.T
    lines = ["1", "3", "-2 4 1", "1.0", "0 1 1 1 -100.0", "1 1 1 1 1.0", "1 1 2 2 1.0", "0 3 1 1 -50", "1 3 1 1 1"]
    lines += [f"0 2 {i + 1} {j + 1} {matrix[i, j]!r}" for i in range(4) for j in range(i + 1)]  # below the diagonal
    lines += [f"1 2 {i + 1} {i + 1} 1.0" for i in range(4)]
    found = parse_sdpa("\n".join(lines).replace("np.float64(", "").replace(")", "")).solve()
    assert found.moments[1] == pytest.approx(np.linalg.eigvalsh(matrix)[-1], abs=1e-6)


VALUES = st.floats(allow_nan=False, allow_infinity=False).filter(bool)


@st.composite
def problems(draw):
    m = draw(st.integers(1, 3))
    sizes = draw(st.lists(st.integers(-3, 4).filter(bool), min_size=1, max_size=3))
    places = []
    for matrix in range(m + 1):
        for block, size in enumerate(sizes):
            for i in range(abs(size)):
                places += [(matrix, block, i, j) for j in range(i, i + 1 if size < 0 else size)]
    chosen = draw(st.lists(st.sampled_from(places), unique=True, max_size=8).map(sorted))
    table = np.array(chosen, dtype=np.int64).reshape(-1, 4)
    values = draw(st.lists(VALUES, min_size=len(chosen), max_size=len(chosen)))
    cost = draw(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=m, max_size=m))
    return SDPProblem(np.array(cost), tuple(sizes), *table.T, np.array(values), draw(st.sampled_from(["", "a b = 3"])))


@settings(max_examples=80, deadline=None, derandomize=True)
@given(problems())
def test_any_problem_comes_back_bit_by_bit(tmp_path_factory, problem):
    file = tmp_path_factory.mktemp("sdpa") / "problem.dat-s"
    write_sdpa(file, problem)
    again = read_sdpa(file)
    assert (again.sizes, again.comment) == (problem.sizes, problem.comment)
    for key in ("cost", "matrix", "block", "row", "column", "value"):
        assert getattr(again, key).tobytes() == getattr(problem, key).tobytes()


x, y, z = variables("x y z")
RELAXED = {
    "quadratic": (x * y + y**2 - x, [x**2 + y**2 <= 1, x >= 0], "sparse", 2),
    "equality": (x - 3 * y, [y == x**2, x >= -1, x <= 2], "sparse", 2),
    "textbook": (x - y**2, [x**2 + y**2 == 1], "textbook", 1),
    "lift": (y - z, [y == x * z, x >= -1, x <= 1, z >= 0, z <= 2], "lift", 1),
}


@pytest.mark.parametrize("name", RELAXED)
def test_a_relaxation_means_the_same_in_a_file(tmp_path, name):
    objective, constraints, method, order = RELAXED[name]
    problem, goal = problem_of(objective, constraints)
    relaxed = relax(problem, method, order, objective=goal)
    cost = np.zeros(relaxed.relaxation.n_moments)
    scaled = relaxed.scaling.polynomials(goal)
    np.add.at(cost, relaxed.relaxation.moments_of(scaled.factors), scaled.coefficients.mid)
    write_sdpa(tmp_path / "p.dat-s", sdp_of(relaxed.program, cost, comment="a relaxation"))
    again = read_sdpa(tmp_path / "p.dat-s")
    wanted = solve(relaxed.program, cost)
    found = again.solve()
    assert again.cost @ found.moments[1:] == pytest.approx(cost[1:] @ wanted.moments[1:], abs=2e-6)
    assert again.comment.startswith("a relaxation")
    assert (cost[0] == 0) or f"add {float(cost[0])!r} to the optimum" in again.comment
    # And the points are feasible for both alike.
    assert residual(relaxed.program, wanted.moments) < 1e-6
    assert residual(conic_of(again), wanted.moments) < 1e-6
    far = wanted.moments + np.r_[0.0, np.full(len(cost) - 1, 3.0)]
    assert (residual(relaxed.program, far) > 1e-3) == (residual(conic_of(again), far) > 1e-3)


def residual(program, moments):
    """Return by how much ``b - A y`` misses the cone."""
    s = program.rhs - program.matrix @ moments[1:]
    cones, worst = program.cones, 0.0
    if cones.zero:
        worst = np.abs(s[: cones.zero]).max()
    place = cones.zero + cones.nonnegative
    worst = max(worst, -s[cones.zero : place].min(initial=0.0))
    for _ in cones.second_order:
        worst = max(worst, np.hypot(*s[place + 1 : place + 3]) - s[place])
        place += 3
    for width in cones.semidefinite:
        height = width * (width + 1) // 2
        matrix = np.zeros((width, width))
        j, i = np.tril_indices(width)
        matrix[i, j] = matrix[j, i] = s[place : place + height] * np.where(i == j, 1.0, np.sqrt(0.5))
        worst = max(worst, -np.linalg.eigvalsh(matrix)[0])
        place += height
    assert place == len(s)
    return worst


def replaced(old, new):
    assert MANUAL.count(old) == 1
    return MANUAL.replace(old, new)


MALFORMED = {
    "nothing": ("", "line 1: the number of variables"),
    "no number of variables": (replaced("   3  =  mDIM", "three"), "line 2: 'three' is not a whole number"),
    "no variables": (replaced("   3  =  mDIM", "0"), "line 2: the number of variables is 0"),
    "a size of zero": (replaced("   2  = bLOCKsTRUCT", "0"), "line 4: a block has the size 0"),
    "a size too many": (
        replaced("   2  = bLOCKsTRUCT", "2 3"),
        "line 4: 1 sizes of blocks are expected, and",
    ),
    "a short cost": (replaced("{48, -8, 20}", "{48, -8}"), "line 5: 3 entries of the cost are expected, not 2"),
    "a cost that is not a number": (replaced("20}", "x}"), "line 5: 'x' is not a finite number"),
    "a short entry": (replaced("2 1 2 2 -8", "2 1 2 -8"), "line 10: matrix, block, row, column and value are exp"),
    "an unknown matrix": (replaced("2 1 2 2 -8", "4 1 2 2 -8"), "line 10: matrix 4 is not between 0 and 3"),
    "an unknown block": (replaced("2 1 2 2 -8", "2 2 2 2 -8"), "line 10: block 2 is not between 1 and 1"),
    "an entry outside": (replaced("2 1 2 2 -8", "2 1 2 3 -8"), r"line 10: entry \(2, 3\) lies outside of block 1"),
    "row zero": (replaced("2 1 2 2 -8", "2 1 0 2 -8"), r"line 10: entry \(0, 2\) lies outside of block 1"),
    "an entry twice": (replaced("3 1 1 2 -8", "1 1 2 1 7"), "line 11: the entry of line 9 is given again"),
    "infinity": (replaced("2 1 2 2 -8", "2 1 2 2 1e999"), "line 10: '1e999' is not a finite number"),
    "off a diagonal": (replaced("   2  = bLOCKsTRUCT", "-2"), r"line 9: entry \(1, 2\) lies off the diagonal"),
}


@pytest.mark.parametrize("name", MALFORMED)
def test_what_is_malformed_is_told_with_its_line(tmp_path, name):
    text, message = MALFORMED[name]
    (tmp_path / "p.dat-s").write_text(text)
    with pytest.raises(ProblemError, match=rf"p\.dat-s: {message}"):
        read_sdpa(tmp_path / "p.dat-s")


def test_a_missing_file_is_told(tmp_path):
    with pytest.raises(ProblemError, match=r"p\.dat-s cannot be read"):
        read_sdpa(tmp_path / "p.dat-s")
