"""Pruning: as few neurons as the data ask for.

Neurons are taken away one at a time, and the network is estimated again, while Schwarz's criterion falls:

    n log(mean squared error) + p log(n)

n counts residuals and p free numbers. The last step leads to the affine network. A neuron that is taken away frees the
others to move, which the saliency of a single weight does not see; so all starts are random again.

References: hybrid thesis, section 3.4; Schwarz, "Estimating the dimension of a model", Annals of Statistics 6 (1978);
Hassibi, Stork, "Second order derivatives for network pruning: optimal brain surgeon", NIPS 1992 (the saliency).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from smid.hybrid.estimate import estimate
from smid.hybrid.hybrid_estimate import HybridEstimate
from smid.hybrid.hybrid_model import HybridModel

__all__ = ["prune"]


def prune(found: HybridEstimate, *, starts: int = 3, seed: int | np.random.Generator) -> HybridEstimate:
    """Return an estimate with fewer neurons, or the same if none can be spared.

    Parameters
    ----------
    found
        From `estimate`.
    starts
        Random starts of each estimate.

    Examples
    --------
    >>> from smid.data import Dataset
    >>> from smid.hybrid import embedded
    >>> from smid.models import Reactor, signal, t
    >>> u = np.repeat(np.random.default_rng(1).uniform(0.1, 0.9, 20), 5)
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": u}, sampling_time=1.0)
    >>> y = Reactor(2.0, sampling_time=1.0).simulate(data).outputs[0]["y"]
    >>> y = y + 0.003 * np.random.default_rng(2).standard_normal(100)
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    >>> large = estimate(embedded(Reactor(3.0), {"w": 1}, [signal("w")[t]], (2,)), data, starts=1, seed=1)
    >>> prune(large, starts=1, seed=1).hybrid.term.hidden
    ()
    """
    generator = np.random.default_rng(seed)
    best = found
    smaller = list(_smaller(best.hybrid))
    while smaller:
        tried = [
            estimate(hybrid, found.data, found.used, starts=starts, scale=found.scale, seed=generator)
            for hybrid in smaller
        ]
        least = min(tried, key=_criterion)
        if _criterion(least) >= _criterion(best):
            break
        best = least
        smaller = list(_smaller(best.hybrid))
    return best


def _smaller(hybrid: HybridModel) -> list[HybridModel]:
    """Return the models with one neuron less in the last hidden layer of one network."""
    terms, found = [placed.term for placed in hybrid.networks], []
    for k, term in enumerate(terms):
        if len(term.hidden) == 1 or (term.hidden and term.hidden[-1] > 1):
            *layers, last = term.hidden
            less = replace(term, hidden=(*layers, last - 1) if last > 1 else ())
            found.append(hybrid.with_terms(*terms[:k], less, *terms[k + 1 :]))
    return found


def _criterion(found: HybridEstimate) -> float:
    n = sum(int(mask.sum()) for mask in found.used) * len(found.model.output_channels)
    return float(n * np.log(found.fit.cost / n) + found.fit.n_free * np.log(n))
