"""Ensemble: an estimate repeated on random halves of the record, for the uncertainty of what was learned.

Each experiment is cut into blocks. Each member is estimated from a new random start on a random half of the blocks,
in a free run over the whole record. The mean squared distance of the members from the estimate on all blocks is the
delete-half jackknife estimate of its variance: with half of the blocks left out the factor is one. Blocks keep what is
correlated in time together, and new starts add what the choice of a minimum contributes.

Reference: Shao, Wu, "A general theory for jackknife variance estimation", The Annals of Statistics 17 (1989).
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from relaxations.algebra.arrays import Array
from smid.display.result import Part, Result
from smid.fitting.problem import Fitting
from smid.hybrid.estimate import StalledFitWarning, estimate
from smid.hybrid.hybrid_estimate import HybridEstimate
from smid.models import ModelError

__all__ = ["Ensemble", "ensemble"]

_BLOCKS = 20
_STRAYED = 1.5  # RMS error of a member on all samples, by that of the estimate


@dataclass(frozen=True, eq=False, repr=False)
class Ensemble(Result):
    """An estimate and its repetitions on halves of the record.

    Parameters
    ----------
    whole
        Estimate on all samples.
    members
        Those whose error on all samples is near that of the estimate.
    strayed
        Number of members that ended in another minimum and are left out.
    """

    whole: HybridEstimate
    members: tuple[HybridEstimate, ...]
    strayed: int

    def deviation(self, read: Callable[[HybridEstimate], Array]) -> Array:
        """Return the standard deviation of what is read from the estimate.

        Parameters
        ----------
        read
            Returns an array from an estimate, of the same shape for each.
        """
        centre = read(self.whole)
        return np.asarray(np.sqrt(np.mean([(read(member) - centre) ** 2 for member in self.members], axis=0)))

    def _content(self) -> Iterator[Part]:
        yield self.whole
        left = f"; {self.strayed} ended in other minima and are left out" if self.strayed else ""
        yield f"Repeated on {len(self.members) + self.strayed} random halves of the record{left}."

    def to_dict(self) -> dict[str, Any]:
        """Return the estimate and the models of the members as plain data."""
        return {
            "whole": self.whole.to_dict(),
            "members": [member.model.to_dict() for member in self.members],
            "strayed": self.strayed,
        }


def ensemble(found: HybridEstimate, *, members: int = 10, seed: int | np.random.Generator) -> Ensemble:
    """Repeat an estimate on random halves of its samples.

    Parameters
    ----------
    found
        From `estimate`.
    members
        Number of repetitions.

    Raises
    ------
    ModelError
        If fewer than two members end near the estimate, or less than two are asked for.
    DataError
        If half of the samples are less than the unknowns.

    Examples
    --------
    >>> from smid.data import Dataset
    >>> from smid.hybrid import embedded, network_output
    >>> from smid.models import Reactor, signal, t
    >>> u = np.repeat(np.random.default_rng(1).uniform(0.1, 0.9, 20), 5)
    >>> plant = Reactor(2.0, sampling_time=1.0)
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": u}, sampling_time=1.0)
    >>> y = plant.simulate(data).outputs[0]["y"] + 0.01 * np.random.default_rng(2).standard_normal(100)
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    >>> whole = estimate(embedded(Reactor(3.0), {"w": 1}, [signal("w")[t]], ()), data, starts=1, seed=1)
    >>> repeated = ensemble(whole, members=4, seed=1)
    >>> repeated.deviation(lambda one: network_output(one.model, one.hybrid.term, [[0.3]])).shape
    (1,)
    """
    if members < 2:
        raise ModelError(f"members = {members}: give at least 2, 10 to 30 for a usable deviation")
    generator = np.random.default_rng(seed)
    error = float(np.mean(_residual(found, found) ** 2))
    near, strayed = [], 0
    for _ in range(members):
        halves = [mask & _half(mask.size, generator) for mask in found.used]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", StalledFitWarning)  # a member that stalls strays, or is as good
            one = estimate(found.hybrid, found.data, halves, starts=1, scale=found.scale, seed=generator)
        if float(np.mean(_residual(one, found) ** 2)) <= _STRAYED**2 * error:
            near.append(one)
        else:
            strayed += 1
    if len(near) < 2:
        raise ModelError(
            f"{strayed} of {members} repetitions ended in other minima: the record does not determine the network. "
            "Give fewer neurons, or a longer record"
        )
    return Ensemble(found, tuple(near), strayed)


def _half(n: int, generator: np.random.Generator) -> Any:
    """Return a mask of a random half of the blocks of an experiment; the first block, of the initial states, stays."""
    blocks = np.arange(n) * _BLOCKS // n
    kept = generator.permutation(np.arange(1, _BLOCKS))[: _BLOCKS // 2 - 1]
    return np.isin(blocks, [0, *kept.tolist()])


def _residual(one: HybridEstimate, found: HybridEstimate) -> Array:
    """Return the scaled residual of a member over all used samples."""
    fitting = Fitting(one.model, found.data, found.used, scale=found.scale)
    with np.errstate(all="ignore"):
        return np.nan_to_num(fitting.residual(fitting.at(one.model.values, one.fit.initial)), nan=np.inf)
