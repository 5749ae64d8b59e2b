"""Sets of effects on one base model: how they are put together, enlarged and reduced."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import ceil, inf, log

import numpy as np

from relaxations.deadline import Progress, map_in_time
from smid.diagnosis.effects.effect import Detection, Effect
from smid.diagnosis.search.compare import rms
from smid.diagnosis.search.guarded import Failure, guarded
from smid.diagnosis.search.noise_model import DISCREPANCY
from smid.diagnosis.search.record import Record
from smid.diagnosis.search.trial import Base, Begun, Trial, begin, finish, fitting, refit, schwarz, try_effect
from smid.display.progress import counted
from smid.fitting.problem import Errors, Fit

_BETTER = 1e-6  # a smaller reduction of the error is no other minimum
_WORTH = 2.0  # of the criterion: a nat

SCREEN = 5.0
"""Nats that the first step of an effect has to promise; over blind cases, what was hidden promised 67 at least."""

HALVING = 2
"""Of the effects, one in so many is fitted to the end on a set that is not empty: those that lead after a few steps.

Reference: Jamieson and Talwalkar, AISTATS 2016 (successive halving).
"""


@dataclass(frozen=True, eq=False)
class EffectSet:
    """Effects put on the base model one after another, with the joint fit of all.

    Parameters
    ----------
    trials
        In the order in which they were put on.
    fit, errors
        See `Trial`.
    detected
        An effect on the noise that the residual shows, if the set has one.
    tied
        The same effects with another variant of the last one, which fit as well. A further effect tells them apart: in
        front of a plant that is linear so far a lag is as good as behind it.
    """

    trials: tuple[Trial, ...]
    fit: Fit
    errors: Errors
    detected: tuple[Effect, Detection] | None = None
    tied: tuple[EffectSet, ...] = ()

    def with_trial(self, trial: Trial) -> EffectSet:
        """Return the set with one effect more."""
        first, *others = (EffectSet((*self.trials, one), one.fit, one.errors) for one in (trial, *trial.tied))
        return replace(first, tied=tuple(others))

    @property
    def alike(self) -> tuple[EffectSet, ...]:
        """The set, then those that are tied with it."""
        return (self, *self.tied)

    def led_by(self, one: EffectSet) -> EffectSet:
        """Return a set that is tied with this one, with all others that are."""
        others = (replace(self, tied=()), *(other for other in self.tied if other is not one))
        return replace(one, tied=others)

    def on(self, base: Base) -> Base:
        """Return a base model with the effects of the set."""
        return replace(base, fit=self.fit, errors=self.errors)

    def has(self, other: Trial | Begun) -> bool:
        """Return whether the set has an effect in the same variant."""
        return (other.effect, other.label) in {(trial.effect, trial.label) for trial in self.trials}

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Sorted names of the effects: what tells one set from another."""
        shown = [trial.effect for trial in self.trials]
        # What a free run shows of noise in an input is the same effect as what the residual shows of it.
        noise = [self.detected[0].name] if self.detected and self.detected[0].name not in shown else []
        return tuple(sorted((*shown, *noise)))

    @cached_property
    def boxes(self) -> Mapping[str, float]:
        """Width of the box of each parameter that an effect brought."""
        model = self.fit.model
        brought = [model.parameter(name) for trial in self.trials for name in trial.parameters]
        return {p.name: p.upper - p.lower for p in brought}


def enlarged(
    one: EffectSet, base: Base, effects: Sequence[Effect], executor: Executor | None, progress: Progress
) -> list[EffectSet | Failure]:
    """Put every effect on a set, each in its best variant that is not there yet; tell which effects fail."""
    # On the base model every effect is fitted to the end, to be told why it is rejected.
    least, most = (SCREEN, ceil(len(effects) / HALVING)) if one.trials else (-inf, len(effects))
    result: list[EffectSet | Failure] = []
    leading: list[tuple[int, Begun]] = []
    few_steps = map_in_time(executor, partial(_begun, one=one, base=base, least=least), effects)
    for effect, found in zip(effects, few_steps, strict=True):
        if isinstance(found, Failure):
            progress(f"{found.effect}: {found.reason}")
            result.append(found)
        elif found is None:
            progress(f"{effect.name}: does not apply, promises nothing or is there")
        else:
            leading.append(found)
    # Fit those to the end that lead after a few steps.
    leading.sort(key=lambda pair: pair[1].criterion)
    for _, behind in leading[most:]:
        progress(f"{behind.effect}: behind {most} others after a few steps")
    leading = leading[:most]
    say = counted(progress, "fits", len(leading))
    finished = map_in_time(executor, partial(_finished, one=one, base=base), leading)
    for (which, begun), trial in zip(leading, finished, strict=True):
        start = one.alike[which]
        if isinstance(trial, Failure):
            say(f"{trial.effect}: {trial.reason}")
            result.append(trial)
        elif trial is None or start.has(trial):
            say(f"{begun.effect}: does not apply or is there")
        else:
            result.append(start.with_trial(trial))
            say(f"{trial.effect}: squared error {max(0.0, 1 - trial.fit.cost / one.fit.cost):.0%} smaller")
    return result


def _begun(effect: Effect, one: EffectSet, base: Base, least: float) -> tuple[int, Begun] | Failure | None:
    """Begin an effect on a set and on those that are tied with it; return on which, the set unless it is worse."""
    found = [guarded(effect.name, begin, effect, start.on(base), least) for start in one.alike]
    begun = [(k, b) for k, b in enumerate(found) if isinstance(b, Begun) and not one.alike[k].has(b)]
    failures = (failure for failure in found if isinstance(failure, Failure))
    return min(begun, key=lambda pair: pair[1].criterion + _WORTH * (pair[0] > 0)) if begun else next(failures, None)


def _finished(started: tuple[int, Begun], one: EffectSet, base: Base) -> Trial | Failure | None:
    which, begun = started
    return guarded(begun.effect, finish, begun, one.alike[which].on(base))


def put_again(
    trials: Sequence[Trial], base: Base, effects: Mapping[str, Effect], values: Mapping[str, float]
) -> EffectSet | None:
    """Put effects on a base model again, from the values that they had elsewhere; None where one cannot be put."""
    done: list[Trial] = []
    for trial in trials:
        again = guarded(trial.effect, refit, effects[trial.effect], trial, base, values)
        if not isinstance(again, Trial):
            return None
        base = base.extended(again)
        done.append(again)
    return EffectSet(tuple(done), base.fit, base.errors)


def leading(found: Sequence[EffectSet], base: Base, count: int) -> list[EffectSet]:
    """Return the sets of at least two effects that fit best, by Schwarz's criterion."""
    several = [one for one in found if len(one.trials) > 1]
    return sorted(several, key=lambda one: criterion(one, base))[:count]


def criterion(one: EffectSet, base: Base) -> float:
    """Return Schwarz's criterion of a set, which counts two for a nat, with what the choice of the variants costs."""
    return schwarz(one.fit.cost, one.fit.n_free, base) + 2 * sum(log(max(t.variants, 1)) for t in one.trials)


def reopened(one: EffectSet, base: Base, effects: Mapping[str, Effect]) -> EffectSet:
    """Put each effect of a set on anew beside the others, in the variant that suits them best, until none is better.

    An effect has the variant and the place with which it was put on: the best without those that came later.
    """
    waiting = list(one.trials[:-1])
    while waiting:
        first = waiting.pop(0)
        rest = put_again([t for t in one.trials if t is not first], base, effects, one.fit.model.values)
        if rest is None:
            continue
        trial = guarded(first.effect, try_effect, effects[first.effect], rest.on(base))
        other = rest.with_trial(trial) if isinstance(trial, Trial) else one
        if criterion(other, base) < criterion(one, base) - _WORTH:
            one, waiting = other, list(other.trials[:-1])
    return one


def reduced(
    one: EffectSet, base: Base, effects: Mapping[str, Effect], known: Mapping[tuple[str, ...], EffectSet]
) -> list[EffectSet]:
    """Return the sets that have one effect less, fitted also from the values of the set that has it.

    Of a set with an effect on the noise, those of the rest too: what another effect explained may be such noise.
    """
    if one.detected:
        plain = replace(one, detected=None)
        return [plain, *reduced(plain, base, effects, known)]
    result = []
    for k in range(len(one.trials)):
        rest = [t for i, t in enumerate(one.trials) if i != k]
        found = known.get(tuple(sorted(t.effect for t in rest)))
        if found is None or sorted(t.variant for t in found.trials) != sorted(t.variant for t in rest):
            # Alone, an effect may have been tried in other variants only.
            again = put_again(rest, base, effects, one.fit.model.values)
            found = min((s for s in (found, again) if s), key=lambda s: criterion(s, base), default=None)
        if found is not None:
            result.append(_fitted_from(found, rest, one, base))
    return result


def _fitted_from(found: EffectSet, rest: Sequence[Trial], one: EffectSet, base: Base) -> EffectSet:
    """Fit a set from the values that another one has for it, which may lie below a pass that its own fit did not take.

    Parameters
    ----------
    rest
        The effects of `found`, as the other set has them.
    """
    left, values = list(found.trials), {**found.fit.model.values, **one.fit.model.values}
    for old in rest:
        new = next((t for t in left if t.variant == old.variant), None)
        if new is None:
            return found
        left.remove(new)
        values |= {name: one.fit.model.values[was] for name, was in zip(new.parameters, old.parameters, strict=True)}
    problem = fitting(found.fit.model, replace(base, fit=one.fit))
    with np.errstate(all="ignore"):
        vector, cost = problem.solve(problem.start(values))
        if not cost < found.fit.cost * (1 - _BETTER):
            return found
        return replace(found, fit=problem.result(vector, cost), errors=tuple(problem.errors(vector, True)))


def with_noise_effects(
    one: EffectSet, record: Record, base: Fit, effects: Sequence[Effect]
) -> list[EffectSet | Failure]:
    """Return a set with each effect on the noise that its residual shows and that competes; tell which fail.

    What laws may leave of the error of the base model is no sign of an effect on the noise.
    """
    if one.detected:
        return []
    left = (DISCREPANCY * rms(record.part(record.residual(base)))) ** 2
    result: list[EffectSet | Failure] = []
    for effect in effects:
        if effect.detect is not None and not effect.marks_glitches:
            found = guarded(effect.name, effect.detect, one.fit.model, record.site(one.fit))
            if isinstance(found, Failure):
                result.append(found)
            elif found is not None and found.score_drop is not None and found.explained > left:
                result.append(replace(one, detected=(effect, found), tied=()))
    return result
