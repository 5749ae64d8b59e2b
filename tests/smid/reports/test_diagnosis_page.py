from dataclasses import replace

import numpy as np
import pytest

import smid
from smid.diagnosis import Fault, Verdict, prove_name
from smid.diagnosis.diagnosis import ENDED_EARLY
from smid.diagnosis.experiment import SeparatingExperiment
from smid.diagnosis.figures import (
    before_and_after,
    correlation_figure,
    experiment_figure,
    on_test_part,
    rivals_figure,
    spoken,
)
from smid.diagnosis.proof.emptiness import Emptiness
from smid.reports import report, versions
from smid.reports.mathml import equations
from tests.smid.reports.dead_zone_records import diagnosis_of, record
from tests.smid.reports.test_page import read


@pytest.fixture(scope="module")
def nothing():
    return diagnosis_of(0.0)


@pytest.fixture(scope="module")
def ambiguous(named):
    first = named.causes[0]
    rival = replace(first.rivals[0], odds=1.7, why="explains the data as well")
    names = (first.effect, rival.effect)
    sentence = f"To tell {names[0]} from {names[1]}, record a PRBS."
    return replace(
        named,
        verdict=Verdict.AMBIGUOUS,
        causes=(replace(first, rivals=(rival, *first.rivals[1:]), confidence=0.6),),
        alternatives=names,
        experiment=SeparatingExperiment("PRBS", np.tile([0.2, -0.2], 50), 0.12, names, sentence),
        model=named.base,
        extended=named.simulated,
        unexplained=True,
    )


def headings(page, *names):
    places = [page.text.index(name) for name in names]
    assert places == sorted(places), names


def test_a_named_cause_is_told_from_verdict_to_versions(named, tmp_path):
    proof = Emptiness("pressure", "bar", 0.06, "run", 20, 59, ((31, 0.4),))
    fault = Fault("quantisation", "pressure", "warning", "pressure is rounded to 0.01 bar.")
    page = read(report(replace(named, proof=proof, faults=(fault,)), tmp_path / "r.html", notes=("A note.",)))
    assert "Diagnosis of pressure: input dead zone" in page.text
    assert "Cause: input dead zone (probability more than 99.9 %). " + named.causes[0].sentence in page.text
    headings(
        page,
        "A note.",
        "What the simulation gets wrong",
        "The evidence",
        "Proven: no parameters of the base model explain samples 20 to 59",
        "RMSE on the test part",
        "Other effects, and why they are rejected",
        named.causes[0].rivals[0].why,
        "Faults in the data",
        "pressure is rounded to 0.01 bar.",
        "The extended model",
        "Before and after",
        "least noise bound that explains them",
        "not tested: it needs a further measured channel",
        "What this page does not prove",
        "Settings and versions",
        versions()["clarabel"],
    )
    assert "excluded" in page.text
    assert f"{named.gain.violations_before} of {named.gain.samples}" in page.text
    assert all(page.labels)


def test_new_parameters_are_highlighted_and_old_ones_are_not(named):
    (name,) = named.new_parameters
    assert any('class="new"' in row for row in equations(named.model, [name]))
    assert not any('class="new"' in row for row in equations(named.base, [name]))
    assert not any('class="new"' in row for row in equations(named.model))


def test_nothing_wrong_reads_well(nothing, tmp_path):
    assert nothing.verdict is Verdict.NONE
    page = read(report(nothing, tmp_path / "r.html"))
    assert "no cause named" in page.text
    assert "The error of the base model looks like noise" in page.text
    assert "How the simulation compares" in page.text
    assert "Other effects" not in page.text
    assert "extended model" not in page.text


def test_the_ambiguous_names_both_and_draws_the_experiment(ambiguous, tmp_path):
    page = read(report(ambiguous, tmp_path / "r.html"))
    assert "Diagnosis of pressure: input dead zone or input delay" in page.text
    assert "These data do not decide between input dead zone and input delay" in page.text
    headings(page, "The experiment to do next", "To tell input dead zone from input delay", "What the simulation")
    assert "Possible effects" in page.text
    assert any("experiment to do next" in label for label in page.labels)


def test_page_is_self_contained_and_escaped(named, tmp_path):
    odd = replace(named, data=replace(named.data, source="<b>simulated</b>.csv"))
    path = report(odd, tmp_path / "r.html", links={"The other page": "other.html"})
    page = read(path)
    assert [a for a in page.addresses if not a.startswith(("#", "data:image/png"))] == ["other.html"]
    assert len(page.ids) == len(set(page.ids)), "names repeat between the figures"
    assert "<b>simulated" not in path.read_text(encoding="utf-8")
    assert "simulated data, not measured" in page.text


def test_what_belongs_to_an_estimate_is_refused(named, tmp_path):
    with pytest.raises(TypeError, match="leave them out"):
        report(named, tmp_path / "r.html", truth={"a1": -0.85})


def test_an_interrupted_search_says_so(named, tmp_path):
    interrupted = replace(named, interrupted=True)
    assert ENDED_EARLY in read(report(interrupted, tmp_path / "r.html")).text
    assert ENDED_EARLY in str(interrupted)
    assert ENDED_EARLY not in str(named)


def test_before_and_after_shades_what_no_fit_has_seen(named):
    top, below = before_and_after(named).axes
    assert [line.get_label() for line in top.lines] == ["measured", "base model", "extended model"]
    (shade,) = top.patches
    begin = top.transData.inverted().transform(shade.get_extents().p0)[0]  # a rectangle, or a polygon in old versions
    assert begin == pytest.approx(0.01 * np.flatnonzero(named.test[0])[0])
    assert len(below.patches) == 2, "the test part and the noise bound"


def test_the_first_picture_shows_miss_and_cure_on_the_test_part(named, nothing, tmp_path):
    top, below = on_test_part(named).axes
    (held,) = named.test
    assert top.lines[0].get_xdata() == pytest.approx(named.data.time()[held])
    missed, cured = (np.sqrt(np.mean(np.square(line.get_ydata()))) for line in below.lines)
    assert (missed, cured) == pytest.approx((named.gain.rmse_before, named.gain.rmse_after))
    assert [line.get_label() for line in on_test_part(nothing).axes[0].lines] == ["measured", "base model"]
    assert named.plot().axes[0].get_ylabel() == "pressure [bar]"
    page = read(report(named, tmp_path / "r.html"))
    assert "on the test part" in page.labels[0]
    headings(page, named.gain_sentence, "Free runs on the test part", "What the simulation gets wrong")


def test_of_a_long_test_part_the_stretch_with_the_largest_error_is_drawn():
    count, miss = 3000, 2600
    u = np.sin(0.1 * np.arange(count))
    w = np.convolve(u, 0.5 ** np.arange(20))[:count]
    y = w + 0.01 * np.random.default_rng(0).standard_normal(count)
    y[miss : miss + 50] += 2.0
    data = smid.Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.1)
    found = smid.diagnose(smid.OutputError(), data, effects=["sensor_bias"], certify=False, workers=1)
    time = found.plot().axes[0].lines[0].get_xdata()
    assert len(time) < 500
    assert time[0] <= 0.1 * miss < 0.1 * (miss + 49) <= time[-1]


def test_correlations_of_the_error_are_cured_too(named, tmp_path):
    before, after = (named.correlations(free) for free in (named.simulated, named.extended))
    assert [one.against for one in before] == ["", "current"]
    assert before[0].outside.mean() > 0.2, "the error of the base model is slow"
    assert all(cured.outside.mean() < 0.1 for cured in after)
    figure = correlation_figure(named)
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["base model", "extended model", "", ""]
    assert figure.axes[2].get_xlim()[1] >= 0.01 * before[1].lags[-1], "lags in seconds"
    page = read(report(named, tmp_path / "r.html"))
    outside = [f"{int(one.outside.sum())} of {one.lags.size}" for one in (before[0], after[0])]
    headings(page, "Correlation of the error", "lags outside the 99 % band", *outside)


def test_rivals_stand_in_the_order_of_their_odds_and_what_is_not_significant_is_folded(named, tmp_path):
    first = named.causes[0]
    worse = replace(first.rivals[0], effect="extra_lag", odds=50.0, why="predicts worse")
    shuffled = replace(first, rivals=(first.rivals[0], worse))
    doubtful = replace(named, causes=(shuffled,), doubts={"gain": 0.02, "hysteresis": 0.2})
    path = report(doubtful, tmp_path / "r.html")
    headings(read(path), "50 to 1", "more than a million to 1")
    folded = path.read_text(encoding="utf-8").split("<details>")[1].split("</details>")[0]
    assert "2 effects not significant" in folded
    assert folded.index("hysteresis") < folded.index("gain")
    text = report(doubtful, tmp_path / "r.md").read_text(encoding="utf-8")
    assert text.count("<details>") == text.count("</details>") == 2


def test_views_of_the_error_are_folded_where_none_is_significant(named, tmp_path):
    said = "No single quantity explains the error significantly"
    assert said not in read(report(named, tmp_path / "r.html")).text
    structure = tuple(replace(found, share=0.0) for found in named.misfit.structure)
    vague = replace(named, misfit=replace(named.misfit, structure=structure))
    assert said in read(report(vague, tmp_path / "v.html")).text
    assert said in report(vague, tmp_path / "v.md").read_text()


def test_effects_that_the_test_part_does_not_show_are_told_from_none(named, nothing, tmp_path):
    details = replace(nothing, details=named.causes)
    said = "Effects explain what was fitted better, but the test part shows none of them."
    for text in (str(details), read(report(details, tmp_path / "r.html")).text):
        assert said in text
        assert "No effect is significant." not in text
    assert "No effect is significant." in str(nothing)


def test_several_experiments_stand_one_after_the_other(named):
    twice = replace(
        named,
        data=smid.Dataset.merge([named.data, record_named("again")]),
        simulated=named.simulated * 2,
        extended=named.extended * 2,
        test=named.test * 2,
    )
    top = before_and_after(twice).axes[0]
    assert len(top.lines[0].get_xdata()) == 840
    assert len(top.patches) == 2


def record_named(name):
    data = record(0.3)
    return replace(data, experiments=tuple(replace(run, name=name) for run in data.experiments))


def test_rivals_are_bars_below_the_named_effect(named):
    (axes,) = rivals_figure(named.causes[0], "bar").axes
    names = [t.get_text() for t in axes.get_yticklabels()]
    assert names[0] == "input dead zone"
    assert names[-1] == "without any of them"
    widths = [bar.get_width() for bar in axes.patches]
    assert widths[0] == min(widths)


def test_the_experiment_is_drawn_in_seconds_and_units(ambiguous):
    (axes,) = experiment_figure(ambiguous.experiment, ambiguous).axes
    assert axes.get_ylabel() == "current [A]"
    assert axes.lines[0].get_xdata()[-1] == pytest.approx(0.99)


def test_the_page_says_which_rivals_are_excluded_by_proof(named, tmp_path):
    proven = prove_name(named, 0.06, 1)
    page = read(report(proven, tmp_path / "r.html"))
    proof = proven.name_proof
    assert proof.title.rstrip(".") in page.text
    excluded = sum(found.excluded for found in proof.rivals.values())
    with_cause = f"with {spoken(named.causes[0].effect)}"
    assert f"{with_cause} {proof.extended.status}; {excluded} of {len(proof.rivals)} rivals excluded." in page.text
    for name, found in proof.rivals.items():
        assert f"with {spoken(name)} in place of {spoken(proof.against)}" in page.text
        assert ("; excluded by proof" if found.excluded else "; not excluded by proof") in page.text
