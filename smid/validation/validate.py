"""Validation (phase 3): score of a model's free run on other records."""

from __future__ import annotations

from collections.abc import Mapping
from math import isclose

from smid.data import Dataset
from smid.data.given import Given, as_dataset
from smid.data.units import in_units_of
from smid.feasible.feasible_set import check_noise_bound
from smid.fitting.binding import bind
from smid.identification.estimate import Estimate
from smid.models import Model, ModelError
from smid.validation.fit import ModelFit
from smid.validation.free_runs import free_runs
from smid.validation.scores import Validation, scored_samples, scores_of

Candidate = Model | Estimate | ModelFit


def bound_model(given: Candidate, data: Given) -> tuple[Model, Dataset]:
    """Return a model, or that of an estimate or a fit, bound to data, and the data.

    Data without a sampling time have that of the estimate or the fit.

    Raises
    ------
    TypeError
        If anything else is given.
    ModelError, DataError
        If an estimate or a fit has another sampling time than the data, or units that measure something else, or as
        `smid.bind`.
    """
    if not isinstance(given, Model | Estimate | ModelFit):
        raise TypeError(f"a {type(given).__name__} cannot be simulated: give a model with values, an estimate or a fit")
    if isinstance(given, Model):
        record = as_dataset(data, given)
        return bind(given, record), record
    record = as_dataset(data, given.model, given.data.sampling_time)
    kind = "fit" if isinstance(given, ModelFit) else "estimate"
    if not isclose(given.data.sampling_time, record.sampling_time):
        raise ModelError(
            f"the {kind} has a sampling time of {given.data.sampling_time:g} s, and the record one of "
            f"{record.sampling_time:g} s: resample the record"
        )
    record = in_units_of(record, given.data)
    return bind(given.model, record), record


def validate(model: Candidate, data: Given, noise_bound: float | Mapping[str, float] | None = None) -> Validation:
    """Return the scores of a model's free run on data (phase 3 of the clutch thesis, 3.2.3).

    The free run starts from the first measured outputs. Hidden states, which no channel shows, start where the run fits
    the first samples best. These samples, the warm-up (``n_init``) and missing samples are not scored.

    Parameters
    ----------
    model
        With parameter values. An estimate stands for its central model, and a fit for its model: the record is
        converted to the units of theirs.
    data
        As for :func:`smid.identify`.
    noise_bound
        Bound for counting violations.

    Raises
    ------
    TypeError, ModelError, DataError
        If the model is none, has no values, or does not fit the data; for a bound that is not positive.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> data = Dataset.from_arrays(input={"u": [1.0, 1, 1, 1]}, output={"y": [0.0, 1, 1.5, 1.8]}, sampling_time=1.0)
    >>> score = validate(OutputError(na=1).with_values({"a1": -0.5, "b0": 1.0}), data, 0.1).scores[0]
    >>> score.violations, round(score.largest, 2)
    (0, 0.05)
    """
    bound_to, data = bound_model(model, data)
    bounds = None if noise_bound is None else check_noise_bound(bound_to, noise_bound, None)
    simulated = free_runs(bound_to, data)
    scored = [
        {channel: scored_samples(bound_to, data, number, channel, run[channel]) for channel in bound_to.output_channels}
        for number, run in enumerate(simulated)
    ]
    return Validation(bound_to, data, scores_of(data, simulated, scored, bounds), simulated)
