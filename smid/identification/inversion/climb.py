"""Points further out: from the outermost verified point, along linear programs; each point reached is verified.

The rows over a box around the point are its linearisation, since the slopes of a narrow form are derivatives. The box
grows where the step of the program is verified whole, and shrinks where only a part of it is.

Reference: Fletcher and Sainz de la Maza, Nonlinear programming and nonsmooth optimization by successive linear
programming, Mathematical Programming 43 (1989) 235-256.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from relaxations.algebra.arrays import Array
from smid.identification.inversion.contraction import Program
from smid.identification.inversion.record import Record

_STEPS = 12
_HALVINGS = 6
_FIRST, _LARGEST = 0.25, 1.0  # of the box: reach of a step
_WORTH = 0.1  # a step is worth this share of the tolerance
_MARGIN = 1e-9  # of the noise bound: kept by the steps, so that they can be verified


def climbed(
    record: Record, points: Sequence[Array], k: int, sign: int, box: tuple[Array, Array], tolerance: float
) -> list[Array]:
    """Return a verified point with a smaller ``sign`` times unknown k than all given ones, where one is found.

    Parameters
    ----------
    box
        Its widths are the scale of the steps.
    tolerance
        Share of the box's width.
    """
    point = start = min(points, key=lambda point: sign * point[k])
    width = np.nan_to_num(box[1] - box[0], posinf=0.0)
    reach = _FIRST
    for _ in range(_STEPS):
        near = reach * np.maximum(width, 1e-12 * np.abs(point))
        lower, upper = np.maximum(point - near, record.lower), np.minimum(point + near, record.upper)
        target = _target(record, point, lower, upper, k, sign)
        share, tried = 1.0, target
        while target is not None and share > 0.5**_HALVINGS:
            tried = point + share * (target - point)
            if sign * (tried[k] - point[k]) < 0 and record.fits(tried):
                break
            share *= 0.5
        else:
            reach *= 0.25
            continue
        gained, point = abs(tried[k] - point[k]), tried
        reach = min(_LARGEST, 2 * reach) if share == 1.0 else max(share, 0.25) * reach
        if gained <= _WORTH * tolerance * width[k]:
            break
    return [] if point is start else [point]


def _target(record: Record, point: Array, lower: Array, upper: Array, k: int, sign: int) -> Array | None:
    """Return where the linear program of a box around a point ends; None without a solution."""
    rows = record.linearised(point, lower, upper)
    if not len(rows.centre):
        return None
    found = Program(replace(rows, radius=rows.radius * (1 - _MARGIN))).end(k, sign)
    return None if found is None else 0.5 * lower + 0.5 * upper + 0.5 * (upper - lower) * found[2]
