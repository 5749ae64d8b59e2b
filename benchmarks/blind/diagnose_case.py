"""One blind case, drawn and diagnosed in this process; a module of its own, so that worker processes can import it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.blind.cases import TEST, draw
from benchmarks.blind.kept import diagnosed
from benchmarks.blind.score import CaseResult

if TYPE_CHECKING:
    from smid.diagnosis.cause import Cause

__all__ = ["KINDS", "diagnose_case"]

KINDS = {"single": 1, "none": 0, "none, bound withheld": 0, "pair": 2, "triple": 3}


def diagnose_case(kind: str, seed: int, samples: int, diagnoses: Path) -> CaseResult:
    """Draw a case, diagnose it in this process unless that is done, and compare.

    Parameters
    ----------
    kind : one of `KINDS`
        How many effects are hidden, and whether the diagnosis is given the noise bound.
    seed : int
        Seed of the case.
    samples : int
        Length of its record.
    diagnoses : Path
        Folder of the diagnoses; see `diagnosed`.

    Returns
    -------
    CaseResult
        With verdict "failed" when the diagnosis raised.
    """
    case = draw(seed, KINDS[kind], samples)
    named: tuple[str, ...] = ()
    rivals: tuple[str, ...] = ()
    ratio, message = float("nan"), ""
    probabilities: tuple[float, ...] = ()
    doubts: tuple[tuple[str, float], ...] = ()
    in_other_words, interrupted = 0, False
    started = time.process_time()
    try:
        result = diagnosed(case, kind, diagnoses)
    except Exception as error:  # one broken case must not end a run of hours; it counts as a failure
        verdict, seconds = "failed", time.process_time() - started
        message = f"{type(error).__name__}: {error}".replace("\n", " ").replace("|", "/")[:300]
    else:
        verdict, seconds, interrupted = str(result.verdict), result.seconds, result.interrupted
        named = tuple(_in_words_of(case.truth, cause) for cause in result.causes)
        in_other_words = sum(cause.effect != name for cause, name in zip(result.causes, named, strict=True))
        probabilities = tuple(float(cause.confidence) for cause in result.causes)
        doubts = tuple(result.doubts.items())
        if result.causes:
            rivals = tuple(str(getattr(rival, "effect", rival)) for rival in result.causes[0].rivals)
        recorded = case.data.experiments[0].values[result.output]
        rest = (recorded - case.predictable)[round((1 - TEST) * samples) :]
        ratio = float(result.gain.rmse_after) / float(np.sqrt(np.mean(rest**2)))
    strength, place = case.strength, (case.plant, case.signal)
    return CaseResult(
        kind,
        seed,
        case.truth,
        named,
        verdict,
        rivals,
        ratio,
        strength,
        *place,
        seconds,
        message,
        probabilities,
        doubts,
        in_other_words,
        interrupted,
    )


def _in_words_of(truth: Sequence[str], cause: Cause) -> str:
    """Return the name of a cause, or the hidden effect that the diagnosis says is the same equation."""
    return next((name for name in (cause.effect, *cause.synonyms) if name in truth), cause.effect)
