"""The proof of the name: what is proven of the base model, of the extended one and of its rivals, on the same samples.

Windows grow around the largest error of the base model, each within the next. What is excluded on a window is excluded
on every longer one. A feasible point has to be verified on each anew. The longest window on which the extended model is
verified makes the statement.
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
from smid.diagnosis.diagnosis import Diagnosis
from smid.diagnosis.proof.decide import Decision, Status, decide
from smid.diagnosis.proof.emptiness import Emptiness
from smid.diagnosis.proof.name_proof import NameProof
from smid.diagnosis.proof.window import windows
from smid.feasible.feasible_set import check_noise_bound
from smid.models import Model, ModelError
from smid.models.simulated import check_equations

_NOISE = "the effect acts on the noise, which the bound limits"


def prove_name(
    diagnosis: Diagnosis,
    noise_bound: float | Mapping[str, float],
    seconds: float = 60.0,
    progress: Progress | None = None,
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

    Raises
    ------
    ModelError
        For a bad noise bound, a model without noise at its output, or the diagnosis of a recorded simulation.
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
    models = (diagnosis.base, *([_extended(diagnosis)] if diagnosis.causes else []), *(r.model for r in rivals))
    tried = list(windows(residual))
    # Begin with the samples on which the base model is excluded already.
    known, begun = _known(diagnosis, bounds[output]), [w for w in tried if _holds(w, diagnosis)]
    tried, known = (begun, known) if known and begun else (tried, ())
    stated: tuple[Decision, ...] = ()
    interrupted = False
    try:
        for number, window in enumerate(tried):
            left = seconds - (time.monotonic() - began)
            if stated and (_is_complete(stated) or left <= 0):
                break
            if progress:
                progress(f"proving the name on samples {window.first} to {window.last}")
            found = _decided(models, diagnosis.data, window, bounds, stated or known, left / (len(tried) - number))
            if stated and _is_verified(stated) and not (_is_verified(found) or found[1].excluded):
                break
            stated = found
    except KeyboardInterrupt:
        if not stated:
            raise
        interrupted = True
    base, *rest = stated
    run = diagnosis.data.experiments[tried[0].experiment].name
    proof = NameProof(
        noise_bound=bounds[output],
        unit=diagnosis.unit,
        experiment=run,
        first=min(one.first for one in stated),
        last=max(one.last for one in stated),
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


def _known(diagnosis: Diagnosis, noise_bound: float) -> tuple[Decision, ...]:
    """Return what the diagnosis has proven of the base model, if it holds at this noise bound."""
    proof = diagnosis.proof
    if proof is None or proof.noise_bound < noise_bound:
        return ()
    return (Decision(Status.EXCLUDED, proof.first, proof.last, proof.samples, "", 0.0),)


def _holds(window: Window, diagnosis: Diagnosis) -> bool:
    """Return whether a window holds the samples on which the base model is excluded already."""
    proof, run = diagnosis.proof, diagnosis.data.experiments[window.experiment]
    return (
        proof is not None and proof.experiment == run.name and window.first <= proof.first and proof.last <= window.last
    )


def _extended(diagnosis: Diagnosis) -> Model | None:
    """Return the extended model; None where a cause acts on the noise and is not in the model."""
    inside = {p.name for p in diagnosis.model.parameters}
    return diagnosis.model if all(inside & {p.name for p in c.parameters} for c in diagnosis.causes) else None


def _decided(
    models: Sequence[Model | None],
    data: Dataset,
    window: Window,
    bounds: Mapping[str, float],
    known: Sequence[Decision],
    seconds: float,
) -> tuple[Decision, ...]:
    """Decide every model on a window; what is excluded on a part of the window stays excluded."""
    result: list[Decision] = []
    end = time.monotonic() + seconds
    for number, model in enumerate(models):
        if number < len(known) and known[number].excluded:
            result.append(known[number])
        elif model is None:
            result.append(Decision(Status.NOT_POSABLE, window.first, window.last, (), _NOISE, 0.0))
        else:
            share = (end - time.monotonic()) / (len(models) - number)
            result.append(decide(model, data, window, bounds, share))
    return tuple(result)


def _is_complete(stated: Sequence[Decision]) -> bool:
    """Return whether a longer window can prove nothing more."""
    base, *rest = stated
    settled = (Status.EXCLUDED, Status.NOT_POSABLE)
    return base.excluded and all(one.status in settled for one in rest[1:])


def _is_verified(stated: Sequence[Decision]) -> bool:
    return len(stated) > 1 and stated[1].status is Status.FEASIBLE


def _judged(cause: Cause, proof: NameProof) -> Cause:
    """Return the cause with what was proven of its rivals."""

    def why(rival: Rival) -> str:
        return f"{rival.why}; " + (
            "excluded by proof" if proof.rivals[rival.effect].excluded else "not excluded by proof"
        )

    return replace(cause, rivals=tuple(replace(rival, why=why(rival)) for rival in cause.rivals))
