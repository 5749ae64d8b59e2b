"""Causes with evidence and sentences, from the result of a search."""

from __future__ import annotations

import numpy as np

from smid.diagnosis.cause import Cause, CauseParameter, Rival
from smid.diagnosis.effects.effect import Detection, Effect, Site
from smid.diagnosis.search.compare import correlation_length, structure
from smid.diagnosis.search.merit import Ranked, Record, Stage
from smid.diagnosis.search.search import Found
from smid.diagnosis.search.trial import Trial
from smid.fitting.fit import Fitting

_SPREAD = 3.0  # standard deviations either side
_MOST_RIVALS = 5
_MOST_ODDS = 1e12


def causes(record: Record, found: Found, site: Site) -> list[Cause]:
    """Return the named effects with evidence; where ambiguous, the last lists the equally good effects as rivals."""
    named = [stage for stage in found.stages if stage.leader is not None]
    result = []
    for stage in named:
        assert stage.leader is not None
        trial = stage.leader.trial
        values = {n: found.base.fit.model.values.get(n, v) for n, v in trial.values.items()}
        result.append(
            Cause(
                trial.effect,
                trial.label,
                trial.describe(values, site) if trial.describe else "",
                _confidence(stage),
                _parameters(record, trial),
                _rivals(stage),
                _evidence(record, stage),
            )
        )
    return result


def _evidence(record: Record, stage: Stage) -> dict[str, float]:
    leader = stage.leader
    assert leader is not None
    before = record.residual(stage.base.fit)
    after = record.residual(leader.trial.fit)
    return {
        "rmse_before": stage.rmse,
        "rmse_after": leader.rmse,
        "chance": leader.chance,
        "score_drop": stage.score - leader.score,
        "structure_before": structure(record.held_part(before)),
        "structure_after": structure(record.held_part(after)),
        "signature": leader.trial.signature,
    }


def _confidence(stage: Stage) -> float:
    """Return the leader's share of the odds among all effects tried, times the probability that the gain is real."""
    leader = stage.leader
    assert leader is not None
    behind = np.array([r.score - leader.score for r in stage.ranked if r is not leader])
    return float((1 - leader.chance) / (1 + np.exp(-np.clip(behind, -1400, 1400) / 2).sum()))


def _rivals(stage: Stage) -> tuple[Rival, ...]:
    leader = stage.leader
    assert leader is not None
    tied = {r.trial.effect for r in stage.tied}
    shown = [*stage.tied, *(r for r in stage.ranked if r is not leader and r.trial.effect not in tied)]
    return tuple(
        Rival(
            r.trial.effect,
            r.rmse,
            float(min(np.exp(min((r.score - leader.score) / 2, 100.0)), _MOST_ODDS)),
            _why(r, leader, r.trial.effect in tied),
        )
        for r in shown[: max(_MOST_RIVALS, len(tied))]
    )


def _why(rival: Ranked, leader: Ranked, tied: bool) -> str:
    if tied:
        return f"explains the data equally well: held-out RMSE {rival.rmse:.4g}, against {leader.rmse:.4g}"
    more = len(rival.trial.parameters) - len(leader.trial.parameters)
    if rival.rmse <= 1.02 * leader.rmse and more > 0:
        return f"rejected: {more} more parameter{'s' if more > 1 else ''} for the same held-out RMSE {rival.rmse:.4g}"
    return f"rejected: held-out RMSE {rival.rmse:.4g}, against {leader.rmse:.4g}"


def _parameters(record: Record, trial: Trial) -> tuple[CauseParameter, ...]:
    """Return the effect's parameters with the linearised intervals of the fit that named it."""
    model = trial.fit.model
    problem = Fitting(model, record.data, record.used, trial.fit.initial)
    vector = problem.start(model.values)
    spread = _deviations(problem, vector, correlation_length(record.fitted_part(record.residual(trial.fit))))
    result = []
    for name in trial.parameters:
        parameter = model.parameter(name)
        half = _SPREAD * spread[problem.run.parameters.index(name)]
        value = model.values[name]
        finite = np.isfinite(half)
        result.append(
            CauseParameter(
                name,
                parameter.unit,
                value,
                float(max(value - half, parameter.lower)) if finite else None,
                float(min(value + half, parameter.upper)) if finite else None,
                parameter.null,
                False,
            )
        )
    return tuple(result)


def _deviations(problem: Fitting, vector: np.ndarray, correlated: float) -> np.ndarray:
    """Return standard deviations of the fitted numbers, infinite where the data do not determine them."""
    jacobian, residual = problem.jacobian(vector), problem.residual(vector)
    norms = np.linalg.norm(jacobian, axis=0)
    deviations = np.full(problem.n_free, np.inf)
    seen = (norms > 0) & np.isfinite(norms)
    if seen.any() and np.isfinite(jacobian[:, seen]).all():
        scaled = jacobian[:, seen] / norms[seen]
        inverse = np.linalg.pinv(scaled.T @ scaled, rcond=1e-12, hermitian=True)
        variance = float(np.sum(residual**2)) / max(len(residual) - problem.n_free, 1) * correlated
        deviations[seen] = np.sqrt(np.maximum(np.diag(inverse), 0) * variance) / norms[seen]
    return deviations


def detected(effect: Effect, detection: Detection, site: Site, stage_rmse: float) -> Cause:
    """Return the cause for a detected effect on the noise."""
    parameters = tuple(
        CauseParameter(name, "", float(value), None, None, None, False) for name, value in detection.values.items()
    )
    evidence = {"rmse_before": stage_rmse, "rmse_after": stage_rmse, **detection.evidence}
    said = effect.describe(detection.values, site) if effect.describe else ""
    return Cause(effect.name, "", said, detection.confidence, parameters, (), evidence)
