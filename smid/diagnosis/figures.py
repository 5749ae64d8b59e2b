"""The figures of a diagnosis: before and after, a cause and its rivals, and the experiment to do next."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from relaxations.algebra.arrays import Array, Mask
from smid.diagnosis.cause import Cause
from smid.diagnosis.diagnosis import Diagnosis, Verdict
from smid.diagnosis.experiment import SeparatingExperiment
from smid.display.style import BLUE, GRID, INK, NARROW, ORANGE, SHADE, SKY, WIDTH, style

_LONG = 400  # samples; in longer records two close curves cannot be distinguished
_CLOSE = 120  # samples of the close view


def before_and_after(diagnosis: Diagnosis) -> Figure:
    """Draw the measured output with the free runs of base and extended model, and their errors below."""
    measured, held = _joined(_measured(diagnosis)), np.concatenate(diagnosis.test)
    base, extended = _joined(diagnosis.simulated), _joined(diagnosis.extended)
    better = diagnosis.model is not diagnosis.base
    time, ends = _time(diagnosis)
    unit = f" [{diagnosis.unit}]" if diagnosis.unit else ""
    wrong = diagnosis.verdict is not Verdict.NONE or diagnosis.unexplained
    close = _worst_stretch(measured - base, held) if wrong and len(time) > _LONG else None
    with style():
        rows = 2 if close is None else 3
        figure = Figure(figsize=(WIDTH, 1.75 * rows + 0.3), layout="constrained")
        axes = figure.subplots(rows, 1)
        top, below = axes[0], axes[-1]
        for panel in (top, axes[1]) if close is not None else (top,):
            panel.plot(time, measured, color=INK, linewidth=2.2, alpha=0.3, label="measured")
            panel.plot(time, base, color=ORANGE, linewidth=1.0, label="base model")
            if better:
                panel.plot(time, extended, color=BLUE, linewidth=1.0, label="extended model")
            panel.set_ylabel(f"{diagnosis.output}{unit}")
        _shade(top, time, held, "test part")
        _shade(below, time, held, "_")
        bound = diagnosis.misfit.noise_bound
        if bound is not None:
            below.axhspan(-bound, bound, color=SKY, alpha=0.45, linewidth=0, label="± noise bound")
        below.plot(time, measured - base, color=ORANGE, linewidth=0.7)
        if better:
            below.plot(time, measured - extended, color=BLUE, linewidth=0.7)
        below.set_ylabel(f"error{unit}")
        below.set_xlabel("time [s]" if not ends else "time, one experiment after the other [s]")
        for panel in axes:
            panel.grid(True, linewidth=0.4, color=GRID)
            panel.margins(x=0.01)
        for panel in (top, below):
            for end in ends:
                panel.axvline(end, color=INK, linewidth=0.6, linestyle=":")
        if close is not None:
            _zoom(axes[1], time, (measured, base, extended), close)
        figure.align_ylabels()
        handles, labels = top.get_legend_handles_labels()
        more = below.get_legend_handles_labels()
        figure.legend([*handles, *more[0]], [*labels, *more[1]], loc="outside upper center", ncols=5, columnspacing=1.2)
    return figure


def rivals_figure(cause: Cause, unit: str) -> Figure:
    """Draw the error of the fit without the cause, with it, and with each rival instead.

    Parameters
    ----------
    unit
        Of the output.
    """
    bars = [(cause.effect, cause.evidence["fit_rmse_after"], BLUE)]
    bars += [(rival.effect, rival.rmse, SKY) for rival in cause.rivals]
    bars.append(("without any of them", cause.evidence["fit_rmse_before"], GRID))
    with style():
        figure = Figure(figsize=(NARROW, 0.62 + 0.26 * len(bars)), layout="constrained")
        axes = figure.subplots()
        values = np.array([value for _, value, _ in bars])
        places = np.arange(len(bars))[::-1]
        axes.barh(places, values, color=[colour for *_, colour in bars], height=0.66)
        for place, value in zip(places, values, strict=True):
            axes.text(value + 0.012 * values.max(), place, f"{value:.3g}", va="center", fontsize=8)
        axes.set_yticks(places, [spoken(name) for name, *_ in bars])
        axes.tick_params(axis="y", length=0)
        axes.set_xlim(0, 1.1 * values.max())
        axes.set_xlabel(f"RMSE of the fit [{unit}]" if unit else "RMSE of the fit")
    return figure


def experiment_figure(experiment: SeparatingExperiment, diagnosis: Diagnosis) -> Figure:
    """Draw the input of the experiment that would tell rivals apart.

    Parameters
    ----------
    diagnosis
        Gives the input's name, its unit and the sampling time.
    """
    channel = diagnosis.data.channel(diagnosis.misfit.input)
    with style():
        figure = Figure(figsize=(WIDTH, 1.5), layout="constrained")
        axes = figure.subplots()
        time = diagnosis.data.sampling_time * np.arange(len(experiment.values))
        axes.step(time, experiment.values, where="post", color=BLUE)
        axes.set_xlabel("time [s]")
        axes.set_ylabel(str(channel))
        axes.grid(True, linewidth=0.4, color=GRID)
        axes.margins(x=0.01)
    return figure


def spoken(effect: str) -> str:
    """Return an effect's name with spaces.

    Examples
    --------
    >>> spoken("input_dead_zone")
    'input dead zone'
    """
    return effect.replace("_", " ")


def _measured(diagnosis: Diagnosis) -> list[Array]:
    return [run.values[diagnosis.output] for run in diagnosis.data.experiments]


def _joined(parts: Sequence[Array]) -> Array:
    return np.concatenate(list(parts))


def _time(diagnosis: Diagnosis) -> tuple[Array, list[float]]:
    """Return the instants, experiments one after the other, and where one ends and the next begins."""
    data = diagnosis.data
    if len(data.experiments) == 1:
        return data.time(0), []
    step = data.sampling_time
    ends = np.cumsum([run.n_samples for run in data.experiments])[:-1]
    return step * np.arange(data.n_samples, dtype=np.float64), [float(step * end) for end in ends]


def _shade(axes: Axes, time: Array, held: Mask, label: str) -> None:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], held, [False]]).astype(int)))
    for first, after in edges.reshape(-1, 2):
        axes.axvspan(time[first], time[after - 1], color=SHADE, alpha=0.8, linewidth=0, zorder=0, label=label)
        label = "_"


def _worst_stretch(error: Array, held: Mask) -> slice:
    """Return the part of the test part with the largest error."""
    count = min(_CLOSE, int(held.sum()))
    power = np.convolve(np.where(held, np.nan_to_num(error), 0.0) ** 2, np.ones(count), "valid")
    first = int(np.argmax(power))
    return slice(first, first + count)


def _zoom(axes: Axes, time: Array, curves: Sequence[Array], close: slice) -> None:
    axes.set_xlim(time[close][0], time[close][-1])
    inside = np.concatenate([curve[close] for curve in curves])
    margin = 0.06 * float(np.ptp(inside)) or 1.0
    axes.set_ylim(float(inside.min()) - margin, float(inside.max()) + margin)
    axes.set_title("close view: where the base model misses most on the test part", loc="left", fontsize=8)
