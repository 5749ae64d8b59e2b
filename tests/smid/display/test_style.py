"""Figures on pages: time in its unit, nothing cut off."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from smid.display.style import WIDTH, prepare, style


def drawn(last, label="time [s]", **legend):
    with style():
        figure = Figure(figsize=(WIDTH, 1.5), layout="constrained")
        axes = figure.subplots(2, 1, sharex=True)
        time = np.linspace(0.0, last, 50)
        for axis in axes:
            axis.plot(time, np.sin(time))
        axes[1].set_xlabel(label)
        if legend:
            figure.legend(**legend, handles=[*axes[0].lines, *axes[1].lines] * 3)
    prepare(figure)
    figure.draw_without_rendering()
    return figure, axes


@pytest.mark.parametrize(
    ("last", "unit", "seconds"), [(100, "s", 1), (600, "min", 60), (40_000, "h", 3600), (1e6, "d", 86400)]
)
def test_an_axis_of_time_has_the_unit_of_its_span(last, unit, seconds):
    _, axes = drawn(last)
    assert axes[1].get_xlabel() == f"time [{unit}]"
    ticks = axes[1].get_xticks()
    low, high = axes[1].get_xlim()
    assert len([tick for tick in ticks if low <= tick <= high]) >= 3
    for tick, text in zip(ticks, axes[1].get_xticklabels(), strict=True):
        assert float(text.get_text().replace("−", "-")) * seconds == pytest.approx(tick)


def test_an_axis_of_anything_else_keeps_its_unit():
    assert drawn(1e6, "current [A]")[1][1].get_xlabel() == "current [A]"


def test_labels_and_legends_stay_inside_the_figure():
    names = [f"a long name of line {k}" for k in range(6)]
    figure, axes = drawn(10, "a name of a quantity " * 6 + "[K/s]", labels=names, ncols=6, loc="outside upper center")
    (legend,) = figure.legends
    for artist in (legend, axes[1].xaxis.label):
        box = artist.get_window_extent()
        assert box.x0 >= 0
        assert box.x1 <= figure.bbox.width
    assert [text.get_text() for text in legend.get_texts()] == names
