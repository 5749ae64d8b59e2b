"""The embedded arm: Newton's law with a network in place of friction and drag, estimated together with the inertia.

    d/dt angle = speed,    d/dt speed = (c u - 16 Nm N(speed / 80 rad/s)) / J

With this scaling the network's input and output stay within about +-1. The free-run error is minimised over 1/J and the
weights. With this topology the thesis found local minima.

Reference: hybrid thesis, (5.15), (6.8), figures F.1.a and F.1.b, listings K.15, K.16, K.18 and K.22.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.hybrid.cost_surface import CostSurface, cost_surface
from smid.hybrid.embedded import embedded
from smid.hybrid.free_run_error import FreeRunError
from smid.hybrid.hybrid_model import HybridModel
from smid.hybrid.neural import network_of
from smid.models import RotatingArm, signal, t
from smid.networks import TanhNetwork
from smid.signals import TABLE_F1
from smid.theses.hybrid.arm.exact_motion import ARM
from smid.theses.hybrid.arm.records import held_record
from smid.theses.hybrid.plants import arm_friction

__all__ = [
    "INERTIA_START",
    "SPEED_UNIT",
    "TORQUE_UNIT",
    "embedded_arm",
    "embedded_error",
    "figure_6_9",
    "friction_curve",
    "random_start",
    "true_friction",
]

SPEED_UNIT, TORQUE_UNIT = 80.0, 16.0  # rad/s, Nm
WEIGHT_BOX = (-1e4, 1e4)
INERTIA_START = 16.0  # 1/(kg m2), where every run of the thesis starts


def embedded_arm(hidden: tuple[int, ...] = (3,), *, scheme: str = "rk4", substeps: int = 1) -> HybridModel:
    """Return the arm with a network for its friction; free are ``theta``, the reciprocal inertia, and the weights.

    Parameters
    ----------
    hidden
        Neurons of each hidden layer; the thesis has three.
    scheme, substeps
        Of the integration; see `Model`.

    Examples
    --------
    >>> hybrid = embedded_arm((1,))
    >>> [p.name for p in hybrid.model.parameters if p.lower < p.upper]
    ['theta', 'N_w1_1_1', 'N_b1_1', 'N_w2_1_1', 'N_b2_1']
    """
    white = RotatingArm(theta=None, scheme=scheme, substeps=substeps)
    factor = -TORQUE_UNIT * white.parameter("theta").symbol
    hybrid = embedded(white, {"speed": factor}, [signal("speed")[t] / SPEED_UNIT], hidden)
    # The jump at rest is a neuron of very large weight.
    return replace(hybrid, model=hybrid.model.bound(**{p.name: WEIGHT_BOX for p in hybrid.term.parameters}))


def embedded_error(hybrid: HybridModel, data: Dataset) -> FreeRunError:
    """Return the free-run error of an embedded arm over records that begin at rest.

    Its variables are 1/J in 16 / (kg m2) and the weights.

    Parameters
    ----------
    data
        With the channels of `held_record`.

    Examples
    --------
    >>> from smid.theses.hybrid.arm.records import held_record
    >>> from smid.signals import TABLE_F1
    >>> hybrid = embedded_arm((1,))
    >>> problem = embedded_error(hybrid, held_record(TABLE_F1["one_sine"]))
    >>> bool(problem.error(random_start(hybrid, 0.01, seed=1)) > 0)
    True
    """
    units = np.ones(1 + len(hybrid.term.parameters))
    units[0] = INERTIA_START
    return FreeRunError(hybrid.model, data, units)


def random_start(hybrid: HybridModel, spread: float, seed: int | np.random.Generator) -> Array:
    """Return a random start for `embedded_error` as in the thesis, shape (p,).

    1/J is 16, every weight uniform from 0 to `spread`, in rad, s and Nm.

    Parameters
    ----------
    hybrid
        From `embedded_arm`, with one hidden layer.
    spread
        1 in listing K.22, 0.01 in listing K.18.

    Examples
    --------
    >>> float(random_start(embedded_arm((1,)), 0.01, seed=1)[0])
    1.0
    """
    neurons = hybrid.term.hidden[0]
    weights = spread * np.random.default_rng(seed).uniform(size=len(hybrid.term.parameters))
    weights[:neurons] *= SPEED_UNIT
    weights[2 * neurons :] /= TORQUE_UNIT
    return np.concatenate([[1.0], weights])


def friction_curve(hybrid: HybridModel, values: Mapping[str, float], speed: ArrayLike) -> Array:
    """Return the network's torque for friction and drag in Nm, shape (n,).

    Parameters
    ----------
    speed
        Shape (n,). In rad/s.

    Examples
    --------
    >>> hybrid = embedded_arm((1,))
    >>> weights = dict(zip([p.name for p in hybrid.term.parameters], [1.0, 0.0, 0.5, 0.0]))
    >>> friction_curve(hybrid, weights, [0.0, 8000.0])
    array([0., 8.])
    """
    network: TanhNetwork = network_of(hybrid.model.with_values(values), hybrid.term)
    return TORQUE_UNIT * network(np.asarray(speed, dtype=np.float64)[:, None] / SPEED_UNIT)


def true_friction(speed: ArrayLike, values: Mapping[str, float] = ARM) -> Array:
    """Return friction and drag of the plant in Nm, (5.7)-(5.8), figure 6.8, shape (n,).

    Parameters
    ----------
    speed
        Shape (n,). In rad/s.

    Examples
    --------
    >>> true_friction([0.01, 10.0]).round(4)
    array([0.4, 0.7])
    """
    v = np.asarray(speed, dtype=np.float64)
    law = [values[name] for name in ("Ws", "eps", "Wd", "b")]
    return np.array([arm_friction(item, *law) for item in v.ravel().tolist()]).reshape(v.shape)


def figure_6_9(points: int = 81) -> CostSurface:
    """Return the surface of the thesis's figure 6.9: one neuron without biases, the plant's inertia, one sine.

    Parameters
    ----------
    points
        Number of values of each weight: the neuron's, for speed in 80 rad/s, and the output's, for torque in 16 Nm.

    Examples
    --------
    >>> figure_6_9(11).rmse.shape
    (11, 11)
    """
    hybrid = embedded_arm((1,))
    neuron, bias, output, offset = (parameter.name for parameter in hybrid.term.parameters)
    problem = embedded_error(hybrid, held_record(TABLE_F1["one_sine"]))
    grid = {neuron: np.linspace(-8.0, 8.0, points), output: np.linspace(-4.0, 4.0, points)}
    return cost_surface(problem, {"theta": ARM["theta"], bias: 0.0, offset: 0.0}, grid)
