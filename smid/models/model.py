"""A model: a list of named equations that can be simulated, bounded and rewritten."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy
from numpy.typing import NDArray

from smid.models import edit_lines, edit_parameters
from smid.models.equations import Equations
from smid.models.errors import ModelError
from smid.models.expressions import from_text, to_text
from smid.models.parts import Line, Measurement, Parameter
from smid.models.structure import causal_order, exogenous, first_samples, state_lags
from smid.models.symbols import VALUE, canonical, plain_symbols, signal, t

if TYPE_CHECKING:
    from smid.models.simulate import Experiments, Simulation

__all__ = ["VALUE", "Line", "Measurement", "Model", "Parameter", "signal", "t"]


@dataclass(frozen=True)
class Model:
    """A discrete-time model as a list of explicit, causal equations.

    Attributes
    ----------
    name : str
        Name, for display.
    parameters : tuple of Parameter
        The unknown constants.
    lines : tuple of Line
        One line per defined signal; sorted into causal order on construction.
    measurements : tuple of Measurement
        What the data show of the signals.
    constraints : tuple of sympy.Expr
        Prior knowledge: each expression in the parameters is >= 0.
    values : Mapping of str to float
        Parameter values where known (a central model), in the parameters' units.
    description : str
        A sentence for the reader.

    Raises
    ------
    ModelError
        If names clash, a symbol is undefined, lines form an algebraic loop, or a value is not a parameter's.

    Examples
    --------
    >>> alpha, u, w = Parameter("alpha", -1, 1), signal("u"), signal("w")
    >>> line = Line(w[t], -alpha.symbol * w[t - 1] + u[t - 1])
    >>> model = Model("first order", (alpha,), (line,), (Measurement("y", "w", "eta"),))
    >>> model.inputs, model.channels, model.max_lag, model.states
    (('u',), ('u', 'y'), 1, ('w',))
    """

    name: str
    parameters: tuple[Parameter, ...]
    lines: tuple[Line, ...]
    measurements: tuple[Measurement, ...]
    constraints: tuple[sympy.Expr, ...] = ()
    values: Mapping[str, float] = field(default_factory=dict)
    description: str = ""

    def __post_init__(self) -> None:
        _check_names(self)
        constraints = tuple(canonical(constraint) for constraint in self.constraints)
        values = {name: float(value) for name, value in self.values.items()}
        # Tuples and a read-only mapping: a model is a key of the caches of compiled simulations.
        for name, value in (
            ("parameters", tuple(self.parameters)),
            ("lines", causal_order(self.lines)),
            ("measurements", tuple(self.measurements)),
            ("constraints", constraints),
            ("values", MappingProxyType(values)),
        ):
            object.__setattr__(self, name, value)
        _check_symbols(self)

    def __hash__(self) -> int:
        return hash((self.name, self.parameters, self.lines, self.measurements, self.constraints))

    def __reduce__(self) -> tuple[type[Model], tuple[Any, ...]]:
        # A read-only mapping does not pickle, and models travel to worker processes.
        content = {part.name: getattr(self, part.name) for part in fields(self)}
        return Model, tuple({**content, "values": dict(self.values)}.values())

    @property
    def inputs(self) -> tuple[str, ...]:
        """Signals that are read but never defined, noisy inputs included."""
        return exogenous(self.lines)

    @property
    def input_channels(self) -> tuple[str, ...]:
        """Channel of the data that each of `inputs` comes from."""
        measured = {measurement.signal: measurement.channel for measurement in reversed(self.measurements)}
        return tuple(measured.get(name, name) for name in self.inputs)

    @property
    def output_channels(self) -> tuple[str, ...]:
        """Channels that show a signal the model computes."""
        defined = {line.signal for line in self.lines}
        return tuple(measurement.channel for measurement in self.measurements if measurement.signal in defined)

    @property
    def channels(self) -> tuple[str, ...]:
        """All channels the data must have: inputs, then outputs."""
        others = tuple(measurement.channel for measurement in self.measurements)
        return tuple(dict.fromkeys(self.input_channels + others))

    @property
    def states(self) -> tuple[str, ...]:
        """Defined signals whose own past determines their future."""
        return tuple(state_lags(self.lines))

    @property
    def max_lag(self) -> int:
        """Samples the model looks back, lags added up along its lines: the first sample it can compute."""
        return max(first_samples(self.lines).values(), default=0)

    def parameter(self, name: str) -> Parameter:
        """Find a parameter by name.

        Parameters
        ----------
        name : str
            Name of the parameter.

        Returns
        -------
        Parameter
            That parameter.

        Raises
        ------
        ModelError
            If there is none of that name.
        """
        return edit_parameters.find_parameter(self, name)

    def equations(self) -> Equations:
        """Give the model's equations, boxes, measurements and priors for print, LaTeX and notebooks.

        Returns
        -------
        Equations
            ``print(model.equations())`` shows one per line.
        """
        return Equations.of(self)

    def __str__(self) -> str:
        return str(self.equations())

    def _repr_html_(self) -> str:
        return self.equations().html()

    def to_dict(self) -> dict[str, Any]:
        """Give the model as plain, JSON-ready content; infinite bounds become None.

        Returns
        -------
        dict
            Input of `from_dict`.
        """
        return {
            "name": self.name,
            "description": self.description,
            "parameters": [
                {
                    "name": parameter.name,
                    "lower": parameter.lower if math.isfinite(parameter.lower) else None,
                    "upper": parameter.upper if math.isfinite(parameter.upper) else None,
                    "unit": parameter.unit,
                    "null": parameter.null,
                }
                for parameter in self.parameters
            ],
            "lines": {line.signal: to_text(line.expression) for line in self.lines},
            "measurements": [
                {
                    "channel": measurement.channel,
                    "signal": measurement.signal,
                    "noise": measurement.noise,
                    "inverse": None if measurement.inverse is None else to_text(measurement.inverse),
                }
                for measurement in self.measurements
            ],
            "constraints": [to_text(constraint) for constraint in self.constraints],
            "values": dict(self.values),
        }

    @staticmethod
    def from_dict(content: Mapping[str, Any]) -> Model:
        """Rebuild a model from the output of `to_dict`.

        Parameters
        ----------
        content : Mapping
            What `to_dict` gave; its expressions are parsed, never executed.

        Returns
        -------
        Model
            An equal model.

        Raises
        ------
        ModelError
            If a field is missing or an expression cannot be read.
        """
        try:
            parameters = tuple(_parameter(entry) for entry in content["parameters"])
            measurements = tuple(
                Measurement(
                    entry["channel"],
                    entry["signal"],
                    entry["noise"],
                    None if entry["inverse"] is None else from_text(entry["inverse"]),
                )
                for entry in content["measurements"]
            )
            lines = tuple(Line(signal(name)[t], from_text(text)) for name, text in content["lines"].items())
            constraints = tuple(from_text(text) for text in content["constraints"])
            return Model(
                content["name"],
                parameters,
                lines,
                measurements,
                constraints,
                content["values"],
                content["description"],
            )
        except KeyError as missing:
            raise ModelError(f"the stored model lacks {missing}: store it with Model.to_dict") from None

    def simulate(
        self,
        data: Experiments,
        parameters: Mapping[str, float] | None = None,
        initial: str | Mapping[str, NDArray[np.float64]] = "measured",
    ) -> Simulation:
        """Run the model freely over data; see `smid.models.simulate.simulate_data`."""
        from smid.models.simulate import simulate_data  # the simulator imports the model

        return simulate_data(self, data, parameters, initial)

    def predict(self, data: Experiments, parameters: Mapping[str, float] | None = None) -> Simulation:
        """Predict one step ahead over data; see `smid.models.simulate.predict_data`."""
        from smid.models.simulate import predict_data  # the simulator imports the model

        return predict_data(self, data, parameters)

    with_parameter = edit_parameters.with_parameter
    with_values = edit_parameters.with_values
    fix = edit_parameters.fix
    bound = edit_parameters.bound
    substitute = edit_parameters.substitute
    with_line = edit_lines.with_line
    replace_line = edit_lines.replace_line
    add_term = edit_lines.add_term
    insert_before = edit_lines.insert_before
    insert_after = edit_lines.insert_after
    with_constraint = edit_parameters.with_constraint
    with_input_noise = edit_lines.with_input_noise


def _parameter(entry: Mapping[str, Any]) -> Parameter:
    lower = -math.inf if entry["lower"] is None else entry["lower"]
    upper = math.inf if entry["upper"] is None else entry["upper"]
    return Parameter(entry["name"], lower, upper, entry["unit"], entry["null"])


def _check_names(model: Model) -> None:
    """Every name stands for one thing."""
    names = (
        [("parameter", parameter.name) for parameter in model.parameters]
        + [("signal", name) for name in dict.fromkeys((*exogenous(model.lines), *(s.signal for s in model.lines)))]
        + [("channel", measurement.channel) for measurement in model.measurements]
        + [("noise", measurement.noise) for measurement in model.measurements if measurement.noise]
    )
    for signal_name, count in Counter(line.signal for line in model.lines).items():
        if count > 1:
            raise ModelError(f"signal {signal_name!r} is defined by {count} lines: keep one, or use replace_line")
    for name, count in Counter(name for _, name in names).items():
        if count > 1:
            kinds = " and ".join(kind for kind, other in names if other == name)
            raise ModelError(f"the name {name!r} stands for {kinds}: rename one of them")


def _check_symbols(model: Model) -> None:
    """Every symbol is a parameter, every measured signal and every value belongs to the model."""
    known = {parameter.name for parameter in model.parameters}
    expressions = [(f"the line of {line.signal!r}", line.expression) for line in model.lines]
    expressions += [(f"the constraint '{constraint} >= 0'", constraint) for constraint in model.constraints]
    for measurement in model.measurements:
        inverse = measurement.inverse if measurement.inverse is not None else VALUE
        expressions.append(
            (f"the sensor curve of {measurement.channel!r}", inverse.xreplace({VALUE: sympy.Integer(1)}))
        )
    for place, expression in expressions:
        unknown = sorted(plain_symbols(expression) - known)
        if unknown:
            raise ModelError(f"{place} uses {', '.join(unknown)}, no parameter: add it by with_parameter")
    for constraint in model.constraints:
        if constraint.atoms(sympy.Indexed):
            raise ModelError(f"the constraint '{constraint} >= 0' reads a signal: state it in the parameters only")
    signals = {*exogenous(model.lines), *(line.signal for line in model.lines)}
    for measurement in model.measurements:
        if measurement.signal not in signals:
            raise ModelError(
                f"channel {measurement.channel!r} measures {measurement.signal!r}, which no line "
                f"defines or reads: name one of {', '.join(sorted(signals))}"
            )
    for name, value in model.values.items():
        if name not in known or not math.isfinite(value):
            raise ModelError(f"the value {name} = {value} is refused: give finite values of {', '.join(sorted(known))}")
