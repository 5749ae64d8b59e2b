"""Turned coordinates for the coefficients of a static curve, in which each is known well or has no effect.

The gains of three powers of an input that takes two levels, say, are known by two of their sums only. Boxes of the
gains stay as wide as they were, and the enclosures with them. Along the singular vectors of the powers' samples they do
not: the third coordinate cancels from every form.

For unknowns x, coordinates ``z = W (x - o)`` and any matrix T, ``x = o + T z + (1 - T W) (x - o)``. The last part is as
small as rounding where T is the inverse of W.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import sympy

from relaxations.algebra.affine_arithmetic import CENTRE, HIGH, LOW, RADIUS, SLOPES
from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.ball_arithmetic import EPSILON, TINY
from smid.models import Model
from smid.models.structure import exogenous
from smid.models.symbols import plain_symbols, references, signal, t

_UP = 1 + 64 * EPSILON
_GOLDEN = 0.6180339887


def middle_and_half(lower: Array, upper: Array) -> tuple[Array, Array]:
    """Return the numbers with which ``middle + half * e`` covers a box for e in [-1, 1]: half is 0 without ends."""
    known = np.isfinite(upper - lower)
    middle = 0.5 * np.where(known, lower, 0.0) + 0.5 * np.where(known, upper, 0.0)
    half = np.where(known, np.maximum(upper - middle, middle - lower) * (1 + 4 * EPSILON), 0.0)
    return middle, half + np.where(half > 0, TINY, 0.0)


def generic(lower: Array, upper: Array) -> Array:
    """Return a point of a box at which nothing vanishes by chance: at the middle, at zero, products often do.

    An unknown without ends is at its lower one.
    """
    place = np.modf(_GOLDEN * np.arange(1, len(lower) + 1))[0]
    point: Array = lower + place * np.where(np.isfinite(upper - lower), upper - lower, 0.0)
    return point


def static_curves(model: Model, signals: Mapping[str, Array]) -> Iterator[tuple[Index, Array]]:
    """Yield the parameters that are coefficients in one line alone, of what the record determines, with its samples.

    Parameters
    ----------
    signals
        Of any run.
    """
    names = [p.name for p in model.parameters]
    lines = {line.signal: line for line in model.lines}
    occurring = Counter(name for line in model.lines for name in plain_symbols(line.expression))
    known = set(exogenous(model.lines))
    for line in model.lines:
        if all(name in known for name, _ in line.reads) and not plain_symbols(line.expression):
            known.add(line.signal)
    for line in lines.values():
        factors = {
            name: sympy.diff(line.expression, sympy.Symbol(name, real=True))
            for name in sorted(plain_symbols(line.expression), key=names.index)
            if occurring[name] == 1
        }
        own = {
            name: factor
            for name, factor in factors.items()
            if not plain_symbols(factor) and all(read in known for read, _ in references(factor))
        }
        if len(own) > 1:
            columns = [_samples(factor, signals) for factor in own.values()]
            shortest = min(map(len, columns))  # each column ends with the last sample
            yield np.array([names.index(name) for name in own]), np.column_stack([c[-shortest:] for c in columns])


def _samples(factor: sympy.Expr, signals: Mapping[str, Array]) -> Array:
    """Return what multiplies a coefficient, at the samples where it is known."""
    reads = sorted(references(factor))
    depth = max((lag for _, lag in reads), default=0)
    n = len(next(iter(signals.values())))
    values = [signals[name][depth - lag : n - lag] for name, lag in reads]
    symbols = [sympy.Dummy() for _ in reads]
    atoms = {signal(name)[t - lag]: symbol for (name, lag), symbol in zip(reads, symbols, strict=True)}
    found = sympy.lambdify(symbols, factor.xreplace(atoms), "numpy")(*values)
    return np.nan_to_num(np.broadcast_to(found, n - depth).astype(np.float64))


@dataclass(frozen=True, eq=False)
class Frame:
    """Coordinates of a box of unknowns.

    Parameters
    ----------
    origin
        Shape (unknowns,).
    inverse, basis
        Shape (unknowns, unknowns): W and T above.
    slack
        Shape (unknowns,). Bound of the last part above, over the box.
    lower, upper
        Shape (unknowns,). The coordinates of the box.
    """

    origin: Array
    inverse: Array
    basis: Array
    slack: Array
    lower: Array
    upper: Array

    @staticmethod
    def of(lower: Array, upper: Array, curves: Sequence[tuple[Index, Array]]) -> Frame:
        """Return the coordinates along the singular vectors of some samples.

        Parameters
        ----------
        lower, upper
            A finite box of the unknowns.
        curves
            Unknowns that are coefficients of one static curve, and the samples that each is multiplied with: shapes
            (k,) and (n, k).
        """
        origin, half = middle_and_half(lower, upper)
        half = np.maximum(half, TINY)
        turned = np.eye(len(half))
        for unknowns, samples in curves:
            turned[np.ix_(unknowns, unknowns)] = np.linalg.svd(samples * half[unknowns], full_matrices=True)[2]
        inverse, basis = turned / half, half[:, None] * turned.T
        # The coordinates of the box, and what T W leaves; each sum is rounded outwards.
        count = len(half)
        reach = (np.abs(inverse) @ half) * (_UP + 4 * count * EPSILON)
        defect = np.abs(np.eye(count) - basis @ inverse) + 4 * count * EPSILON * (np.abs(basis) @ np.abs(inverse))
        return Frame(origin, inverse, basis, (defect @ half) * _UP + TINY, -reach, reach)

    def write(self, forms: Array, middle: Array, half: Array, which: Index) -> None:
        """Write the forms of some unknowns over a box of as many coordinates, on which alone they depend."""
        count, basis = len(which), self.basis[np.ix_(which, which)]
        forms[:, CENTRE] = self.origin[which] + basis @ middle
        forms[:, SLOPES : SLOPES + count] = basis * half
        size = np.abs(self.origin[which]) + np.abs(basis) @ (np.abs(middle) + half)
        forms[:, RADIUS] = (self.slack[which] + 4 * (count + 2) * EPSILON * size) * _UP
        reach = (np.abs(forms[:, SLOPES : SLOPES + count]).sum(axis=1) + forms[:, RADIUS]) * _UP
        forms[:, LOW] = forms[:, CENTRE] - reach - EPSILON * np.abs(forms[:, CENTRE])
        forms[:, HIGH] = forms[:, CENTRE] + reach + EPSILON * np.abs(forms[:, CENTRE])

    def unknowns(self, coordinates: Array) -> Array:
        """Return roughly the unknowns of a point."""
        return self.origin + self.basis @ coordinates
