"""Scores and ranks of effects, and which may be named.

See `smid.diagnosis.search.search` for the score and its thresholds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from relaxations.algebra.arrays import Array, Mask
from smid.data import Dataset
from smid.diagnosis.effects.effect import Effect, Site
from smid.diagnosis.evidence.autoregression import autoregression_of
from smid.diagnosis.experiment import separating_experiment
from smid.diagnosis.search.compare import chance, rms
from smid.diagnosis.search.trial import Base, Trial
from smid.fitting.fit import Fit, Fitting
from smid.fitting.minimax import minimax

MARGIN = 20.0
TIE = 6.0
_CHANCE = 0.01
_LEAST_GAIN = 0.01
_PROVISIONAL, _PROVISIONAL_CHANCE = 0.8, 0.1
_HALF = 0.5
_BEYOND = 1.05  # the noise bound; what a model integrates or interpolates in its own way adds a little to the noise


@dataclass(frozen=True, eq=False)
class Record:
    """The data as the search uses them.

    Parameters
    ----------
    used, held
        Shape (n,). Per experiment, the samples that may be fitted, and those kept back.
    input, output
        Main channels.
    noise_bound
        Of the output, in its unit.
    """

    data: Dataset
    used: tuple[Mask, ...]
    held: tuple[Mask, ...]
    input: str
    output: str
    noise_bound: float | None = None

    def residual(self, fit: Fit) -> tuple[Array, ...]:
        """Return measured minus simulated output of a fit, per experiment."""
        return fit.residual(self.data, self.output)

    def site(self, fit: Fit) -> Site:
        """Return the site for effects on the noise: the residual of all samples."""
        return Site(self.data, self.input, self.output, self.residual(fit))

    def fitted_part(self, residual: Sequence[Array]) -> list[Array]:
        """Cut a residual to the samples that were fitted."""
        return [r[u] for r, u in zip(residual, self.used, strict=True) if u.any()]

    def held_part(self, residual: Sequence[Array]) -> list[Array]:
        """Cut a residual to the samples that were kept back."""
        return [r[h] for r, h in zip(residual, self.held, strict=True) if h.any()]

    def score(self, fit: Fit) -> float:
        """Return the score of a fit; infinite where the simulation diverges."""
        residual = self.residual(fit)
        if not all(np.isfinite(r).all() for r in residual):
            return np.inf
        counted = [u | h for u, h in zip(self.used, self.held, strict=True)]
        bridged = [_bridged(r, c) for r, c in zip(residual, counted, strict=True)]
        noise = autoregression_of(self.fitted_part(bridged))
        past = noise.coefficients.size - 1
        white = [np.concatenate([np.full(past, np.nan), noise.whiten(r)]) for r in bridged]
        fitted, held = (
            np.concatenate([w[kept] for w, kept in zip(white, part, strict=True)]) for part in (self.used, self.held)
        )
        n, m = fitted.size, held.size
        with np.errstate(all="ignore"):
            spread = n * np.log(np.nanmean(fitted**2)) + m * np.log(np.nanmean(held**2))
            value = float(spread + (fit.n_free + past) * np.log(n))
        return value if np.isfinite(value) else np.inf

    def excess(self, fit: Fit) -> float:
        """Return by what factor the noise would have to exceed its bound for parameters near a fit; 1 for none.

        Of the fitted samples; 1 as well where no bound is known.
        """
        if self.noise_bound is None or len(fit.model.output_channels) > 1:
            return 1.0
        within = _BEYOND * self.noise_bound
        if max(float(np.abs(part).max()) for part in self.fitted_part(self.residual(fit))) <= within:
            return 1.0
        problem = Fitting(fit.model, self.data, self.used, fit.initial)
        _, largest = minimax(problem, problem.start(fit.model.values))
        return max(largest * problem.scale[self.output] / within, 1.0)

    def merit(self, fit: Fit) -> float:
        """Return the score of a finished model, plus the loss of likelihood where it needs a larger noise bound."""
        return self.score(fit) + 2 * sum(int(u.sum()) for u in self.used) * float(np.log(self.excess(fit)))


def _bridged(residual: Array, counted: Mask) -> Array:
    """Interpolate samples that do not count: glitches and the warm-up."""
    where = np.flatnonzero(counted)
    return np.interp(np.arange(residual.size), where, residual[where]) if where.size else residual


@dataclass(frozen=True, eq=False)
class Ranked:
    """A trial with its score.

    Parameters
    ----------
    score
        Less is better.
    rmse
        Held out, in the output's unit.
    chance
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
    base
        What all effects were put on.
    score, rmse
        Of the base; the RMSE held out.
    ranked
        All effects that could be fitted, best first.
    leader
        The one that is named.
    tied
        Effects that explain the data as well as the leader.
    runners_up
        Effects that would be named if it were not for the leader, best first.
    carries
        Whether the leader by itself lowers the held-out error.
    """

    base: Base
    score: float
    rmse: float
    ranked: tuple[Ranked, ...]
    leader: Ranked | None = None
    tied: tuple[Ranked, ...] = ()
    runners_up: tuple[Ranked, ...] = ()
    carries: bool = True


def differs(record: Record, first: Fit, second: Fit) -> bool:
    """Return whether an experiment could separate two models: their predictions differ by more than the error left."""
    experiment = separating_experiment({"first": first, "second": second}, record.data, record.input, record.output)
    left = rms(record.held_part(record.residual(first)))
    return experiment is None or experiment.difference > left


def standing(record: Record, base: Fit, trial: Trial) -> Ranked:
    """Return a trial with its score over a base; infinite where the simulation diverges."""
    before, after = (record.held_part(record.residual(f)) for f in (base, trial.fit))
    return Ranked(trial, record.score(trial.fit), rms(after), chance(before, after))


def rank(record: Record, base: Fit, trials: Sequence[Trial]) -> list[Ranked]:
    """Return trials with their scores, best first; those that diverge are left out."""
    with np.errstate(all="ignore"):
        ranked = [standing(record, base, trial) for trial in trials]
    return sorted((r for r in ranked if np.isfinite(r.score)), key=lambda r: r.score)


def judge(found: Stage, effects: Sequence[Effect]) -> Stage:
    """Return a stage with the effect that may be named, the equally good effects, and the runners-up."""
    own, rmse, ranked = found.score, found.rmse, found.ranked
    margin = MARGIN + 2 * np.log(max(len(ranked), 1))
    sure = [r for r in ranked if own - r.score > margin and r.chance <= _CHANCE and r.rmse < (1 - _LEAST_GAIN) * rmse]
    likely, most = [r for r in ranked if own > r.score], _PROVISIONAL * rmse
    promising = [r for r in likely if r.chance <= _PROVISIONAL_CHANCE and r.rmse < most]
    passing = sure or promising
    # An effect that is likelier by far but does not carry over comes before what does: that may be no cause either.
    if not passing or passing[0].score - ranked[0].score > MARGIN:
        first = ranked[0] if ranked and own - ranked[0].score > margin else None
        return replace(found, leader=first, runners_up=tuple(passing), carries=False)
    contains = {e.name: e.contains for e in effects}
    leader = passing[0]
    close = [r for r in passing[1:] if r.score - leader.score < TIE]
    special = _special(passing, contains)
    if special is not None:
        leader, close = special, [r for r in passing if r is not special and abs(r.score - special.score) < TIE]
    # What contains the leader is no rival where they do as well; where the leader is not enough it may be.
    tied = [r for r in close if leader.trial.effect not in contains[r.trial.effect]]
    rest = [r for r in dict.fromkeys((*passing, *promising)) if r is not leader and r not in close]
    return replace(found, leader=leader, tied=tuple(tied), runners_up=tuple(rest))


def _special(passing: Sequence[Ranked], contains: Mapping[str, Sequence[str]]) -> Ranked | None:
    """Return the special case that explains nearly as much as the general effects before it."""
    for one in passing[1:]:
        ahead = [r for r in passing if r.score < one.score - TIE] or passing[:1]
        is_special = all(one.trial.effect in contains[r.trial.effect] for r in ahead)
        if is_special and one.score - passing[0].score < MARGIN:
            return one
    return None


def drop(found: Stage) -> float:
    """Return by how much the leader lowers the score; 0 without one."""
    return found.score - found.leader.score if found.leader is not None else 0.0


def carries_over(record: Record, base: Base, extended: Base) -> bool:
    """Return whether causes halve the held-out error significantly, for a first cause that did not lower it alone."""
    before, after = (record.held_part(record.residual(b.fit)) for b in (base, extended))
    return rms(after) < _HALF * rms(before) and chance(before, after) <= _CHANCE


def errs_more(record: Record, one: Fit, other: Fit) -> bool:
    """Return whether another fit has a held-out error lower by a fifth or more."""
    first, second = (rms(record.held_part(record.residual(f))) for f in (one, other))
    return second < _PROVISIONAL * first


def weigh(
    record: Record, reduced: Base, trial: Trial, rivals: Sequence[Trial] = (), by_name: Mapping[str, Effect] = {}
) -> Stage:
    """Return a stage that weighs a cause against its rivals beside all other causes."""
    leader = standing(record, reduced.fit, trial)
    ranked = sorted([leader, *rank(record, reduced.fit, rivals)], key=lambda r: r.score)
    close = [r for r in ranked if r is not leader and r.score < leader.score + TIE]
    merit = record.merit(trial.fit) if close else np.inf
    tied = tuple(
        r
        for r in close
        if record.merit(r.trial.fit) < merit + TIE
        and trial.effect not in by_name[r.trial.effect].contains
        and differs(record, trial.fit, r.trial.fit)
    )
    rmse = rms(record.held_part(record.residual(reduced.fit)))
    return Stage(reduced, record.score(reduced.fit), rmse, tuple(ranked), leader, tied)
