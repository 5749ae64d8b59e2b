"""One case, drawn and identified in this process; a module of its own, so that worker processes can import it."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np

from benchmarks.soundness.cases import SMOOTH, Case, empty_case, feasible_case, new_case
from benchmarks.soundness.library_cases import library_case
from benchmarks.soundness.score import CaseResult
from smid import CentreStatus, EmptyFeasibleSetError, Estimate, identify
from smid.diagnosis.proof.coefficients import with_free_coefficients
from smid.identification.inversion.cover import Cover
from smid.identification.inversion.record import Record
from smid.identification.windows import windowed
from smid.models import simulate

__all__ = ["check_case", "check_inversion", "check_new", "inside"]


def check_case(feasible: bool, seed: int, method: str = "auto") -> CaseResult:
    """Draw a case, identify it and judge the answer; orders and rounds vary with the seed.

    Another method than ``"auto"`` is for the smooth models; the others are always branched with the lift.
    """
    case = feasible_case(seed) if feasible else empty_case(seed)
    return _judged(
        case,
        seed,
        method=method if case.kind in SMOOTH else "auto",
        order=1 if seed % 4 and method == "auto" else None,
        rounds=1 + seed % 3,
        tolerance=0.5 if case.kind not in SMOOTH else 1e-2,
    )


def check_new(feasible: bool, seed: int) -> CaseResult:
    """Draw a case of the kinds behind ``--new``; windows prove records of a hundred samples, however many they hold."""
    windowed.LONG, windowed._SHARE, windowed.MOST_PIECEWISE = 100, 1.0, 100
    case = new_case(feasible, seed)
    return _judged(case, seed, tolerance=0.5, outliers=case.outliers)


def check_inversion(feasible: bool, seed: int, seconds: float) -> CaseResult:
    """Draw a case of the effect library, invert its free run, and judge the answer.

    Intervals are asked for, and then whether any point fits, in turned coordinates and with free coefficients, as for a
    proof of a name.
    """
    case = library_case(feasible, seed)
    result = _judged(case, seed, method="inversion", tolerance=float(10.0 ** -(seed % 3)), seconds=seconds)
    if result.is_false or result.verdict == "failed":
        return result
    try:
        cover = _covered(case, seconds)
    except Exception as error:  # as below
        return replace(result, verdict="failed", message=f"{type(error).__name__}: {error}"[:300])
    if feasible and not cover.boxes:
        return replace(result, verdict="called empty", message="in turned coordinates")
    if cover.points and not feasible:
        return replace(result, verdict="called feasible", message="in turned coordinates")
    if feasible and is_emptied(case, seconds):
        return replace(result, verdict="called empty", message="with free coefficients")
    return result


def is_emptied(case: Case, seconds: float) -> bool:
    """Return whether the set is called empty with free coefficients, or with what these say of the parameters."""
    record = Record(case.model, case.data, case.noise_bound)
    for freed in with_free_coefficients(record, case.noise_bound):
        cover = _searched(freed.record, seconds)
        if not cover.boxes:
            return True
        record = freed.told(record, case.noise_bound, *cover.outer)
    return not _searched(record, seconds).boxes


def _covered(case: Case, seconds: float) -> Cover:
    """Cover the set by boxes in turned coordinates, until one point fits or none can."""
    with np.errstate(all="ignore"):
        signals = simulate(case.model, case.data.experiments[0].values, case.truth, check=False)
    return _searched(Record(case.model, case.data, case.noise_bound).turned(signals), seconds)


def _searched(record: Record, seconds: float) -> Cover:
    cover = Cover(record, 0.0)
    until = time.perf_counter() + seconds
    while cover.boxes and not cover.points and time.perf_counter() < until:
        cover.step()
    return cover


def _judged(case: Case, seed: int, **settings: Any) -> CaseResult:
    """Identify a case and judge the answer."""
    feasible, started, message = case.construction == "feasible", time.perf_counter(), ""
    try:
        estimate = identify(case.model, case.data, case.noise_bound, **settings)
    except EmptyFeasibleSetError as error:
        verdict = "called empty" if feasible else "certified empty"
        message = str(error)[:200] if feasible else ""
    except Exception as error:  # one broken case must not end a long run; it is reported
        verdict, message = "failed", f"{type(error).__name__}: {error}".replace("\n", " ").replace("|", "/")[:300]
    else:
        verdict, message = inside(estimate, case.truth) if feasible else _never_feasible(estimate)
        message = message or ("windows" if estimate.windows else "")
    kind = f"{case.kind}, {case.outliers} outliers" if case.outliers else case.kind
    return CaseResult(
        kind, case.construction, seed, case.data.n_samples, verdict, time.perf_counter() - started, message
    )


def inside(estimate: Estimate, truth: Mapping[str, float | Fraction]) -> tuple[str, str]:
    """Compare the intervals with the parameters that made the data, and with their own witnesses; exactly."""
    for interval in estimate.intervals:
        true = truth[interval.name]
        if not float(interval.lower) <= true <= float(interval.upper):
            return "truth outside", f"{interval.name} = {true!r} outside [{interval.lower!r}, {interval.upper!r}]"
        inner = interval.inner_lower, interval.inner_upper
        if not np.isnan(inner[0]) and not interval.lower <= inner[0] <= inner[1] <= interval.upper:
            return "witness outside", f"{interval.name}: {inner} outside [{interval.lower!r}, {interval.upper!r}]"
    if estimate.unbounded:
        return "inside, no box", ""
    return "inside", ""


def _never_feasible(estimate: Estimate) -> tuple[str, str]:
    """Look for a verified witness or centre: it would call an empty set feasible."""
    witnessed = [i.name for i in estimate.intervals if not (np.isnan(i.inner_lower) and np.isnan(i.inner_upper))]
    if witnessed or estimate.centre_status is CentreStatus.FEASIBLE or estimate.nearest is not None:
        return "called feasible", f"witness for {', '.join(witnessed)}; centre {estimate.centre_status.name}"
    return "undecided", estimate.reason.name.lower()
