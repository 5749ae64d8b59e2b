"""Levenberg-Marquardt from many starts at once, within bounds: one evaluation serves all starts.

    (G + mu D) d = -g,    G = J'J / n,    g = J'r / n,    rho = (E(theta) - E(theta + d)) / (-2 g'd - d'G d)

If the error falls, the step is accepted and ``mu <- mu max(1/3, 1 - (2 rho - 1)^3)``. Otherwise ``mu <- mu nu`` and
``nu <- 2 nu``, from nu = 2 (Nielsen). Each start has its own mu. A step without a finite error is rejected.

`lockstep` takes More's D, the diagonal of the largest G so far, so that the units of the parameters do not matter.
`smid.networks.levenberg_marquardt` takes the identity: the weights of a scaled network have similar sizes. A parameter
at a bound stays there while the gradient points outwards. A step across a bound is cut at the bound.

References: More, "The Levenberg-Marquardt algorithm: implementation and theory", LNM 630 (1978); Madsen, Nielsen,
Tingleff, "Methods for non-linear least squares problems", IMM, DTU (2004), algorithm 3.16; Kanzow, Yamashita,
Fukushima, "Levenberg-Marquardt methods with strong local convergence properties for solving nonlinear equations with
convex constraints", J. Comput. Appl. Math. 172 (2004).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import islice
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from relaxations.algebra.arrays import Array
from smid.networks.least_squares import held

__all__ = ["Points", "descents", "lockstep", "stacked_normal_equations"]

START, SMALLEST, LARGEST, FALL = 1e-3, 1e-14, 1e12, 1e-8
BLOCK = 2048  # residuals whose derivatives are held at once, so that they fit the processor's cache

Rows = NDArray[np.intp]


class Points(Protocol):
    """Many points of a least-squares problem."""

    @property
    def errors(self) -> Array:
        """Mean of the squared residuals at each point, shape (B,); infinite where there is none."""
        ...

    def normal_equations(self, rows: Rows) -> tuple[Array, Array]:
        """Return ``J'r / n``, shape (K, p), and ``J'J / n``, shape (K, p, p), of K of the points."""
        ...


def stacked_normal_equations(residuals: Array, jacobian: Callable[[Rows], Array], rows: Rows) -> tuple[Array, Array]:
    """Return ``J'r / n``, shape (K, p), and ``J'J / n``, shape (K, p, p), of K points.

    Parameters
    ----------
    residuals
        Shape (B, n). Of all points.
    jacobian
        Maps K point numbers to the derivatives of their residuals, shape (K, n, p).
    rows
        Shape (K,). Point numbers, at least one.

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
    """Return the end point of each start, shape (B, p), and its error, shape (B,).

    A start without a finite error stays where it is.

    Parameters
    ----------
    evaluate
        Evaluates points of shape (B, p).
    starts
        Shape (B, p). Within the bounds.
    lower, upper
        Shape (p,).
    evaluations
        Largest number for each start, the start itself included.

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
    *_, last = islice(descents(evaluate, starts, lower, upper), max(1, evaluations))
    return last[0], last[1]


def descents(
    evaluate: Callable[[Array], Points],
    starts: Array,
    lower: Array,
    upper: Array,
    *,
    scaled: bool = True,
    fall: float = FALL,
) -> Iterator[tuple[Array, Array, Rows]]:
    """Yield points, shape (B, p), errors, shape (B,), and the numbers of the starts that moved, after each evaluation.

    The first item holds the starts. The same arrays are yielded each time: copy what must not change.

    Parameters
    ----------
    scaled
        Whether D is More's diagonal; otherwise it is the identity.
    fall
        A start is done once the actual and the predicted fall are below this share of its error.
    """
    theta, count = np.array(starts, dtype=np.float64), len(starts)
    points = evaluate(theta)
    errors = points.errors.copy()
    active = np.flatnonzero(np.isfinite(errors))
    gradient, gram = np.zeros(theta.shape), np.zeros((*theta.shape, theta.shape[1]))
    if active.size:
        gradient[active], gram[active] = points.normal_equations(active)
    sizes = np.diagonal(gram, axis1=1, axis2=2).copy() if scaled else np.ones(theta.shape)
    damping, factor = np.full(count, START), np.full(count, 2.0)
    yield theta, errors, np.arange(count)
    while active.size:
        # One damped step for each active start, cut at the bounds.
        before, g, G = theta[active], gradient[active], gram[active]
        fixed = held(before, g, lower, upper)
        trial = np.clip(before + _step(g, G, sizes[active], damping[active], fixed), lower, upper)
        step = trial - before
        promised = -np.einsum("bi,bi->b", step, 2.0 * g + np.einsum("bij,bj->bi", G, step))
        points = evaluate(trial)
        fallen = errors[active] - points.errors
        falls = fallen > 0
        good, bad = active[falls], active[~falls]
        hoped = np.maximum(promised[falls], np.finfo(float).tiny)
        ratio = np.minimum(fallen[falls], hoped) / hoped  # a fall beyond the prediction counts as the prediction

        # Accept the steps that lower the error, and adapt the damping of all.
        theta[good], errors[good] = trial[falls], points.errors[falls]
        small = fall * errors[active]
        done = falls & (fallen <= small) & (promised <= small)
        kept = np.maximum(1.0 / 3.0, 1.0 - (2.0 * ratio - 1.0) ** 3)
        damping[good], factor[good] = np.maximum(damping[good] * kept, SMALLEST), 2.0
        damping[bad], factor[bad] = damping[bad] * factor[bad], 2.0 * factor[bad]
        if good.size:
            gradient[good], gram[good] = points.normal_equations(np.flatnonzero(falls))
            if scaled:
                sizes[good] = np.maximum(sizes[good], np.diagonal(gram[good], axis1=1, axis2=2))
        yield theta, errors, good
        active = active[~done & (damping[active] <= LARGEST)]


def _step(gradient: Array, gram: Array, sizes: Array, damping: Array, held: NDArray[np.bool_]) -> Array:
    """Return the damped steps, solved in units in which D is the identity; held parameters do not move."""
    units = np.where((sizes > 0) & ~held, 1.0 / np.sqrt(np.where(sizes > 0, sizes, 1.0)), 0.0)
    system = gram * units[:, :, None] * units[:, None, :] + damping[:, None, None] * np.eye(gram.shape[1])
    try:
        return np.asarray(-units * np.linalg.solve(system, (units * gradient)[:, :, None])[:, :, 0])
    except np.linalg.LinAlgError:  # rounding has removed the damping: reject the step, so that the damping grows
        return np.full(gradient.shape, np.nan)
