"""The strict protocol of ``python -m benchmarks.peers``, with the peer that needs no other package."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from benchmarks import measured_cases
from benchmarks.measured_cases import Case
from benchmarks.measured_diagnosis import HEAD, TEST_HEAD
from benchmarks.peers import compare
from benchmarks.peers.arx import PEER
from benchmarks.peers.compare import Row, smid_figures
from benchmarks.peers.protocol import FreeRun, Run, Settings, identified, rmse, run_of
from smid import Dataset, OutputError
from smid.diagnosis.parts import split
from smid.fitting.binding import bind

MODEL = OutputError(2, 1, offset=True)


def record(noise: float) -> Dataset:
    rng = np.random.default_rng(5)
    runs = []
    for name in ("first", "second", "third"):
        u = rng.normal(size=200)
        y = 3 + lfilter([0, 0, 0, 0.5], [1, -1.2, 0.5], u) + noise * rng.normal(size=200)
        runs.append(Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0, name=name))
    return runs[0].with_experiments([run.experiments[0] for run in runs])


def measured(
    data: Dataset, share: float | tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> tuple[list[Row], list[Run], list[np.ndarray]]:
    """Return the rows of a record, the runs that the peer was fitted to, and the answers of its free runs."""
    fitted: list[Run] = []
    answers: list[np.ndarray] = []

    def spy(runs: Sequence[Run], settings: Settings) -> FreeRun:
        fitted.extend(runs)
        free_run = PEER.fit(runs, settings)

        def watched(inputs: np.ndarray, known: np.ndarray) -> np.ndarray:
            answers.append(free_run(inputs, known))
            return answers[-1]

        return watched

    monkeypatch.setattr(measured_cases, "load_record", lambda *_: data)
    case = Case("simulated", lambda full: full, "", MODEL, "", "", share)
    return compare.rows(case, Path(), [replace(PEER, fit=spy)]), fitted, answers


@pytest.mark.parametrize("share", [0.2, ("second",)])
def test_a_peer_never_gets_an_output_of_the_test_part(
    share: float | tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    data = record(noise=0.05)
    masks = split(bind(MODEL, data), data, share).test
    nonsense = data.with_experiments(
        [
            replace(
                run, values=run.values | {"y": np.where(mask, 1e3 * (1 + np.arange(mask.size) % 7), run.values["y"])}
            )
            for run, mask in zip(data.experiments, masks, strict=True)
        ]
    )
    plain, fitted, answers = measured(data, share, monkeypatch)
    changed, fitted_again, answers_again = measured(nonsense, share, monkeypatch)
    assert plain[0].settings == changed[0].settings
    assert changed[0].rmse[0] is None or changed[0].rmse[0] > 100 * plain[0].rmse[0]
    assert len(fitted) == len(fitted_again) > 0
    for before, after in zip(fitted, fitted_again, strict=True):
        np.testing.assert_array_equal(before.output, after.output)
        np.testing.assert_array_equal(before.inputs, after.inputs)
    for answer, again in zip(answers, answers_again, strict=True):
        np.testing.assert_array_equal(answer, again)


def test_nonsense_in_the_inputs_of_the_test_part_changes_no_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    data = record(noise=0.05)
    nonsense = data.with_experiments(
        [
            replace(run, values=run.values | {"u": np.r_[run.values["u"][:160], np.full(40, 1e3)]})
            for run in data.experiments
        ]
    )
    plain, fitted, _ = measured(data, 0.2, monkeypatch)
    changed, fitted_again, _ = measured(nonsense, 0.2, monkeypatch)
    assert plain[0].settings == changed[0].settings
    for before, after in zip(fitted, fitted_again, strict=True):
        np.testing.assert_array_equal(before.inputs, after.inputs)
        np.testing.assert_array_equal(before.output, after.output)


def test_arx_is_simulated_from_its_first_samples() -> None:
    data = record(noise=0.0)
    *seen, last = (run_of(data, run) for run in data.experiments)
    _, free_run = identified(PEER, seen)
    np.testing.assert_allclose(free_run(last.inputs, last.output[:50]), last.output, atol=1e-8)
    shifted = Run(last.inputs, np.r_[last.output[:50], last.output[50:] + 1])
    assert rmse(free_run, [(shifted, 50)]) == pytest.approx(1)


def test_a_divergent_free_run_has_no_rmse() -> None:
    run = Run(np.zeros((300, 1)), np.sin(np.arange(300)))
    assert rmse(lambda inputs, _: 2.0 ** np.arange(len(inputs)), [(run, 10)]) is None


def test_figures_of_smid_come_from_the_page_of_the_strict_protocol_only() -> None:
    page = (
        f"{HEAD}| a | dead zone | `x` (y) | 2 | 1 V | 30 |\n{TEST_HEAD}| a | 2000 mV | 900 mV | 800 |\n\n## Sentences\n"
    )
    assert smid_figures(page) == {("a", False): ("2", "1 V"), ("a", True): ("2000 mV", "900 mV")}
    # Another table on the page says something else of the same record.
    other = "| record | held out |\n|---|---|\n| a | 9 | 9 | 9 | 9 |\n\n"
    assert smid_figures(page.replace("## Sentences", other + "## Sentences")) == smid_figures(page)
    with pytest.raises(SystemExit, match="measured_diagnosis FOLDER"):
        smid_figures(page.replace("test RMSE", "held-out RMSE"))
