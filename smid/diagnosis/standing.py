"""Where effects stand against each other: scores, ranks, and what may be named.

See `smid.diagnosis.search` for the score and its thresholds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from smid.data import Dataset
from smid.diagnosis.compare import chance, correlation_length, rms
from smid.diagnosis.effects.effect import Array, Effect, Mask
from smid.diagnosis.experiment import separating_experiment
from smid.diagnosis.trial import Base, Trial
from smid.fit import Fit

MARGIN = 20.0
TIE = 6.0
_CHANCE = 0.01
_LEAST_GAIN = 0.01
_PROVISIONAL, _PROVISIONAL_CHANCE = 0.8, 0.1


@dataclass(frozen=True, eq=False)
class Record:
    """The data as the search uses them.

    Parameters
    ----------
    data : Dataset
    used, held : tuple of ndarray of bool, shape (n,)
        Per experiment, the samples that may be fitted, and those kept back.
    input, output : str
        Main channels.
    noise_bound : float or None
        Of the output, in its unit.
    """

    data: Dataset
    used: tuple[Mask, ...]
    held: tuple[Mask, ...]
    input: str
    output: str
    noise_bound: float | None = None

    def fitted_part(self, residual: Sequence[Array]) -> list[Array]:
        """Cut a residual to the samples that were fitted."""
        return [r[u] for r, u in zip(residual, self.used, strict=True) if u.any()]

    def held_part(self, residual: Sequence[Array]) -> list[Array]:
        """Cut a residual to the samples that were kept back."""
        return [r[h] for r, h in zip(residual, self.held, strict=True) if h.any()]

    def score(self, residual: Sequence[Array], n_free: int, shrink: float) -> float:
        """Return the score of a model from its residual; infinite where it runs away."""
        fitted, held = self.fitted_part(residual), self.held_part(residual)
        n, m = (sum(map(len, part)) / shrink for part in (fitted, held))
        with np.errstate(all="ignore"):
            value = 2 * n * np.log(rms(fitted)) + 2 * m * np.log(rms(held)) + n_free * np.log(n)
        return float(value) if np.isfinite(value) else np.inf


@dataclass(frozen=True, eq=False)
class Ranked:
    """A trial with its standing.

    Parameters
    ----------
    trial : Trial
    score : float
        Less is better.
    rmse : float
        Held out, in the output's unit.
    chance : float
        Probability that its held-out gain over the current model is chance.
    """

    trial: Trial
    score: float
    rmse: float
    chance: float


@dataclass(frozen=True, eq=False)
class Stage:
    """One round of the search.

    Parameters
    ----------
    base : Base
        What all effects were put on.
    score, rmse : float
        Of the base; the RMSE held out.
    ranked : tuple of Ranked
        All effects that could be fitted, best first.
    leader : Ranked or None
        The one that is named.
    tied : tuple of Ranked
        Effects that explain the data as well as the leader.
    """

    base: Base
    score: float
    rmse: float
    ranked: tuple[Ranked, ...]
    leader: Ranked | None
    tied: tuple[Ranked, ...]


def differs(record: Record, first: Fit, second: Fit) -> bool:
    """Tell whether an experiment could separate two models: their predictions differ by more than the error left."""
    experiment = separating_experiment({"first": first, "second": second}, record.data, record.input, record.output)
    left = rms(record.held_part(first.residual(record.data, record.output)))
    return experiment is None or experiment.difference > left


def rank(record: Record, residual: Sequence[Array], trials: Sequence[Trial], shrink: float) -> list[Ranked]:
    """Return trials with their standing, best first; those that run away are left out."""
    before, ranked = record.held_part(residual), []
    for trial in trials:
        rest = trial.fit.residual(record.data, record.output)
        held, score = record.held_part(rest), record.score(rest, trial.fit.n_free, shrink)
        if np.isfinite(score):
            ranked.append(Ranked(trial, score, rms(held), chance(before, held)))
    return sorted(ranked, key=lambda r: r.score)


def shared_shrink(record: Record, residuals: Sequence[Sequence[Array]]) -> float:
    """Return how many samples stand for an independent one in the best model's residual."""
    parts = [record.fitted_part(r) for r in residuals]
    best = min(parts, key=lambda part: rms(part) if np.isfinite(rms(part)) else np.inf)
    return correlation_length(best)


def judge(
    own: float, rmse: float, ranked: Sequence[Ranked], effects: Sequence[Effect]
) -> tuple[Ranked | None, tuple[Ranked, ...]]:
    """Return the effect that may be named, if any, and those that do as well."""
    margin = MARGIN + 2 * np.log(max(len(ranked), 1))
    passing = [
        r for r in ranked if own - r.score > margin and r.chance <= _CHANCE and r.rmse < (1 - _LEAST_GAIN) * rmse
    ] or [r for r in ranked if own > r.score and r.chance <= _PROVISIONAL_CHANCE and r.rmse < _PROVISIONAL * rmse]
    if not passing:
        return None, ()
    contains = {e.name: e.contains for e in effects}
    leader = passing[0]
    close = [r for r in passing[1:] if r.score - leader.score < TIE]
    # Of a general effect and its special case, equally good, the special case is what the data show.
    special = next((r for r in close if r.trial.effect in contains[leader.trial.effect]), None)
    if special is not None:
        leader, close = special, [passing[0], *(r for r in close if r is not special)]
    return leader, tuple(r for r in close if leader.trial.effect not in contains[r.trial.effect])


def drop(found: Stage) -> float:
    """Return by how much the leader lowers the score; 0 without one."""
    return found.score - found.leader.score if found.leader is not None else 0.0


def weigh(
    record: Record, reduced: Base, trial: Trial, rivals: Sequence[Trial], shrink: float, by_name: dict[str, Effect]
) -> Stage:
    """Return a stage that weighs a cause against its rivals beside all other causes."""
    residual = reduced.fit.residual(record.data, record.output)
    ranked = rank(record, residual, [trial, *rivals], shrink)
    leader = next(r for r in ranked if r.trial is trial)
    tied = tuple(
        r
        for r in ranked
        if r is not leader
        and r.score < leader.score + TIE
        and trial.effect not in by_name[r.trial.effect].contains
        and differs(record, trial.fit, r.trial.fit)
    )
    score = fit_score(record, reduced.fit, shrink)
    return Stage(reduced, score, rms(record.held_part(residual)), tuple(ranked), leader, tied)


def fit_score(record: Record, fit: Fit, shrink: float) -> float:
    """Return the score of a fit."""
    return record.score(fit.residual(record.data, record.output), fit.n_free, shrink)


def stage_of(record: Record, base: Base, trial: Trial, shrink: float) -> Stage:
    """Return the stage that one trial makes."""
    residual, rest = (f.residual(record.data, record.output) for f in (base.fit, trial.fit))
    before, held = record.held_part(residual), record.held_part(rest)
    leader = Ranked(trial, fit_score(record, trial.fit, shrink), rms(held), chance(before, held))
    return Stage(base, fit_score(record, base.fit, shrink), rms(before), (leader,), leader, ())
