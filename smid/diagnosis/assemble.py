"""Causes with evidence and sentences, from the result of a search."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from relaxations.algebra.arrays import Array
from smid.diagnosis.cause import SAME, Cause, CauseParameter, Rival
from smid.diagnosis.effects.effect import Describe, Detection, Effect, Site
from smid.diagnosis.effects.input_noise import in_the_record
from smid.diagnosis.search.compare import chance, rms, spread, structure
from smid.diagnosis.search.evidence import Evidence
from smid.diagnosis.search.guarded import Failure, guarded
from smid.diagnosis.search.posterior import Posterior
from smid.diagnosis.search.ranking import Visited
from smid.diagnosis.search.record import Record
from smid.diagnosis.search.trial import Trial
from smid.fitting.problem import Fit

_SPREAD = 3.0  # standard deviations either side
_GROWN = 2.0  # noise may be so many times as large on the test part: levels and inputs differ there
_MOST_RIVALS = 5
_MOST_ODDS = 1e12
_LIKE = 1.02  # errors whose ratio is smaller are alike

Residual = Sequence[Array]


def ordered(found: Posterior, visited: Sequence[Visited]) -> list[tuple[Trial, Visited | None]]:
    """Return the effects of the chosen set with the set that lacks only this one: what is missed most comes first.

    Where ambiguous, the alternative comes last.
    """
    pairs = [(trial, _lacking(found, visited, [trial.effect])) for trial in found.chosen.effects.trials]
    open_question = found.alternatives[:1]
    return sorted(
        pairs, key=lambda pair: (pair[0].effect in open_question, pair[1].merit if pair[1] is not None else -np.inf)
    )


def too_small(
    found: Posterior,
    visited: Sequence[Visited],
    error: Callable[[Visited | None], float],
    after: float,
    noticed: float,
    heard: str | None = None,
) -> list[Trial]:
    """Return the effects of the chosen set that the test part does not show.

    The one that is missed least is judged first, and each without those before it: two that stand in for one another
    are not both too small.

    Parameters
    ----------
    error
        Of a set on the test part; of the base model where a set was not visited.
    after
        The error of the chosen set.
    noticed
        An error that is larger by this shows.
    heard
        An effect on the noise that the residual shows too. It is not among them: most of the noise stays in the error.
    """
    shown = {*found.alternatives, heard}
    small: list[Trial] = []
    for trial, _ in reversed(ordered(found, visited)):
        rest = _lacking(found, visited, [trial.effect, *(other.effect for other in small)])
        if trial.effect not in shown and not error(rest) - after > noticed:
            small.append(trial)
    return small


def has_grown(chosen: Visited, record: Record, after: Residual) -> bool:
    """Return whether the chosen set errs so much more on the test part that this is not the noise that it tells."""
    return rms(after) - _SPREAD * spread(after) > _GROWN * _error(chosen, record)


def _lacking(found: Posterior, visited: Sequence[Visited], effects: Sequence[str]) -> Visited | None:
    """Return the set that lacks only some effects of the chosen one; None where it was not visited."""
    rest = Counter(found.chosen.names)
    rest.subtract(effects)
    wanted = tuple(sorted(rest.elements()))
    return next((one for one in visited if one.names == wanted), None)


def cause_of(
    trial: Trial,
    found: Posterior,
    without: Visited | None,
    visited: Sequence[Visited],
    record: Record,
    fit: Fit,
    errors: tuple[Residual, Residual],
) -> Cause:
    """Return the cause that an effect of the chosen set is.

    Parameters
    ----------
    without
        The set that lacks only this effect.
    fit
        The chosen set at its likeliest.
    errors
        On the test part, without and with this effect beside the others.
    """
    before, after = errors
    values = {name: fit.model.values[name] for name in trial.parameters}
    lost = found.chosen.merit - without.merit if without is not None else 0.0
    evidence = {
        "rmse_before": rms(before),
        "rmse_after": rms(after),
        "fit_rmse_before": _error(without, record) if without is not None else np.nan,
        "fit_rmse_after": _error(found.chosen, record),
        "chance": chance(before, after),
        "score_drop": 2 * lost,
        "structure_before": structure(before),
        "structure_after": structure(after),
        "signature": trial.signature,
    }
    said = _sentence(trial.effect, trial.describe, values, record.site(fit))
    return Cause(
        trial.effect,
        ", ".join(filter(None, (trial.label, trial.place))),
        said,
        found.probability[trial.effect],
        _parameters(trial, fit, found.chosen.evidence),
        _rivals(trial, found, visited, record),
        evidence,
    )


def _sentence(effect: str, describe: Describe | None, values: Mapping[str, float], site: Site) -> str:
    said = guarded(effect, describe, values, site) if describe else ""
    return f"Its description failed: {said.reason}." if isinstance(said, Failure) else said


def _rivals(trial: Trial, found: Posterior, visited: Sequence[Visited], record: Record) -> tuple[Rival, ...]:
    """Return the effects that were tried in the place of one, best first."""
    own = Counter(found.chosen.names)
    rivals = []
    for one in visited:
        extra, missing = Counter(one.names) - own, own - Counter(one.names)
        if extra.total() == 1 and missing == Counter([trial.effect]):
            (name,) = extra
            behind = found.chosen.merit - one.merit
            odds = float(min(np.exp(min(behind, 100.0)), _MOST_ODDS))
            error = _error(one, record)
            why, fitted = _why(name, behind, error, found, one, record), one.effects.fit.model
            on_noise = one.effects.detected or in_the_record(fitted, record.data) is not fitted
            rivals.append(Rival(name, error, odds, why, None if on_noise else fitted))
    return tuple(rivals[:_MOST_RIVALS])


def _why(name: str, behind: float, error: float, found: Posterior, one: Visited, record: Record) -> str:
    """Return in a short phrase why an effect is not named; its error stands beside the phrase."""
    chosen = _error(found.chosen, record)
    if name in found.alternatives:
        return "explains the data equally well"
    if one in found.synonyms or behind <= 0:
        return SAME
    more = one.effects.fit.n_free - found.chosen.effects.fit.n_free
    if error * _LIKE < chosen:
        return "less likely under the noise of this record, although its error is smaller"
    if error > _LIKE * chosen:
        return "rejected: it leaves a larger error"
    if more > 0:
        return f"less likely: it fits {more} more parameter{'s' if more > 1 else ''} for the same error"
    return "less likely: it predicts blocks that were left out worse"


def _error(one: Visited, record: Record) -> float:
    return rms(record.part(record.residual(one.effects.fit)))


def _parameters(trial: Trial, fit: Fit, known: Evidence | None) -> tuple[CauseParameter, ...]:
    """Return the effect's parameters with the linearised intervals of the joint fit."""
    model = fit.model
    free = [p.name for p in model.parameters if p.lower < p.upper]
    result = []
    for name in trial.parameters:
        p, value = model.parameter(name), model.values[name]
        half = _SPREAD * float(known.deviation[free.index(name)]) if known is not None else np.inf
        lower, upper = (max(value - half, p.lower), min(value + half, p.upper)) if np.isfinite(half) else (None, None)
        result.append(CauseParameter(name, p.unit, value, lower, upper, p.null, False))
    return tuple(result)


def detected(effect: Effect, detection: Detection, site: Site, probability: float, rmse: float) -> Cause:
    """Return the cause for a detected effect on the noise."""
    parameters = tuple(
        CauseParameter(name, "", float(value), None, None, None, False) for name, value in detection.values.items()
    )
    evidence = {"rmse_before": rmse, "rmse_after": rmse, **detection.evidence}
    said = _sentence(effect.name, effect.describe, detection.values, site)
    return Cause(effect.name, "", said, probability, parameters, (), evidence)
