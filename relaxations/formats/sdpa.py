"""Semidefinite programs in SDPA's sparse format (``.dat-s``), which most solvers read.

    minimise  c'x   subject to   F_1 x_1 + ... + F_m x_m - F_0 positive semidefinite,

with block-diagonal matrices. A negative size means a diagonal block. The format has no equalities: an equality of a
relaxation is written as two diagonal entries, ``a'x - b >= 0`` and ``b - a'x >= 0``.

References
----------
K. Fujisawa, M. Fukuda, Y. Futakata, K. Kobayashi, M. Kojima, K. Nakata, M. Nakata and M. Yamashita, "SDPA
(SemiDefinite Programming Algorithm) User's Manual", version 7.0.5 (2008), section 6. B. Borchers, "SDPLIB 1.2, a
library of semidefinite programming test problems", Optimization Methods and Software 11 (1999) 683-690.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import sparse

from relaxations.algebra.arrays import Array, Index
from relaxations.errors import ProblemError
from relaxations.formats.files import parsed
from relaxations.moments.conic import Cones, ConicProgram
from relaxations.solvers import ConicSolution, solve
from relaxations.writing import write_bytes

_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?")
_PUNCTUATION = str.maketrans(",(){}=", "      ")


@dataclass(frozen=True)
class SDPProblem:
    """``minimise cost'x : sum_i F_i x_i - F_0`` positive semidefinite, block by block.

    Parameters
    ----------
    cost
        Shape (m,).
    sizes
        Width of each block; negative for a diagonal one.
    matrix, block, row, column, value
        Shape (n_entries,). Matrix (F_0 to F_m), block, row and column of each entry, from 0, with ``row <= column``.
    comment
        One line at the head of a file.
    """

    cost: Array
    sizes: tuple[int, ...]
    matrix: Index
    block: Index
    row: Index
    column: Index
    value: Array
    comment: str = ""

    def solve(self, solver: str = "clarabel") -> ConicSolution:
        """Return a solution: the optimal x is ``moments[1:]``. Nothing is certified, because x is not bounded.

        Examples
        --------
        >>> found = parse_sdpa('''
        ... 2
        ... 1
        ... {-2}
        ... {1.0, 2.0}
        ... 0 1 1 1 3.0
        ... 1 1 1 1 1.0
        ... 0 1 2 2 4.0
        ... 2 1 2 2 1.0''').solve()
        >>> [round(float(v), 6) for v in found.moments[1:]]
        [3.0, 4.0]
        """
        return solve(conic_of(self), np.concatenate([[0.0], self.cost]), solver)


def sdp_of(program: ConicProgram, objective: Array, comment: str = "") -> SDPProblem:
    """Return a relaxation's conic program as a semidefinite program; its comment states the objective's constant.

    ProblemError if a second-order cone has a size other than 3; the conic programs of relaxations have none.
    """
    if any(size != 3 for size in program.cones.second_order):
        raise ProblemError("only second-order cones of size 3 can be written as 2 x 2 blocks")
    n, cones = program.matrix.shape[1], program.cones
    # s = b - A y is the matrix of the block: F_i holds -A, and F_0 holds -b.
    constant = sparse.csc_matrix(-program.rhs.reshape(-1, 1))
    rows = sparse.csr_matrix(sparse.hstack([constant, -program.matrix]))
    parts: list[tuple[Index, Index, Index, Index, Array]] = []
    sizes: list[int] = []

    def put(block: int, of_rows: sparse.csr_matrix, i: Index, j: Index) -> None:
        entries = of_rows.tocoo()
        own, matrix = np.asarray(entries.row, dtype=np.int64), np.asarray(entries.col, dtype=np.int64)
        value = np.asarray(entries.data, dtype=np.float64)
        parts.append((matrix, np.full(len(own), block), i[own], j[own], value))

    # Equalities twice, with both signs, and the orthant: one diagonal block.
    position = cones.zero + cones.nonnegative
    if position:
        zero, rest = rows[: cones.zero], rows[cones.zero : position]
        linear = sparse.csr_matrix(sparse.vstack([zero, -zero, rest]))
        own = np.arange(linear.shape[0])
        put(0, linear, own, own)
        sizes.append(-linear.shape[0])
    # Second-order cones: 2 x 2 blocks.
    upper = np.array([0, 1, 0]), np.array([0, 1, 1])
    halves = sparse.csr_matrix([[0.5, 0.5, 0.0], [0.5, -0.5, 0.0], [0.0, 0.0, 0.5]])  # (a + e, a - e, 2 c) to (a, e, c)
    for _ in cones.second_order:
        put(len(sizes), sparse.csr_matrix(halves @ rows[position : position + 3]), *upper)
        sizes.append(2)
        position += 3
    for width in cones.semidefinite:
        height = width * (width + 1) // 2
        j, i = np.tril_indices(width)  # columns of the upper triangle, stacked
        unscaled = sparse.diags(np.where(i == j, 1.0, np.sqrt(0.5))) @ rows[position : position + height]
        put(len(sizes), sparse.csr_matrix(unscaled), i, j)
        sizes.append(width)
        position += height
    # Drop zeros, and put the objective's constant in the comment.
    matrix, block, row, column, value = (np.concatenate(p) for p in zip(*parts, strict=True))
    kept = value != 0
    added = f"add {float(objective[0])!r} to the optimum" if objective[0] else ""
    return SDPProblem(
        np.asarray(objective[1 : n + 1], dtype=np.float64),
        tuple(sizes),
        matrix[kept],
        block[kept],
        row[kept],
        column[kept],
        value[kept],
        "; ".join(part for part in (comment, added) if part),
    )


def conic_of(problem: SDPProblem) -> ConicProgram:
    """Return a semidefinite program as a conic program; its moments are the unknowns x."""
    # First row of each block, with the blocks in the order of the cones.
    order = sorted(range(len(problem.sizes)), key=lambda b: _kind(problem.sizes[b]))
    start = np.zeros(len(problem.sizes), dtype=np.int64)
    total = 0
    for b in order:
        start[b] = total
        total += _height(problem.sizes[b])
    kind = np.array([_kind(size) for size in problem.sizes], dtype=np.int64)[problem.block]
    first = start[problem.block]
    i, j, value = problem.row, problem.column, problem.value
    plain, pair, wide = kind == 0, kind == 1, kind == 2
    diagonal = pair & (i == j)
    # Row and value of each entry, by the kind of its block; two rows for the diagonal of a Lorentz cone.
    parts = (
        (first + i, value, plain),
        (first, value, diagonal),
        (first + 1, np.where(i == 0, value, -value), diagonal),
        (first + 2, 2.0 * value, pair & (i != j)),
        (first + j * (j + 1) // 2 + i, np.where(i == j, 1.0, np.sqrt(2.0)) * value, wide),
    )
    rows = np.concatenate([r[chosen] for r, _, chosen in parts])
    values = np.concatenate([v[chosen] for _, v, chosen in parts])
    columns = np.concatenate([problem.matrix[chosen] for *_, chosen in parts])
    # Column 0 is F_0, which becomes the right-hand side.
    full = sparse.csc_matrix((values, (rows, columns)), shape=(total, len(problem.cost) + 1))
    sizes = [problem.sizes[b] for b in order]
    return ConicProgram(
        sparse.csc_matrix(-full[:, 1:]),
        -full[:, [0]].toarray().ravel(),
        Cones(
            0,
            sum(_height(s) for s in sizes if _kind(s) == 0),
            tuple(3 for s in sizes if _kind(s) == 1),
            tuple(s for s in sizes if _kind(s) == 2),
        ),
        (),
    )


def _kind(size: int) -> int:
    """Return 0 for a linear block, 1 for a second-order cone, 2 for a semidefinite block."""
    return 0 if size < 0 or size == 1 else 1 if size == 2 else 2


def _height(size: int) -> int:
    """Return the number of rows of a block in the conic program."""
    return abs(size) if _kind(size) == 0 else 3 if size == 2 else size * (size + 1) // 2


def write_sdpa(path: str | Path, problem: SDPProblem) -> None:
    """Write a file; every float is read back without rounding.

    Examples
    --------
    >>> import tempfile
    >>> one, zero = np.array([1]), np.array([0])
    >>> problem = SDPProblem(np.array([0.1]), (-1,), one, zero, zero, zero, np.array([1.0]), "x >= 0")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "problem.dat-s"
    ...     write_sdpa(file, problem)
    ...     print(file.read_text(), end="")
    "x >= 0
    1
    1
    -1
    0.1
    1 1 1 1 1.0
    """
    lines = [f'"{" ".join(problem.comment.split())}'] if problem.comment else []
    lines += [
        f"{len(problem.cost)}",
        f"{len(problem.sizes)}",
        " ".join(str(size) for size in problem.sizes),
        " ".join(repr(float(c)) for c in problem.cost),
    ]
    order = np.lexsort((problem.column, problem.row, problem.block, problem.matrix))
    for k in order.tolist():
        place = f"{problem.matrix[k]} {problem.block[k] + 1} {problem.row[k] + 1} {problem.column[k] + 1}"
        lines.append(f"{place} {float(problem.value[k])!r}")
    write_bytes(path, ("\n".join(lines) + "\n").encode("ascii", errors="replace"))


def read_sdpa(path: str | Path) -> SDPProblem:
    """Return the semidefinite program of a file; see :func:`parse_sdpa`.

    Raises
    ------
    ProblemError
        With the file, the line and the cause.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder) / "problem.dat-s"
    ...     one, zero = np.array([1]), np.array([0])
    ...     write_sdpa(file, SDPProblem(np.array([0.1]), (-1,), one, zero, zero, zero, np.array([1.0]), "x >= 0"))
    ...     again = read_sdpa(file)
    >>> again.comment, again.sizes, again.cost
    ('x >= 0', (-1,), array([0.1]))
    """
    return parsed(path, parse_sdpa)


def parse_sdpa(text: str) -> SDPProblem:
    """Return the semidefinite program of a text in SDPA's sparse format.

    Raises
    ------
    ProblemError
        With the line and the cause.

    Examples
    --------
    >>> problem = parse_sdpa('''
    ... 1 = mDIM
    ... 1 = nBLOCK
    ... {2}
    ... {1.0}
    ... 1 1 1 1 1.0
    ... 1 1 2 2 1.0
    ... 0 1 1 2 -3.0''')
    >>> round(float(problem.solve().moments[1]), 4)  # the least x with [[x, 3], [3, x]] positive semidefinite
    3.0
    """
    # Comments, then sizes and costs in the first four lines.
    lines = [(k, line) for k, line in enumerate(text.splitlines(), start=1) if line.strip()]
    comments = [line for _, line in lines if line.lstrip().startswith(('"', "*"))]
    lines = [(k, line) for k, line in lines if not line.lstrip().startswith(('"', "*"))]
    if len(lines) < 4:
        raise ProblemError("line 1: the number of variables, that of blocks, their sizes and the cost are expected")
    m = _whole(lines[0], "number of variables")
    n_blocks = _whole(lines[1], "number of blocks")
    sizes = [_integer(word, lines[2][0]) for word in _leading(lines[2], n_blocks, "sizes of blocks")]
    if 0 in sizes:
        raise ProblemError(f"line {lines[2][0]}: a block has the size 0")
    cost = [_real(word, lines[3][0]) for word in _leading(lines[3], m, "entries of the cost")]
    # The entries, one a line; each position may occur once.
    places: dict[tuple[int, int, int, int], int] = {}
    values = []
    for number, line in lines[4:]:
        words = line.translate(_PUNCTUATION).split()
        if len(words) != 5:
            raise ProblemError(
                f"line {number}: matrix, block, row, column and value are expected, not {line.strip()!r}"
            )
        matrix, block, row, column = (_integer(word, number) for word in words[:4])
        if not 0 <= matrix <= m:
            raise ProblemError(f"line {number}: matrix {matrix} is not between 0 and {m}")
        if not 1 <= block <= n_blocks:
            raise ProblemError(f"line {number}: block {block} is not between 1 and {n_blocks}")
        width = abs(sizes[block - 1])
        if not (1 <= row <= width and 1 <= column <= width):
            raise ProblemError(f"line {number}: entry ({row}, {column}) lies outside of block {block} of width {width}")
        if row != column and sizes[block - 1] < 0:
            raise ProblemError(
                f"line {number}: entry ({row}, {column}) lies off the diagonal of diagonal block {block}"
            )
        place = (matrix, block - 1, min(row, column) - 1, max(row, column) - 1)
        if place in places:
            raise ProblemError(f"line {number}: the entry of line {places[place]} is given again")
        places[place] = number
        values.append(_real(words[4], number))
    table = np.array(list(places), dtype=np.int64).reshape(-1, 4)
    return SDPProblem(
        np.array(cost, dtype=np.float64),
        tuple(sizes),
        table[:, 0],
        table[:, 1],
        table[:, 2],
        table[:, 3],
        np.array(values, dtype=np.float64),
        comments[0].lstrip().lstrip('"*').strip() if comments else "",
    )


def _leading(line: tuple[int, str], count: int, what: str) -> list[str]:
    """Return the first ``count`` words of a line; text may follow, as in ``2 = mDIM``."""
    number, text = line
    words = text.translate(_PUNCTUATION).split()
    if len(words) < count:
        raise ProblemError(f"line {number}: {count} {what} are expected, not {len(words)}")
    if len(words) > count and _NUMBER.fullmatch(words[count]):
        raise ProblemError(f"line {number}: {count} {what} are expected, and there are more")
    return words[:count]


def _whole(line: tuple[int, str], what: str) -> int:
    """Return the integer at the beginning of a line, at least 1."""
    value = _integer(_leading(line, 1, what)[0], line[0])
    if value < 1:
        raise ProblemError(f"line {line[0]}: the {what} is {value}, at least 1 is needed")
    return value


def _integer(word: str, number: int) -> int:
    """Return an integer."""
    if not re.fullmatch(r"[-+]?\d{1,9}", word):
        raise ProblemError(f"line {number}: {word!r} is not a whole number")
    return int(word)


def _real(word: str, number: int) -> float:
    """Return a finite number."""
    value = float(word.lower().replace("d", "e")) if _NUMBER.fullmatch(word) else np.nan
    if not np.isfinite(value):
        raise ProblemError(f"line {number}: {word!r} is not a finite number")
    return value
