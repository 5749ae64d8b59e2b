"""Term sparsity: each moment matrix is split by a graph that the terms of the problem define.

1. The support is the set of terms of the objective and of the inequalities.
2. Monomials b, c of the basis of g are joined if a term of ``g b c`` is a square or lies in the support.
3. The graph is extended: to its connected components ("block closure"), or to a chordal graph. The matrix is split into
   the components, or the maximal cliques.
4. A multiple of an equality is kept if one of its terms is a square or lies in the support.
5. The terms of everything that is kept are the next support. All cliques of variables share one support.

Each step gives an equal or tighter bound, because its graph contains the graph before. Block closures end at the bound
of the full relaxation. Their blocks are parts of those of sign symmetry (:mod:`relaxations.moments.symmetry`). Chordal
extensions give smaller blocks and may end at a weaker bound.

References
----------
J. Wang, V. Magron and J. B. Lasserre, "TSSOS: a moment-SOS hierarchy that exploits term sparsity", SIAM Journal on
Optimization 31 (2021) 30-58, and "Chordal-TSSOS", ibid. 114-141. J. Wang, V. Magron, J. B. Lasserre and N. H. A. Mai,
"CS-TSSOS: correlative and term sparsity for large-scale polynomial optimization", ACM Transactions on Mathematical
Software 48 (2022) 42.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from relaxations.algebra.arrays import Index
from relaxations.algebra.polynomial import Factors, Polynomials
from relaxations.moments.blocks import Clique, Split
from relaxations.reductions.sparsity import chordal_cliques

Words = NDArray[np.uint64]


@dataclass(frozen=True)
class _Keys:
    """Hash keys of monomials: the sum, modulo 2^64, of a random word for each variable. Keys of factors add.

    The parities of the exponents are the exclusive or of these words, which is zero for a square. If two monomials have
    the same key, the graph gets a superfluous edge. The relaxation is then larger and still valid.
    """

    words: Words

    @staticmethod
    def of(n_variables: int) -> _Keys:
        # Seeded, so that a run can be repeated; the last word is that of padding, -1.
        """Return keys with a seeded generator, so that a run can be repeated."""
        words = np.random.default_rng(0).integers(1, 2**64, n_variables + 1, dtype=np.uint64)
        words[-1] = 0
        return _Keys(words)

    def sums(self, factors: Factors) -> Words:
        """Return the key of each monomial."""
        return np.asarray(self.words[factors].sum(axis=1, dtype=np.uint64))

    def parities(self, factors: Factors) -> Words:
        """Return the key of the odd exponents of each monomial."""
        return np.asarray(np.bitwise_xor.reduce(self.words[factors], axis=1))


@dataclass(frozen=True)
class _Matrix:
    """One matrix ``g b b'``, as keys of its basis and of the terms of g."""

    basis: Words
    parities: Words
    terms: Words
    term_parities: Words

    def graph(self, support: Words) -> NDArray[np.bool_]:
        """Return the adjacency matrix on the basis; every monomial is joined to itself."""
        products = self.basis[:, None] + self.basis[None, :]
        odd = self.parities[:, None] ^ self.parities[None, :]
        joined = np.eye(len(self.basis), dtype=np.bool_)
        for term, parity in zip(self.terms, self.term_parities, strict=True):
            joined |= (odd == parity) | np.isin(products + term, support)
        return joined


@dataclass(frozen=True)
class _Part:
    """A clique as keys; ``rows`` is the multiple of an equality to which each term belongs."""

    matrices: tuple[_Matrix, ...]
    rows: Index
    terms: Words
    squares: NDArray[np.bool_]

    @staticmethod
    def of(clique: Clique, keys: _Keys) -> _Part:
        """Return the keys of a clique."""
        g, multiples = clique.inequalities, clique.multiples
        bases = {half: (keys.sums(basis), keys.parities(basis)) for half, basis in clique.bases().items()}
        sums, parities = keys.sums(g.factors), keys.parities(g.factors)
        matrices = (
            _Matrix(*bases[half], sums[g.rows == row], parities[g.rows == row])
            for row, half in enumerate(clique.basis_degrees().tolist())
        )
        terms = keys.sums(multiples.factors)
        return _Part(tuple(matrices), multiples.rows, terms, keys.parities(multiples.factors) == 0)

    def support(self, blocks: Sequence[Sequence[Index]]) -> Words:
        """Return the terms in the given blocks of each matrix."""
        found = []
        for matrix, own in zip(self.matrices, blocks, strict=True):
            products = _union([(matrix.basis[block][:, None] + matrix.basis[block]).ravel() for block in own])
            found.append((products[:, None] + matrix.terms).ravel())
        return _union(found)

    def multiples_with(self, support: Words) -> Index:
        """Return the multiples of equalities that have a square or a term in the support."""
        return np.unique(self.rows[self.squares | np.isin(self.terms, support)])

    def terms_of(self, multiples: Index) -> Words:
        """Return the terms of the given multiples."""
        return self.terms[np.isin(self.rows, multiples)]


def split(cliques: Sequence[Clique], objective: Polynomials, steps: int, chordal: bool) -> tuple[Split, ...]:
    """Return the kept constraints of each clique after at most ``steps`` extensions of the support.

    >>> one, nothing = Polynomials.from_terms([{(): 1.0}]), Polynomials.empty()
    >>> clique = Clique((0, 1, 2), 2, nothing, nothing, one)
    >>> objective = Polynomials.from_terms([{(0, 1): 1.0, (2, 2, 2, 2): 1.0}])  # x0 x1 + x2^4
    >>> (kept,) = split([clique], objective, 1, chordal=False)
    >>> kept.widths  # of ten: 1, x0 x1 and the squares; x0 and x1; x2; x0 x2; x1 x2
    [5, 2, 1, 1, 1]
    """
    keys = _Keys.of(1 + max(max(clique.variables) for clique in cliques))
    parts = [_Part.of(clique, keys) for clique in cliques]
    support = _union([keys.sums(objective.factors), *(keys.sums(clique.inequalities.factors) for clique in cliques)])
    splits: tuple[Split, ...] = ()
    for _ in range(steps):
        blocks = [tuple(_closed(matrix.graph(support), chordal) for matrix in part.matrices) for part in parts]
        extended = _union([support, *(part.support(own) for part, own in zip(parts, blocks, strict=True))])
        rows = [part.multiples_with(extended) for part in parts]
        extended = _union([extended, *(part.terms_of(own) for part, own in zip(parts, rows, strict=True))])
        splits = tuple(Split(*kept) for kept in zip(rows, blocks, strict=True))
        if len(extended) == len(support):
            break
        support = extended
    return splits


def _union(parts: Sequence[Words]) -> Words:
    """Return the distinct keys of all parts."""
    return np.unique(np.concatenate(parts))


def _closed(graph: NDArray[np.bool_], chordal: bool) -> tuple[Index, ...]:
    """Return the parts of a basis: connected components of the graph, or cliques of their chordal extensions."""
    _, component = connected_components(graph, directed=False)
    order = np.argsort(component, kind="stable")
    parts = np.split(order, np.flatnonzero(np.diff(component[order])) + 1)
    if not chordal:
        return tuple(parts)
    found = []
    for part in parts:
        within = graph[np.ix_(part, part)]
        neighbours = [set(np.flatnonzero(row).tolist()) for row in within]
        found += [part[list(clique)] for clique in chordal_cliques(neighbours)]
    return tuple(found)
