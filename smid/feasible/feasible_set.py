"""The extended feasible parameter set: model, data and noise bounds as a polynomial problem ((2.12), (3.14))."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import sympy

from relaxations.algebra.arrays import Array, Index
from relaxations.algebra.polynomial import Polynomials
from relaxations.moments.parametric_lift import complicating_variables
from relaxations.problem.problem import PolynomialProblem
from relaxations.reductions.sparsity import cliques
from smid.data import DataError, Dataset, excitation
from smid.data.gaps import bridged
from smid.feasible.assemble import FREE_BOUND, Opening, Placed, Sides, Stamped, stamp_all
from smid.feasible.template import Templates
from smid.fitting.binding import bind
from smid.models import Model, ModelError
from smid.models.symbols import end

__all__ = ["FREE_BOUND", "FeasibleSet", "check_data", "check_noise_bound", "check_samples", "is_constant"]


@dataclass(frozen=True)
class FeasibleSet:
    """All parameters and noises that are consistent with every sample.

    Parameters
    ----------
    model
        Bound to the data's channels (:func:`smid.bind`).
    data
        The experiments share the parameters.
    noise_bound
        In the channel's unit; one number holds for every noisy channel.
    free_channel
        A channel whose bound becomes the last variable of the problem, ``noise_bound`` (phase 1).

    Attributes
    ----------
    problem
        Variables: the parameters, then the noises and latent signals sample by sample.
    samples
        Shape (n_equalities, 2). Experiment and time index of each equality.
    templates
        The model's templates.
    openings
        The kinks (of Max, Min, Abs and sign) that the box of the parameters does not decide. The problem holds their
        hulls, so it is a relaxation of the set; without openings it is the set itself.
    placed, definitions
        See :class:`smid.feasible.assemble.Stamped`.
    missing
        The variables that stand for missing samples. They have no bound, or the box that was proven for them.

    Raises
    ------
    ModelError, DataError
        If bound, model and data do not fit together.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> data = Dataset.from_arrays(input=[1.0, 1, 1, 0], output=[0.0, 0.5, 0.7, 0.8], sampling_time=1.0)
    >>> feasible = FeasibleSet(OutputError(na=1, stable=True), data, 0.1)
    >>> feasible.n_equalities, feasible.degree
    (3, 2)
    """

    model: Model
    data: Dataset
    noise_bound: float | Mapping[str, float]
    free_channel: str | None = None
    problem: PolynomialProblem = field(init=False)
    samples: Index = field(init=False)
    templates: Templates = field(init=False, repr=False)
    openings: tuple[Opening, ...] = field(init=False, repr=False)
    placed: tuple[Placed, ...] = field(init=False, repr=False)
    definitions: tuple[tuple[Index, Index], ...] = field(init=False, repr=False)
    missing: Index = field(init=False, repr=False)

    def __post_init__(self) -> None:
        model = bind(self.model, self.data)
        check_data(model, self.data)
        bounds = check_noise_bound(model, self.noise_bound, self.free_channel)
        templates = Templates.of(model)
        if templates.hinges and self.free_channel is not None:
            raise ModelError(
                "the least noise bound of a model with Max, Min, Abs or sign is not available: give the bound that you "
                "know of the sensor, or that of a model without them"
            )
        object.__setattr__(self, "model", model)
        object.__setattr__(self, "templates", templates)
        self._take(stamp_all(templates, self.data, bounds, self.free_channel))

    def _take(self, stamped: Stamped) -> None:
        for name in ("problem", "samples", "openings", "placed", "definitions", "missing"):
            object.__setattr__(self, name, getattr(stamped, name))

    def on_box(self, lower: Array, upper: Array, choose: Sides | None = None) -> FeasibleSet:
        """Return the set on a smaller box of the parameters, shape (n_parameters,), where fewer kinks may be open.

        ``choose`` gives sides to open kinks (:func:`smid.feasible.assemble.stamp_all`).
        """
        other = copy(self)
        other._take(stamp_all(self.templates, self.data, self.bounds, None, (lower, upper), choose))
        return other

    def with_problem(self, problem: PolynomialProblem) -> FeasibleSet:
        """Return the same set with a tighter (proven) box."""
        other = copy(self)
        object.__setattr__(other, "problem", problem)
        return other

    def without(self, variables: Index) -> FeasibleSet:
        """Return a larger set, without some of the missing samples and the equations that read them."""
        if not len(variables):
            return self
        other = copy(self)
        problem, kept = self.problem.without(variables)
        place = {name: k for k, name in enumerate(problem.names)}
        missing = [place[self.problem.names[k]] for k in np.setdiff1d(self.missing, variables)]
        object.__setattr__(other, "problem", problem)
        object.__setattr__(other, "samples", self.samples[kept])
        object.__setattr__(other, "missing", np.array(missing, dtype=np.int64))
        rows = {int(row): k for k, row in enumerate(kept)}
        pairs = [
            [(rows[int(r)], place[self.problem.names[v]]) for r, v in zip(*given, strict=True) if int(r) in rows]
            for given in self.definitions
        ]
        definitions = tuple((np.array(found).reshape(-1, 2).astype(np.int64)) for found in pairs)
        object.__setattr__(other, "definitions", tuple((found[:, 0], found[:, 1]) for found in definitions))
        return other

    @property
    def bounds(self) -> dict[str, float]:
        """Return the bound of each noisy channel, in the channel's unit."""
        return check_noise_bound(self.model, self.noise_bound, self.free_channel)

    @property
    def n_variables(self) -> int:
        """Return the number of parameters and latents."""
        return self.problem.n_variables

    @property
    def n_equalities(self) -> int:
        """Return the number of equalities: one per sample and dynamic line."""
        return self.problem.equalities.n_rows

    @property
    def n_inequalities(self) -> int:
        """Return the number of inequalities without the boxes."""
        return self.problem.inequalities.n_rows

    @property
    def degree(self) -> int:
        """Return the largest degree among the constraints."""
        return self.problem.degree

    @cached_property
    def complicating(self) -> tuple[str, ...] | None:
        """Return the variables that the parametric lift would lift; None where the lift does not apply."""
        found = complicating_variables(self.problem)
        return None if found is None else tuple(self.problem.names[k] for k in found)

    def cliques(self) -> tuple[tuple[str, ...], ...]:
        """Return the cliques of the correlative sparsity pattern, by name."""
        return tuple(tuple(self.problem.names[k] for k in c) for c in cliques(self.problem))

    def to_sympy(self, most: int = 200) -> dict[str, list[sympy.Expr]]:
        """Return ``"equalities"`` (== 0) and ``"inequalities"`` (>= 0, the box included) as sympy expressions.

        Raises
        ------
        ModelError
            If there are more than ``most`` equalities.
        """
        if self.n_equalities > most:
            raise ModelError(f"{self.n_equalities} equalities are too many to write out: crop the data below {most}")
        symbols = [sympy.Symbol(name, real=True) for name in self.problem.names]
        boxes = []
        for s, low, high in zip(symbols, self.problem.lower, self.problem.upper, strict=True):
            boxes += [s - float(low)] if np.isfinite(low) else []
            boxes += [float(high) - s] if np.isfinite(high) else []
        return {
            "equalities": _to_sympy(self.problem.equalities, symbols),
            "inequalities": _to_sympy(self.problem.inequalities, symbols) + boxes,
        }

    def __str__(self) -> str:
        bounds = ", ".join(f"|noise of {c}| <= {b:g}" for c, b in self.bounds.items())
        lifted = "none small enough" if self.complicating is None else ", ".join(self.complicating)
        return (
            f"Feasible set of {self.model.name}: {self.n_variables} variables "
            f"({len(self.model.parameters)} parameters), {self.n_equalities} equalities, "
            f"{self.n_inequalities} inequalities, degree {self.degree}; {bounds}; complicating: {lifted}"
        )


def _to_sympy(polynomials: Polynomials, symbols: list[sympy.Symbol]) -> list[sympy.Expr]:
    expressions = [sympy.Integer(0)] * polynomials.n_rows
    for row, factor, value in zip(polynomials.rows, polynomials.factors, polynomials.coefficients.mid, strict=True):
        expressions[row] += sympy.Float(float(value)) * sympy.Mul(*(symbols[v] for v in factor if v >= 0))
    return expressions


def check_noise_bound(model: Model, noise_bound: float | Mapping[str, float], free: str | None) -> dict[str, float]:
    """Return the bound of each noisy channel; the bound of the channel ``free`` is not given.

    ModelError for a bound that is missing, not positive, not finite, or of an exact channel.
    """
    noisy = [m.channel for m in model.measurements if m.noise is not None]
    wanted = [c for c in noisy if c != free]
    stated = noise_bound if isinstance(noise_bound, Mapping) else dict.fromkeys(wanted, noise_bound)
    given = {channel: float(end(value, 1)) for channel, value in stated.items()}
    for channel, value in given.items():
        if channel not in noisy:
            raise ModelError(f"noise bound of {channel!r}: the noisy channels are {', '.join(noisy)}; name one of them")
        if not (np.isfinite(value) and value > 0):
            raise ModelError(
                f"the noise bound of {channel!r} is {value}: give a positive number in the channel's unit "
                "(smid.error_bound encloses the least one)"
            )
    missing = [c for c in wanted if c not in given]
    if missing:
        raise ModelError(f"no noise bound for {', '.join(missing)}: give noise_bound={{channel: bound}}")
    return {c: given[c] for c in wanted}


def check_data(model: Model, data: Dataset) -> None:
    """Raise an error if data and model do not fit together, before any work."""
    check_samples(model, data)
    for channel in model.input_channels:
        # Only order 1: a ramp, which measures a static curve, excites little more. The intervals show whether the
        # data suffice for the parameters.
        if is_constant(data, channel):
            raise DataError(
                f"the input {channel!r} does not excite: it is {data.experiments[0].values[channel][0]:g} at every "
                "sample; measure with an input that moves (a step, a ramp, a PRBS), or crop the record to where it does"
            )


def is_constant(data: Dataset, channel: str) -> bool:
    """Return whether a channel has one value in all experiments."""
    return excitation(*(bridged(run.values[channel]) for run in data.experiments), max_order=1).order < 1


def check_samples(model: Model, data: Dataset) -> None:
    """Raise an error if the data lack a channel of the model, or are too short for it."""
    have = tuple(c.name for c in data.channels)
    missing = [c for c in model.channels if c not in have]
    if missing:
        raise DataError(
            f"the model needs the channel {missing[0]!r}, the data have {', '.join(have)}: "
            "name the channels when loading, or the model's input and output"
        )
    for channel in model.input_channels:
        if data.missing[channel]:
            raise DataError(
                f"the model reads {channel!r} as an input, and {data.missing[channel]} of its samples are missing: "
                "load it as an input of the data, so that the record is split there"
            )
    # The parts of a record that is split at missing samples share the parameters, so together they must suffice. Each
    # missing output is one unknown more.
    lag = model.max_lag
    unknown = len(model.parameters) + max((data.missing[c] for c in model.output_channels), default=0)
    equations = sum(experiment.n_samples - lag for experiment in data.experiments)
    shortest = min(data.experiments, key=lambda experiment: experiment.n_samples)
    if shortest.n_samples <= lag or equations <= unknown:
        raise DataError(
            f"experiment {shortest.name!r} has {shortest.n_samples} samples, the model needs {lag + unknown + 1} in "
            f"one experiment, or more than {lag} in each of several (its lag, its parameters and one more): take a "
            "longer record or a smaller model"
        )
