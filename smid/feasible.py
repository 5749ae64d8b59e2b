"""The extended feasible parameter set: model, data and noise bounds as a polynomial problem ((2.12), (3.14))."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass, field
from functools import cache, cached_property

import numpy as np
import sympy

from relaxations.balls import Array, Balls, Index, concatenate
from relaxations.lift import complicating_variables
from relaxations.polynomial import Polynomials
from relaxations.problem import PolynomialProblem, polynomials_from_sympy
from relaxations.reductions.sparsity import cliques
from smid.binding import bind
from smid.data import DataError, Dataset, excitation
from smid.models import Model, ModelError
from smid.template import Template, templates

FREE_BOUND = "noise_bound"  # name of the variable that stands for an unknown noise bound


@dataclass(frozen=True)
class FeasibleSet:
    """All parameters and noises that are consistent with every sample.

    Parameters
    ----------
    model : Model
        Bound to the data's channels (:func:`smid.bind`).
    data : Dataset
        All its experiments take part; the parameters are shared.
    noise_bound : float or mapping channel -> float
        In the channel's unit; one number holds for every noisy channel.
    free_channel : str, optional
        A channel whose bound becomes the last variable of the problem, ``noise_bound`` (phase 1).

    Attributes
    ----------
    problem : PolynomialProblem
        Variables: the parameters, then the noises and latent signals sample by sample.
    samples : ndarray of int, shape (n_equalities, 2)
        Experiment and time index that each equality belongs to.

    Raises
    ------
    ModelError, DataError
        Where bound, model and data do not fit together.

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

    def __post_init__(self) -> None:
        model = bind(self.model, self.data)
        check_data(model, self.data)
        bounds = check_noise_bound(model, self.noise_bound, self.free_channel)
        problem, samples = _stamp_all(model, self.data, bounds, self.free_channel)
        for name, value in (("model", model), ("problem", problem), ("samples", samples)):
            object.__setattr__(self, name, value)

    def with_problem(self, problem: PolynomialProblem) -> FeasibleSet:
        """Return the same set with a tighter (proven) box."""
        other = copy(self)
        object.__setattr__(other, "problem", problem)
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
        """Return the number of inequalities beside the boxes."""
        return self.problem.inequalities.n_rows

    @property
    def degree(self) -> int:
        """Return the largest degree among the constraints."""
        return self.problem.degree

    @cached_property
    def complicating(self) -> tuple[str, ...] | None:
        """Return the variables that the parametric lift would lift; None where it does not apply."""
        found = complicating_variables(self.problem)
        return None if found is None else tuple(self.problem.names[k] for k in found)

    def cliques(self) -> tuple[tuple[str, ...], ...]:
        """Return the cliques of the correlative sparsity pattern, by name."""
        return tuple(tuple(self.problem.names[k] for k in c) for c in cliques(self.problem))

    def to_sympy(self, most: int = 200) -> dict[str, list[sympy.Expr]]:
        """Return the constraints as sympy expressions, for small problems.

        Parameters
        ----------
        most : int
            Refuse more equalities than this.

        Returns
        -------
        dict
            ``"equalities"`` (== 0) and ``"inequalities"`` (>= 0), the box included.

        Raises
        ------
        ModelError
            When there are more than ``most`` equalities.
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
    """Return the bound of each noisy channel; ``free`` is a channel whose bound is not given.

    Raises
    ------
    ModelError
        For a bound that is missing, not positive, not finite, or of an exact channel.
    """
    noisy = [m.channel for m in model.measurements if m.noise is not None]
    wanted = [c for c in noisy if c != free]
    given = dict(noise_bound) if isinstance(noise_bound, Mapping) else {c: float(noise_bound) for c in wanted}
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
    return {c: float(given[c]) for c in wanted}


def check_data(model: Model, data: Dataset) -> None:
    """Raise a clear error where data and model do not fit together, before any work."""
    have = tuple(c.name for c in data.channels)
    missing = [c for c in model.channels if c not in have]
    if missing:
        raise DataError(
            f"the model needs the channel {missing[0]!r}, the data have {', '.join(have)}: "
            "name the channels when loading, or the model's input and output"
        )
    least = model.max_lag + len(model.parameters) + 1
    for experiment in data.experiments:
        if experiment.n_samples < least:
            raise DataError(
                f"experiment {experiment.name!r} has {experiment.n_samples} samples, the model needs {least} "
                "(its lag, its parameters and one more): take a longer record or a smaller model"
            )
    for channel in model.input_channels:
        # Order 1 and no more: a ramp excites little else, and is just what a static curve is measured with. Whether
        # the data suffice for the parameters is what the intervals say.
        records = [experiment.values[channel] for experiment in data.experiments]
        if excitation(*records, max_order=1).order < 1:
            raise DataError(
                f"the input {channel!r} does not excite: it is {records[0][0]:g} at every sample; "
                "measure with an input that moves (a step, a ramp, a PRBS), or crop the record to where it does"
            )


def _stamp_all(
    model: Model, data: Dataset, bounds: Mapping[str, float], free: str | None
) -> tuple[PolynomialProblem, Index]:
    """Stamp a model's equations over all experiments."""
    noise_channel = {m.noise: m.channel for m in model.measurements if m.noise is not None}
    parts = templates(model)
    place = {p.name: k for k, p in enumerate(model.parameters)}
    names = [p.name for p in model.parameters]
    lower = [np.array([p.lower for p in model.parameters], dtype=np.float64)]
    upper = [np.array([p.upper for p in model.parameters], dtype=np.float64)]
    equalities: list[Polynomials] = []
    samples = []
    free_latents: list[Index] = []
    definitions: list[tuple[Polynomials, Index]] = []
    stamped: list[tuple[Template, Mapping[str, Array], Index, Mapping[str, int], Mapping[str, int]]] = []

    @cache
    def exact() -> Polynomials:
        return Polynomials.join([_stamp(*arguments, expand=True) for arguments in stamped])

    count = len(names)
    for number, experiment in enumerate(data.experiments):
        suffix = "" if len(data.experiments) == 1 else f",{experiment.name}"
        offsets = {}
        for latent, (first, last) in _ranges(parts, experiment.n_samples).items():
            offsets[latent] = count - first
            size = last - first + 1
            names += [f"{latent}[{k}{suffix}]" for k in range(first, last + 1)]
            channel = noise_channel.get(latent)
            limit = bounds.get(channel, np.inf) if channel is not None else np.inf
            if channel is not None and channel == free:
                free_latents.append(np.arange(count, count + size))
            lower.append(np.full(size, -limit))
            upper.append(np.full(size, limit))
            count += size
        for part in parts:
            times = np.arange(part.max_lag, experiment.n_samples)
            arguments = (part, experiment.values, times, place, offsets)
            stamped.append(arguments)
            equalities.append(_stamp(*arguments))
            if part.defines:
                definitions.append((equalities[-1], times + offsets[part.signal]))
            samples.append(np.stack([np.full(len(times), number), times], axis=1))

    inequalities = polynomials_from_sympy(model.constraints, [p.symbol for p in model.parameters])
    if free is not None:
        names.append(FREE_BOUND)
        lower.append(np.zeros(1))
        upper.append(np.full(1, np.inf))
        inequalities = Polynomials.join([inequalities, *(_within(i, count) for i in free_latents)])
    low, high = np.concatenate(lower), np.concatenate(upper)
    for defining, variables in definitions:
        reach = _reach(defining, variables, low, high)
        low[variables], high[variables] = -reach, reach
    problem = PolynomialProblem(tuple(names), low, high, Polynomials.join(equalities), inequalities, exact)
    return problem, np.concatenate(samples).astype(np.int64)


def _ranges(parts: tuple[Template, ...], n_samples: int) -> dict[str, tuple[int, int]]:
    """Return first and last time index at which each latent occurs."""
    ranges: dict[str, tuple[int, int]] = {}
    for part in parts:
        for latent, lag in sorted(part.latents):
            first, last = part.max_lag - lag, n_samples - 1 - lag
            old = ranges.get(latent, (first, last))
            ranges[latent] = (min(old[0], first), max(old[1], last))
    return ranges


def _stamp(
    part: Template,
    values: Mapping[str, Array],
    times: Index,
    place: Mapping[str, int],
    offsets: Mapping[str, int],
    expand: bool = False,
) -> Polynomials:
    """Return one equality per time, all terms at once; ``expand`` gives coefficients as sums of exact floats."""
    degree = max(len(term.parameters) + len(term.latents) for term in part.terms)
    rows, factors, coefficients = [], [], []
    for term in part.terms:
        columns = [np.full(len(times), place[p]) for p in term.parameters]
        columns += [times - lag + offsets[latent] for latent, lag in term.latents]
        columns += [np.full(len(times), -1)] * (degree - len(columns))
        monomials = np.sort(np.stack(columns, axis=1), axis=1) if columns else np.empty((len(times), 0))
        own, balls = np.arange(len(times)), term.coefficients(values, times)
        if expand and balls.rad.any():
            own, balls = term.expansions(values, times)
        rows.append(own)
        factors.append(monomials[own])
        coefficients.append(balls)
    stamped = Polynomials(
        len(times), np.concatenate(rows), np.concatenate(factors).astype(np.int64), concatenate(coefficients)
    )
    # Collecting would add the summands up again.
    return stamped if expand else stamped.collect()


def _reach(defining: Polynomials, variables: Index, lower: Array, upper: Array) -> Array:
    """Return how large each latent can be that an equality gives explicitly, with coefficient one."""
    own = (defining.term_degrees == 1) & (defining.factors.max(axis=1) == variables[defining.rows])
    largest = np.maximum(np.abs(lower), np.abs(upper))
    sizes = Balls.exact(np.where(own, 0.0, defining.coefficients.magnitude()))
    with np.errstate(invalid="ignore"):
        for column in defining.factors.T:
            sizes = sizes * Balls.exact(np.where((column >= 0) & ~own, largest[column], 1.0))
        reach = sizes.segment_sum(defining.rows, defining.n_rows).upper
    return np.where(np.isfinite(reach), reach, np.inf)


def _within(latents: Index, bound: int) -> Polynomials:
    """Return ``bound - latent >= 0`` and ``bound + latent >= 0``."""
    count = len(latents)
    own = np.arange(2 * count)
    return Polynomials(
        2 * count,
        np.concatenate([own, own]),
        np.concatenate([np.tile(latents, 2), np.full(2 * count, bound)]).reshape(-1, 1),
        Balls.exact(np.concatenate([np.full(count, -1.0), np.ones(3 * count)])),
    )
