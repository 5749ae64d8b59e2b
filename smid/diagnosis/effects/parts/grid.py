"""Starts from a grid: for shapes that no slope leads to, as where a thing that sticks comes free.

The points of the grid are simulated with the base model's values, all at once; those about the best points from several
beginnings of the memory, which acts until the thing first comes free. They are ranked by what is left of the outputs
after the best sum of the simulated output, of what lags of several poles make of it, and a constant: so a gain or a
pole that the base model has wrong without the effect does not decide. About the best points the grid is made finer. The
base model is then fitted at each point that is returned. Where the best point promises no more than the best of as many
does by chance, it is returned as it is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np
from scipy.signal import lfilter

from relaxations.algebra.arrays import Array
from smid.diagnosis.effects.effect import Site
from smid.diagnosis.effects.parts.asked_for import Start
from smid.fitting.one_step_ahead import one_step_ahead
from smid.fitting.problem import Fitting
from smid.models import Model, Parameter
from smid.models.simulate import simulate

__all__ = ["best_of"]

_POLES = (0.6, 0.8, 0.9, 0.95, 0.98)
_BEAM, _ROUNDS = 12, 5
_EVALUATIONS = 30
_BEGINNINGS = (-0.8, -0.4, 0.0, 0.4, 0.8)
_APART = 0.2  # in the logarithm of a parameter: nearer points are one start
_TOGETHER = 64  # points that are simulated at once
_RIDGE = 1e-9  # of the lags' power: neighbouring poles give nearly the same


def best_of(
    model: Model, site: Site, axes: Mapping[str, Sequence[float]], memory: str, count: int
) -> tuple[Start, ...]:
    """Return different points at which the model is nearest to the output, each with values of its base; best first.

    A model without values is not fitted, and the points are spread over the grid.

    Parameters
    ----------
    axes
        Per parameter its levels, largest first, each the same share of the one before.
    memory
        A signal that begins anywhere up to the sum of the parameters, of either sign.
    """
    points = np.array(list(product(*axes.values())))
    free = {p.name for p in model.parameters if p.lower < p.upper}
    if not free <= set(model.values) | set(axes):
        return _named(axes, points[:: -(-len(points) // count)])
    leaves = partial(_left, model, site, tuple(axes), memory)
    left, (without,) = leaves((0.0,), points), leaves((0.0,), np.zeros((1, len(axes))))
    # The best of as many points may promise the logarithm of their number, in nats, by chance.
    n = sum(run.n_samples for run in site.data.experiments)
    if not left.min() < without * len(points) ** (-2 / n):
        return _named(axes, points[[np.argmin(left)]])
    finer = np.array([levels[0] / levels[1] for levels in axes.values()])
    most = np.array([model.parameter(name).upper for name in axes])
    moves = np.array([way for way in product((-1, 0, 1), repeat=len(axes)) if any(way)])
    for _ in range(_ROUNDS):
        finer = np.sqrt(finer)
        best = points[np.argsort(left, kind="stable")[:_BEAM]]
        near = np.unique(np.minimum(most, best[:, None] * finer**moves).reshape(-1, len(axes)), axis=0)
        points, left = np.concatenate([points, near]), np.concatenate([left, leaves(_BEGINNINGS, near)])
    chosen: list[Array] = []
    for point in points[np.argsort(left, kind="stable")]:
        if len(chosen) < count and all(np.abs(np.log(point / other)).max() > _APART for other in chosen):
            chosen.append(point)
    return tuple(_adapted(model, site, point) for point in _named(axes, np.array(chosen)))


def _named(axes: Mapping[str, Sequence[float]], points: Array) -> tuple[Start, ...]:
    return tuple(dict(zip(axes, point, strict=True)) for point in points.tolist())


def _adapted(model: Model, site: Site, point: Start) -> Start:
    """Return a point with the values of the base model that fit it, from its own and from a fit one step ahead."""
    used = [np.ones(run.n_samples, bool) for run in site.data.experiments]
    held = {p.name: Parameter(p.name, point[p.name], point[p.name]) for p in model.parameters if p.name in point}
    known = replace(model, parameters=tuple(held.get(p.name, p) for p in model.parameters))
    ahead = one_step_ahead(known, site.data, used, starts=1)
    problem = Fitting(model, site.data, used)
    begun = [{**model.values, **point}, *([{**ahead, **point}] if ahead else [])]
    solved = [problem.solve(problem.start(values), _EVALUATIONS, 1e-4, tuple(point)) for values in begun]
    vector, cost = min(solved, key=lambda pair: pair[1])
    return {**problem.result(vector, cost).model.values, **point} if np.isfinite(cost) else point


def _left(
    model: Model, site: Site, names: Sequence[str], memory: str, beginnings: Sequence[float], points: Array
) -> Array:
    """Return the sum of squares that each point leaves, outputs over their scales, shape (n_points,).

    Parameters
    ----------
    beginnings
        Of the memory, as shares of the sum of a point: of each experiment the best counts.
    """
    if len(points) > _TOGETHER:  # what a processor's cache holds
        parts = np.array_split(points, -(-len(points) // _TOGETHER))
        return np.concatenate([_left(model, site, names, memory, beginnings, part) for part in parts])
    values, begin = dict(zip(names, points.T, strict=True)), model.max_lag
    reach = np.repeat(points.sum(axis=1, keepdims=True), begin, axis=1)
    left = np.zeros(len(points))
    for run in site.data.experiments:
        found = np.zeros((len(beginnings), len(points)))
        for k, share in enumerate(beginnings):
            simulated = simulate(model, run.values, values, {memory: share * reach}, check=False)
            for channel in model.output_channels:
                y = run.values[channel][begin + 1 :] / site.scale(channel)
                found[k] += _left_of(y - y.mean(), simulated[channel][:, begin:] / site.scale(channel))
        left += found.min(axis=0)
    return left


def _left_of(y: Array, w: Array) -> Array:
    """Return what sums of each simulated output, of lags of it, and a constant leave of the measured one."""
    lagged = [lfilter([1 - pole], [1, -pole], w)[:, 1:] for pole in _POLES]
    basis = np.stack((w[:, 1:], w[:, :-1], *lagged), axis=1)
    basis -= basis.mean(axis=2, keepdims=True)
    gram, drop = basis @ basis.transpose(0, 2, 1), basis @ y
    power = np.trace(gram, axis1=1, axis2=2) + np.finfo(float).tiny  # zero where nothing moves
    gram += _RIDGE * power[:, None, None] * np.eye(len(gram[0]))
    good = np.isfinite(gram).all(axis=(1, 2))
    weights = np.linalg.solve(gram[good], drop[good][..., None])[..., 0]
    left = np.full(len(w), np.inf)
    left[good] = y @ y - np.sum(drop[good] * weights, axis=1)
    return left
