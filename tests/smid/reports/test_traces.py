"""Figures over time as numbers: nothing that a picture shows is lost, and pages hold the library only where needed."""

import base64

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from matplotlib.figure import Figure

import smid
from smid.display.style import RED, SHADE, SKY
from smid.reports.content import Picture
from smid.reports.html import as_fragment
from smid.reports.traces import LONG, MOST_POINTS, bin_size, thinned, traces_of

LIBRARY = "https://github.com/leeoniya/uPlot (v"


def figure_of(count=1200, start=5.0):
    """A figure with all that a zoomable one may hold, in two panels."""
    figure = Figure()
    top, below = figure.subplots(2, 1, sharex=True)
    time = start + 0.1 * np.arange(count)
    values = np.sin(time)
    values[100:150] = np.nan
    top.fill_between(time, values - 0.1, values + 0.1, color=SKY, alpha=0.4, label="band")
    top.plot(time, values, label="measured")
    top.plot(time[::7], values[::7], color=RED, linestyle="", marker=".")
    top.axvspan(time[10], time[20], color=SHADE)
    below.fill_between(time, values, values + 1, step="post")
    below.plot(time, values, drawstyle="steps-post")
    below.axhline(0.5, linestyle="--", label="level")
    below.axhspan(-1, 2)
    top.set_ylabel("y [bar]")
    below.set_xlabel("time [s]")
    return figure, time, values


def numbers(row):
    offset, text = row
    return offset + np.frombuffer(base64.b64decode(text), "<f4").astype(float)


@settings(max_examples=60, deadline=None)
@given(
    arrays(np.float64, st.integers(2, 300), elements=st.one_of(st.floats(-1e6, 1e6), st.just(np.nan))),
    st.integers(2, 40),
)
def test_each_bin_keeps_its_least_and_its_largest_sample_and_gaps_stay_gaps(values, size):
    found = thinned(values, size).reshape(-1, 2)
    assert len(found) == -(-len(values) // size)
    for k, pair in enumerate(found):
        inside = values[k * size : (k + 1) * size]
        known = inside[~np.isnan(inside)]
        if known.size:
            assert sorted(pair) == [known.min(), known.max()]
        else:
            assert np.isnan(pair).all()


@given(st.integers(1, 10**8))
def test_no_series_has_more_points_than_the_limit(samples):
    size = bin_size(samples)
    assert (samples if size == 1 else 2 * -(-samples // size)) <= MOST_POINTS


def test_all_that_a_figure_shows_is_there():
    figure, time, values = figure_of()
    found = traces_of(figure)
    assert (found.label, found.start, found.samples, found.whole) == ("time", 5.0, len(time), True)
    assert found.step == pytest.approx(0.1)
    top, below = found.panels
    assert top.label == "y [bar]"
    band, line, dots = top.traces
    np.testing.assert_allclose(band.rows, [values - 0.1, values + 0.1])
    np.testing.assert_array_equal(line.rows[0], values)
    np.testing.assert_array_equal(dots.rows[0][::7], values[::7])
    assert np.isnan(np.delete(dots.rows[0], np.s_[::7])).all()
    assert (band.look["colour"], band.look["alpha"], band.look["label"]) == ("--sky", 0.4, "band")
    assert (dots.look["colour"], dots.look["width"]) == ("--red", 0)
    assert top.shades[0][:2] == pytest.approx((time[10], time[20]))
    stairs, span, steps, level = below.traces
    np.testing.assert_allclose(stairs.rows, [values, values + 1])
    assert stairs.look["steps"]
    assert [row.tolist() for row in span.rows] == [[-1], [2]]
    assert steps.look["steps"]
    assert (level.rows[0].tolist(), level.look["label"]) == ([0.5], "level")


def test_the_numbers_of_a_page_keep_small_changes_of_a_large_value():
    figure, values = Figure(), 101325 + 0.01 * np.sin(np.arange(30_000.0))
    axes = figure.subplots()
    axes.plot(0.5 * np.arange(30_000), values)
    axes.set_xlabel("time [s]")
    plain = traces_of(figure).to_dict()
    row = numbers(plain["panels"][0]["traces"][0]["rows"][0])
    assert len(row) == plain["points"] <= MOST_POINTS
    np.testing.assert_allclose(row, thinned(values, 3), rtol=0, atol=1e-8)
    assert plain["step"] == pytest.approx(0.75)
    assert plain["note"] == "Each bin of 1.5 s is shown by its least and its largest sample. "


def test_a_figure_that_was_drawn_before_gives_the_same():
    figure, *_ = figure_of(3000)
    before = traces_of(figure).to_dict()
    as_fragment([Picture(figure, "drawn")], "x")
    assert figure.axes[1].get_xlabel() == "time [min]"
    assert traces_of(figure).to_dict() == before


@pytest.mark.parametrize(
    "change",
    [
        lambda figure: figure.axes[0].text(0, 0, "note"),
        lambda figure: figure.axes[0].set_yscale("symlog"),
        lambda figure: figure.axes[0].scatter([6], [0]),
        lambda figure: figure.axes[0].bar([6], [1]),
        lambda figure: figure.axes[0].set_title("title", loc="left"),
        lambda figure: figure.axes[0].plot([6.01, 6.02], [0, 1]),
        lambda figure: figure.axes[0].plot([5.0, 1e9], [0, 1]),
        lambda figure: figure.axes[0].plot([5.0, np.nan], [0, 1]),
        lambda figure: figure.axes[0].plot(np.zeros(2000), np.zeros(2000)),
        lambda figure: figure.axes[1].set_xlabel("frequency [Hz]"),
    ],
)
def test_a_figure_with_something_else_stays_a_picture(change):
    figure, *_ = figure_of()
    change(figure)
    assert traces_of(figure) is None


def test_a_short_figure_stays_a_picture():
    assert traces_of(figure_of(LONG)[0]) is None
    assert traces_of(Figure()) is None


def test_a_page_holds_the_library_once_and_only_if_a_figure_needs_it(tmp_path):
    def page(count):
        u = np.arange(count) % 7.0
        data = smid.Dataset.from_arrays(input={"u": u}, output={"y": u}, sampling_time=1.0)
        return smid.report(data, tmp_path / f"{count}.html").read_text("utf-8")

    assert page(LONG + 1).count(LIBRARY) == 1
    assert "<script" not in page(LONG)


def test_a_fragment_has_no_script():
    assert "<script" not in as_fragment([Picture(figure_of()[0], "long")], "x")
