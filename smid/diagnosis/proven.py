"""Certified intervals for the parameters that a diagnosis added."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from relaxations.deadline import Progress
from smid.diagnosis.cause import Cause, CauseParameter
from smid.diagnosis.diagnosis import Diagnosis
from smid.identification.estimate import ParameterInterval
from smid.identification.identify import identify
from smid.models.simulated import check_equations


def prove_parameters(
    diagnosis: Diagnosis, noise_bound: float | Mapping[str, float], samples: int = 60, progress: Progress | None = None
) -> Diagnosis:
    """Replace the linearised intervals of the named effects' parameters by certified ones.

    They hold if the extended model is true and the noise keeps its bound. A part of the record gives wider intervals,
    which hold too. A model with a kink needs finite boxes for its other parameters: ``stable=True``, or own bounds.

    Parameters
    ----------
    noise_bound
        Of the output, in its unit, or by output.
    samples
        Samples used, from the start of each experiment.
    progress
        As for :func:`smid.identify`.

    Raises
    ------
    ModelError
        Where the extended model has no semialgebraic form, or extends a recorded simulation.
    DataError
        Where the samples are too few.
    EmptyFeasibleSetError
        Where it is proven that the extended model does not explain the samples either.

    Examples
    --------
    >>> import numpy as np
    >>> from smid.data import Dataset
    >>> from smid.diagnosis import diagnose
    >>> from smid.models import OutputError
    >>> from smid.models.simulate import simulate
    >>> u = np.random.default_rng(0).uniform(-1, 1, 300)
    >>> y = simulate(OutputError(), {"u": u}, {"a1": -0.8, "b0": 1.0})["y"] + 0.5
    >>> y = y + np.random.default_rng(1).uniform(-0.05, 0.05, 300)
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    >>> found = diagnose(OutputError(), data, 0.05, effects=["sensor_bias"], workers=1)
    >>> bias = prove_parameters(found, 0.05, 30).causes[0].parameters[0]
    >>> bias.proven, bias.lower < 0.5 < bias.upper
    (True, True)
    """
    check_equations(diagnosis.model, "the intervals of a diagnosed simulation cannot be certified")
    estimate = identify(diagnosis.model, diagnosis.data.crop(0, samples), noise_bound, progress=progress)
    proven = {interval.name: interval for interval in estimate.intervals}
    return replace(diagnosis, causes=tuple(_proven(cause, proven) for cause in diagnosis.causes))


def _proven(cause: Cause, proven: dict[str, ParameterInterval]) -> Cause:
    def replaced(p: CauseParameter) -> CauseParameter:
        interval = proven.get(p.name)
        return p if interval is None else replace(p, lower=interval.lower, upper=interval.upper, proven=True)

    return replace(cause, parameters=tuple(replaced(p) for p in cause.parameters))
