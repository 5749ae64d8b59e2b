"""Diagnosis: misfit of a model, search for causes, extended model, and gain on data that nothing has seen."""

from __future__ import annotations

import pickle
import time
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import Progress, TimeIsUp, check_seconds, time_limit
from smid.data import Dataset
from smid.data.estimates import estimate_names, with_estimates, without_estimates
from smid.data.given import Given, as_dataset
from smid.data.listing import missing_notes
from smid.diagnosis.assemble import cause_of, detected, has_grown, ordered, too_small
from smid.diagnosis.cause import Cause
from smid.diagnosis.checks import bound_of_output, check_moving, chosen_effects, output_of, processes
from smid.diagnosis.diagnosis import Diagnosis, Verdict
from smid.diagnosis.effects.effect import Detection, Effect, Site
from smid.diagnosis.effects.input_noise import in_the_record
from smid.diagnosis.evidence.faults import Fault, data_faults
from smid.diagnosis.evidence.misfit import Misfit, check_finite, misfit
from smid.diagnosis.experiment import SeparatingExperiment, separating_experiment
from smid.diagnosis.filled import counted, filled, unfilled, without_missing
from smid.diagnosis.gain import gain
from smid.diagnosis.glitches import Glitches, adds_none, glitches_in, glitches_of, without_glitches
from smid.diagnosis.long_record import MOST_SAMPLES, fitted_to, shorten
from smid.diagnosis.parts import Parts, free_run
from smid.diagnosis.proof.emptiness import Emptiness, prove_empty
from smid.diagnosis.search.compare import is_more_than_noise, rms, spread
from smid.diagnosis.search.evidence import evidence
from smid.diagnosis.search.guarded import Failure, guarded
from smid.diagnosis.search.judged import judged
from smid.diagnosis.search.noise_model import noise_model
from smid.diagnosis.search.posterior import Posterior, posterior
from smid.diagnosis.search.ranking import Visited
from smid.diagnosis.search.record import Record
from smid.diagnosis.search.search import Found, search
from smid.diagnosis.search.trial import Base, fitted_base
from smid.diagnosis.search.whole import compared
from smid.diagnosis.simulator import simulator
from smid.display.progress import Shows, spoken, with_bar
from smid.feasible.feasible_set import check_samples
from smid.fitting.binding import bind
from smid.fitting.problem import Fit, Fitting
from smid.models import Model, ModelError
from smid.models.edit_lines import rename_channels
from smid.processes import copies

_SEARCHING = 0.8  # of the time allowed
_LEAST_PROVING = 0.1  # seconds


@with_bar
def diagnose(
    model: Model | None,
    data: Given,
    noise_bound: float | Mapping[str, float] | None = None,
    effects: Sequence[str | Effect] | None = None,
    test: float | Sequence[str] = 0.2,
    *,
    output: str | None = None,
    simulated: str | None = None,
    certify: bool = True,
    workers: int | None = None,
    seconds: float = np.inf,
    executor: Executor | None = None,
    progress: Shows = None,
) -> Diagnosis:
    """Return the diagnosis of a model: its misfit, the causes, the extended model and the gain on test data.

    The record has two parts. All fits use the first, and the choice between effects predicts blocks of it that a fit
    has left out. The test part is used once, at the end, for the gain.

    Parameters
    ----------
    model
        The base model; values it carries are a first guess, all its free parameters are fitted. None with
        ``simulated``.
    data
        As for :func:`smid.identify`.
    noise_bound
        In the channel's unit.
    effects
        Which to try, names or your own; by default all of `smid.diagnosis.EFFECTS`.
    test
        Share of each experiment, at its end, or names of the experiments, that no fit and no choice may see. Of a
        whole experiment, the first ``data.n_init`` samples, or 50, tell the initial states and do not count.
    output
        Which of several outputs is diagnosed; by default the first of the model. The fits use all of them.
    simulated
        Channel with the output of a simulator under the recorded input. The simulation is diagnosed as it is recorded,
        without a model: a linear model, fitted to this channel, tells how an effect at the input passes through.
    certify
        Whether to prove, with a noise bound, that the base model cannot explain the data.
    workers
        Processes that try effects in parallel; by default one for each processor. They are copies of this process,
        which Linux can make of a process with one thread; elsewhere the diagnosis stays in this process.
    seconds
        Time allowed, wall clock. A fifth of it is kept for what is done with the causes found by then.
    executor
        Used instead of own processes: a cluster's, say.
    progress
        Called with a line of text now and then; True shows a bar, in a terminal or a notebook.

    Raises
    ------
    ModelError
        For an unknown effect, a bad noise bound, too little time to fit the base model, a model that is no match for
        the data, or not one of ``model`` and ``simulated``.
    DataError
        For missing or constant channels, a part too short to judge, a model that cannot be simulated on the data, or a
        record of a simulation that has not one input and one output.

    Examples
    --------
    >>> from smid.models import OutputError
    >>> u = np.random.default_rng(0).uniform(-1, 1, 300)
    >>> from smid.models.simulate import simulate
    >>> y = simulate(OutputError(delay=3), {"u": u}, {"a1": -0.8, "b0": 1.0})["y"]
    >>> y = y + np.random.default_rng(1).uniform(-0.05, 0.05, 300)
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    >>> diagnosis = diagnose(OutputError(), data, effects=["input_delay", "extra_lag"], workers=1)
    >>> print(diagnosis.conclusion)
    Cause: input_delay.
    """
    began = time.monotonic()
    check_seconds(seconds)
    chosen = chosen_effects(effects)
    count = processes(workers)
    data = as_dataset(data, model)
    with _time_to_fit(seconds, began):
        model = _given(model, data, simulated)
    # Rename signals with the name of a further channel, so that effects can read the channel.
    model = rename_channels(bind(model, data), {}, (c.name for c in data.channels))
    if not model.input_channels or not model.output_channels:
        raise ModelError("a diagnosis needs a model with an input and an output: it compares free runs")
    check_samples(model, data)
    output, others = output_of(model, output)
    bound = bound_of_output(model, noise_bound, output)
    say = spoken(progress) or _silent
    data, split = _fit_for_search(data)
    shortened = shorten(model, data, test, bounded=bound is not None)
    data, parts = shortened.data, shortened.parts
    parts = counted(parts, data, model.output_channels)
    told = (*others, *split, *missing_notes(data), *shortened.said)
    model = replace(model, sampling_time=data.sampling_time) if model.continuous else model
    for sentence in told:
        say(sentence)
    check_moving(model, parts.seen)
    windowed = shortened.searched is not parts.seen
    estimates = [name for channel in model.exogenous_channels for name in estimate_names(channel)]
    record = _record(model, with_estimates(shortened.searched, estimates), output, bound)
    faults = data_faults(parts.seen)
    for fault in faults:
        say(fault.sentence)

    with _time_to_fit(seconds, began), _pool(executor, count, chosen) as pool:
        say("fitting the base model")
        base = _base(model, record)
        # The test part lends its input, not its output.
        free = free_run(fitted_to(base.fit, parts.seen) if windowed else base.fit, data, parts)
        for run, outputs in zip(data.experiments, free, strict=True):
            check_finite(run.name, outputs[record.output][data.n_init :])
        if any(data.missing.values()):
            record = replace(record, data=filled(record.data, base.fit.simulated))
            base = _base(base.fit.model, record)
        looked = _look(model, record, base, None, chosen, pool, say)
    # Each part has estimates of its own: what is seen does not depend on the test part.
    read = sorted({name for one in looked.found.visited for name in one.effects.fit.model.input_channels})
    parts = replace(parts, seen=with_estimates(parts.seen, read))
    if windowed:
        looked = _look_at_all(looked, _record(model, parts.seen, output, bound), chosen, say)
    elif looked.found.interrupted:
        looked = _judged(looked, chosen, seconds - (time.monotonic() - began))
    found = posterior(looked.found.visited, looked.same)
    left_over = max(seconds - (time.monotonic() - began), _LEAST_PROVING)
    proof = None
    if certify and bound is not None:
        with time_limit(left_over):
            proof = prove_empty(
                looked.base.fit.model, parts.seen, bound, record.output, looked.record.residual(looked.base.fit)
            )
    whole = with_estimates(filled(data, free), read)
    diagnosis = _assemble(whole, parts, looked, found, chosen, said=told, faults=faults, proof=proof, began=began)
    return replace(diagnosis, data=data)


@contextmanager
def _time_to_fit(seconds: float, began: float) -> Iterator[None]:
    """Limit a block to what is left of the time for the search, and say so where not even the base model is fitted."""
    try:
        # A limit that is past already ends the block at its first check.
        with time_limit(max(_SEARCHING * seconds - (time.monotonic() - began), np.finfo(float).tiny)):
            yield
    except TimeIsUp:
        raise ModelError(
            f"seconds = {seconds:g} is too short to fit the base model: allow more time, or give a shorter record"
        ) from None


def _fit_for_search(data: Dataset) -> tuple[Dataset, tuple[str, ...]]:
    """Return a record that can be searched, and a sentence where it was split: a long one is cut into windows."""
    if data.n_samples <= MOST_SAMPLES or not any(data.missing.values()):
        return data, ()
    parts = data.without_gaps()
    return parts, (f"The record is long, and is split where samples are missing: {len(parts.experiments)} parts.",)


def _given(model: Model | None, data: Dataset, simulated: str | None) -> Model:
    """Return the model given, or the one of a recorded simulation."""
    if model is not None and simulated is None:
        return model
    if model is not None or simulated is None:
        raise ModelError(
            "a diagnosis is of a model or of a simulated channel: give a model, or None and simulated='the channel'"
        )
    return simulator(data, simulated)


@dataclass(frozen=True, eq=False)
class _Looked:
    """What was found on the part of a record that may be seen."""

    record: Record
    base: Base
    shown: Misfit
    found: Found
    glitches: Glitches | None

    def same(self, first: Visited, second: Visited) -> bool:
        """Return whether a set says no more than another one, which is likelier.

        No experiment could tell them apart: they differ by less than the error left. Or it has more numbers, and gives
        the run of the other one on this record, within what a nat tells: the further numbers do nothing.
        """
        record, one, other = self.record, first.effects.fit, second.effects.fit
        left, output = rms(record.part(record.residual(one))), record.output
        apart = record.part(tuple(a[output] - b[output] for a, b in zip(one.simulated, other.simulated, strict=True)))
        if other.n_free > one.n_free and np.sum(np.concatenate(apart) ** 2) <= 2 * left**2:
            return True
        experiment = separating_experiment({"first": one, "second": other}, record.data, record.input, output)
        return experiment is not None and experiment.difference <= left


def _look(
    model: Model,
    record: Record,
    base: Base,
    before: _Looked | None,
    chosen: Sequence[Effect],
    pool: Executor | None,
    say: Progress,
) -> _Looked:
    """Fit the base model, and search for causes without the glitches that it, or the model found before, shows."""
    known = before.found.visited[0].effects.fit if before else base.fit
    glitches = glitches_of(record, known, chosen)
    seen = without_glitches(record, glitches)
    base = _base(model, seen) if glitches else base
    shown = _misfit(record, base.fit)
    say(shown.sentence)
    begun = before.found.visited[0].effects.trials if before else ()
    found = search(seen, base, chosen, pool, say, begun)
    looked = _Looked(seen, base, shown, found, glitches)
    if before:
        return looked
    left = glitches_of(record, found.visited[0].effects.fit, chosen)
    if glitches and left is None:
        # A limit that is reached briefly looks like a glitch until it is in the model.
        return replace(looked, record=record, glitches=None)
    if found.interrupted or left is None or adds_none(left, glitches):
        return looked
    say("the extended model shows glitches: searching again without them")
    with suppress(TimeIsUp):
        return _look(model, record, base, looked, chosen, pool, say)
    return replace(looked, found=replace(found, interrupted=True))


def _judged(looked: _Looked, chosen: Sequence[Effect], seconds: float) -> _Looked:
    """Compare what a search that was ended has not come to; see `judged`."""
    record, sets = replace(looked.record, used=looked.base.used), [one.effects for one in looked.found.visited]
    with suppress(TimeIsUp, KeyboardInterrupt), time_limit(max(seconds, _LEAST_PROVING)):
        visited = judged(record, looked.base, sets, chosen)
        return replace(looked, found=replace(looked.found, visited=visited))
    return looked


def _look_at_all(looked: _Looked, record: Record, chosen: Sequence[Effect], say: Progress) -> _Looked:
    """Fit what a search on windows found to the whole of what may be seen, and compare it there."""
    say("fitting the base model to the whole record")
    glitches = glitches_of(record, fitted_to(looked.found.visited[0].effects.fit, record.data), chosen)
    seen = without_glitches(record, glitches)
    base = _base(looked.base.fit.model, seen)
    found = compared(seen, base, looked.found, chosen, say)
    return _Looked(seen, base, _misfit(record, base.fit), found, glitches)


def _misfit(record: Record, fitted: Fit) -> Misfit:
    simulated = tuple(s[record.output] for s in fitted.simulated)
    data = unfilled(without_estimates(record.data), record.used, record.output)
    return misfit(data, record.output, simulated, noise_bound=record.noise_bound, skip=data.n_init, input=record.input)


def _assemble(
    data: Dataset,
    parts: Parts,
    looked: _Looked,
    found: Posterior,
    chosen: Sequence[Effect],
    *,
    said: tuple[str, ...],
    faults: tuple[Fault, ...],
    proof: Emptiness | None,
    began: float,
) -> Diagnosis:
    record, base, visited = looked.record, looked.base, looked.found.visited
    output, bound, measured = record.output, record.noise_bound, [run.values[record.output] for run in data.experiments]

    # The only use of the test part: one free run of the base, of the extended model, and without each cause. Glitches
    # in it are no error of a model.
    final = _likeliest(found.chosen, record)
    base_run, final_run = (free_run(f, data, parts) for f in (base.fit, final))
    errors = tuple(y - run[output] for y, run in zip(measured, final_run, strict=True))
    bad = glitches_in(Site(data, record.input, output, errors), final.model, chosen)
    failed = dict(looked.found.failed)
    if isinstance(bad, Failure):
        failed, bad = {**failed, bad.effect: bad.reason}, None
    glitches = bad[1].glitches if bad else None
    counted = [t & ~g for t, g in zip(parts.test, glitches, strict=True)] if glitches else parts.test

    def tested(runs: Sequence[Mapping[str, Array]]) -> list[Array]:
        """Return the errors of a free run on the test part."""
        pairs = zip(measured, runs, counted, strict=True)
        return [(y - run[output])[mask] for y, run, mask in pairs if mask.any()]

    before, after = tested(base_run), tested(final_run)

    @cache
    def errors_of(one: Visited | None) -> list[Array]:
        return tested(free_run(one.effects.fit, data, parts)) if one is not None else before

    heard, grown = found.chosen.effects.detected, has_grown(found.chosen, record, after)
    told = heard[0].name if heard and not grown else None
    small = too_small(found, visited, lambda one: rms(errors_of(one)), rms(after), spread(after), told)
    named: list[Cause] = []
    details: list[Cause] = []
    for trial, without in ordered(found, visited):
        cause = cause_of(trial, found, without, visited, record, final, (errors_of(without), after))
        (details if trial in small else named).append(cause)
    # Where the search has left glitches out, those of the test part are told with them.
    glitched = replace(looked, glitches=looked.glitches and (bad or looked.glitches))
    noise, extended = list[Cause](), final.model
    for effect, detection in _noise_effects(glitched, found, final, chosen):
        probability = found.probability.get(effect.name, detection.confidence)
        cause = detected(effect, detection, record.site(final), probability, rms(after))
        if detection.glitches is None:
            (details if grown else noise).append(cause)
            extended = extended if grown else detection.model
        else:
            noise.append(cause)
    # Glitches that show only with the extended model are smaller than the named causes. What is ambiguous comes last.
    first = 1 if looked.glitches and glitches_of(record, base.fit, chosen) else 0
    causes = [*noise[:first], *named, *noise[first:]]
    causes.sort(key=lambda cause: cause.effect in found.alternatives[:1])
    verdict = Verdict.AMBIGUOUS if found.alternatives else Verdict.NAMED if causes else Verdict.NONE
    extended = in_the_record(extended, record.data)
    if verdict is Verdict.NONE:
        final_run, after, extended = base_run, before, base.fit.model
    held = [y[mask] for y, mask in zip(measured, counted, strict=True) if mask.any()]
    # What was tried applies, and what a search that ended early did not try may.
    tried = {name for v in visited for name in v.names}
    failed = {name: why for name, why in failed.items() if name not in tried}
    rest = [e for e in chosen if e.detect is None and e.name not in {*tried, *failed}]
    interrupted = looked.found.interrupted
    inapplicable = [e for e in rest if not interrupted and not any(e.extensions(base.fit.model, base.site()))]
    return Diagnosis(
        base=base.fit.model,
        model=extended,
        data=data,
        output=output,
        unit=data.channel(output).unit,
        verdict=verdict,
        causes=tuple(causes),
        alternatives=found.alternatives,
        details=tuple(details),
        doubts={name: found.probability[name] for name in found.doubts},
        misfit=looked.shown,
        faults=faults,
        shortened=said,
        gain=gain(held, before, after, bound),
        proof=proof,
        experiment=_experiment(found, looked),
        skipped={**{e.name: e.needs or "does not apply" for e in inapplicable}, **failed},
        failed=tuple(failed),
        dropped=tuple(sorted(looked.found.led - set(found.chosen.names))),
        unexplained=not noise and is_more_than_noise(after, bound),
        simulated=tuple(run[output] for run in base_run),
        extended=tuple(run[output] for run in final_run),
        test=parts.test,
        interrupted=interrupted,
        seconds=time.monotonic() - began,
    )


def _likeliest(one: Visited, record: Record) -> Fit:
    """Return the likeliest fit of a set under its noise; what its laws may leave judges sets, and moves no number."""
    found = one.effects.fit
    problem = Fitting(found.model, record.data, record.used, found.initial)
    problem.start(found.model.values)
    noise = noise_model(one.effects.errors, record.used)
    return problem.result(evidence(record, noise, found, one.effects.boxes).vector, found.cost)


def _experiment(found: Posterior, looked: _Looked) -> SeparatingExperiment | None:
    """Return the experiment that separates the alternatives, where the record is ambiguous."""
    named = set(found.chosen.names) - set(found.alternatives)
    rivals: dict[str, Fit] = {}
    for name in found.alternatives:
        one = next((v for v in looked.found.visited if set(v.names) == named | {name}), None)
        if one is not None:
            rivals[name] = one.effects.fit
    if len(rivals) < 2:
        return None
    return separating_experiment(rivals, looked.record.data, looked.record.input, looked.record.output)


def _noise_effects(
    looked: _Looked, found: Posterior, final: Fit, chosen: Sequence[Effect]
) -> list[tuple[Effect, Detection]]:
    """Return the effects on the noise: glitches, then those of the chosen set, then those that compete with none."""
    result = [looked.glitches] if looked.glitches else []
    heard, shown = found.chosen.effects.detected, {trial.effect for trial in found.chosen.effects.trials}
    result += [heard] if heard and heard[0].name not in shown else []
    for effect in chosen:
        if effect.detect is not None and not effect.marks_glitches:
            detection = guarded(effect.name, effect.detect, final.model, looked.record.site(final))
            if isinstance(detection, Detection) and detection.score_drop is None:
                result.append((effect, detection))
    return result


def _silent(_line: str) -> None:
    """Drop a line of progress."""


def _record(model: Model, data: Dataset, output: str, bound: float | None) -> Record:
    """Return the record as the search uses it."""
    begun = tuple(np.arange(run.n_samples) >= data.n_init for run in data.experiments)
    used = without_missing(begun, data, model.output_channels)
    # By the order of the data: a model orders the inputs of one line by their names.
    first = next((c for c in data.inputs if c in model.input_channels), model.input_channels[0])
    return Record(data, used, first, output, bound)


def _base(model: Model, record: Record) -> Base:
    """Fit the base model."""
    return fitted_base(model, record.data, record.used, record.input, record.output)


def _pool(executor: Executor | None, count: int, effects: Sequence[Effect]) -> AbstractContextManager[Executor | None]:
    """Return the executor for the trials: the given one, own processes, or None."""
    if executor is not None:
        return nullcontext(executor)
    if not all(_travels(effect) for effect in effects):
        return nullcontext(None)
    return copies(min(count, len(effects)))


def _travels(effect: Effect) -> bool:
    """Return whether other processes can import the functions of an effect: not from a notebook cell, or a closure."""
    try:
        return b"__main__" not in pickle.dumps(effect)
    except (pickle.PicklingError, AttributeError, TypeError):
        return False
