"""A model: a list of named equations that can be simulated, bounded and rewritten."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy
from numpy.typing import NDArray

from smid.models import edit_lines, edit_parameters
from smid.models.checks import check_integration, check_names, check_symbols
from smid.models.discretise import ENCLOSED, discretise
from smid.models.equations import Equations
from smid.models.errors import ModelError
from smid.models.expressions import from_text, to_text
from smid.models.parts import Edit, Line, Measurement, Parameter
from smid.models.structure import causal_order, exogenous, first_samples, state_lags
from smid.models.symbols import VALUE, canonical, number, signal, t

if TYPE_CHECKING:
    from smid.models.simulate import Experiments, Simulation

__all__ = ["VALUE", "Line", "Measurement", "Model", "Parameter", "signal", "t"]


@dataclass(frozen=True)
class Model:
    """A model as a list of explicit, causal equations, in samples or in derivatives.

    Attributes
    ----------
    name
        Name, for display.
    parameters
        The unknown constants.
    lines
        One line per defined signal, plain or a rate; sorted into causal order on construction.
    measurements
        What the data show of the signals.
    constraints
        Prior knowledge: each expression in the parameters is >= 0.
    values
        Parameter values where known (a central model), in the parameters' units.
    description
        A sentence for the reader.
    scheme
        How rate lines are integrated between samples: "euler", "trapezoidal" or "rk4" (explicit), or "rosenbrock"
        (linearly implicit, for stiff rates). Intervals hold for this discretisation. With "enclosed" they hold for the
        differential equation itself: they are computed by inversion (:mod:`smid.identification.inversion`), with the
        remainder of each step enclosed; everything else is simulated by "rk4".
    substeps
        Steps of the scheme per sampling interval.
    sampling_time
        In seconds; needed by rate lines as soon as something is computed. None: taken from the data.
    origins
        Name of the effect that added a parameter, a signal or the reading of an input, by the parameter's or signal's
        name. The base model's own are not listed.
    units
        Unit of a channel or signal, by name, where the model states it; the data must have the same.
    bounds
        Of hidden states, signals with memory that no channel measures, by name: (lower, upper), finite. They hold at
        every sample. A state with bounds is not eliminated (:mod:`smid.models.hidden_states`).
    edit
        Who edits the model now, see `edited_by`; neither stored nor compared.

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
    scheme: str = "rk4"
    substeps: int = 1
    sampling_time: float | None = None
    origins: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    edit: Edit | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        check_names(self)
        check_integration(self)
        constraints = tuple(canonical(constraint) for constraint in self.constraints)
        values = {name: float(value) for name, value in self.values.items()}
        # Tuples and a read-only mapping: a model is a key of the caches of compiled simulations.
        for name, value in (
            ("parameters", tuple(self.parameters)),
            ("lines", causal_order(self.lines)),
            ("measurements", tuple(self.measurements)),
            ("constraints", constraints),
            ("values", MappingProxyType(values)),
            ("origins", self._known_origins()),
            ("bounds", self._known_bounds()),
            (
                "units",
                MappingProxyType({name: unit for name, unit in self.units.items() if unit and name in self.names}),
            ),
        ):
            object.__setattr__(self, name, value)
        check_symbols(self)

    def _known_origins(self) -> Mapping[str, str]:
        """Return the origins of the parameters and signals that there are."""
        known = {*(p.name for p in self.parameters), *(line.signal for line in self.lines), *exogenous(self.lines)}
        return MappingProxyType({name: origin for name, origin in self.origins.items() if origin and name in known})

    def _known_bounds(self) -> Mapping[str, tuple[float, float]]:
        """Return the bounds of the signals that have a line and no measurement; the others are of no use."""
        hidden = {line.signal for line in self.lines} - {m.signal for m in self.measurements}
        return MappingProxyType({n: (float(low), float(high)) for n, (low, high) in self.bounds.items() if n in hidden})

    def __hash__(self) -> int:
        own = (self.name, self.parameters, self.lines, self.measurements, self.constraints)
        return hash((*own, self.scheme, self.substeps, self.sampling_time))

    def __reduce__(self) -> tuple[type[Model], tuple[Any, ...]]:
        # A read-only mapping does not pickle, and models travel to worker processes.
        content = {part.name: getattr(self, part.name) for part in fields(self)}
        plain = {name: dict(content[name]) for name in ("values", "origins", "units", "bounds")}
        return Model, tuple({**content, **plain}.values())

    @property
    def names(self) -> frozenset[str]:
        """Every name that stands for a parameter, signal, channel or noise."""
        noises = (item.noise for item in self.measurements if item.noise)
        parameters = (item.name for item in self.parameters)
        return frozenset((*parameters, *self.inputs, *(line.signal for line in self.lines), *self.channels, *noises))

    @property
    def taken(self) -> frozenset[str]:
        """`names`, and those that the edit under way reserves."""
        return self.names | (self.edit.reserved if self.edit else frozenset())

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
    def exogenous_channels(self) -> tuple[str, ...]:
        """Input channels that are not outputs as well."""
        return tuple(channel for channel in self.input_channels if channel not in self.output_channels)

    @property
    def outputs(self) -> tuple[Measurement, ...]:
        """Measurements of signals that the model computes. A predictor also reads their channels as inputs."""
        defined = {line.signal for line in self.lines}
        return tuple(measurement for measurement in self.measurements if measurement.signal in defined)

    @property
    def output_channels(self) -> tuple[str, ...]:
        """Channels that show a signal the model computes."""
        return tuple(measurement.channel for measurement in self.outputs)

    @property
    def channels(self) -> tuple[str, ...]:
        """All channels the data must have: inputs, then outputs."""
        others = tuple(measurement.channel for measurement in self.measurements)
        return tuple(dict.fromkeys(self.input_channels + others))

    @property
    def states(self) -> tuple[str, ...]:
        """Defined signals whose own past determines their future."""
        return tuple(state_lags(self._structure))

    @cached_property
    def max_lag(self) -> int:
        """Samples the model looks back, lags added up along its lines: the first sample it can compute."""
        return max(first_samples(self._structure).values(), default=0)

    @property
    def continuous(self) -> bool:
        """Whether any line is a rate."""
        return any(line.rate for line in self.lines)

    @property
    def enclosed(self) -> bool:
        """Whether intervals hold for the differential equation itself."""
        return self.continuous and self.scheme == ENCLOSED

    def discretised(self) -> Model:
        """Return the equivalent model of plain lines, which is what is simulated and, unless `enclosed`, bounded.

        Parameters whose box is one point are put into its lines as numbers, which can make them linear or polynomial;
        they stay among its parameters.

        Raises
        ------
        ModelError
            If there are rate lines and no sampling time.

        Examples
        --------
        >>> x, u = signal("x"), signal("u")
        >>> lines = (Line(x[t], u[t] - x[t], rate=True),)
        >>> tank = Model("tank", (), lines, (Measurement("y", "x", "eta"),), scheme="euler", sampling_time=0.5)
        >>> print(tank.discretised().lines[0])
        x[t] = u[t - 1]/2 + x[t - 1]/2
        """
        if not self.continuous:
            return self
        if self.sampling_time is None:
            raise ModelError(
                f"model {self.name!r} has rates and no sampling time: build it with Model(..., "
                "sampling_time=...), in seconds, or use a Dataset, which knows its own"
            )
        return self._discretised

    @cached_property
    def _discretised(self) -> Model:
        return replace(self, lines=self._structure)

    @cached_property
    def _structure(self) -> tuple[Line, ...]:
        """The plain lines; which signals they read at which lags does not depend on the sampling time."""
        if not self.continuous:
            return self.lines
        fixed = {p.symbol: number(p.lower) for p in self.parameters if p.lower == p.upper}
        step = 1.0 if self.sampling_time is None else self.sampling_time
        return causal_order(discretise(self.lines, self.scheme, self.substeps, step, self.taken, fixed))

    def parameter(self, name: str) -> Parameter:
        """Find a parameter by name.

        Parameters
        ----------
        name
            Name of the parameter.

        Raises
        ------
        ModelError
            If there is none of that name.
        """
        return edit_parameters.find_parameter(self, name)

    def equations(self) -> Equations:
        """Return the model's equations, boxes, measurements and priors for print, LaTeX and notebooks."""
        return Equations.of(self)

    def __str__(self) -> str:
        return str(self.equations())

    def _repr_html_(self) -> str:
        return self.equations().html()

    def to_dict(self) -> dict[str, Any]:
        """Return the model as plain, JSON-ready content; infinite bounds become None."""
        integration = {
            "rates": [line.signal for line in self.lines if line.rate],
            "scheme": self.scheme,
            "substeps": self.substeps,
            "sampling_time": self.sampling_time,
        }
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
            "origins": dict(self.origins),
            "units": dict(self.units),
            **({"bounds": {name: list(box) for name, box in self.bounds.items()}} if self.bounds else {}),
            **(integration if self.continuous else {}),
        }

    @staticmethod
    def from_dict(content: Mapping[str, Any]) -> Model:
        """Rebuild a model from the output of `to_dict`.

        Parameters
        ----------
        content
            What `to_dict` gave; its expressions are parsed, never executed.

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
            rates = content.get("rates", ())
            lines = tuple(
                Line(signal(name)[t], from_text(text), name in rates) for name, text in content["lines"].items()
            )
            integration = {name: content[name] for name in ("scheme", "substeps", "sampling_time") if rates}
            constraints = tuple(from_text(text) for text in content["constraints"])
            return Model(
                content["name"],
                parameters,
                lines,
                measurements,
                constraints,
                content["values"],
                content["description"],
                origins=content.get("origins", {}),
                units=content.get("units", {}),
                bounds=content.get("bounds", {}),
                **integration,
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
    insert_sensor = edit_lines.insert_sensor
    with_constraint = edit_parameters.with_constraint
    with_input_noise = edit_lines.with_input_noise
    edited_by = edit_parameters.edited_by


def _parameter(entry: Mapping[str, Any]) -> Parameter:
    lower = -math.inf if entry["lower"] is None else entry["lower"]
    upper = math.inf if entry["upper"] is None else entry["upper"]
    return Parameter(entry["name"], lower, upper, entry["unit"], entry["null"])
