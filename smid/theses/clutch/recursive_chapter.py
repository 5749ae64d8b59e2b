"""Recursive estimation (section 3.3 of the thesis) and recursive set-membership (section 6.2) in one study."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from math import isfinite

from smid.data import Dataset
from smid.display.table import Table, figure
from smid.recursive import Tracking
from smid.recursive.figures import traces_figure
from smid.theses.chapter import Chapter, Drawing, Topic
from smid.theses.clutch.recursive_study import SHOWN, THESIS, RecursiveStudy
from smid.theses.clutch.set_study import SetStudy

__all__ = ["RecursiveChapter"]


@dataclass(frozen=True, eq=False, repr=False)
class RecursiveChapter(Chapter):
    """The recursive estimators, and the recursive sets."""

    title = "Clutch, section 3.3: recursive estimation, and recursive set-membership"
    command = "clutch recursive"
    not_compared = (
        "The thesis's records are confidential and its figures are normalised. Our records are simulated. Their errors "
        "cannot be compared as numbers, except the a posteriori error, which is rounding in both cases.",
        "The only number of the thesis is the bound 2e-14 on the relative error. It does not state the errors one step "
        "ahead and in a free run.",
        "The thesis does not state the settings of its Kalman filter, nor the gain of its unnormalised gradient beyond "
        "'all possible values'. Ours follow rules from one record, and are not tuned to the other records.",
        "The thesis has no recursive set-membership. It is its first wish for future work.",
        "The records were sampled irregularly and interpolated linearly to 2 ms. The interpolation adds to the noise "
        "of the pressure, most at steps. A proof at the sensor's bound of 0.3 bar is valid for the samples as loaded.",
    )

    estimators: RecursiveStudy
    sets: SetStudy

    @property
    def conclusion(self) -> str:
        """Return the conclusions of both parts."""
        return f"{self.estimators.meaning} {self.sets.conclusion}"

    def records(self) -> Dataset:
        """Return the records of the estimators."""
        return self.estimators.comparison.trackings[0].data

    def topics(self) -> Iterator[Topic]:
        """Return the comparison with the thesis, the estimators, and the sets."""
        study, sets = self.estimators, self.sets
        unit = study.on_noise.unit
        models = list(dict.fromkeys(str(t.arx) for t in study.comparison.trackings))
        yield Topic("Comparison with the thesis", self._against_thesis())
        yield Topic(
            "The meaning of an a posteriori error of 2e-14",
            study.meaning,
            "With gain 1 the normalised gradient moves the parameters, at each sample, until they explain that sample. "
            "Its error is then zero except for rounding, whatever the data are.",
            *(
                Drawing(tracking.plot, f"{tracking.method} on {tracking.record}: output, errors, parameters.")
                for tracking in self._on(SHOWN, models[0])
                if tracking.method == study.on_noise.method
            ),
        )
        yield Topic(
            "The adaptation gain, figure 3.12",
            f"The error one step ahead is smallest at gain {figure(study.gains.best)}. Holding the last pressure gives "
            f"an RMSE of {figure(study.gains.trackings[0].held.rmse)} {unit}.",
            study.gains.table,
            Drawing(study.gains.plot, "RMSE of the three errors over the adaptation gain."),
        )
        gradient = study.unnormalised
        yield Topic(
            "The unnormalised gradient at all gains",
            f"Of all gains, {figure(gradient.best)} has the smallest RMSE one step ahead, "
            f"{figure(min(t.one_step.rmse for t in gradient.trackings if isfinite(t.one_step.rmse)))} {unit}. Holding "
            f"the last pressure gives {figure(gradient.trackings[0].held.rmse)} {unit}. The stability rule is violated "
            f"above {figure(gradient.largest_gain)}.",
            gradient.table,
            Drawing(gradient.plot, "RMSE of the three errors over the gain of the unnormalised gradient."),
        )
        yield Topic(
            "Traces, figures 3.8 to 3.11 and 3.13 to 3.20",
            "After the update, the model of the normalised gradient passes through each sample, because it was fitted "
            "to that sample. The free run has the last parameters. An axis covers the measured range.",
            *(
                Drawing(partial(traces_figure, self._on(SHOWN, model), "method"), f"{model}: the methods on {SHOWN}.")
                for model in models[:1]
                if self._on(SHOWN, model)
            ),
            Drawing(
                partial(
                    traces_figure, [t for t in study.normalised if t.record != SHOWN] or study.normalised, "record"
                ),
                f"{study.on_noise.method}, {study.on_noise.arx}, on the other records.",
            ),
        )
        yield Topic(
            "All methods on all records, figures 3.8 to 3.20",
            "The error one step ahead must be compared with that of holding the last pressure. A free run with the "
            "last parameters shows whether they are a model of the plant. 20C_step_b, 60C_step_c and m20C_step_c are "
            "the records with hysteresis. A dash: the run diverged.",
            study.summary,
            *(self._by_record(model, kind) for model in models for kind in ("one step ahead", "free run")),
            Drawing(study.plot, "RMSE of the three errors, by method and record."),
        )
        yield Topic(
            "Recursive set-membership: known plants",
            "At every sample the estimator certifies intervals that contain the parameters. They are wider than the "
            "batch intervals, because an update must be fast.",
            sets.change,
            sets.against_batch,
            sets.at_end,
            Drawing(sets.plot, "Certified intervals over time; the pole of the plant changes half way."),
        )
        yield Topic(
            "Recursive set-membership: the actuator",
            "An empty set is a proof: no constant parameters, with a stable pole and coefficients within 1 bar, "
            "explain the samples since the set was started. The thesis concludes that every input range has a model "
            "of its own. Here it is proven, with times, that no constant model fits all samples.",
            sets.of_records,
        )

    def _on(self, record: str, model: str) -> list[Tracking]:
        return [t for t in self.estimators.comparison.trackings if t.record == record and str(t.arx) == model]

    def _against_thesis(self) -> Table:
        unit, noise, gains = self.estimators.on_noise.unit, self.estimators.on_noise, self.estimators.gains
        same = self.estimators.normalised

        def span(of: Callable[[Tracking], float]) -> str:
            found = sorted(map(of, same))
            return f"{figure(found[0])} to {figure(found[-1])} {unit}"

        posterior, on_noise = figure(max(t.largest_left_alone for t in same)), figure(noise.largest_left_alone)
        rows = (
            ("a posteriori error", f"relative, at most {THESIS:g}", f"at most {posterior} {unit}"),
            ("a posteriori, output replaced by noise", "not tried", f"at most {on_noise} {unit}"),
            ("one step ahead, RMSE", "not stated", span(lambda t: t.one_step.rmse)),
            ("holding the last pressure, RMSE", "not stated", span(lambda t: t.held.rmse)),
            ("free run with constant parameters, RMSE", "not stated", span(lambda t: t.free_run.rmse)),
            ("best adaptation gain", "1, by the a posteriori error", f"{figure(gains.best)}, one step ahead"),
        )
        return Table(f"{noise.method}, {noise.arx}, on all records.", ("", "thesis", "our records"), rows, "lll")

    def _by_record(self, model: str, kind: str) -> Table:
        records = list(dict.fromkeys(t.record for t in self.estimators.comparison.trackings))
        found = {record: self._on(record, model) for record in records}
        methods = [str(t.method) for t in found[records[0]]]
        holds = kind == "one step ahead"
        rows = tuple(
            (record, *(figure(t.residuals[kind].rmse) for t in runs), *([figure(runs[0].held.rmse)] if holds else []))
            for record, runs in found.items()
        )
        header = ("record", *methods, *(["last pressure held"] if holds else []))
        caption = f"{model}: RMSE {kind} [{self.estimators.on_noise.unit}]."
        return Table(caption, header, rows, "l" + "r" * (len(header) - 1))
