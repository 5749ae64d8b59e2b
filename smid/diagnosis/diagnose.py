"""Diagnosis: misfit of a model, search for causes, extended model, and gain on held-out data."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import replace

import numpy as np

from relaxations.algebra.arrays import Array
from relaxations.deadline import Progress, TimeIsUp, check_seconds, time_limit
from smid.data import DataError, Dataset
from smid.diagnosis.assemble import causes, detected
from smid.diagnosis.cause import Cause
from smid.diagnosis.certify import prove_empty
from smid.diagnosis.diagnosis import Diagnosis, Verdict
from smid.diagnosis.effects import EFFECTS
from smid.diagnosis.effects.effect import Detection, Effect
from smid.diagnosis.evidence.faults import Fault, data_faults
from smid.diagnosis.evidence.misfit import Misfit, misfit
from smid.diagnosis.experiment import separating_experiment
from smid.diagnosis.gain import gain
from smid.diagnosis.search.compare import rms, structure
from smid.diagnosis.search.merit import Record
from smid.diagnosis.search.search import Found, search
from smid.diagnosis.search.trial import Base
from smid.feasible.feasible_set import check_data, check_noise_bound
from smid.fitting.binding import bind
from smid.fitting.fit import fit
from smid.models import Model, ModelError
from smid.models.edit_lines import rename_channels

_LEAST_HELD = 30
_STRUCTURE = 0.2
_SEARCHING = 0.8  # of the time allowed
_LEAST_PROVING = 0.1  # seconds


def diagnose(
    model: Model,
    data: Dataset,
    noise_bound: float | Mapping[str, float] | None = None,
    effects: Sequence[str | Effect] | None = None,
    holdout: float | Sequence[str] = 0.3,
    *,
    certify: bool = True,
    workers: int | None = None,
    seconds: float = np.inf,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Return the diagnosis of a model: its misfit, the causes, the extended model and the gain on held-out data.

    Parameters
    ----------
    model
        The base model; values it carries are a first guess, all its free parameters are fitted.
    noise_bound
        In the channel's unit.
    effects
        Which to try, names or your own; by default all of `smid.diagnosis.EFFECTS`.
    holdout
        Share of each experiment, at its end, or names of the experiments, that no fit may see.
    certify
        Whether to prove, with a noise bound, that the base model cannot explain the data.
    workers
        Processes that try effects in parallel; by default one for each processor. 1 stays in this process.
    seconds
        Time allowed, wall clock. A fifth of it is kept for what is done with the causes named by then.
    executor
        Used instead of own processes: a cluster's, say.
    progress
        Called with a line of text now and then.

    Raises
    ------
    ModelError
        For an unknown effect, a bad noise bound, too little time to fit the base model, or a model that is no match for
        the data.
    DataError
        For missing channels, a held-out part too short to judge, or a model that cannot be simulated on the data.

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
    # Rename signals with the name of a further channel, so that effects can read the channel.
    model = rename_channels(bind(model, data), {}, (c.name for c in data.channels))
    chosen = _chosen(effects)
    if workers is not None and workers < 1:
        raise ModelError(f"workers = {workers}: give a number of processes, at least 1, or none for one per processor")
    if not model.input_channels or not model.output_channels:
        raise ModelError("a diagnosis needs a model with an input and an output: it compares free runs")
    check_data(model, data)
    bound = _bound(model, noise_bound)
    record = replace(_record(model, data, holdout), noise_bound=bound)
    say = progress or _silent
    faults = data_faults(data)
    for fault in faults:
        say(fault.sentence)

    with time_limit(_SEARCHING * seconds), _pool(executor, workers, chosen) as pool:
        try:
            say("fitting the base model")
            base = _base(model, record)
            glitches = _glitches(record, base, chosen)
            seen = _without(record, glitches)
            base, shown, found = _look(model, seen, base, chosen, pool, progress)
        except TimeIsUp:
            raise ModelError(
                f"seconds = {seconds:g} is too short to fit the base model: allow more time, or give a shorter record"
            ) from None
        left = _glitches(record, found.base, chosen)
        if left is None:
            # A limit that is reached briefly looks like a glitch until it is in the model.
            glitches, seen = None, record
        elif not found.interrupted and not _same(left, glitches):
            say("the extended model shows glitches: searching again without them")
            again = None
            with suppress(TimeIsUp):
                again = _look(model, _without(record, left), base, chosen, pool, progress)
            if again is None or again[2].interrupted:
                found = replace(found, interrupted=True)
            else:
                glitches, seen = left, _without(record, left)
                base, shown, found = again
    detections = [glitches] if glitches else []
    detections += _noise_effects(seen, found, chosen)
    left_over = max(seconds - (time.monotonic() - began), _LEAST_PROVING)
    return _assemble(model, seen, base, found, detections, shown, faults, chosen, certify, began, left_over)


def _assemble(
    model: Model,
    record: Record,
    base: Base,
    found: Found,
    detections: Sequence[tuple[Effect, Detection]],
    shown: Misfit,
    faults: tuple[Fault, ...],
    chosen: Sequence[Effect],
    certify: bool,
    began: float,
    seconds: float,
) -> Diagnosis:
    data, output, bound = record.data, record.output, record.noise_bound
    final = found.base.fit
    before, after = record.residual(base.fit), record.residual(final)
    site = base.site()
    named = causes(record, found, site)
    rmse = rms(record.held_part(after))
    noise = {e.name: detected(e, d, record.site(final), rmse) for e, d in detections}
    # Glitches that show only with the extended model are smaller than the named causes.
    marking = [e.name for e in chosen if e.marks_glitches and e.name in noise]
    first = [noise.pop(name) for name in marking if _glitches(record, base, chosen)]
    listed = (*first, *named, *noise.values())
    tied = next((stage for stage in found.stages if stage.tied), None)
    verdict = Verdict.AMBIGUOUS if tied else Verdict.NAMED if listed else Verdict.NONE
    extended = final.model
    for _, detection in detections:
        extended = detection.model if detection.glitches is None else extended
    proof = None
    if certify and bound is not None:
        with time_limit(seconds):
            proof = prove_empty(model, data, bound, output, before)
    held = [run.values[output] for run in data.experiments]
    inapplicable = [e for e in chosen if e.detect is None and not any(True for _ in e.extensions(base.fit.model, site))]
    rivals = {r.trial.effect: r.trial.fit for r in (tied.leader, *tied.tied) if r} if tied else {}
    return Diagnosis(
        base=base.fit.model,
        model=extended if listed else base.fit.model,
        data=data,
        output=output,
        unit=data.channel(output).unit,
        verdict=verdict,
        causes=listed,
        misfit=shown,
        faults=faults,
        gain=gain(record.held_part(held), record.held_part(before), record.held_part(after), bound),
        proof=proof,
        experiment=separating_experiment(rivals, data, record.input, output) if tied else None,
        skipped={e.name: e.needs or "does not apply" for e in inapplicable},
        dropped=found.dropped,
        unexplained=_unexplained(record, after, bound, noise),
        simulated=tuple(s[output] for s in base.fit.simulated),
        extended=tuple(s[output] for s in final.simulated),
        held=record.held,
        interrupted=found.interrupted,
        seconds=time.monotonic() - began,
    )


def _unexplained(record: Record, after: Sequence[Array], bound: float | None, noise: Mapping[str, Cause]) -> bool:
    """Return whether the remaining error exceeds the noise bound, or is correlated, without a named cause."""
    left = record.held_part(after)
    if noise:
        return False
    if bound is not None:
        return bool(np.abs(np.concatenate(left)).max() > 1.2 * bound)
    return structure(left) > _STRUCTURE


def _silent(_line: str) -> None:
    """Drop a line of progress."""


def _chosen(effects: Sequence[str | Effect] | None) -> tuple[Effect, ...]:
    known = {effect.name: effect for effect in EFFECTS}
    if effects is None:
        return EFFECTS
    if isinstance(effects, str):
        raise ModelError(f"effects = {effects!r}: give a list of names, [{effects!r}]")
    chosen = []
    for item in effects:
        if isinstance(item, str) and item not in known:
            raise ModelError(
                f"effect {item!r} is unknown: choose from {', '.join(known)}, or give an Effect of your own"
            )
        chosen.append(known[item] if isinstance(item, str) else item)
    if not chosen or len({e.name for e in chosen}) < len(chosen):
        raise ModelError("the effects to try must be at least one, each under its own name: list every effect once")
    return tuple(chosen)


def _bound(model: Model, noise_bound: float | Mapping[str, float] | None) -> float | None:
    """Return the noise bound of the main output."""
    if noise_bound is None:
        return None
    noisy = {m.channel for m in model.measurements if m.noise is not None}
    outputs = [c for c in model.output_channels if c in noisy]
    if not outputs:
        raise ModelError(
            "the model takes no output as noisy, so a noise bound does not apply: give none, or a model whose output "
            "has noise"
        )
    return check_noise_bound(model, noise_bound, None)[outputs[0]]


def _record(model: Model, data: Dataset, holdout: float | Sequence[str]) -> Record:
    """Split the samples into a fitted and a held-out part."""
    names = [run.name for run in data.experiments]
    holdout = [holdout] if isinstance(holdout, str) else holdout
    used, held = [], []
    for run in data.experiments:
        counts = np.arange(run.n_samples) >= data.n_init
        if isinstance(holdout, int | float):
            if not 0.05 <= holdout <= 0.9:
                raise DataError(f"holdout = {holdout}: give a share between 0.05 and 0.9, or names of experiments")
            late = np.arange(run.n_samples) >= round((1 - holdout) * run.n_samples)
        else:
            unknown = [name for name in holdout if name not in names]
            if unknown:
                raise DataError(f"experiment {unknown[0]!r} to hold out is unknown: the data have {', '.join(names)}")
            late = np.full(run.n_samples, run.name in holdout)
        used.append(counts & ~late)
        held.append(counts & late)
    free = sum(p.lower < p.upper for p in model.parameters)
    least = max(_LEAST_HELD, 3 * free)
    for part, samples, word in ((held, least, "held-out"), (used, 2 * least, "fitted")):
        if sum(int(p.sum()) for p in part) < samples:
            raise DataError(
                f"the {word} part has {sum(int(p.sum()) for p in part)} samples, too few to judge by: it needs "
                f"{samples}. Take a longer record or another share in holdout"
            )
    # By the order of the data: a model orders the inputs of one line by their names.
    first = next((c for c in data.inputs if c in model.input_channels), model.input_channels[0])
    return Record(data, tuple(used), tuple(held), first, model.output_channels[0])


def _base(model: Model, record: Record) -> Base:
    """Fit the base model."""
    return Base(fit(model, record.data, record.used), record.data, record.used, record.input, record.output)


def _look(
    model: Model,
    record: Record,
    base: Base,
    chosen: Sequence[Effect],
    pool: Executor | None,
    progress: Progress | None,
) -> tuple[Base, Misfit, Found]:
    """Return the base model, its misfit on the samples that count, and the causes found."""
    say = progress or _silent
    if any((u != b).any() for u, b in zip(record.used, base.used, strict=True)):
        base = _base(model, record)
    data, output = record.data, record.output
    simulated = tuple(s[output] for s in base.fit.simulated)
    shown = misfit(data, output, simulated, noise_bound=record.noise_bound, skip=data.n_init, input=record.input)
    say(shown.sentence)
    say(f"trying {len(chosen)} effects")
    return base, shown, search(record, base, chosen, pool, progress)


def _glitches(record: Record, base: Base, chosen: Sequence[Effect]) -> tuple[Effect, Detection] | None:
    """Return the glitches in the residual of the whole record; None where there are none, or no effect detects them."""
    effect = next((e for e in chosen if e.marks_glitches), None)
    if effect is None or effect.detect is None:
        return None
    detection = effect.detect(base.fit.model, record.site(base.fit))
    return None if detection is None or detection.glitches is None else (effect, detection)


def _without(record: Record, glitches: tuple[Effect, Detection] | None) -> Record:
    """Return the record without glitches in the fitted and held-out samples."""
    masks = glitches[1].glitches if glitches else None
    if masks is None:
        return record
    return replace(
        record,
        used=tuple(u & ~g for u, g in zip(record.used, masks, strict=True)),
        held=tuple(h & ~g for h, g in zip(record.held, masks, strict=True)),
    )


def _same(found: tuple[Effect, Detection], before: tuple[Effect, Detection] | None) -> bool:
    """Return whether no glitch was added."""
    new, old = found[1].glitches, before[1].glitches if before else None
    return new is None or (old is not None and not any((n & ~o).any() for n, o in zip(new, old, strict=True)))


def _noise_effects(record: Record, found: Found, chosen: Sequence[Effect]) -> list[tuple[Effect, Detection]]:
    """Return the effects on the noise that the residual of the extended model shows."""
    if found.interrupted or any(stage.tied for stage in found.stages):
        return []
    site = record.site(found.base.fit)
    result = []
    for effect in chosen:
        if effect.detect is not None and not effect.marks_glitches:
            detection = effect.detect(found.base.fit.model, site)
            if detection is not None:
                result.append((effect, detection))
    return result


def _pool(
    executor: Executor | None, workers: int | None, effects: Sequence[Effect]
) -> AbstractContextManager[Executor | None]:
    """Return the executor for the trials: the given one, own processes, or None."""
    if executor is not None:
        return nullcontext(executor)
    count = min(workers or os.cpu_count() or 1, len(effects))
    # Other processes cannot import the functions of an effect from a notebook cell.
    if count <= 1 or any(e.extend.__module__ == "__main__" for e in effects):
        return nullcontext(None)
    return ProcessPoolExecutor(count)
