r"""A model around a simulation made elsewhere, whose output is a channel of the record.

A model :math:`w_t = f(w_{t-1}, \ldots, u_{t-1}, \ldots)` follows the simulator. The simulated output s then has the
remainder :math:`r_t = s_t - f(s_{t-1}, \ldots, u_{t-1}, \ldots)`, which the record gives. So

.. math:: w_t = f(w_{t-1}, \ldots, u_{t-1}, \ldots) + r_t, \qquad y_t = w_t + \eta_t

is the simulator: w is s if both start alike. An edit of the line of w, or of what it reads, changes the plant, and
leaves the remainder as recorded. An effect at an input, in a state or at the sensor needs no case of its own. For a
simulator that f follows exactly such an edit is exact, else it is as good as f is near the trajectory of s.
"""

from __future__ import annotations

from dataclasses import replace

from smid.models.errors import ModelError
from smid.models.model import Line, Measurement, Model, signal, t
from smid.models.symbols import number, rename_signals, swapped, unused

__all__ = ["SIMULATION", "Simulated", "check_equations", "standalone"]

SIMULATION = "simulation"
"""The origin of the simulated output and of the remainder: they are no part of the plant."""

_FOLLOWER = "follower"  # the origin of the inputs as the simulator had them, and of constants that no plant has


def Simulated(follower: Model, simulated: str) -> Model:
    """Return the model of a simulator whose output is recorded.

    Parameters
    ----------
    follower
        A model of one line that follows the simulator, from its exact inputs to the *measured* output, with a value for
        each parameter. The values become fixed.
    simulated
        Channel with the simulated output.

    Raises
    ------
    ModelError
        If the follower has several lines, or a parameter without a value.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> print(Simulated(OutputError().with_values({"a1": -0.5, "b0": 2.0}), "y_sim"))
    simulated y
      remainder[t] = -simulation[t - 1]/2 + simulation[t] - 2*u_simulated[t - 1]
      w[t] = -a1*w[t - 1] + b0*u_acting[t - 1] + remainder[t]
      y[t] = w[t] + eta[t]
      u[t] = u_acting[t]
      u[t] = u_simulated[t]
      y_sim[t] = simulation[t]
      a1 in [-0.5, -0.5], = -0.5
      b0 in [2, 2], = 2
    """
    if len(follower.lines) != 1 or follower.values.keys() != {p.name for p in follower.parameters}:
        raise ModelError("a follower needs one line, and a value for each parameter: fit it first")
    (line,) = follower.lines
    taken = {*follower.taken, simulated}

    def free(wanted: str) -> str:
        name = unused(wanted, taken)
        taken.add(name)
        return name

    output, remainder = free(SIMULATION), free("remainder")
    channels = dict(zip(follower.inputs, follower.input_channels, strict=True))
    # Each input is read twice: as it acts on the plant, which effects edit, and as the simulator had it.
    acting = {name: free(f"{channel}_acting") for name, channel in channels.items()}
    given = {name: free(f"{channel}_simulated") for name, channel in channels.items()}
    values = {p.symbol: number(follower.values[p.name]) for p in follower.parameters}
    step = rename_signals(swapped(line.expression, values), {line.signal: output, **given})
    return replace(
        follower.bound(**{name: (value, value) for name, value in follower.values.items()}),
        name=f"simulated {follower.output_channels[0]}",
        lines=(
            Line(signal(remainder)[t], signal(output)[t] - step),
            replace(line, expression=rename_signals(line.expression, acting) + signal(remainder)[t]),
        ),
        measurements=(
            *follower.measurements,
            *(Measurement(channels[name], read, None) for role in (acting, given) for name, read in role.items()),
            Measurement(simulated, output, None),
        ),
        origins=dict.fromkeys((output, remainder), SIMULATION)
        | dict.fromkeys((*given.values(), *follower.values), _FOLLOWER),
    )


def standalone(model: Model) -> Model:
    """Return the model with the follower in place of the recorded simulation, for inputs that the simulator never had.

    A model without a simulation is returned as it is.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> follower = OutputError().with_values({"a1": -0.5, "b0": 2.0})
    >>> print(standalone(Simulated(follower, "y_sim")).lines[0])
    simulation[t] = simulation[t - 1]/2 + 2*u_simulated[t - 1]
    """
    given = {name for name, origin in model.origins.items() if origin == SIMULATION}
    remainder = next((line for line in model.lines if line.signal in given), None)
    if remainder is None:
        return model
    (output,) = given - {remainder.signal}
    now = signal(output)[t]
    return replace(model, lines=(Line(now, now - remainder.expression), *model.lines))


def check_equations(model: Model, what: str) -> None:
    """Refuse to prove something of a recorded simulation, of which there are no equations; ModelError."""
    if SIMULATION in model.origins.values():
        raise ModelError(f"{what}: of the simulator only its recorded output is known; diagnose a model instead")
