"""The look of all figures: Okabe-Ito colours, thin lines, and SVG for light and dark pages."""

from __future__ import annotations

import io
import re
import textwrap
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from os import PathLike
from typing import Any

import matplotlib
import numpy as np
from cycler import cycler
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import AutoLocator, FuncFormatter

from relaxations.writing import write_bytes

# Okabe and Ito's colours differ for every common kind of colour blindness.
BLUE, ORANGE, GREEN, RED, SKY = "#0072b2", "#e69f00", "#009e73", "#d55e00", "#56b4e9"
INK, GRID, SHADE = "#222222", "#c8c8c8", "#e6e6e6"
PAPER = "#fefefe"  # behind the ink; white itself stays white on a dark page
WIDTH = 4.8
"""Width of a figure in inches: letters of 8 points are legible where a page on a phone shows it whole."""

# On a page these become CSS variables, so that one picture serves light and dark backgrounds.
VARIABLES = {
    **{INK: "ink", GRID: "grid", SHADE: "shade", PAPER: "paper"},
    **{BLUE: "blue", ORANGE: "orange", GREEN: "green", RED: "red", SKY: "sky"},
}

_MANY_POINTS, _MANY_CORNERS = 1000, 4000
_SHARP = 200  # pixels per inch
# Pixels of a page per point of a figure: letters of 8 points are 8 pixels on a phone, and 16 on a large screen.
_LEAST, _MOST = 1.0, 2.0
# Seconds of a unit of time, and the least number of them that an axis spans.
_UNITS, _LEAST_SPAN = {"d": 86400.0, "h": 3600.0, "min": 60.0}, 3

_SETTINGS: dict[Any, Any] = {
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.labelsize": 8,
    "axes.linewidth": 0.6,
    "axes.prop_cycle": cycler(color=[BLUE, ORANGE, GREEN, RED, SKY]),
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 9,
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Verdana", "Arial", "Helvetica"],
    "font.size": 9,
    "grid.color": GRID,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "legend.title_fontsize": 8,
    "lines.linewidth": 0.9,
    "path.simplify_threshold": 1 / 3,  # points: finer noise is thinner than a line, and costs megabytes
    "svg.fonttype": "none",  # text stays text: it can be read aloud, searched and copied
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
}


@contextmanager
def style() -> Iterator[None]:
    """Set the look of this package, whatever the user's own matplotlib settings are."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_SETTINGS)
        yield


def inline_svg(figure: Figure, label: str, salt: str) -> str:
    """Return a figure as an ``<svg>`` element for a page that defines ``--ink``, ``--blue`` and so on in CSS.

    ``label`` describes the figure for screen readers. ``salt`` differs for each figure of a page, so that names differ.
    """
    text = _svg(figure, salt, paper=False)
    text = text[text.index("<svg") :]  # a page has its own XML head
    text = re.sub(r"\s*<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    # Two decimals of a point suffice on a screen; six digits double the size of a page.
    text = re.sub(r' d="[^"]*"', lambda path: re.sub(r"(\.\d\d)\d+", r"\1", path[0]), text)
    # Without fixed width and height the picture takes the width of the page.
    text = re.sub(r' (width|height)="[\d.]+pt"', "", text, count=2)
    width = 72 * figure.get_figwidth()
    size = f"min-width: {_LEAST * width:.0f}px; max-width: {_MOST * width:.0f}px"
    text = _dots_as_one_path(text)
    for colour, name in VARIABLES.items():
        text = re.sub(rf"\b(fill|stroke): {colour}", rf"\1: var(--{name})", text)
    # The names of matplotlib's groups repeat from figure to figure.
    text = re.sub(r'<g id="[^"]*">', "<g>", text)
    head = f'<svg role="img" aria-label="{escape(label, quote=True)}" style="{size}" '
    return text.replace("<svg ", head, 1).rstrip()


def notebook_svg(figure: Figure, label: str) -> str:
    """Return a figure for a page of unknown background: ink in the page's own colour, the rest readable on both."""
    colours = {name: colour for colour, name in VARIABLES.items()}
    colours |= {"ink": "currentColor", "paper": "transparent", "grid": "#8885", "shade": "#8883", "blue": "#1f8ad6"}
    variables = "".join(f" --{name}: {colour};" for name, colour in colours.items())
    return f'<div style="overflow-x: auto;{variables}">{inline_svg(figure, label, label)}</div>'


def save_svg(figure: Figure, path: str | PathLike[str]) -> None:
    """Write a figure on white paper to a file; the same figure gives the same file."""
    write_bytes(path, _svg(figure, "smid", paper=True).encode())


def _svg(figure: Figure, salt: str, *, paper: bool) -> str:
    # ``savefig`` would place and draw everything once more beforehand.
    prepare(figure)
    for patch in (figure.patch, *(axes.patch for axes in figure.axes)):
        patch.set_visible(paper)
    buffer = io.StringIO()
    with style():
        matplotlib.rcParams["svg.hashsalt"] = salt
        canvas: Any = FigureCanvasSVG(figure)  # without types
        canvas.print_svg(buffer, metadata={"Date": None})
    return buffer.getvalue()


class _TicksOfUnit(AutoLocator):
    """Ticks at round numbers of a unit, on an axis in seconds."""

    def __init__(self, seconds: float) -> None:
        super().__init__()
        self._seconds = seconds

    def tick_values(self, vmin: float, vmax: float) -> Any:
        return self._seconds * np.asarray(super().tick_values(vmin / self._seconds, vmax / self._seconds))


def prepare(figure: Figure) -> None:
    """Make a figure fit for a page: axes of time in the unit that suits their span, no label cut off, no huge file."""
    FigureCanvasSVG(figure)  # letters are measured as they are drawn, in points
    figure.set_dpi(72)
    with style():
        for axes in figure.axes:
            _tell_time_in_its_unit(axes)
        _place(figure)
        if _break_what_is_too_long(figure):
            _place(figure)
    figure.set_layout_engine("none")
    _draw_clouds_as_pixels(figure)


def _tell_time_in_its_unit(axes: Axes) -> None:
    """Show minutes, hours or days where a linear axis in seconds spans several of them."""
    label, (low, high) = axes.get_xlabel(), axes.get_xlim()
    found = [(name, one) for name, one in _UNITS.items() if abs(high - low) >= _LEAST_SPAN * one]
    if not found or not label.endswith("[s]") or axes.get_xscale() != "linear":
        return
    unit, seconds = found[0]
    axes.set_xlabel(f"{label.removesuffix('[s]')}[{unit}]")
    axes.xaxis.set_major_locator(_TicksOfUnit(seconds))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x / seconds:.10g}"))


def _place(figure: Figure) -> None:
    if engine := figure.get_layout_engine():
        engine.execute(figure)


def _break_what_is_too_long(figure: Figure) -> bool:
    """Break labels longer than their axis, and legends wider than the figure; tell whether there were any."""
    broken = False
    for axes in figure.axes:
        frame = axes.get_window_extent()
        for label, side in ((axes.xaxis.label, "width"), (axes.yaxis.label, "height")):
            length, room = getattr(label.get_window_extent(), side), getattr(frame, side)
            if length > room:
                text = label.get_text()
                broken = True
                label.set_text(textwrap.fill(text, max(int(len(text) * room / length), 1), break_long_words=False))
    for legend in list(figure.legends):
        box = legend.get_window_extent()
        if box.width > figure.bbox.width:
            labels = [text.get_text() for text in legend.get_texts()]
            above = box.y0 + box.y1 > figure.bbox.height
            broken = True
            legend.remove()
            figure.legend(
                [handle for handle in legend.legend_handles if handle is not None],
                labels,
                loc="outside upper center" if above else "outside lower center",
                ncols=max(int(len(labels) * figure.bbox.width / box.width), 1),
                title=legend.get_title().get_text() or None,
            )
    return broken


def _draw_clouds_as_pixels(figure: Figure) -> None:
    """Rasterise scatter plots of many points and bands of many corners, which would make the file large."""
    heavy: list[Artist] = []
    for axes in figure.axes:
        for group in axes.collections:
            corners = sum(np.shape(path.vertices)[0] for path in group.get_paths())
            if corners > _MANY_CORNERS or np.shape(group.get_offsets())[0] > _MANY_POINTS:
                heavy.append(group)
    with warnings.catch_warnings():
        # Older versions of matplotlib cannot rasterise contours, and say so; the picture is larger then.
        warnings.filterwarnings("ignore", "Rasterization of")
        for artist in heavy:
            artist.set_rasterized(True)
    if heavy:
        figure.set_dpi(_SHARP)


def _dots_as_one_path(text: str) -> str:
    """Draw the round markers of a line as one path of points with round ends: a fifth of the bytes.

    A marker is defined once, as a circle of Bezier curves that begins at its radius, and used at each sample.
    """
    sizes = {
        name: 2 * float(radius) + float((re.findall(r"stroke-width: ([\d.]+)", look) or [1])[0])
        for name, radius, look in re.findall(r'<path id="(\w+)" d="M 0 ([\d.]+) \nC [^"]*" style="([^"]*)"/>', text)
    }

    def merged(run: re.Match[str]) -> str:
        name, fill, stroke = run["name"], run["fill"], run["stroke"]
        if name not in sizes or fill != stroke:
            return run[0]
        points = "".join(f"M{float(x):.2f} {float(y):.2f}h0" for x, y in re.findall(r'x="(.*?)" y="(.*?)"', run[0]))
        look = f"fill: none; stroke: {stroke}; stroke-width: {sizes[name]:.2f}; stroke-linecap: round"
        return f'<path d="{points}" style="{look}"/>'

    use = r'<use xlink:href="#{}" x="[^"]*" y="[^"]*" style="fill: {}; stroke: {}"/>'
    first = use.format(r"(?P<name>\w+)", r"(?P<fill>#\w+)", r"(?P<stroke>#\w+)")
    more = use.format("(?P=name)", "(?P=fill)", "(?P=stroke)")
    return re.sub(rf"{first}(?:\s*{more})+", merged, text)
