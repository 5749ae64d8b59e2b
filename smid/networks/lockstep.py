"""Levenberg and Marquardt's method from many starts in lockstep: one evaluation steps all of them.

    (G + mu D) d = -g,    G = J'J / n,    g = J'r / n,    D: the diagonal of G, the largest so far

A loop through time costs nearly the same for one run as for many, so the starts share it.  Each has its own damping mu,
after Nielsen as in `smid.networks.levenberg_marquardt`, and leaves when it is done.  D, Moré's, makes the method blind
to the numbers' units: the weights of a jump are hundreds of times larger than the others.

A number on its box's side which the gradient presses outwards stays there.  A step across a side ends on it, and is
judged by what the quadratic model promised for the step that was taken.

References: Moré, "The Levenberg-Marquardt algorithm: implementation and theory", LNM 630 (1978); Madsen, Nielsen,
Tingleff, "Methods for non-linear least squares problems", IMM, DTU (2004), algorithm 3.16; Kanzow, Yamashita,
Fukushima, "Levenberg-Marquardt methods with strong local convergence properties for solving nonlinear equations with
convex constraints", J. Comput. Appl. Math. 172 (2004).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from smid.networks.network import Array

__all__ = ["Points", "lockstep", "stacked_normal_equations"]

START, SMALLEST, LARGEST, FALL = 1e-3, 1e-14, 1e12, 1e-8
BLOCK = 2048  # residuals whose derivatives are held at once; more would leave the cache

Rows = NDArray[np.intp]


class Points(Protocol):
    """What the method asks of many points at once."""

    @property
    def errors(self) -> Array:
        """Mean of the squared residuals at each, shape (B,); infinite where there is none."""
        ...

    def normal_equations(self, rows: Rows) -> tuple[Array, Array]:
        """Return ``J'r / n``, shape (K, p), and ``J'J / n``, shape (K, p, p), of K of the points."""
        ...


def stacked_normal_equations(residuals: Array, jacobian: Callable[[Rows], Array], rows: Rows) -> tuple[Array, Array]:
    """Give the normal equations of some points, of a few at a time.

    Parameters
    ----------
    residuals
        Shape (B, n). Of all points.
    jacobian
        Takes K of the points; gives the derivatives of their residuals, shape (K, n, p).
    rows
        Shape (K,). Which points, one or more.

    Returns
    -------
    gradient : ndarray, shape (K, p)
        ``J'r / n``.
    gram : ndarray, shape (K, p, p)
        ``J'J / n``.

    Examples
    --------
    >>> slopes = np.array([[[1.0], [2.0]]])
    >>> stacked_normal_equations(np.array([[1.0, 3.0]]), lambda rows: slopes[rows], np.array([0]))[0]
    array([[3.5]])
    """
    n = residuals.shape[1]
    block = max(1, BLOCK // n)
    gradients, grams = [], []
    for k in range(0, rows.size, block):
        steep = jacobian(rows[k : k + block])
        turned = np.swapaxes(steep, 1, 2)
        gradients.append((turned @ residuals[rows[k : k + block], :, None])[:, :, 0] / n)
        grams.append(turned @ steep / n)
    return np.concatenate(gradients), np.concatenate(grams)


def lockstep(
    evaluate: Callable[[Array], Points], starts: Array, lower: Array, upper: Array, *, evaluations: int
) -> tuple[Array, Array]:
    """Descend from many starts.

    Parameters
    ----------
    evaluate
        Takes points, shape (B, p).
    starts
        Shape (B, p). Within the box.
    lower, upper
        Shape (p,). Sides of the box.
    evaluations
        At most so many for each start, its own included.

    Returns
    -------
    theta : ndarray, shape (B, p)
        Where each ended; a start without a finite error stays.
    errors : ndarray, shape (B,)
        There.

    Examples
    --------
    >>> class Valley:
    ...     def __init__(self, x):
    ...         self.x, self.errors = x, (x[:, 0] - x[:, 0] ** 3 - 0.3) ** 2
    ...     def normal_equations(self, rows):
    ...         x = self.x[rows, :1]
    ...         slope = 1 - 3 * x**2
    ...         return slope * (x - x**3 - 0.3), slope[:, :, None] ** 2
    >>> lockstep(Valley, np.array([[0.1], [0.7]]), np.zeros(1), np.ones(1), evaluations=50)[0].round(3).tolist()
    [[0.339], [0.786]]
    """
    theta, count = np.array(starts, dtype=np.float64), len(starts)
    points = evaluate(theta)
    errors = points.errors.copy()
    active = np.flatnonzero(np.isfinite(errors))
    gradient, gram = np.zeros(theta.shape), np.zeros((*theta.shape, theta.shape[1]))
    if active.size:
        gradient[active], gram[active] = points.normal_equations(active)
    sizes = np.diagonal(gram, axis1=1, axis2=2).copy()
    damping, factor = np.full(count, START), np.full(count, 2.0)
    for _ in range(evaluations - 1):
        if not active.size:
            break
        before, g, G = theta[active], gradient[active], gram[active]
        held = ((before <= lower) & (g > 0)) | ((before >= upper) & (g < 0))
        trial = np.clip(before + _step(g, G, sizes[active], damping[active], held), lower, upper)
        step = trial - before
        promised = -np.einsum("bi,bi->b", step, 2.0 * g + np.einsum("bij,bj->bi", G, step))
        points = evaluate(trial)
        fall = errors[active] - points.errors
        falls = fall > 0
        good, bad = active[falls], active[~falls]
        hoped = np.maximum(promised[falls], np.finfo(float).tiny)
        ratio = np.minimum(fall[falls], hoped) / hoped  # a greater fall than was promised is as good
        theta[good], errors[good] = trial[falls], points.errors[falls]
        if good.size:
            gradient[good], gram[good] = points.normal_equations(np.flatnonzero(falls))
        sizes[good] = np.maximum(sizes[good], np.diagonal(gram[good], axis1=1, axis2=2))
        kept = np.maximum(1.0 / 3.0, 1.0 - (2.0 * ratio - 1.0) ** 3)
        damping[good], factor[good] = np.maximum(damping[good] * kept, SMALLEST), 2.0
        damping[bad], factor[bad] = damping[bad] * factor[bad], 2.0 * factor[bad]
        small = FALL * (errors[active] + np.where(falls, fall, 0.0))
        done = falls & (fall <= small) & (promised <= small)
        active = active[~done & (damping[active] <= LARGEST)]
    return theta, errors


def _step(gradient: Array, gram: Array, sizes: Array, damping: Array, held: NDArray[np.bool_]) -> Array:
    """Solve for the damped steps, in units in which D is the identity; numbers that are held do not move."""
    units = np.where((sizes > 0) & ~held, 1.0 / np.sqrt(np.where(sizes > 0, sizes, 1.0)), 0.0)
    system = gram * units[:, :, None] * units[:, None, :] + damping[:, None, None] * np.eye(gram.shape[1])
    return np.asarray(-units * np.linalg.solve(system, (units * gradient)[:, :, None])[:, :, 0])
