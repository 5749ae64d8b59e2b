"""The conic program of a relaxation, and the multipliers that a solver's dual vector contains.

    minimise  q'y   subject to   A y + s = b,   s in K,

over the moments ``y`` without the constant one. The rows of A come in this order:

1. equalities (zero cone);
2. 1 x 1 blocks (nonnegative orthant);
3. 2 x 2 blocks (second-order cones): ``[[a, c], [c, e]]`` is semidefinite if and only if ``(a + e, a - e, 2 c)`` is in
   the Lorentz cone;
4. wider blocks (scaled upper triangle, columns stacked).
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from relaxations.algebra.arrays import Array, Index
from relaxations.errors import ProblemError
from relaxations.moments.moment import Blocks, Relaxation

# Measured with Clarabel: 64 to 82 bytes per pair on blocks of widths 3 to 105, 350 to 440 bytes per term on lifts of
# 30 thousand to 1.4 million terms, half of it for the assembly.
BYTES_PER_PAIR = 80  # for each pair of entries of a block
BYTES_PER_TERM = 400  # for each term of rows and blocks
FEWER = "give fewer constraints: a shorter record, or windows of it one by one, whose intervals hold together"


@dataclass(frozen=True)
class Cones:
    """Sizes of the cones, in the order of the rows.

    Parameters
    ----------
    zero
        Number of equalities.
    nonnegative
        Rows of the nonnegative orthant.
    second_order
        Rows of each Lorentz cone: 3 for a 2 x 2 block.
    semidefinite
        Width w of each block, which has ``w (w + 1) / 2`` rows.

    Examples
    --------
    >>> Cones(zero=1, nonnegative=2, second_order=(3,), semidefinite=(5,)).semidefinite
    (5,)
    """

    zero: int
    nonnegative: int
    second_order: tuple[int, ...]
    semidefinite: tuple[int, ...]


@dataclass(frozen=True)
class ConicProgram:
    """The constraints ``A y + s = b, s in K``, shared by all objectives over one relaxation.

    Parameters
    ----------
    matrix
        A, shape (n_rows, n_moments - 1); the constant moment has no column.
    rhs
        b, shape (n_rows,).
    cones
        K, in the order of the rows.
    slices
        Rows of each group of blocks of the relaxation; empty if the program comes from another source.
    """

    matrix: sparse.csc_matrix
    rhs: Array
    cones: Cones
    slices: tuple[slice, ...]

    @property
    def n_rows(self) -> int:
        """Return the number of rows of A."""
        return int(self.matrix.shape[0])


@dataclass(frozen=True)
class Multipliers:
    """The multipliers of a dual solution that a certificate uses.

    Parameters
    ----------
    equalities
        Shape (n_equalities,).
    factors
        Each of shape (count, size, rank). The multiplier of block k is ``F_k F_k'``, so it is always semidefinite.
    """

    equalities: Array
    factors: tuple[Array, ...]


def check_memory(widths: Mapping[int, int], terms: int, what: str, cure: str) -> None:
    """Refuse a relaxation that needs more than four fifths of the machine's memory, by :func:`check_bytes`.

    ``widths`` gives the number of blocks of each width, ``terms`` the number of coefficients in all rows and blocks.
    A solver stores a dense matrix over the entries of each block, and its factors.
    """
    pairs = sum(count * (width * (width + 1) // 2) ** 2 for width, count in widths.items())
    needed = BYTES_PER_PAIR * pairs + BYTES_PER_TERM * terms
    blocks = f"semidefinite blocks of width {max(widths)} and " if widths else ""
    check_bytes(needed, f"{what} asks for {blocks}", cure)


def check_bytes(needed: float, what: str, cure: str) -> None:
    """Refuse a computation that needs more than four fifths of the machine's memory, by a ProblemError.

    The message consists of the computation, ``what`` ("... asks for "), both sizes, and what the user can do, ``cure``.
    """
    available = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") if hasattr(os, "sysconf") else 8e9
    if needed > 0.8 * available:
        raise ProblemError(f"{what}about {_size(needed)} of memory; this machine has {_size(available)}: {cure}")


def _size(count: float) -> str:
    return f"{count / 1e12:.0f} TB" if count >= 1e13 else f"{count / 1e9:.3g} GB"


def conic_program(relaxation: Relaxation) -> ConicProgram:
    """Return the constraints of a relaxation as a conic program.

    Examples
    --------
    The moments of x and x^2 on [-1, 1]: ``1 - y_2 >= 0``, and ``[[1, y_1], [y_1, y_2]]`` as a Lorentz cone.

    >>> from relaxations.moments.lasserre_hierarchy import lasserre
    >>> from relaxations.problem.problem import from_sympy
    >>> import sympy
    >>> x = sympy.Symbol("x")
    >>> program = conic_program(lasserre(from_sympy(None, [], [], [x], {x: (-1, 1)})[0], 1))
    >>> program.rhs - program.matrix @ np.array([0.5, 0.25])  # s, at the moments of the point 1/2
    array([0.75, 1.25, 0.75, 1.  ])
    >>> program.cones
    Cones(zero=0, nonnegative=1, second_order=(3,), semidefinite=())
    """
    row_parts, moment_parts, value_parts = (
        [relaxation.equality_row],
        [relaxation.equality_moment],
        [relaxation.equality_coefficient.mid],
    )
    # Append the groups in the order of the cones, and note the rows of each.
    start = relaxation.n_equalities
    nonnegative = 0
    second_order: list[int] = []
    semidefinite: list[int] = []
    slices: dict[int, slice] = {}
    groups = sorted(range(len(relaxation.blocks)), key=lambda g: min(_width(relaxation.blocks[g]), 3))
    for g in groups:
        blocks = relaxation.blocks[g]
        rows, moments, values, height = _rows(blocks)
        row_parts.append(rows + start)
        moment_parts.append(moments)
        value_parts.append(-values)
        slices[g] = slice(start, start + height)
        start += height
        width = _width(blocks)
        if width == 1:
            nonnegative += blocks.count
        elif width == 2:
            second_order += [3] * blocks.count
        else:
            semidefinite += [width] * blocks.count
    # Column 0 belongs to the constant moment: it becomes the right-hand side.
    full = sparse.csc_matrix(
        (np.concatenate(value_parts), (np.concatenate(row_parts), np.concatenate(moment_parts))),
        shape=(start, relaxation.n_moments),
    )
    return ConicProgram(
        full[:, 1:],
        -full[:, [0]].toarray().ravel(),
        Cones(relaxation.n_equalities, nonnegative, tuple(second_order), tuple(semidefinite)),
        tuple(slices[g] for g in range(len(relaxation.blocks))),
    )


def _width(blocks: Blocks) -> int:
    """Return the width of a group's blocks, after facial reduction."""
    return blocks.size if blocks.congruence is None else int(blocks.congruence.shape[2])


def _rows(blocks: Blocks) -> tuple[Index, Index, Array, int]:
    """Return the triplets (row, moment, value) of ``s(y)`` for a group, and its number of rows."""
    width = _width(blocks)
    if blocks.congruence is None:
        block, i, j, moment, value = blocks.block, blocks.i, blocks.j, blocks.moment, blocks.coefficient.mid
    else:
        block, i, j, moment, value = _congruent(blocks)
    if width == 1:
        return block, moment, value, blocks.count
    if width == 2:
        diagonal = i == j
        first = 3 * block
        rows = np.concatenate([first[diagonal], first[diagonal] + 1, first[~diagonal] + 2])
        values = np.concatenate(
            [value[diagonal], np.where(i[diagonal] == 0, 1.0, -1.0) * value[diagonal], 2.0 * value[~diagonal]]
        )
        moments = np.concatenate([moment[diagonal], moment[diagonal], moment[~diagonal]])
        return rows, moments, values, 3 * blocks.count
    triangle = width * (width + 1) // 2
    rows = block * triangle + j * (j + 1) // 2 + i
    return rows, moment, np.where(i == j, 1.0, np.sqrt(2.0)) * value, blocks.count * triangle


def _congruent(blocks: Blocks) -> tuple[Index, Index, Index, Index, Array]:
    """Return the entries of ``V' M V`` for each block M."""
    assert blocks.congruence is not None
    i, j = np.triu_indices(_width(blocks))
    parts = []
    for k in range(blocks.count):
        mine = blocks.block == k
        v = blocks.congruence[k]
        left, right = v[blocks.i[mine]], v[blocks.j[mine]]
        off = (blocks.i[mine] != blocks.j[mine])[:, None]
        value = left[:, i] * right[:, j] + np.where(off, right[:, i] * left[:, j], 0.0)
        value *= blocks.coefficient.mid[mine][:, None]
        entry, kept = np.nonzero(np.abs(value) > 1e-14)
        moment = blocks.moment[mine][entry]
        parts.append((np.full(len(entry), k), i[kept], j[kept], moment, value[entry, kept]))
    block, rows, columns, moment, value = (np.concatenate(p) for p in zip(*parts, strict=True))
    return block, rows, columns, moment, value


def multipliers(relaxation: Relaxation, program: ConicProgram, dual: Array) -> Multipliers:
    """Return the projection of a solver's dual vector onto the dual cone, as factors of semidefinite matrices.

    Parameters
    ----------
    program
        The conic program of the relaxation.
    dual
        Shape (n_rows,). Finite.

    Examples
    --------
    >>> from relaxations.moments.lasserre_hierarchy import lasserre
    >>> from relaxations.problem.problem import from_sympy
    >>> import sympy
    >>> x = sympy.Symbol("x")
    >>> relaxation = lasserre(from_sympy(None, [], [], [x], {x: (-1, 1)})[0], 1)
    >>> dual = np.array([4.0, 0.0, 1.0, 0.0])  # for 1 - x^2 the number 4, for the moment matrix diag(1, -1)
    >>> moment_matrix, box = multipliers(relaxation, conic_program(relaxation), dual).factors
    >>> (moment_matrix @ moment_matrix.swapaxes(1, 2))[0].round(12)
    array([[1., 0.],
           [0., 0.]])
    """
    factors = []
    for blocks, rows in zip(relaxation.blocks, program.slices, strict=True):
        width = _width(blocks)
        z = dual[rows]
        matrix = np.zeros((blocks.count, width, width))
        if width == 1:
            matrix[:, 0, 0] = z
        elif width == 2:
            z = z.reshape(-1, 3)
            matrix[:, 0, 0], matrix[:, 1, 1] = z[:, 0] + z[:, 1], z[:, 0] - z[:, 1]
            matrix[:, 0, 1] = matrix[:, 1, 0] = z[:, 2]
        else:
            j, i = np.tril_indices(width)  # columns of the upper triangle, stacked
            z = z.reshape(blocks.count, -1)
            matrix[:, i, j] = matrix[:, j, i] = z * np.where(i == j, 1.0, np.sqrt(0.5))
        if width == 1:
            root = np.sqrt(np.maximum(matrix, 0.0))
        else:
            values, vectors = np.linalg.eigh(matrix)
            root = vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :]
        factors.append(root if blocks.congruence is None else blocks.congruence @ root)
    # The solver's sign of an equality multiplier is opposite to the certificate's.
    return Multipliers(-dual[: relaxation.n_equalities], tuple(factors))
