"""Starts in free-run error from a search in input error.

The free-run error of the embedded arm has many minima, and each evaluation is a simulation. The input error has its
best point nearly in the same place and costs a thousandth. It is linear in 1/J and the output weights, which are solved
for at every point (variable projection). The search is over the centres and slopes of the neurons,

    N(v) = sum_i w_i tanh(e^(s_i) (v - p_i)) + d,    p_i within the visited speeds,  s_i in a range,

a box of two numbers per neuron. Differential evolution searches it from a random population, without a start.
Levenberg-Marquardt refines its best points in input error. The best of them is then chosen, by input error or by
free-run error, and refined in free-run error. A small input error can still diverge in free run, where the network's
jump at rest has the wrong direction.

The alternative uses knowledge of the plant: "one neuron takes care of the discontinuity" (section F.1). One neuron
starts as a jump at rest, the others after Nguyen and Widrow, and several such starts are refined.

References: hybrid thesis, section 7.4; Storn, Price, "Differential evolution", J. Global Optimization 11 (1997);
Golub, Pereyra, SIAM J. Numerical Analysis 10 (1973).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import Bounds, differential_evolution

from relaxations.algebra.arrays import Array
from smid.data import DataError
from smid.models import ModelError
from smid.networks import lockstep, nguyen_widrow
from smid.theses.hybrid.arm.embedded_arm import INERTIA_START, SPEED_UNIT
from smid.theses.hybrid.arm.input_error import INERTIA_UNIT, InputError, Motion

__all__ = ["global_start", "jump_start", "multistart_start"]

STEEPNESS = (0.5, 1600.0)  # of a neuron, per 80 rad/s: from nearly straight to a jump
POPULATION = 5  # per number searched; scipy's own 15 leaves too few generations for so small a budget
RIDGE = 1e-10
JUMP, DESCENT = 3.0 * SPEED_UNIT, 100  # steepness per 80 rad/s, evaluations
REFINED = 20  # points of the population

Judge = Callable[[Array], Array]


def global_start(
    motion: Motion,
    hidden: int = 5,
    *,
    budget: int = 15_000,
    judge: Judge | None = None,
    seed: int | np.random.Generator,
) -> Array:
    """Return 1/J and the weights from a global search in input error, shape (3 hidden + 2,).

    They are scaled for `embedded_error` with as many neurons.

    Parameters
    ----------
    budget
        Number of evaluations of the input error.
    judge
        Errors of candidates, by which the best is chosen; by default the input error. The free-run error of the same
        record, `FreeRunError.errors`, also rejects those that diverge.

    Raises
    ------
    ModelError
        If there is no neuron, or the budget is less than two generations.
    DataError
        If the motion has fewer samples than variables, or is at rest.

    Examples
    --------
    >>> from smid.theses.hybrid.arm.input_error import modulate_motion
    >>> from smid.theses.hybrid.arm.records import held_record
    >>> from smid.signals import TABLE_F1
    >>> start = global_start(modulate_motion(held_record(TABLE_F1["one_sine"])), 3, budget=3000, seed=1)
    >>> bool(abs(INERTIA_START * start[0] - 21.74) < 0.2)
    True
    """
    population = POPULATION * 2 * hidden
    if hidden < 1 or budget < 2 * population:
        raise ModelError(f"hidden = {hidden}, budget = {budget}: give a neuron or more, and at least {2 * population}")
    if motion.speed.size < 3 * hidden + 2:
        raise DataError(f"{3 * hidden + 2} numbers but {motion.speed.size} samples: give more, or fewer neurons")
    speed = motion.speed / SPEED_UNIT
    if not np.ptp(speed) > 0:
        raise DataError("the arm is at rest in every sample: give a voltage that moves it")
    # Search centres and slopes of the neurons.
    problem = InputError(motion, (hidden,))
    low, high = np.log(STEEPNESS)
    box = Bounds(
        np.repeat([float(speed.min()), low], hidden),
        np.repeat([float(speed.max()), high], hidden),
    )

    def cost(points: Any, /) -> Any:
        return _project(problem, points.T)[0]

    found = differential_evolution(
        cost,
        box,
        popsize=POPULATION,
        maxiter=budget // population - 1,
        tol=0.0,
        polish=False,
        vectorized=True,
        updating="deferred",
        rng=seed,
    )
    # Refine all variables of the best points together.
    points = found.population[np.argsort(found.population_energies)[:REFINED]]
    _, linear = _project(problem, points)
    steepness = np.exp(points[:, hidden:])
    inertia, output, bias = linear[:, :1], linear[:, 1:-1], linear[:, -1:]
    starts = np.hstack([inertia, steepness, -steepness * points[:, :hidden], output, bias])
    return _best(problem, starts, judge)


def multistart_start(
    motion: Motion,
    hidden: int = 5,
    *,
    starts: int = 20,
    judge: Judge | None = None,
    seed: int | np.random.Generator,
) -> Array:
    """Return a start as `global_start`, from descents whose first neuron is a jump at rest.

    Raises
    ------
    ModelError
        If there is no neuron or no start.
    DataError
        If the motion has fewer samples than variables.

    Examples
    --------
    >>> from smid.theses.hybrid.arm.input_error import modulate_motion
    >>> from smid.theses.hybrid.arm.records import held_record
    >>> from smid.signals import TABLE_F1
    >>> start = multistart_start(modulate_motion(held_record(TABLE_F1["one_sine"])), 3, starts=2, seed=1)
    >>> bool(abs(INERTIA_START * start[0] - 21.74) < 0.2)
    True
    """
    if hidden < 1 or starts < 1:
        raise ModelError(f"hidden = {hidden}, starts = {starts}: give a neuron or more, and a start or more")
    problem, generator = InputError(motion, (hidden,)), np.random.default_rng(seed)
    points = np.array([np.append(1.0, jump_start(hidden, generator)) for _ in range(starts)])
    if points.shape[1] > motion.speed.size:
        raise DataError(f"{points.shape[1]} numbers but {motion.speed.size} samples: give more, or fewer neurons")
    return _best(problem, points, judge)


def jump_start(hidden: int, generator: np.random.Generator) -> Array:
    """Return random weights of a network of one input in which one neuron is a jump at rest, shape (3 hidden + 1,)."""
    weights = nguyen_widrow((1, hidden), generator).weights.copy()
    weights[0], weights[hidden] = JUMP, 0.0
    return weights


def _best(problem: InputError, starts: Array, judge: Judge | None) -> Array:
    """Descend in input error from starts, shape (B, p); return the best of the results with 1/J in place of J."""
    free = np.full(starts.shape[1], np.inf)
    found, errors = lockstep(problem.points, starts, -free, free, evaluations=DESCENT)
    found[:, 0] = 1.0 / (found[:, 0] * INERTIA_UNIT * INERTIA_START)
    return np.asarray(found[np.argmin(errors if judge is None else judge(found))])


def _project(problem: InputError, points: Array) -> tuple[Array, Array]:
    """Return the least input error at points of centres and slopes, shape (B, 2 hidden), and the linear variables."""
    places, steepness = np.split(points, 2, axis=1)
    hidden = np.tanh(np.exp(steepness)[:, None, :] * (problem.speed[None, :, :] - places[:, None, :]))
    ones = np.ones((*hidden.shape[:2], 1))
    columns = np.concatenate([np.broadcast_to(problem.pull[:, None], ones.shape), hidden, ones], axis=2)
    gram = np.swapaxes(columns, 1, 2) @ columns / len(problem.pull)
    right = np.swapaxes(columns, 1, 2) @ problem.torque / len(problem.pull)
    # Two equal neurons make the equations singular; the ridge keeps them solvable.
    linear = np.linalg.solve(gram + RIDGE * np.eye(gram.shape[1]), right[:, :, None])[:, :, 0]
    residual = (columns @ linear[:, :, None])[:, :, 0] - problem.torque
    return np.mean(residual**2, axis=1), linear
