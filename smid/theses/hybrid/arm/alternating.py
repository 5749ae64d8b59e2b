"""Alternating estimation: the network at a fixed inertia, then the inertia at a fixed network, repeated.

    a few Levenberg-Marquardt steps of    sum_t (N(v) - (c u - a / theta))^2    over the weights
    theta  <-  sum_t a f / sum_t f^2,     f = c u - N(v)                        (exact)

Each half is easy: a static network, and one division. The descent is slow where inertia and friction can replace each
other, but it rarely stops in a local minimum.

The thesis's listing takes speed and acceleration from the simulated plant. Here they are part of the `Motion`.

Reference: hybrid thesis, sections 6.3.4 and F.3, listing K.22.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np

from relaxations.algebra.arrays import Array
from smid.display.result import Part, Result
from smid.models import ModelError
from smid.networks import Iterate, Method, NetworkError, TanhNetwork, levenberg_marquardt
from smid.theses.hybrid.arm.embedded_arm import INERTIA_START, SPEED_UNIT, TORQUE_UNIT
from smid.theses.hybrid.arm.input_error import Motion

__all__ = ["Alternation", "alternate"]

STEPS, SETTLED = 2, 1e-7


@dataclass(frozen=True, eq=False, repr=False)
class Alternation(Result):
    """The result of the alternation.

    Parameters
    ----------
    theta
        Shape (n_rounds + 1,). 1/J in 1/(kg m2), at the start and after each round.
    network
        From speed in 80 rad/s to torque in 16 Nm.
    rmse
        Of the torque, in Nm.
    """

    theta: Array
    network: TanhNetwork
    rmse: float

    @property
    def reciprocal_inertia(self) -> float:
        """Return the last 1/J, in 1/(kg m2)."""
        return float(self.theta[-1])

    def _content(self) -> Iterator[Part]:
        found = f"1/J = {self.reciprocal_inertia:.5g} 1/(kg m2) after {self.theta.size - 1} rounds"
        yield f"{found}, error of the torque {self.rmse:.3g} Nm RMS."


def alternate(
    motion: Motion,
    start: TanhNetwork,
    *,
    theta: float = INERTIA_START,
    rounds: int = 1000,
    method: Method = levenberg_marquardt,
) -> Alternation:
    """Estimate 1/J and the network by turns.

    Parameters
    ----------
    start
        First network, of scaled speed.
    theta
        First 1/J, in 1/(kg m2).
    rounds
        Largest number; fewer if 1/J changes by less than 1e-7 of itself in ten rounds.
    method
        Of `smid.networks`, for the network; `gradient_descent` is back propagation.

    Raises
    ------
    ModelError
        If theta or the number of rounds is not positive.

    Examples
    --------
    >>> v = np.linspace(-80.0, 80.0, 81)
    >>> a = 100.0 * np.cos(v)
    >>> motion = Motion(v, a, a / 20.0 + 4.0 * np.tanh(v / 80.0))
    >>> found = alternate(motion, TanhNetwork((1, 1), np.array([0.5, 0.0, 0.5, 0.0])))
    >>> round(found.reciprocal_inertia, 3)
    20.0
    """
    if not theta > 0 or rounds < 1:
        raise ModelError(f"theta = {theta}, rounds = {rounds}: give positive numbers")
    inputs, weights, path = motion.speed[:, None] / SPEED_UNIT, start.weights, [float(theta)]
    for _ in range(rounds):
        # The network at this inertia, then the inertia at this network.
        target = (motion.torque - motion.acceleration / path[-1]) / TORQUE_UNIT
        points: Iterator[Iterate] = method(NetworkError(start.sizes, inputs, target), weights)
        *_, last = islice(points, STEPS + 1)
        weights = last.theta
        pull = motion.torque - TORQUE_UNIT * TanhNetwork(start.sizes, weights)(inputs)
        path.append(float(motion.acceleration @ pull / (pull @ pull)))
        if len(path) > 10 and abs(path[-1] - path[-11]) < SETTLED * abs(path[-1]):
            break
    network = TanhNetwork(start.sizes, weights)
    residual = motion.acceleration / path[-1] + TORQUE_UNIT * network(inputs) - motion.torque
    return Alternation(np.array(path), network, float(np.sqrt(np.mean(residual**2))))
