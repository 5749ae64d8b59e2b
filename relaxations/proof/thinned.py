"""Multipliers with fewer and shorter numbers that prove nearly the same bound.

An interior-point solver leaves every multiplier a little above zero, also on rows that do not matter. What is left out
of ``sum_k lambda_k h_k m_k + sum_j <F_j F_j', g_j b_j b_j'>``, a polynomial w, is added to the residual r of
:mod:`relaxations.proof.certificate`. So the bound ``r_0 - sum_{i > 0} |r_i|`` loses at most
``sum_{i > 0} |w_i| - w_0``.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.algebra.polynomial import Polynomials
from relaxations.moments.conic import Multipliers
from relaxations.moments.moment import Blocks, Relaxation
from relaxations.proof.certificate import Certificate, certify

LONG = 200  # blocks: fewer are a short file anyway


def thinned(relaxation: Relaxation, objective: Polynomials, found: Certificate, loss: float) -> Certificate:
    """Return a certificate whose bound is lower by at most ``loss``, with zeros where multipliers count least.

    What is left has the 24 binary digits of short floats, where these lose no more. A relaxation with few blocks keeps
    its certificate.

    Parameters
    ----------
    objective
        As for :func:`relaxations.proof.certificate.certify`.
    """
    if sum(blocks.count for blocks in relaxation.blocks) < LONG or not np.isfinite(found.bound):
        return found
    equalities, factors = found.multipliers.equalities, found.multipliers.factors
    # What the bound loses without each equality's multiplier, and without each column of each factor.
    rows = np.abs(equalities) * np.bincount(
        relaxation.equality_row, relaxation.equality_coefficient.magnitude(), len(equalities)
    )
    columns = [_losses(blocks, own) for blocks, own in zip(relaxation.blocks, factors, strict=True)]
    # Leave out those that lose least.
    losses = np.concatenate([rows, *(own.ravel() for own in columns)])
    order = np.argsort(losses, kind="stable")
    kept = np.ones(len(losses), dtype=bool)
    kept[order[np.cumsum(np.maximum(losses[order], 0.0)) <= 0.5 * loss]] = False
    ends = np.cumsum([len(rows), *(own.size for own in columns)])
    masks = [kept[a:b].reshape(own.shape) for (a, b), own in zip(pairwise(ends), columns, strict=True)]
    left = Multipliers(
        np.where(kept[: len(rows)], equalities, 0.0),
        tuple(np.where(mask[:, None, :], own, 0.0) for mask, own in zip(masks, factors, strict=True)),
    )
    for candidate in (_short(left), left):
        proof = certify(relaxation, objective, candidate)
        if proof.bound >= found.bound - loss:
            return proof
    return found


def _losses(blocks: Blocks, factors: Array) -> Array:
    """Return what the bound loses without each column of each factor, shape (count, rank)."""
    twice = np.where(blocks.i == blocks.j, 1.0, 2.0)[:, None]
    parts = twice * factors[blocks.block, blocks.i] * factors[blocks.block, blocks.j] * blocks.coefficient.mid[:, None]
    lost = np.where((blocks.moment == 0)[:, None], -parts, np.abs(parts))
    found = np.zeros((blocks.count, factors.shape[2]))
    np.add.at(found, blocks.block, lost)
    return found


def _short(full: Multipliers) -> Multipliers:
    """Return multipliers rounded to short floats."""

    def rounded(values: Array) -> Array:
        with np.errstate(over="ignore", under="ignore"):
            return values.astype(np.float32).astype(np.float64)

    return Multipliers(rounded(full.equalities), tuple(rounded(own) for own in full.factors))
