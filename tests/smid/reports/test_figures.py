import re
from dataclasses import replace

import matplotlib
import numpy as np
import pytest

import smid
from relaxations.search.enclosure import Proof
from smid.display.style import inline_svg, notebook_svg, style
from smid.identification.figures import intervals_figure
from smid.identification.lowest_order import OrderStep
from smid.reports.page import data_figure
from smid.validation.figures import simulation_figure


def texts(axes):
    return [t.get_text() for t in axes.texts]


def test_a_row_per_parameter_with_its_ends_rounded_outwards(estimate):
    figure = intervals_figure(estimate)
    assert [a.get_ylabel() for a in figure.axes] == ["a1", "b0"]
    for axes, interval in zip(figure.axes, estimate.intervals, strict=True):
        lower, upper = map(float, texts(axes))
        assert lower <= interval.lower
        assert upper >= interval.upper


def length(axes):
    """Return the length of the certified bar."""
    return axes.patches[0].get_width()


def test_bars_are_as_long_as_the_widths_in_percent_of_the_centre(estimate):
    first, second = (length(axes) for axes in intervals_figure(estimate).axes)
    widths = [i.width / abs(i.centre) for i in estimate.intervals]
    assert max(first, second) == pytest.approx(2)
    assert first / second == pytest.approx(widths[0] / widths[1])
    # Widths that differ much stay in order, and visible.
    i = estimate["a1"]
    spread = [replace(i, lower=10 - w, upper=10 + w, inner_lower=10.0, inner_upper=10.0) for w in (1e-4, 0.1, 9, 25)]
    drawn = [length(axes) for axes in intervals_figure(replace(estimate, intervals=tuple(spread))).axes]
    assert 0.1 < drawn[0] < drawn[1] < drawn[2] < drawn[3] == 2


def test_a_width_in_percent_needs_a_centre(estimate):
    assert replace(estimate["a1"], lower=-3.0, upper=-1.0).width_percent == 100
    assert np.isnan(replace(estimate["a1"], lower=-1.0, upper=1.0).width_percent)
    assert np.isnan(replace(estimate["a1"], lower=-np.inf).width_percent)


def test_the_end_of_a_prior_box_is_marked(estimate):
    assert estimate["b0"].proof_lower is Proof.BOX
    legend = [t.get_text() for t in intervals_figure(estimate).legends[0].get_texts()]
    assert "prior box" in legend
    assert len(intervals_figure(estimate).axes[1].lines) == len(intervals_figure(estimate).axes[0].lines) + 1


@pytest.mark.parametrize(
    "change",
    [
        {"lower": -np.inf, "upper": np.inf, "inner_lower": np.nan, "inner_upper": np.nan},
        {"lower": 0.5, "upper": 0.5, "inner_lower": 0.5, "inner_upper": 0.5},
        {"inner_lower": np.nan, "inner_upper": np.nan},
    ],
)
def test_degenerate_intervals_are_drawn(estimate, change):
    interval = replace(estimate["a1"], **change)
    figure = intervals_figure(replace(estimate, intervals=(interval,)))
    assert len(figure.axes) == 1
    inline_svg(figure, "one", "a")


def test_every_axis_has_its_unit(data, validation):
    assert {a.get_ylabel() for a in data_figure(data).axes} == {"y [bar]", "u [V]"}
    top, below = simulation_figure(validation).axes
    assert (top.get_ylabel(), below.get_ylabel(), below.get_xlabel()) == (
        "y [bar]",
        "error [bar]",
        "time [s]",
    )


def test_the_noise_bound_is_drawn_where_it_is_known(validation):
    assert len(simulation_figure(validation).axes[0].collections) == 1
    free = smid.validate(validation.model, validation.data)
    assert not simulation_figure(free).axes[0].collections


def test_the_users_settings_are_left_alone(estimate):
    before = dict(matplotlib.rcParams)
    inline_svg(intervals_figure(estimate), "intervals", "a")
    assert dict(matplotlib.rcParams) == before
    with style():
        assert matplotlib.rcParams["font.size"] == 9


def test_results_plot_these_figures(estimate, validation):
    assert len(estimate.plot().axes) == 2
    assert [a.get_ylabel() for a in validation.plot().axes] == ["y [bar]", "error [bar]"]


def test_what_is_known_of_least_bounds_is_drawn_where_it_is_known(estimate):
    model, words = estimate.model, ("y", "bar", 0.1)
    refused = [OrderStep(model, True, False, "", bound) for bound in (0.5, None)]
    found = smid.LowestOrder((*refused, OrderStep(model, False, True, "", None)), estimate, *words)
    (axes,) = found.plot().axes
    points = {line.get_label(): line.get_xydata().tolist() for line in axes.lines if line.get_label() != "allowed"}
    assert points == {"proven: no less": [[0, 0.5]], "verified: no more": [[2, 0.1]]}
    assert axes.get_ylabel() == "least noise bound of y [bar]"
    undecided = smid.LowestOrder((OrderStep(model, False, False, "", None),), estimate, *words)
    assert [line.get_label() for line in undecided.plot().axes[0].lines] == ["allowed"]


def test_a_picture_for_notebooks_takes_its_ink_from_the_page(validation):
    picture = notebook_svg(validation.plot(), "free run")
    assert "--ink: currentColor;" in picture
    used = set(re.findall(r"var\(--(\w+)\)", picture))
    assert {"ink", "grid", "blue", "red"} <= used
    assert all(f"--{name}: " in picture for name in used)
