"""Where the estimation of a hybrid model starts: scaled networks with random hidden weights and zero output.

With an output of zero the model is the first-principles model alone. Inputs are scaled to [-1, 1], the output so that a
weight of one changes the channels by about one standard deviation.

Reference: Nguyen and Widrow, IJCNN 1990.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from smid.data import Dataset
from smid.fitting.one_step_ahead import prediction
from smid.fitting.problem import Fitting
from smid.hybrid.hybrid_model import HybridModel
from smid.hybrid.neurons import NEURONS, RECURRENT
from smid.hybrid.problem import output_slopes
from smid.hybrid.trained_range import network_inputs
from smid.models import Model, ModelError
from smid.networks import nguyen_widrow

__all__ = ["ahead_of", "first_principles", "has_sensor_curve", "hidden_weights", "scaled"]

_DIGITS = 3  # of the numbers that scale a network


def has_sensor_curve(model: Model) -> bool:
    """Return whether an output has a sensor curve, so that its samples are no samples of a signal."""
    return any(item.inverse is not None for item in model.outputs)


def ahead_of(
    model: Model, data: Dataset, used: Sequence[NDArray[np.bool_]], *, scale: Mapping[str, float] | None = None
) -> Fitting:
    """Return the fit of the one-step-ahead predictions over the samples that can be predicted."""
    if has_sensor_curve(model):
        raise ModelError(f"an output of {model.name!r} has a sensor curve: put the curve into the model's lines")
    # The first samples cannot be predicted: the samples before them are unknown.
    return prediction(model, data, [mask & (np.arange(mask.size) >= model.max_lag) for mask in used], scale)


def first_principles(hybrid: HybridModel) -> dict[str, float]:
    """Return the start: first-principles values, or the middle of each box, and zero weights."""
    values = {parameter.name: 0.0 for placed in hybrid.networks for parameter in placed.term.parameters}
    for parameter in hybrid.model.parameters:
        if parameter.name not in values and parameter.lower < parameter.upper:
            middle = (parameter.lower + parameter.upper) / 2
            values[parameter.name] = hybrid.model.values.get(parameter.name, middle if np.isfinite(middle) else 0.0)
    return values


def scaled(
    hybrid: HybridModel, data: Dataset, used: Sequence[NDArray[np.bool_]], alone: Mapping[str, float]
) -> HybridModel:
    """Return the model with its networks scaled to the inputs, measured where they are, and to the outputs."""
    kind = Fitting if has_sensor_curve(hybrid.model) else ahead_of
    inputs = network_inputs(hybrid, lambda model: kind(model, data, used), alone)
    samples = np.concatenate([columns[mask] for columns, mask in zip(inputs, used, strict=True)])
    if not np.isfinite(samples).all():
        raise ModelError(
            f"the simulation of {hybrid.white.name!r} alone diverges on these data: start from other parameter values"
        )
    low, high = samples.min(axis=0), samples.max(axis=0)
    # A constant input has no range; its weight acts as a bias.
    centre, half_range = (high + low) / 2.0, np.where(high > low, (high - low) / 2.0, 1.0)
    # An output's unit changes the channels by one standard deviation, in a free run if the model alone has one.
    biases = [placed.term.output_weights[-1].name for placed in hybrid.networks]
    slopes = dict.fromkeys(biases, 1.0)
    for fitting in (Fitting(hybrid.model, data, used), kind(hybrid.model, data, used)):
        found = output_slopes(fitting, fitting.start(alone))
        if found is not None:
            slopes = dict(zip(fitting.run.parameters, found.tolist(), strict=False))
            break
    terms, first = [], 0
    for placed, bias in zip(hybrid.networks, biases, strict=True):
        part = slice(first, first := first + len(placed.term.inputs))
        unit = placed.term.unit / slopes[bias] if slopes.get(bias, 0.0) > 0 else placed.term.unit
        terms.append(
            replace(
                placed.term,
                centre=tuple(map(_rounded, centre[part].tolist(), half_range[part].tolist())),
                half_range=tuple(map(_rounded, half_range[part].tolist())),
                unit=_rounded(unit),
            )
        )
    return hybrid.with_terms(*terms)


def _rounded(value: float, size: float = 0.0) -> float:
    """Return a number of few digits of a size, by default its own.

    The scaling need not be exact, and stands in the model's equations.
    """
    return round(value, _DIGITS - 1 - int(np.floor(np.log10(size or value))))


def hidden_weights(hybrid: HybridModel, generator: np.random.Generator) -> dict[str, float]:
    """Return random hidden weights of all networks, for scaled inputs; the last layers are zero."""
    found: dict[str, float] = {}
    for placed in hybrid.networks:
        term = placed.term
        if placed.topology == RECURRENT:
            weights = nguyen_widrow((len(term.inputs), 1), generator).weights[: len(term.parameters)]
            found |= dict(zip((parameter.name for parameter in term.parameters), weights.tolist(), strict=True))
        if not term.hidden:
            continue
        weights = NEURONS[term.neuron].start(term.sizes, generator)
        weights[-term.sizes[-1] - 1 :] = 0.0
        for parameter, weight in zip(term.parameters, weights.tolist(), strict=True):
            box = hybrid.model.parameter(parameter.name)
            found[parameter.name] = float(np.clip(weight, box.lower, box.upper))
    return found
