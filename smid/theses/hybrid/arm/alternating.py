"""Alternating estimation: the network at a fixed inertia, then the inertia at a fixed network, and so on.

    a few Levenberg-Marquardt steps of    sum_t (N(v) - (c u - a / theta))^2    over the weights
    theta  <-  sum_t a f / sum_t f^2,     f = c u - N(v)                        which is exact

Each half is easy: a static network, and one division.  Together they descend slowly, as coordinate descent does where
inertia and friction can stand in for each other, but they hardly get stuck.

The thesis's listing reads speed and acceleration off the simulated plant; here they come with the `Motion`, from
wherever it was measured.

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
    """What the alternation came to.

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
        """The last 1/J, in 1/(kg m2)."""
        return float(self.theta[-1])

    def _content(self) -> Iterator[Part]:
        told = f"1/J = {self.reciprocal_inertia:.5g} 1/(kg m2) after {self.theta.size - 1} rounds"
        yield f"{told}, error of the torque {self.rmse:.3g} Nm RMS."


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
    motion
        Speed, acceleration and motor torque.
    start
        Of scaled speed; where the network begins.
    theta
        Where 1/J begins, in 1/(kg m2).
    rounds
        At most so many; it ends sooner when 1/J has moved by less than 1e-7 of itself in ten rounds.
    method
        Of `smid.networks`, for the network: `gradient_descent` is the back propagation of the textbooks.

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
