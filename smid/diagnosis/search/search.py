"""The search for causes: try every effect, name the one that explains most, and again on the extended model.

At each stage all effects are fitted to what the current model leaves (`smid.diagnosis.search.trial`).  They are
ranked by

    score = n_f log(mean square, fitted part) + n_h log(mean square, held-out part) + k log n_f

over n_f fitted and n_h held-out samples of the residual after an autoregression of its own, fitted to the fitted part,
has taken out what its past tells; k counts the numbers fitted, the autoregression's too.  It is twice the negative log
likelihood of correlated noise, with Schwarz's penalty: a further parameter has to pay for itself, and what does not
carry over to held-out data loses.  Without the autoregression the slow part of a residual, a fraction of its power in
noise but nearly all of it in the error of a free run, would drown what an effect explains.  The leader is named if

1. the score falls by more than chance gives among all effects tried (`MARGIN`, plus twice the log of their number),
2. the held-out error falls, by block bootstrap,
3. no effect that fails the second test is likelier by more than `MARGIN`, and
4. no rival comes within `TIE` of it; else the verdict is "ambiguous". A general effect has to be likelier than its
  special case by `MARGIN`.  A rival from which no experiment within the
   recorded range would tell the leader (their predictions differ by less than the error that is left) is the same
   equation under another name, and no rival: a decay with y^2 is a quadratic drag.

Two scores that differ by `TIE` = 6 stand for odds of 20 to 1, `MARGIN` = 20 for odds of 20000 to 1; both are
customary sizes for Schwarz's criterion and not fitted to any record.

While several causes are missing, the best of them may gain less than test 1 asks.  Then a leader that takes a
fifth off the held-out error is followed *provisionally*; it has to pass test 1 at the end, when all is found.  Or it
may pass test 1 and not lower the held-out error until the others are there: then what is found in the end has to halve
it, or the path is cut before that leader.  Where that leaves nothing, a way that begins with a less likely effect is
taken if it halves the held-out error itself, or ends likelier than the first way began.

Rivals that tie while other causes are still missing are each followed to the end, and the paths compared there; so are
the runners-up where the leader's path ends with more than noise left: two frictions may look like one drag. A path that
ends in a model which no parameters nearby bring within the noise bound (`smid.fitting.minimax`) is judged by the
bound that it needs as well: what the noise cannot be is evidence that least squares do not see, and all there is
where two models err slowly and far. After each further cause all are put to the test again (*backward deletion*):
each is left out, and dropped if it is not missed, or replaced if another effect does better beside the rest.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import Progress, TimeIsUp, map_in_time
from smid.diagnosis.effects.effect import Effect
from smid.diagnosis.search.compare import rms, structure
from smid.diagnosis.search.merit import (
    MARGIN,
    TIE,
    Ranked,
    Record,
    Stage,
    carries_over,
    differs,
    drop,
    errs_more,
    judge,
    rank,
    weigh,
)
from smid.diagnosis.search.trial import QUICK, THOROUGH, Base, Effort, Trial, refit, try_effect

_WHITE = 0.05
_PROMISING, _CARRYING = 8, 3
_FILTERED = 0.6
_NEARLY = 1.05  # the least bound is sought nearby, and may be missed by a little
_FOLLOWED = 2
_RECONSIDERED = 5
MOST_CAUSES = 4


@dataclass(frozen=True, eq=False)
class Found:
    """The result of a search.

    Parameters
    ----------
    stages
        One for each named cause, the largest gain first; or the first round alone, where it named nothing.
    base
        The extended model.
    dropped
        Effects that were named first and withdrawn later, because the others explain the data without them.
    """

    stages: tuple[Stage, ...]
    base: Base
    dropped: tuple[str, ...]
    interrupted: bool


def search(
    record: Record,
    base: Base,
    effects: Sequence[Effect],
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Found:
    """Return the causes, searched until no effect explains more."""
    path = _Path((), base, ())
    try:
        first = _stage(record, base, effects, executor, progress) if not _is_noise(record, base) else None
        if first is None or first.leader is None:
            return Found((first,) if first else (), base, (), False)
        path = _Path((replace(first, tied=()),), base.extended(first.leader.trial), ())
        if _noise_explains_more(record, first, effects):
            return Found((replace(first, leader=None, tied=()),), base, (), False)
        # What looks alike while other causes are still missing may not when they are found: follow each. And where
        # the best way ends with more than noise left, the first step may have been the wrong one.
        paths: list[tuple[_Path, float]] = []
        merit = refused = np.inf
        nearest = sorted(first.runners_up, key=lambda r: r.rmse)[:_FOLLOWED]
        for choice in (first.leader, *first.tied[:_FOLLOWED], *nearest):
            if choice in first.runners_up and _is_white(record, path.base) and record.excess(path.base.fit) < _NEARLY:
                break
            begun = _Path((_chosen(first, choice),), base.extended(choice.trial), ())
            _tell(progress, begun.stages[0])
            followed = _follow(record, base, begun, effects, executor, progress)
            # A detour must gain as much as a cause, and so must each additional cause that it names.
            more = max(len(followed.stages) - len(path.stages), 0)
            ahead = MARGIN * (1 + more) if choice in first.runners_up else 0.0
            reached = record.merit(followed.base.fit)
            # An effect that halves the held-out error is named even if another one has a higher likelihood but does
            # not reduce that error.
            is_way_out = not path.stages and carries_over(record, base, followed.base)
            if not paths or is_way_out or reached < min(merit, refused) - ahead:
                path, merit = followed, reached
            if not paths and not path.stages:
                # The leader did not lower the held-out error: a less likely effect is not named in its place.
                refused = record.merit(begun.base.fit)
            paths.append((followed, reached))
        # As good as the best, and an experiment would separate them.
        equal = [p for p, reached in paths if p is not path and abs(reached - merit) < TIE]
        rest = [p for p in equal if differs(record, p.base.fit, path.base.fit)]
        tied = tuple(p.stages[0].leader for p in rest if p.stages and p.stages[0].leader is not None)
        if tied and path.stages:
            path = replace(path, stages=(replace(path.stages[0], tied=tied), *path.stages[1:]))
        if not path.stages:
            return Found((replace(first, leader=None, tied=()),), base, path.dropped, False)
    except (TimeIsUp, KeyboardInterrupt):
        path = _settled(record, path)
        return Found(path.stages, path.base, path.dropped, True)
    return Found(path.stages, path.base, path.dropped, False)


def _chosen(found: Stage, choice: Ranked) -> Stage:
    """Return a stage with another leader; a runner-up counts as one that lowers the held-out error."""
    return replace(found, leader=choice, tied=(), carries=found.carries or choice in found.runners_up)


@dataclass(frozen=True, eq=False)
class _Path:
    """Named causes, the model with them, and the effects that were withdrawn."""

    stages: tuple[Stage, ...]
    base: Base
    dropped: tuple[str, ...]

    @property
    def trials(self) -> tuple[Trial, ...]:
        return tuple(s.leader.trial for s in self.stages if s.leader is not None)


def _follow(
    record: Record,
    start: Base,
    path: _Path,
    effects: Sequence[Effect],
    executor: Executor | None,
    progress: Progress | None,
) -> _Path:
    """Name further causes until no effect explains more, then test each again."""
    while len(path.stages) < MOST_CAUSES and not _is_noise(record, path.base):
        # A withdrawn effect is not tried again: two effects could replace each other without end.
        others = [e for e in effects if e.name not in path.dropped]
        found = _stage(record, path.base, others, executor, progress)
        if found.leader is None or _noise_explains_more(record, found, effects):
            break
        _tell(progress, found)
        path = replace(path, stages=(*path.stages, found), base=path.base.extended(found.leader.trial))
    path = _settled(record, path)
    # A single cause that passed all tests need not be tested again.
    return (
        path
        if len(path.stages) == 1 and _is_sure(path.stages[0])
        else _reconsider(record, start, path, effects, executor)
    )


def _settled(record: Record, path: _Path) -> _Path:
    """Cut a path before the first cause that did not lower the held-out error, unless later causes made it do so."""
    for k, found in enumerate(path.stages):
        if not found.carries and not carries_over(record, found.base, path.base):
            return replace(path, stages=path.stages[:k], base=found.base)
    return path


def _is_sure(found: Stage) -> bool:
    """Return whether a stage's leader passed the test against chance when it was found."""
    return drop(found) > MARGIN


def _noise_explains_more(record: Record, found: Stage, effects: Sequence[Effect]) -> bool:
    """Return whether an effect on the noise makes the residual likelier than a leader that smooths this noise.

    A leader that removes most of the held-out error does not smooth noise.
    """
    assert found.leader is not None
    if found.leader.rmse < _FILTERED * found.rmse:
        return False
    leader = found.leader.trial.effect
    model, site = found.base.fit.model, record.site(found.base.fit)
    drops = [
        d.score_drop
        for e in effects
        if e.detect and leader in e.smoothed_by and (d := e.detect(model, site)) is not None
    ]
    return max(drops, default=0.0) > drop(found)


def _tell(progress: Progress | None, found: Stage) -> None:
    if progress and found.leader is not None:
        progress(f"named {found.leader.trial.effect}: held-out RMSE {found.rmse:.4g} -> {found.leader.rmse:.4g}")


def _is_noise(record: Record, base: Base) -> bool:
    """Return whether only noise is left: all errors within the noise bound, and white."""
    largest = max(float(np.abs(part).max()) for part in _left(record, base))
    # A fit has a small error too: a free run within 1.1 times the bound counts as within it.
    return record.noise_bound is not None and largest <= 1.1 * record.noise_bound and _is_white(record, base)


def _is_white(record: Record, base: Base) -> bool:
    return structure(_left(record, base)) < _WHITE


def _left(record: Record, base: Base) -> list[Array]:
    residual = record.residual(base.fit)
    return [*record.fitted_part(residual), *record.held_part(residual)]


def _try_all(
    effects: Iterable[Effect], base: Base, effort: Effort, executor: Executor | None, progress: Progress | None = None
) -> list[Trial]:
    effects = [e for e in effects if e.detect is None]
    trials = []
    results = map_in_time(executor, partial(try_effect, base=base, effort=effort), effects)
    for effect, trial in zip(effects, results, strict=True):
        if progress:
            progress(f"{effect.name}: " + ("does not apply" if trial is None else f"{trial.signature:.0%} promised"))
        if trial is not None:
            trials.append(trial)
    return trials


def _stage(
    record: Record,
    base: Base,
    effects: Sequence[Effect],
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Stage:
    """Try all effects on a base, quickly, the promising again thoroughly, and judge them."""
    own, rmse = record.score(base.fit), rms(record.held_part(record.residual(base.fit)))
    quick = _try_all(effects, base, QUICK, executor, progress)
    # Where only noise is left, few effects or none are promising.
    least = own if _is_white(record, base) else np.inf
    ranked = rank(record, base.fit, quick)
    # A fit that has not converged may lack slow changes, and with them likelihood.
    carrying = sorted(ranked, key=lambda r: r.rmse)[:_CARRYING]
    promising = {r.trial.effect for r in (*ranked[:_PROMISING], *carrying) if r.score < least}
    thorough = _try_all([e for e in effects if e.name in promising], base, THOROUGH, executor)
    # A thorough trial has converged, and replaces the quick one.
    trials = {t.effect: t for t in [*quick, *thorough]}
    judged = judge(Stage(base, own, rmse, tuple(rank(record, base.fit, [*trials.values()]))), effects)
    leader = judged.leader
    tied = tuple(r for r in judged.tied if leader is not None and differs(record, leader.trial.fit, r.trial.fit))
    return replace(judged, tied=tied)


def _reconsider(
    record: Record, start: Base, path: _Path, effects: Sequence[Effect], executor: Executor | None
) -> _Path:
    """Leave out each cause in turn: drop it if it is not missed, replace it if another does better beside the rest.

    A rival that does nearly as well and makes another cause superfluous takes the place of both; one that does as well
    is noted as tied.
    """
    by_name = {e.name: e for e in effects}
    # Effects that came near at any stage.
    near = dict.fromkeys(
        r.trial.effect for s in path.stages for r in s.ranked[:_RECONSIDERED] if r.trial.effect in by_name
    )
    k = 0
    while k < len(path.stages):
        trials = path.trials
        replayed = _replay(start, [t for i, t in enumerate(trials) if i != k], by_name, path)
        if replayed is None:  # without it the others cannot be simulated
            k += 1
            continue
        reduced, again = replayed
        others = [by_name[n] for n in near if n not in {t.effect for t in trials}]
        alternatives = _try_all(others, reduced, THOROUGH, executor)
        full, without = record.score(path.base.fit), record.score(reduced.fit)
        best = min(
            (t for t in alternatives if not errs_more(record, t.fit, path.base.fit)),
            key=lambda t: record.score(t.fit),
            default=None,
        )
        least = record.score(best.fit) if best is not None else np.inf
        remaining = _renewed((s for i, s in enumerate(path.stages) if i != k), again)
        if without - full < MARGIN:
            path = _Path(remaining, reduced, (*path.dropped, trials[k].effect))
            k = 0
        elif best is not None and least < full - (MARGIN if trials[k].effect in by_name[best.effect].contains else TIE):
            stage = weigh(record, reduced, best)
            path = _Path((*remaining, stage), reduced.extended(best), (*path.dropped, trials[k].effect))
            k = 0
        elif (fewer := _with_fewer(record, start, path, k, alternatives, by_name)) is not None:
            path, k = fewer, 0
        else:
            weighed = weigh(record, reduced, replace(trials[k], fit=path.base.fit), alternatives, by_name)
            path = replace(path, stages=tuple(weighed if i == k else s for i, s in enumerate(path.stages)))
            k += 1
    # Each stage now has the gain of its cause beside all others: sort by the held-out error without it.
    errors = {name: _error_without(record, start, path, name, by_name) for name in {t.effect for t in path.trials}}
    return replace(path, stages=tuple(sorted(path.stages, key=lambda s: (-errors[_name(s)], -drop(s)))))


def _with_fewer(
    record: Record, start: Base, path: _Path, k: int, rivals: Sequence[Trial], by_name: dict[str, Effect]
) -> _Path | None:
    """Put a rival that does nearly as well in the place of a cause and of another one, if the two are not missed."""
    full, trials = record.score(path.base.fit), path.trials
    for rival in (r for r in rivals if record.score(r.fit) < full + MARGIN):
        for j in range(len(trials)):
            rest = [trials[i] for i in range(len(trials)) if i not in (j, k)]
            reduced = _replay(start, rest, by_name, path) if j != k else None
            extended = refit(by_name[rival.effect], rival, reduced[0]) if reduced is not None else None
            if reduced is not None and extended is not None and record.score(extended.fit) < full:
                remaining = _renewed((s for i, s in enumerate(path.stages) if i not in (j, k)), reduced[1])
                stage = weigh(record, reduced[0], extended)
                dropped = (*path.dropped, trials[j].effect, trials[k].effect)
                return _Path((*remaining, stage), reduced[0].extended(extended), dropped)
    return None


def _renewed(stages: Iterable[Stage], trials: Sequence[Trial]) -> tuple[Stage, ...]:
    """Return stages with their effects as they were put on again: the parameters may have other names then."""
    return tuple(
        replace(s, leader=replace(s.leader, trial=trial)) if s.leader is not None else s
        for s, trial in zip(stages, trials, strict=True)
    )


def _name(found: Stage) -> str:
    assert found.leader is not None
    return found.leader.trial.effect


def _error_without(record: Record, start: Base, path: _Path, name: str, by_name: dict[str, Effect]) -> float:
    """Return the held-out RMSE with all other effects, this one left out everywhere it was put."""
    own = [s for s in path.stages if _name(s) == name]
    replayed = _replay(start, [t for t in path.trials if t.effect != name], by_name, path) if len(own) > 1 else None
    return rms(record.held_part(record.residual(replayed[0].fit))) if replayed else max(s.rmse for s in own)


def _replay(
    start: Base, trials: Sequence[Trial], by_name: dict[str, Effect], path: _Path
) -> tuple[Base, tuple[Trial, ...]] | None:
    """Put effects of a path on the base model again, one after another, from the values that they and the path had."""
    base, done = start, []
    for trial in trials:
        again = refit(by_name[trial.effect], trial, base, path.base.fit.model.values)
        if again is None:
            return None
        base = base.extended(again)
        done.append(again)
    return base, tuple(done)
