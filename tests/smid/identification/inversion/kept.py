"""Whether a point keeps the rows of a box."""

import numpy as np
from scipy.optimize import linprog


def is_kept(rows, point, lower, upper, slack=1e-12):
    """Return whether a point keeps all rows, for one value of the symbols that they share."""
    middle, half = 0.5 * lower + 0.5 * upper, np.maximum(0.5 * (upper - lower), 1e-300)
    slopes = rows.slopes.toarray()
    left = rows.centre + slopes[:, : len(point)] @ ((point - middle) / half)
    reach, shared = rows.radius + slack * (1 + np.abs(slopes).sum(axis=1)), slopes[:, len(point) :]
    if not shared.shape[1]:
        return np.all(np.abs(left) <= reach)
    sides = np.concatenate([reach - left, reach + left])
    found = linprog(np.zeros(shared.shape[1]), np.vstack([shared, -shared]), sides, bounds=(-1, 1))
    return found.status == 0
