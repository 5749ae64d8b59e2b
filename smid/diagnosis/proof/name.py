"""The proof of the name: what is proven of the base model, of the extended one and of its rivals, on the same samples.

The samples are a window around the largest error of the base model. On the longest one on which a fit of the extended
model is verified, base model and rivals are decided side by side (:mod:`.decide`). What fits a window fits its parts,
and what is excluded on a part is excluded on the window. So the statement is about the part on which most is decided.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from relaxations.deadline import Progress, check_seconds
from smid.data import Dataset
from smid.data.window import Window
from smid.diagnosis.cause import Cause, Rival
from smid.diagnosis.checks import processes
from smid.diagnosis.diagnosis import Diagnosis
from smid.diagnosis.proof.decide import Decision, Race, Status, fitted
from smid.diagnosis.proof.emptiness import Emptiness
from smid.diagnosis.proof.name_proof import NameProof
from smid.diagnosis.proof.window import longer, windows
from smid.feasible.feasible_set import check_noise_bound
from smid.models import Model, ModelError
from smid.models.simulated import check_equations

_NOISE = "the effect acts on the noise, which the bound limits"
_LONGER = (500, 1000)  # samples, where the extended model fits so many
_BASE = 3.0  # shares of the time for the base model, as all rests on it


def prove_name(
    diagnosis: Diagnosis,
    noise_bound: float | Mapping[str, float],
    seconds: float = 60.0,
    progress: Progress | None = None,
    *,
    workers: int | None = None,
) -> Diagnosis:
    """Return the diagnosis with the proof of its name: the base excluded, the extended model verified, rivals excluded.

    All proofs are about the same samples, around the largest error of the base model. They hold for all parameters
    within their boxes. `Diagnosis.name_proof` has the decisions; ``why`` of each rival of the first cause says whether
    the rival is excluded by proof. Where the base model is excluded, `Diagnosis.proof` says so.

    Parameters
    ----------
    noise_bound
        In the channel's unit.
    seconds
        Time allowed, wall clock.
    progress
        Called with a line of text now and then.
    workers
        Processes that share the models, as for :func:`smid.diagnose`.

    Raises
    ------
    ModelError
        For a bad noise bound or number of workers, a model without noise at its output, or the diagnosis of a recorded
        simulation.
    ProblemError
        For a time that is not positive.
    KeyboardInterrupt
        Where Ctrl-C comes before anything is proven; later it returns what is proven.

    Examples
    --------
    >>> from smid.data import Dataset
    >>> from smid.diagnosis import diagnose
    >>> from smid.models import OutputError
    >>> from smid.models.simulate import simulate
    >>> u = np.random.default_rng(0).uniform(-1, 1, 300)
    >>> y = simulate(OutputError(), {"u": u}, {"a1": -0.8, "b0": 1.0})["y"] + 0.5
    >>> y = y + np.random.default_rng(1).uniform(-0.05, 0.05, 300)
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    >>> found = diagnose(OutputError(), data, 0.05, effects=["sensor_bias"], workers=1)
    >>> proof = prove_name(found, 0.05).name_proof
    >>> str(proof.base.status), str(proof.extended.status)
    ('excluded', 'feasible')
    """
    began = time.monotonic()
    check_seconds(seconds)
    count = processes(workers)
    check_equations(diagnosis.base, "the name of a diagnosed simulation cannot be proven")
    output, bounds = diagnosis.output, check_noise_bound(diagnosis.base, noise_bound, None)
    if output not in bounds:
        raise ModelError(
            f"the model takes {output!r} as exact, so nothing can be proven: give a model with noise on it"
        )
    # The samples before the test part.
    residual = [
        (run.values[output] - free)[: np.flatnonzero(test)[0] if test.any() else None]
        for run, free, test in zip(diagnosis.data.experiments, diagnosis.simulated, diagnosis.test, strict=True)
    ]
    first = next((cause for cause in diagnosis.causes if cause.rivals), None)
    rivals = first.rivals if first else ()
    extended = _extended(diagnosis) if diagnosis.causes else None
    models = (diagnosis.base, *([extended] if diagnosis.causes else []), *(rival.model for rival in rivals))
    tried = list(windows(residual))
    tried += longer(tried[-1], len(residual[tried[-1].experiment]), _LONGER)
    window, verified = _longest(extended, diagnosis.data, tried, bounds, seconds)
    if progress:
        progress(f"proving the name on samples {window.first} to {window.last}")
    known = {k: _not_posable(window) for k, model in enumerate(models) if model is None}
    known |= {1: verified} if verified else {}
    known |= _known(diagnosis, window, bounds[output])
    race = Race(models, diagnosis.data, window, bounds, tried[: tried.index(window)], known, {0: _BASE})
    interrupted = False
    try:
        race.run(seconds - (time.monotonic() - began), count)
    except KeyboardInterrupt:
        if not any(found.status in (Status.EXCLUDED, Status.FEASIBLE) for found in race.decisions):
            raise
        interrupted = True
    window, (base, *rest) = max(((part, race.on(part)) for part in tried[: tried.index(window) + 1]), key=_decided)
    run = diagnosis.data.experiments[window.experiment].name
    proof = NameProof(
        noise_bound=bounds[output],
        unit=diagnosis.unit,
        experiment=run,
        first=window.first,
        last=window.last,
        causes=tuple(cause.effect for cause in diagnosis.causes),
        base=base,
        extended=rest[0] if rest else None,
        against=first.effect if first else "",
        rivals={r.effect: found for r, found in zip(rivals, rest[1:], strict=True)},
        interrupted=interrupted,
        seconds=time.monotonic() - began,
    )
    empty = Emptiness.of(base, output, diagnosis.unit, bounds[output], run) if base.excluded else diagnosis.proof
    causes = tuple(_judged(cause, proof) if cause is first else cause for cause in diagnosis.causes)
    return replace(diagnosis, causes=causes, proof=empty, name_proof=proof)


def _known(diagnosis: Diagnosis, window: Window, noise_bound: float) -> dict[int, Decision]:
    """Return what the diagnosis has proven of the base model, if it holds on the window and at this noise bound."""
    proof, run = diagnosis.proof, diagnosis.data.experiments[window.experiment].name
    if proof is None or proof.noise_bound < noise_bound or proof.experiment != run:
        return {}
    if not window.first <= proof.first <= proof.last <= window.last:
        return {}
    return {0: Decision(Status.EXCLUDED, proof.first, proof.last, proof.samples, "", 0.0)}


def _not_posable(window: Window) -> Decision:
    return Decision(Status.NOT_POSABLE, window.first, window.last, (), _NOISE, 0.0)


def _extended(diagnosis: Diagnosis) -> Model | None:
    """Return the extended model; None where a cause acts on the noise and is not in the model."""
    inside = {p.name for p in diagnosis.model.parameters}
    return diagnosis.model if all(inside & {p.name for p in c.parameters} for c in diagnosis.causes) else None


def _decided(stated: tuple[Window, tuple[Decision, ...]]) -> tuple[bool, bool, int, int]:
    """Return how much is decided: of the base model, of the extended one, of how many; and on how many samples."""
    window, decisions = stated
    base, *rest = decisions
    decided = sum(found.status in (Status.EXCLUDED, Status.FEASIBLE) for found in decisions)
    return base.excluded, bool(rest) and rest[0].status is Status.FEASIBLE, decided, len(window)


def _longest(
    extended: Model | None, data: Dataset, tried: Sequence[Window], bounds: Mapping[str, float], seconds: float
) -> tuple[Window, Decision | None]:
    """Return the longest window on which a fit of the extended model is verified, with the decision.

    Where there is no extended model the longest one, and where no fit is verified the shortest one, which may still be
    decided.
    """
    if extended is None:
        return tried[-1], None
    end = time.monotonic() + seconds
    for window in reversed(tried):
        found = fitted(extended, data, window, bounds, end - time.monotonic())
        if found is not None:
            return window, found
    return tried[0], None


def _judged(cause: Cause, proof: NameProof) -> Cause:
    """Return the cause with what was proven of its rivals."""

    def why(rival: Rival) -> str:
        return f"{rival.why}; " + (
            "excluded by proof" if proof.rivals[rival.effect].excluded else "not excluded by proof"
        )

    return replace(cause, rivals=tuple(replace(rival, why=why(rival)) for rival in cause.rivals))
