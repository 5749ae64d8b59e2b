"""Verified points near the ends: from a local search without proof (:mod:`smid.identification.windows.scan`)."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import check_time
from smid.fitting.problem import Fitting
from smid.identification.inversion.record import Record
from smid.identification.windows.scan import Scan

_BACK = (0.0, 1e-9, 1e-6, 1e-4, 1e-2, 0.05, 0.2, 0.4, 0.6, 0.8)  # shares of the way inside that are tried


def outermost(record: Record, scan: Scan) -> Iterator[Array]:
    """Yield verified points: a run well within the noise bounds, and one near each end of each parameter."""
    inside = unknowns_of(record, scan.problem, scan.inside)
    if scan.least > 1.0 or not record.fits(inside):
        return
    yield inside
    for name in scan.free:
        for sign in (1, -1):
            check_time()
            end = unknowns_of(record, scan.problem, scan.extreme(name, sign).vector)
            yield from near(record, end, inside)


def near(record: Record, end: Array, inside: Array) -> Iterator[Array]:
    """Yield a verified point between an end and a point inside, close to the end; none where none was found."""
    tried = (end + share * (inside - end) for share in _BACK)
    yield from islice(filter(record.fits, tried), 1)


def unknowns_of(record: Record, problem: Fitting, vector: Array) -> Array:
    """Return the unknowns of a fitted run: its parameters, and its initial samples of the states."""
    fit = problem.result(vector, 0.0)
    unknowns = [fit.model.values.get(p.name, p.lower) for p in record.model.parameters]
    for inputs, initial, piece in zip(problem.inputs, fit.initial, record.cut.wholes, strict=True):
        signals, _ = problem.run.run(inputs, fit.model.values, initial, jacobian=False)
        unknowns += [float(signals[record.tape.signals[k]][now]) for k, now in np.argwhere(piece.initial >= 0).tolist()]
    return np.clip(unknowns, record.lower[: record.count], record.upper[: record.count])
