"""The samples that a search may see, and the blocks of them that are left out in turn."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from relaxations.algebra.arrays import Array, Index, Mask
from smid.data import Dataset
from smid.diagnosis.effects.effect import Site
from smid.fitting.problem import Fit

FOLDS = 5
_BEGINNING = 0.1  # share of an experiment that tells its initial states, and is never left out


@dataclass(frozen=True, eq=False)
class Record:
    """The data as the search uses them: without the test part.

    Parameters
    ----------
    used
        Shape (n,). Per experiment, the samples that count: after the warm-up and no glitches.
    input, output
        Main channels.
    noise_bound
        Of the main output, in its unit.
    """

    data: Dataset
    used: tuple[Mask, ...]
    input: str
    output: str
    noise_bound: float | None = None

    @cached_property
    def folds(self) -> tuple[Array, ...]:
        """Per experiment, the number of the block that a sample belongs to; -1 for samples that are never left out."""
        lengths = [run.n_samples for run in self.data.experiments]
        begun = [round(_BEGINNING * n) for n in lengths]
        total, done, folds = sum(lengths) - sum(begun), 0, []
        for n, first in zip(lengths, begun, strict=True):
            place = done + np.arange(n - first)
            folds.append(np.concatenate([np.full(first, -1), place * FOLDS // total]))
            done += n - first
        return tuple(folds)

    @cached_property
    def latest(self) -> tuple[Index, ...]:
        """Per experiment and sample, the last one so far that counts; the first one where there is none before."""
        numbers = (np.where(u, np.arange(u.size), np.argmax(u)) for u in self.used)
        return tuple(np.maximum.accumulate(n) for n in numbers)

    def residual(self, fit: Fit) -> tuple[Array, ...]:
        """Return measured minus simulated main output of a fit, per experiment."""
        return fit.residual(self.data, self.output)

    def part(self, residual: tuple[Array, ...]) -> list[Array]:
        """Cut a residual to the samples that count."""
        return [r[u] for r, u in zip(residual, self.used, strict=True) if u.any()]

    def site(self, fit: Fit) -> Site:
        """Return the site for effects; its residual bridges the samples that do not count."""
        residual = tuple(bridged(r, u) if u.any() else r for r, u in zip(self.residual(fit), self.used, strict=True))
        return Site(self.data, self.input, self.output, residual)


def bridged(samples: Array, counted: Mask) -> Array:
    """Return samples with straight lines across those that do not count.

    Examples
    --------
    >>> bridged(np.array([1.0, 90.0, 3.0]), np.array([True, False, True]))
    array([1., 2., 3.])
    """
    return np.interp(np.arange(samples.size), np.flatnonzero(counted), samples[counted])
