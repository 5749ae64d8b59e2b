"""The base model of a simulation made elsewhere: a linear follower of the simulated channel, chosen and fitted.

The follower gives the response of the simulator to an effect at its input or in its state; see `smid.models.simulated`.
It is fitted to the simulated channel, never to the measurement. Of a few output-error models, the smallest whose error
is near the least is taken.
"""

from __future__ import annotations

from smid.data import DataError, Dataset
from smid.data.channel import name_hint
from smid.feasible.feasible_set import check_data, is_constant
from smid.fitting.binding import bind
from smid.fitting.fit import fit
from smid.models import Model, OutputError
from smid.models.simulated import Simulated

__all__ = ["simulator"]

_ORDERS = ((1, 0, 1), (1, 1, 0), (2, 1, 1), (2, 2, 0))  # poles, degree of the numerator, delay
_NEAR, _EXACT = 1.1, 1e-3  # times the least error, and of the standard deviation


def simulator(data: Dataset, simulated: str) -> Model:
    """Return the base model around the recorded output of a simulator.

    Parameters
    ----------
    simulated
        Channel with the simulated output, at the samples of the measurement.

    Raises
    ------
    DataError
        If the channel is missing, constant, an input or an output, or the record has several inputs or outputs.

    Examples
    --------
    >>> import numpy as np
    >>> u = np.random.default_rng(0).uniform(-1, 1, 100)
    >>> from smid.models.simulate import simulate
    >>> s = simulate(OutputError(), {"u": u}, {"a1": -0.8, "b0": 1.0})["y"]
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": 2 * s}, sampling_time=1.0, y_sim=s)
    >>> {name: round(value, 6) + 0.0 for name, value in simulator(data, "y_sim").values.items()}
    {'a1': -0.8, 'b0': 1.0, 'offset': 0.0}
    """
    _check(data, simulated)
    (input,), (output,) = data.inputs, data.outputs

    def candidate(order: tuple[int, int, int], output: str) -> Model:
        return OutputError(*order, input=input, output=output, offset=True)

    check_data(bind(candidate(_ORDERS[-1], simulated), data), data)
    fits = [fit(candidate(order, simulated), data) for order in _ORDERS]
    enough = max(_NEAR**2 * min(found.cost for found in fits), _EXACT**2 * data.n_samples)
    order, found = next(pair for pair in zip(_ORDERS, fits, strict=True) if pair[1].cost <= enough)
    return Simulated(candidate(order, output).with_values(found.model.values), simulated)


def _check(data: Dataset, simulated: str) -> None:
    """Refuse a record or a channel that no simulation can be judged by."""
    if simulated not in data.names:
        raise DataError(f"the simulated channel {simulated!r} is not in the data; {name_hint(simulated, data.names)}")
    if len(data.inputs) != 1 or len(data.outputs) != 1:
        raise DataError(
            f"the data have the inputs {', '.join(data.inputs)} and the outputs {', '.join(data.outputs)}: to diagnose "
            "a recorded simulation, name one input and the measured output, and give the rest as further channels"
        )
    if simulated in (*data.inputs, *data.outputs):
        raise DataError(
            f"the simulated channel {simulated!r} is the input or the measured output: name the channel that holds the "
            "output of the simulator"
        )
    if is_constant(data, simulated):
        value = data.experiments[0].values[simulated][0]
        raise DataError(
            f"the simulated channel {simulated!r} is {value:g} at every sample: record the output of the "
            "simulator under the recorded input"
        )
