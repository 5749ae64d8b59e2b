"""One look for all figures: Okabe-Ito colours, thin lines, and SVG for light and dark pages."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib
from cycler import cycler
from matplotlib.figure import Figure

# Okabe and Ito's colours keep apart for every common kind of colour blindness.
BLUE, ORANGE, GREEN, RED, SKY = "#0072b2", "#e69f00", "#009e73", "#d55e00", "#56b4e9"
INK, GRID, SHADE = "#222222", "#c8c8c8", "#e6e6e6"
WIDTH, NARROW = 5.6, 4.8
"""Widths of figures, in inches; a narrow one is readable on a phone without scrolling."""

# In a page these become CSS variables: the same picture serves a light and a dark background.
_VARIABLES = {
    INK: "ink",
    GRID: "grid",
    SHADE: "shade",
    BLUE: "blue",
    ORANGE: "orange",
    GREEN: "green",
    RED: "red",
    SKY: "sky",
}

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
    """Draw in the look of this package, whatever the user's own matplotlib settings are.

    Examples
    --------
    >>> with style():
    ...     matplotlib.rcParams["svg.fonttype"]
    'none'
    """
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_SETTINGS)
        yield


def inline_svg(figure: Figure, label: str, salt: str) -> str:
    """Return a figure as an ``<svg>`` element for a page that defines ``--ink``, ``--blue`` and so on in CSS.

    Parameters
    ----------
    figure : Figure
    label : str
        What the picture shows, for readers who do not see it.
    salt : str
        Different for each figure of a page: the names inside then differ too.

    Examples
    --------
    >>> inline_svg(Figure(), "nothing", "a")[:32]
    '<svg role="img" aria-label="noth'
    """
    from html import escape

    buffer = io.StringIO()
    with style():
        matplotlib.rcParams["svg.hashsalt"] = salt
        figure.savefig(buffer, format="svg", transparent=True)
    text = buffer.getvalue()
    text = text[text.index("<svg") :]  # a page has its own XML head
    text = re.sub(r"\s*<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    # A hundredth of a point is less than a screen shows; six digits make a page twice as large.
    text = re.sub(r' d="[^"]*"', lambda path: re.sub(r"(\.\d\d)\d+", r"\1", path[0]), text)
    # Without fixed width and height the picture takes the width of the page.
    text = re.sub(r' (width|height)="[\d.]+pt"', "", text, count=2)
    for colour, name in _VARIABLES.items():
        text = re.sub(rf"\b(fill|stroke): {colour}", rf"\1: var(--{name})", text)
    # The names that matplotlib gives to groups repeat from figure to figure.
    text = re.sub(r'<g id="[^"]*">', "<g>", text)
    return text.replace("<svg ", f'<svg role="img" aria-label="{escape(label, quote=True)}" ', 1).rstrip()
