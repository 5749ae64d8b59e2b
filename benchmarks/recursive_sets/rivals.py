"""Other bounded recursive outer sets, for equation-error models: an ellipsoid and a zonotope, in plain NumPy.

Neither bounds its rounding, so that theirs are numbers where `smid.recursive.RecursiveSet` has theorems.  Both keep the
intersection of the boxes around their sets.
"""

from __future__ import annotations

import numpy as np

from relaxations.algebra.arrays import Array


class Ellipsoid:
    """The smallest ellipsoid around the last one cut by a strip: Fogel and Huang, Automatica 18 (1982).

    In the ball that the ellipsoid is an image of, the strip is ``low <= x <= high``.  The smallest ellipsoid around the
    slice touches both rims; where its centre lies is a quadratic equation.
    """

    def __init__(self, lower: Array, upper: Array) -> None:
        n = len(lower)
        self.centre, self.shape = (lower + upper) / 2, np.diag(n * ((upper - lower) / 2) ** 2)
        self.lower, self.upper = lower, upper

    def update(self, phi: Array, y: float, bound: float) -> None:
        """Take one equation ``|y - phi' theta| <= bound``."""
        n, toward = len(phi), self.shape @ phi
        scale = np.sqrt(phi @ toward)
        if scale == 0:
            return
        middle = phi @ self.centre
        low, high = max(-1.0, (y - bound - middle) / scale), min(1.0, (y + bound - middle) / scale)
        if low * high <= -1 / n or low >= high:
            return
        along, across, place = _slice(n, low, high)
        self.centre = self.centre + place * toward / scale
        self.shape = across * self.shape + (along - across) * np.outer(toward, toward) / scale**2
        reach = np.sqrt(np.diag(self.shape))
        self.lower = np.maximum(self.lower, self.centre - reach)
        self.upper = np.minimum(self.upper, self.centre + reach)


def _slice(n: int, low: float, high: float) -> tuple[float, float, float]:
    """Return the squared half-axes along and across, and the centre, of the ellipsoid around a slice of the ball."""
    total = low + high
    if abs(total) < 1e-12:
        return n * high**2, n * (1 - high**2) / (n - 1), 0.0
    # With 1/along = A and 1/across = A (1 - 2 x / total), A = 1/q(x), the volume is least where
    # n q' (total - 2 x) + 2 (n - 1) q = 0.
    q = np.array([1.0, -2 * low - 2 * (1 - low**2) / total, 1.0])
    condition = n * np.polymul([2.0, q[1]], [-2.0, total]) + 2 * (n - 1) * q
    places = np.roots(condition).real
    place = min(places, key=lambda x: -_volume(n, x, total, q))
    along = float(np.polyval(q, place))
    return along, along / (1 - 2 * place / total), float(place)


def _volume(n: int, place: float, total: float, q: Array) -> float:
    along, ratio = np.polyval(q, place), 1 - 2 * place / total
    return -np.inf if along <= 0 or ratio <= 0 else float(-n * np.log(along) + (n - 1) * np.log(ratio))


class Zonotope:
    """A zonotope of bounded order, cut by strips: Bravo, Alamo and Camacho, IEEE Trans. Automatic Control 51 (2006).

    The cut with the least sum of squared generators; where there are too many, the shortest go into a box.
    """

    def __init__(self, lower: Array, upper: Array, order: int = 10) -> None:
        self.centre, self.generators = (lower + upper) / 2, np.diag((upper - lower) / 2)
        self.lower, self.upper, self.order = lower, upper, order

    def update(self, phi: Array, y: float, bound: float) -> None:
        """Take one equation ``|y - phi' theta| <= bound``."""
        n, across = len(phi), self.generators.T @ phi
        gain = self.generators @ across / (across @ across + bound**2)
        self.centre = self.centre + gain * (y - phi @ self.centre)
        generators = np.column_stack([self.generators - np.outer(gain, across), bound * gain])
        if generators.shape[1] > self.order * n:
            kept = np.argsort(np.linalg.norm(generators, axis=0))[::-1]
            boxed = np.abs(generators[:, kept[(self.order - 1) * n :]]).sum(axis=1)
            generators = np.column_stack([generators[:, kept[: (self.order - 1) * n]], np.diag(boxed)])
        self.generators = generators
        reach = np.abs(generators).sum(axis=1)
        self.lower = np.maximum(self.lower, self.centre - reach)
        self.upper = np.minimum(self.upper, self.centre + reach)
