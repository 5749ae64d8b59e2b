"""The figure of a study: bounds against order, width against noise bound and samples, time against samples.

A panel shows one factor. Of the other factors it takes the least noise bound and the most samples. Colours show orders,
line styles show methods. Later lines are thinner, because good relaxations often coincide.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, StrMethodFormatter

from smid.display.style import BLUE, GREEN, GRID, INK, ORANGE, RED, SKY, WIDTH, style
from smid.study.cell import Cell
from smid.study.outcome import Outcome

if TYPE_CHECKING:
    from smid.study.study import Study


_COLOURS = (BLUE, ORANGE, GREEN, RED, SKY)
_STYLES, _MARKERS = ("-", "--", ":", "-."), ("o", "s", "^", "D")

Pair = tuple[Cell, Outcome]


@dataclass(frozen=True)
class _Series:
    """The cells of one order and method, with their line style."""

    order: int
    method: str
    look: dict[str, Any]
    shift: float
    pairs: tuple[Pair, ...]

    def at(self, keep: Callable[[Cell], bool]) -> list[Pair]:
        return [(cell, outcome) for cell, outcome in self.pairs if keep(cell)]


def study_figure(study: Study, record: str) -> Figure:
    """Draw the factors that vary in a study, for one record.

    Each parameter has a row of panels: certified bounds (thin) and witnessed bounds (thick) against the order, and the
    certified width against the noise bound and against the number of samples. The bottom panel shows the time.
    """
    cells = [cell for cell in study.cells if cell.record == record]
    bounds = sorted({c.noise_bound for c in cells}, key=_level)
    orders, methods = sorted({c.order for c in cells}), list(dict.fromkeys(c.method for c in cells))
    series = list(_series(study, record, orders, methods))
    panels = list(_panels(study, series, sorted({c.samples for c in cells}), bounds, orders))
    parameters = study.model.parameters
    timed = len({c.samples for c in cells}) > 1
    with style():
        figure = Figure(figsize=(WIDTH, 0.5 + 1.6 * (len(parameters) + timed)), layout="constrained")
        grid = figure.add_gridspec(len(parameters) + timed, len(panels))
        for row, parameter in enumerate(parameters):
            unit = f" [{parameter.unit}]" if parameter.unit else ""
            for column, (title, draw) in enumerate(panels):
                axes = _axes(figure, grid[row, column])
                draw(axes, row)
                axes.set_ylabel(("width of " if title.startswith("width") else "") + parameter.name + unit)
                if row == 0:
                    axes.set_title(title, loc="left")
                if row < len(parameters) - 1:
                    axes.set_xlabel("")
        # The time has a panel of its own at the bottom.
        if timed:
            axes = _axes(figure, grid[-1, :])
            _times(axes, series, lambda c: c.noise_bound == bounds[0])
            axes.set_title(f"time{_fixed((bounds, _text(study, bounds[0])))}".replace("\n", " "), loc="left")
        _legend(figure, series, orders, methods)
    return figure


def _panels(
    study: Study,
    series: list[_Series],
    sizes: list[int],
    bounds: list[tuple[tuple[str, float], ...]],
    orders: list[int],
) -> Iterator[tuple[str, Callable[[Axes, int], None]]]:
    """Return title and drawing function of a panel for each factor that varies."""
    most, least = sizes[-1], bounds[0]
    if len(orders) > 1 or len(sizes) == len(bounds) == 1:
        at = _fixed((bounds, _text(study, least)), (sizes, f"N = {most}"))
        yield f"bounds{at}", _ends(series, lambda c: (c.noise_bound, c.samples) == (least, most), orders)
    if len(bounds) > 1:
        label = f"noise bound{_unit(study, least)}"
        draw = _widths(series, lambda c: c.samples == most, lambda c: _level(c.noise_bound), label)
        yield f"width{_fixed((sizes, f'N = {most}'))}", draw
    if len(sizes) > 1:
        draw = _widths(series, lambda c: c.noise_bound == least, lambda c: c.samples, "samples N")
        yield f"width{_fixed((bounds, _text(study, least)))}", draw


def _series(study: Study, record: str, orders: list[int], methods: list[str]) -> Iterator[_Series]:
    count = len(orders) * len(methods)
    for m, method in enumerate(methods):
        for k, order in enumerate(orders):
            look = {
                "color": _COLOURS[k % len(_COLOURS)],
                "linestyle": _STYLES[m % len(_STYLES)],
                "marker": _MARKERS[m % len(_MARKERS)],
                "linewidth": 0.9 + 0.5 * (count - 1 - len(orders) * m - k),
                "markersize": 3.0 + 0.8 * (count - 1 - len(orders) * m - k),
            }
            pairs = tuple(
                (cell, outcome)
                for cell, outcome in study.done
                if (cell.record, cell.order, cell.method) == (record, order, method)
            )
            yield _Series(order, method, look, 0.2 * (m - (len(methods) - 1) / 2), pairs)


def _ends(series: list[_Series], keep: Callable[[Cell], bool], orders: list[int]) -> Callable[[Axes, int], None]:
    def draw(axes: Axes, number: int) -> None:
        for one in series:
            for _, outcome in one.at(keep):
                if outcome.intervals:
                    interval, place = outcome.intervals[number], orders.index(one.order) + one.shift
                    colour, line = one.look["color"], one.look["linestyle"]
                    ends = [interval.lower, interval.upper]
                    axes.plot([place] * 2, ends, color=colour, linestyle=line, linewidth=1.0)
                    axes.plot([place] * 2, ends, color=colour, linestyle="", marker="_", markersize=9)
                    inner = [interval.inner_lower, interval.inner_upper]
                    axes.plot([place] * 2, inner, color=colour, linewidth=4.0, alpha=0.5, solid_capstyle="butt")
        axes.set_xlim(-0.6, len(orders) - 0.4)
        axes.set_xticks(range(len(orders)), [str(order) for order in orders])
        axes.set_xlabel("relaxation order")

    return draw


def _widths(
    series: list[_Series], keep: Callable[[Cell], bool], place: Callable[[Cell], float], label: str
) -> Callable[[Axes, int], None]:
    def draw(axes: Axes, number: int) -> None:
        for one in series:
            points = sorted((place(c), o.intervals[number].width) for c, o in one.at(keep) if o.intervals)
            axes.plot([x for x, _ in points], [width for _, width in points], **one.look)
        axes.margins(x=0.12)
        widths = [width for line in axes.lines for width in np.asarray(line.get_ydata()) if np.isfinite(width)]
        axes.set_ylim(0, 1.08 * max(widths, default=0.0) or 1.0)
        axes.xaxis.set_major_locator(MaxNLocator(3, steps=[1, 2, 5, 10]))
        axes.set_xlabel(label)

    return draw


def _times(axes: Axes, series: list[_Series], keep: Callable[[Cell], bool]) -> None:
    for one in series:
        points = sorted((c.samples, o.seconds) for c, o in one.at(keep) if np.isfinite(o.seconds))
        axes.plot([n for n, _ in points], [seconds for _, seconds in points], **one.look)
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    axes.set_xlabel("samples N")
    axes.set_ylabel("time [s]")


def _axes(figure: Figure, place: Any) -> Axes:
    axes: Axes = figure.add_subplot(place)
    axes.grid(True, linewidth=0.4, color=GRID)
    return axes


def _legend(figure: Figure, series: list[_Series], orders: list[int], methods: list[str]) -> None:
    if len(series) < 2:
        return
    keys = [
        Line2D([], [], **{**one.look, "linewidth": 1.2, "markersize": 4.0}, label=_name(one, orders, methods))
        for one in series
    ]
    keys.append(Line2D([], [], color=INK, linewidth=4.0, alpha=0.5, label="witnessed"))
    figure.legend(handles=keys, loc="outside upper center", ncols=min(len(keys), 4))


def _name(one: _Series, orders: list[int], methods: list[str]) -> str:
    parts = [one.method] if len(methods) > 1 else []
    return ", ".join(parts + ([f"order {one.order}"] if len(orders) > 1 else []))


def _level(noise_bound: tuple[tuple[str, float], ...]) -> float:
    """Return the first channel's bound, for the axis."""
    return noise_bound[0][1]


def _fixed(*factors: tuple[list[Any], str]) -> str:
    """Return the values of the other factors that vary, for the title of a panel."""
    named = [value for values, value in factors if len(values) > 1]
    return f"\nat {', '.join(named)}" if named else ""


def _unit(study: Study, bound: tuple[tuple[str, float], ...]) -> str:
    channel = bound[0][0]
    unit = next(iter(study.records.values())).channel(channel).unit
    return f" of {channel}" + (f" [{unit}]" if unit else "")


def _text(study: Study, bound: tuple[tuple[str, float], ...]) -> str:
    unit = next(iter(study.records.values())).channel(bound[0][0]).unit
    return f"±{bound[0][1]:.3g} {unit}".rstrip()
