"""The page of section 3.3, recursive estimation, and of the recursive set-membership that section 6.2 asks for."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path

from smid.display.table import Table, figure
from smid.recursive import Tracking
from smid.reports.chapter import chapter_page
from smid.reports.content import Picture, Section
from smid.reports.documents import study_document
from smid.reports.formats import write_page
from smid.theses.clutch.recursive_study import THESIS, RecursiveStudy
from smid.theses.clutch.set_study import SetStudy

__all__ = ["recursive_page"]

_SHOWN = "20C_step_a"  # figures 3.8 to 3.11

_NOT_COMPARED = (
    "The thesis's records are confidential, its figures normalised. Ours are simulated; the errors of the two cannot "
    "be compared as numbers, but for the a posteriori error, which is rounding in both.",
    "Its only number is the bound 2e-14 on the relative error. Errors one step ahead and in a free run are not told.",
    "The settings of its Kalman filter and the gain of its unnormalised gradient beyond 'all possible values' are not "
    "told. Ours come from one record by rules, and are not tuned to the others.",
    "It has no recursive set-membership: that is its first wish for future work.",
    "The records were sampled irregularly and brought to 2 ms by straight lines. That adds to the noise of the "
    "pressure, most at steps. So a proof at the sensor's own bound of 0.3 bar speaks of the samples as loaded.",
)


def recursive_page(
    study: RecursiveStudy, sets: SetStudy, path: str | PathLike[str], settings: Mapping[str, str] | None = None
) -> Path:
    """Write the page of the recursive studies.

    Raises
    ------
    ValueError, OSError
        Where the path names no format, or cannot be written.

    Examples
    --------
    The study takes minutes and is not run here; ``smid clutch recursive --report recursive.html`` does the same.

    >>> from smid.theses.clutch.recursive_study import recursive_study
    >>> from smid.theses.clutch.set_study import set_study
    >>> page = recursive_page(recursive_study(), set_study(), "recursive.html")  # doctest: +SKIP
    """
    unit = study.on_noise.unit
    models = list(dict.fromkeys(str(t.arx) for t in study.comparison.trackings))
    sections = (
        Section("The thesis beside this study", (_beside_thesis(study),)),
        Section(
            "What an a posteriori error of 2e-14 means",
            (
                study.meaning,
                "With gain 1 the normalised gradient moves the parameters, at each sample, until they explain that "
                "very sample. Whatever the data are, its error is then zero but for rounding.",
                *(
                    Picture(tracking.plot(), f"{tracking.method} on {tracking.record}: output, errors, parameters.")
                    for tracking in _on(study, _SHOWN, models[0])
                    if tracking.method == study.on_noise.method
                ),
            ),
        ),
        Section(
            "The adaptation gain, figure 3.12",
            (
                f"One step ahead the error is least at gain {figure(study.gains.best)}. Holding the last pressure errs "
                f"by {figure(study.gains.trackings[0].held.rmse)} {unit} RMS.",
                study.gains.table,
                Picture(study.gains.plot(), "RMSE of the three errors over the adaptation gain."),
            ),
        ),
        Section(
            "All methods on all records, figures 3.8 to 3.20",
            (
                "One step ahead an estimator competes with holding the last pressure. A free run, with the last "
                "parameters frozen, tells whether there is a model. 20C_step_b, 60C_step_c and m20C_step_c are the "
                "records with hysteresis. A dash: the run grew without bound.",
                *(_by_record(study, model, kind, unit) for model in models for kind in ("one step ahead", "free run")),
                Picture(study.plot(), "RMSE of the three errors, method by method and record by record."),
            ),
        ),
        Section(
            "Recursive set-membership: known plants",
            (
                "At every sample the estimator certifies intervals that hold the parameters. They hold more than the "
                "batch intervals do, for an update must be cheap.",
                sets.change,
                sets.against_batch,
                sets.at_end,
                Picture(sets.plot(), "Certified intervals in time of a plant whose pole changes half way."),
            ),
        ),
        Section(
            "Recursive set-membership: the actuator",
            (
                "An empty set proves that no constant parameters, with a stable pole and coefficients within 1 bar, "
                "explain the samples since the set was begun. The thesis concludes that every input range has a model "
                "of its own; here it is proven, with times, that none serves for all.",
                sets.of_records,
            ),
        ),
    )
    page = chapter_page(
        "Clutch, section 3.3: recursive estimation, and recursive set-membership",
        f"{study.meaning} {sets.conclusion}",
        sections,
        study.comparison.trackings[0].data,
        document=study_document("clutch-recursive", {"estimators": study.to_dict(), "sets": sets.to_dict()}),
        not_compared=_NOT_COMPARED,
        settings=settings,
    )
    return write_page(page, path)


def _on(study: RecursiveStudy, record: str, model: str) -> list[Tracking]:
    return [t for t in study.comparison.trackings if t.record == record and str(t.arx) == model]


def _beside_thesis(study: RecursiveStudy) -> Table:
    unit, noise = study.on_noise.unit, study.on_noise
    same = [t for t in study.comparison.trackings if (t.arx, t.method) == (noise.arx, noise.method)]

    def span(of: Callable[[Tracking], float]) -> str:
        found = sorted(of(t) for t in same)
        return f"{figure(found[0])} to {figure(found[-1])} {unit}"

    rows = (
        (
            "a posteriori error",
            f"relative, at most {THESIS:g}",
            f"at most {figure(max(t.largest_left_alone for t in same))} {unit}",
        ),
        ("a posteriori, output replaced by noise", "not tried", f"at most {figure(noise.largest_left_alone)} {unit}"),
        ("one step ahead, RMSE", "not told", span(lambda t: t.one_step.rmse)),
        ("holding the last pressure, RMSE", "not told", span(lambda t: t.held.rmse)),
        ("free run with frozen parameters, RMSE", "not told", span(lambda t: t.free_run.rmse)),
        ("best adaptation gain", "1, by the a posteriori error", f"{figure(study.gains.best)}, one step ahead"),
    )
    return Table(f"{noise.method}, {noise.arx}, on all records.", ("", "thesis", "our records"), rows, "lll")


def _by_record(study: RecursiveStudy, model: str, kind: str, unit: str) -> Table:
    records = list(dict.fromkeys(t.record for t in study.comparison.trackings))
    found = {record: _on(study, record, model) for record in records}
    methods = [str(t.method) for t in found[records[0]]]
    holds = kind == "one step ahead"
    rows = tuple(
        (
            record,
            *(figure(t.residuals[kind].rmse) for t in runs),
            *([figure(runs[0].held.rmse)] if holds else []),
        )
        for record, runs in found.items()
    )
    header = ("record", *methods, *(["last pressure held"] if holds else []))
    return Table(f"{model}: RMSE {kind} [{unit}].", header, rows, "l" + "r" * (len(header) - 1))
