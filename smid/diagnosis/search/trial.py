"""One effect tried on one model: every extension fitted from several starts, the best kept.

The *signature* of an extension is the share of the base residual that one Gauss-Newton step from a start would take
away: one simulation with sensitivities, no fit. It ranks the starts and screens the extensions; the promising are
fitted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from relaxations.algebra.arrays import Array, Mask
from smid.data import Dataset
from smid.diagnosis.effects.effect import Describe, Effect, Extension, Site
from smid.fitting.fit import fit
from smid.fitting.one_step_ahead import one_step_ahead
from smid.fitting.problem import Errors, Fit, Fitting
from smid.models import Model, ModelError
from smid.models.sensitivities import Initial

# The effort of a trial: which of its extensions and starts are fitted, and for how many evaluations.
_NEAR = 0.05  # of the way from the base model to a start
_EXTENSIONS = 5  # those with the best signatures
_ADAPTED, _ADAPTING = 12, 5  # starts to which the rest of the model is adapted first
_STARTS, _SHORT = 2, 10  # of these, the one with the best signature, then those that fit best
_FINISHED, _LONG = 2, 200  # extensions fitted to the end: poles near one and initial states make narrow valleys

REACH = 7.0
"""Nats below the best, odds of a thousand, up to which sets are compared by all blocks, and grown."""


@dataclass(frozen=True, eq=False)
class Trial:
    """An effect fitted to a model's data in the way that suits it best.

    Parameters
    ----------
    effect, label
        Name of the effect, and which of its variants.
    fit
        The extended model, fitted.
    parameters
        The parameters that it has more than the base.
    signature
        Share of the base cost that the first step promised.
    errors
        Of the fit, with their derivatives; see `smid.fitting.problem.Fitting.errors`.
    variants
        How many variants the effect has here.
    describe, place
        See `Extension`.
    tied
        Other variants that fit as well, within `REACH`.
    """

    effect: str
    label: str
    fit: Fit
    parameters: tuple[str, ...]
    signature: float
    errors: Errors
    variants: int = 1
    describe: Describe | None = None
    place: str = ""
    tied: tuple[Trial, ...] = ()

    @property
    def variant(self) -> tuple[str, str]:
        """The effect and its label."""
        return self.effect, self.label

    @property
    def values(self) -> dict[str, float]:
        """Fitted values of the effect's parameters."""
        return {name: self.fit.model.values[name] for name in self.parameters}


@dataclass(frozen=True, eq=False)
class Base:
    """A fitted model and what it was fitted to.

    Parameters
    ----------
    fit, errors
        With values; see `Trial`.
    data
        The whole record.
    used
        Shape (n,). Per experiment, the samples that may be fitted.
    input, output
        Main channels.
    difference
        Whether fits take finite differences for sensitivities, to compare with.
    """

    fit: Fit
    errors: Errors
    data: Dataset
    used: tuple[Mask, ...]
    input: str
    output: str
    difference: bool = False

    def extended(self, trial: Trial) -> Base:
        """Return the base that an effect makes."""
        return replace(self, fit=trial.fit, errors=trial.errors)

    def site(self) -> Site:
        """Return the site for effects: the part of the record that may be fitted."""
        residual = self.fit.residual(self.data, self.output)
        runs, rest = [], []
        for run, used, error in zip(self.data.experiments, self.used, residual, strict=True):
            if used.any():
                last = int(np.flatnonzero(used)[-1]) + 1
                runs.append(replace(run, values={name: samples[:last] for name, samples in run.values.items()}))
                rest.append(error[:last])
        return Site(replace(self.data, experiments=tuple(runs), resampling=()), self.input, self.output, tuple(rest))


def fitted_base(
    model: Model, data: Dataset, used: tuple[Mask, ...], input: str, output: str, *, difference: bool = False
) -> Base:
    """Return a model fitted to a record; see `Base`."""
    found = fit(model, data, used)
    problem = Fitting(found.model, data, used, found.initial, difference=difference)
    errors = tuple(problem.errors(problem.start(found.model.values), True))
    return Base(found, errors, data, used, input, output, difference)


@dataclass(frozen=True, eq=False)
class Begun:
    """An effect after a few steps on a base: what decides whether it is fitted to the end.

    Parameters
    ----------
    effect
        Its name.
    criterion
        Of the best extension, see `schwarz`.
    candidates
        The extensions that fit best, the best first.
    """

    effect: str
    criterion: float
    candidates: tuple[_Candidate, ...]
    variants: int

    @property
    def label(self) -> str:
        """Which of the variants fits best so far."""
        return self.candidates[0].extension.label


@dataclass(frozen=True, eq=False)
class _Candidate:
    """An extension with the values and the states before sample 0 that a short fit found."""

    criterion: float
    cost: float
    extension: Extension
    values: Mapping[str, float]
    initial: tuple[Initial, ...]
    signature: float


def try_effect(effect: Effect, base: Base) -> Trial | None:
    """Fit the promising extensions that an effect offers and return the best; None where there is none.

    Raises
    ------
    ModelError
        If no extension can be simulated from any start.
    """
    begun = begin(effect, base)
    return finish(begun, base) if begun else None


def begin(effect: Effect, base: Base, least: float = -np.inf) -> Begun | None:
    """Fit the promising extensions that an effect offers for a few steps; None where there is none.

    Parameters
    ----------
    least
        Nats that the first step of an extension has to promise.

    Raises
    ------
    ModelError
        If no extension can be simulated from any start.
    """
    with np.errstate(all="ignore"):
        ranked, variants, finite = [], 0, False
        for extension in effect.extensions(base.fit.model, base.site()):
            variants += 1
            problem = fitting(extension.model, base)
            scored = _scored(problem, extension, base)
            finite = finite or bool(scored)
            if scored and _promises(least, scored[0][0], problem, extension, base):
                ranked.append((extension, problem, scored))
        if variants and not finite:
            raise ModelError(
                "its model simulates to infinity or NaN from every start: bound its parameters, or give starts that "
                "are nearer to the null values"
            )
        ranked.sort(key=lambda item: -item[2][0][0])
        candidates = []
        for extension, problem, scored in ranked[:_EXTENSIONS]:
            # Adapt only the rest of the model to each start first, so that starts can be compared. For small starts
            # only the signature is informative.
            new = _added(extension.model, base.fit.model)
            first, *others = [problem.solve(vector, _ADAPTING, 1e-2, new) for _, vector in scored[:_ADAPTED]]
            others.sort(key=lambda pair: pair[1])
            fitted = [problem.solve(vector, _SHORT, 1e-4) for vector, _ in (first, *others[: _STARTS - 1])]
            vector, cost = min(fitted, key=lambda pair: pair[1])
            reached, found = schwarz(cost, problem.n_free, base), _values(problem, vector)
            initial = tuple(problem.initial(vector))
            candidates.append(_Candidate(reached, cost, extension, found, initial, scored[0][0]))
        best = sorted(candidates, key=lambda c: c.criterion)[:_FINISHED]
        return Begun(effect.name, best[0].criterion, tuple(best), variants) if best else None


def finish(begun: Begun, base: Base) -> Trial | None:
    """Fit an effect to the end; None where its parameters end outside what they must lie in, or the fit diverges."""
    with np.errstate(all="ignore"):
        tried: list[tuple[float, Trial]] = []
        for candidate in begun.candidates:
            model, problem = candidate.extension.model, _from(candidate, base)
            vector, cost = problem.solve(problem.start(candidate.values), _LONG)
            # Without the effect the fit of the base may be far off: begin from a fit of the whole, too.
            if ahead := one_step_ahead(model, base.data, base.used, starts=1):
                other = _from(candidate, base)
                fresh, less = other.solve(other.start(ahead), _SHORT, 1e-4)
                fresh, less = other.solve(fresh, _LONG) if less < candidate.cost else (fresh, less)
                vector, cost, problem = (fresh, less, other) if less < cost else (vector, cost, problem)
            if np.isfinite(cost) and _is_itself(candidate.extension, problem, vector):
                trial = _trial(
                    begun.effect, candidate.extension, base, problem, vector, cost, candidate.signature, begun.variants
                )
                tried.append((schwarz(cost, problem.n_free, base), trial))
        if not tried:
            return None
        (least, best), *others = sorted(tried, key=lambda item: item[0])
        # The criterion counts two for a nat.
        return replace(best, tied=tuple(trial for criterion, trial in others if criterion <= least + 2 * REACH))


def _promises(least: float, share: float, problem: Fitting, extension: Extension, base: Base) -> bool:
    """Return whether a first step promises some nats, less what as many parameters gain by chance.

    Where no start promises them, steps are tried from near the base model, where the linear approximation holds.
    """
    n = sum(int(u.sum()) for u in base.used)
    needed = 1.0 - float(np.exp(-2.0 * (least + 0.5 * len(_added(extension.model, base.fit.model))) / n))
    known, nulls = _known(extension, base), {p.name: p.null for p in extension.model.parameters if p.null is not None}
    near = (
        {name: nulls[name] + _NEAR * (value - nulls[name]) if name in nulls else value for name, value in start.items()}
        for start in extension.starts
    )
    return share > needed or any(
        problem.explained(problem.start({**known, **start}), base.fit.cost) > needed for start in near
    )


def _is_itself(extension: Extension, problem: Fitting, vector: Array) -> bool:
    """Return whether all parameters lie where the effect is not another one."""
    values = _values(problem, vector)
    return all(low < values[name] < high for name, (low, high) in extension.inside.items())


def refit(effect: Effect, trial: Trial, base: Base, values: Mapping[str, float] | None = None) -> Trial | None:
    """Return an effect fitted to another base in the same way; None where it does not apply or diverges."""
    with np.errstate(all="ignore"):
        same = [
            extension
            for extension in effect.extensions(base.fit.model, base.site())
            if extension.label == trial.label and len(_added(extension.model, base.fit.model)) == len(trial.parameters)
        ]
        if not same:
            return None
        # The effects that it stood among may be missing.
        extension = next((one for one in same if one.place == trial.place), same[0])
        problem, known = fitting(extension.model, base), _known(extension, base)
        own = dict(zip(_added(extension.model, base.fit.model), trial.values.values(), strict=True))
        starts = [{**known, **own}, *([{**known, **own, **values}] if values else [])]
        fitted = [problem.solve(problem.start(start), _LONG) for start in starts]
        vector, cost = min(fitted, key=lambda pair: pair[1])
        if np.isfinite(cost) and problem.result(vector, cost).is_finite:
            return _trial(effect.name, extension, base, problem, vector, cost, trial.signature, trial.variants)
    return None


def _trial(
    effect: str,
    extension: Extension,
    base: Base,
    problem: Fitting,
    vector: Array,
    cost: float,
    signature: float,
    variants: int,
) -> Trial:
    fit, errors = problem.result(vector, cost), tuple(problem.errors(vector, True))
    added = _added(extension.model, base.fit.model)
    return Trial(effect, extension.label, fit, added, signature, errors, variants, extension.describe, extension.place)


def _added(extended: Model, model: Model) -> tuple[str, ...]:
    old = {p.name for p in model.parameters if p.lower < p.upper}
    return tuple(p.name for p in extended.parameters if p.name not in old and p.lower < p.upper)


def fitting(model: Model, base: Base) -> Fitting:
    """Return the fit of a model to what a base was fitted to, from the initial states of its fit."""
    return Fitting(model, base.data, base.used, base.fit.initial, difference=base.difference)


def _from(candidate: _Candidate, base: Base) -> Fitting:
    return Fitting(candidate.extension.model, base.data, base.used, candidate.initial, difference=base.difference)


def _values(problem: Fitting, vector: Array) -> dict[str, float]:
    return dict(zip(problem.run.parameters, vector.tolist(), strict=False))


def _known(extension: Extension, base: Base) -> dict[str, float]:
    # Parameters that an extension does not name start at the base's value, or in the middle of the box.
    middle = {p.name: 0.5 * (p.lower + p.upper) for p in extension.model.parameters if np.isfinite(p.upper - p.lower)}
    return middle | dict(base.fit.model.values)


def _scored(problem: Fitting, extension: Extension, base: Base) -> list[tuple[float, Array]]:
    """Return the starts with their signatures, best first."""
    known, scored = _known(extension, base), []
    for start in extension.starts:
        vector = problem.start({**known, **start})
        share = problem.explained(vector, base.fit.cost)
        if np.isfinite(share):
            scored.append((share, vector))
    return sorted(scored, key=lambda pair: -pair[0])


def schwarz(cost: float, n_free: int, base: Base) -> float:
    """Return Schwarz's information criterion over the fitted samples, up to a constant."""
    n = sum(int(u.sum()) for u in base.used) * len(base.fit.simulated[0])
    return float(n * np.log(max(cost, 1e-300)) + n_free * np.log(n)) if np.isfinite(cost) else np.inf
