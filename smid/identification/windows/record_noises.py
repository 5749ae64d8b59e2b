"""Noises within their bounds with which fixed parameters fit every sample, by numpy over the whole record.

Once the parameters are fixed the equations are linear in the noises, ``A x = b``, and each of them reads a few samples
in a row: ``A A'`` is a band. The nearest noises that solve the equations are one banded solve away, and the nearest
within the bounds are clipped. To reflect at both in turn (Douglas and Rachford) ends at noises in both sets, after some
tens of passes where there is room. Where there is none, the noises that stay beyond their bounds are those that object.

Reference: H. H. Bauschke and P. L. Combettes, Convex Analysis and Monotone Operator Theory in Hilbert Spaces (2011),
section 26.3.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.linalg import cho_solve_banded, cholesky_banded

from relaxations.algebra.arrays import Array, Index
from relaxations.deadline import check_time
from relaxations.search.benders.program import least_excess
from relaxations.solvers import Solver
from smid.identification.windows.whole_record import Equations

_WITHIN = 0.98  # noises are clipped to this share of their bounds: at the bounds themselves passes end ever more slowly


@dataclass(frozen=True, eq=False)
class Part:
    """The least excess over the noise bounds in some samples, and noises that have it.

    Parameters
    ----------
    noises
        Shape (n_noises, n_samples). Shares of their bounds.
    times, weights
        Shape (n_equations,). Of each equation, its sample and the size of its multiplier.
    """

    excess: float
    noises: Array
    times: Index
    weights: Array


class RecordNoises:
    """The noises of one experiment at fixed parameters, as shares of their bounds.

    Parameters
    ----------
    equations
        Of every output.
    bounds
        Of each noise, by its name.
    n_samples
        Of the experiment.

    Raises
    ------
    numpy.linalg.LinAlgError
        Where equations depend on each other.
    """

    def __init__(
        self,
        equations: Sequence[Equations],
        values: Mapping[str, float],
        bounds: Mapping[str, float],
        n_samples: int,
    ) -> None:
        self._noises, self._n = tuple(bounds), n_samples
        self._first = [e.first for e in equations]
        self._constants = np.zeros((n_samples, len(equations)))
        self._factors: list[dict[tuple[int, int], Array]] = []
        for line, e in enumerate(equations):
            constant, factors = e.at(values)
            self._constants[e.first :, line] = constant
            self._factors.append({})
            for (noise, lag), factor in factors.items():
                padded = np.zeros(n_samples)
                padded[e.first :] = bounds[noise] * factor
                self._factors[line][self._noises.index(noise), lag] = padded
        self._cholesky = cholesky_banded(self._band(), lower=True)

    def passes(self, most: int) -> Iterator[Array]:
        """Yield noises that solve the equations, ever nearer to within their bounds; shape (n_noises, n_samples)."""
        reflected = np.zeros((len(self._noises), self._n))
        for _ in range(most):
            check_time()
            solved = self.solving(reflected)
            yield solved
            reflected += np.clip(2 * solved - reflected, -_WITHIN, _WITHIN) - solved

    def solving(self, x: Array) -> Array:
        """Return the nearest noises that solve the equations."""
        left = self._constants.copy()
        for line, factors in enumerate(self._factors):
            for (noise, lag), factor in factors.items():
                left[lag:, line] += factor[lag:] * x[noise, : self._n - lag]
        multipliers = cho_solve_banded((self._cholesky, True), left.ravel()).reshape(left.shape)
        solved = x.copy()
        for line, factors in enumerate(self._factors):
            for (noise, lag), factor in factors.items():
                solved[noise, : self._n - lag] -= factor[lag:] * multipliers[lag:, line]
        return solved

    def part(self, first: int, last: int, solver: Solver, around: Array | None = None) -> Part | None:
        """Return the noises of some samples that exceed their bounds least, by a linear program.

        None where the solver has no answer. With noises around, those that other equations read as well stay.

        Parameters
        ----------
        around
            Shape (n_noises, n_samples).
        """
        length, count = last - first + 1, len(self._noises)
        free = np.ones((count, length), dtype=bool)
        if around is not None:
            depth = max(self._first)
            free[:, : depth if first else 0] = False
            free[:, length - depth if last < self._n - 1 else length :] = False
        # The equations that read these samples alone.
        times = [np.arange(first + begin, last + 1) for begin in self._first]
        constant = np.concatenate([self._constants[own, line] for line, own in enumerate(times)])
        rows, columns, values, before = [], [], [], 0
        for own, factors in zip(times, self._factors, strict=True):
            for (noise, lag), factor in factors.items():
                rows.append(before + np.arange(len(own)))
                columns.append(noise * length + own - lag - first)
                values.append(factor[own])
            before += len(own)
        triplets = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
        matrix = sparse.csc_matrix(triplets, shape=(before, count * length))
        noises = np.zeros((count, length)) if around is None else np.where(free, 0.0, around[:, first : last + 1])
        constant = constant + matrix @ noises.ravel()
        found = least_excess(constant, matrix[:, free.ravel()], np.zeros(0), sparse.csc_matrix((0, free.sum())), solver)
        if found is None:
            return None
        excess, noises[free], multipliers = found
        return Part(excess, noises, np.concatenate(times), np.abs(multipliers))

    def _band(self) -> Array:
        """Return ``A A'`` from its diagonal down, equations ordered by samples; one where a line has none yet."""
        count = len(self._factors)
        depth = max(lag for factors in self._factors for _, lag in factors)
        band = np.zeros(((depth + 1) * count, self._n, count))
        for i, factors in enumerate(self._factors):
            band[0, : self._first[i], i] = 1.0
            for j, others in enumerate(self._factors):
                for (noise, lag), factor in factors.items():
                    for (same, before), other in others.items():
                        # The equation of i comes so many samples, and so many rows, after that of j.
                        later = lag - before
                        below = later * count + i - j
                        if same == noise and below >= 0:
                            band[below, : self._n - later, j] += factor[later:] * other[: self._n - later]
        return band.reshape(len(band), -1)
