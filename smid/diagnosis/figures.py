"""The figures of a diagnosis: before and after, correlations, a cause and its rivals, and the experiment to do next."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from relaxations.algebra.arrays import Array, Mask
from smid.data.gaps import stretches
from smid.diagnosis.cause import Cause
from smid.diagnosis.diagnosis import Diagnosis
from smid.diagnosis.experiment import SeparatingExperiment
from smid.display.style import BLUE, GRID, INK, ORANGE, SHADE, SKY, WIDTH, style
from smid.validation.figures import draw_correlation

_LONG = 400  # samples; in longer records two close curves cannot be distinguished
_CLOSE = 200  # samples of the close view


def on_test_part(diagnosis: Diagnosis) -> Figure:
    """Draw the free runs of base and extended model on the test part, and their errors below.

    Of a long test part, or of several, the stretch where the base model misses most.
    """
    number, part = _worst_stretch(diagnosis)
    run, several = diagnosis.data.experiments[number], len(diagnosis.data.experiments) > 1
    curves = [run.values[diagnosis.output], diagnosis.simulated[number], diagnosis.extended[number]]
    measured, base, extended = (curve[part] for curve in curves)
    with style():
        figure = Figure(figsize=(WIDTH, 3.3), layout="constrained")
        top, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        _draw(diagnosis, top, below, diagnosis.data.time(number)[part], (measured, base, extended))
        below.set_xlabel(f"time in {run.name} [s]" if several else "time [s]")
        _legend(figure, top, below)
    return figure


def before_and_after(diagnosis: Diagnosis) -> Figure:
    """Draw the whole record with the free runs of base and extended model, and their errors below."""
    time, ends = _time(diagnosis)
    measured, held = _joined(_measured(diagnosis)), np.concatenate(diagnosis.test)
    with style():
        figure = Figure(figsize=(WIDTH, 3.3), layout="constrained")
        top, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 2))
        _draw(diagnosis, top, below, time, (measured, _joined(diagnosis.simulated), _joined(diagnosis.extended)))
        _shade(top, time, held, "test part")
        _shade(below, time, held, "_")
        below.set_xlabel("time [s]" if not ends else "time, one experiment after the other [s]")
        for panel in (top, below):
            for end in ends:
                panel.axvline(end, color=INK, linewidth=0.6, linestyle=":")
        _legend(figure, top, below)
    return figure


def correlation_figure(diagnosis: Diagnosis) -> Figure:
    """Draw the correlations of the test error with its past and with each input, for base and extended model."""
    models = [("base model", diagnosis.correlations(diagnosis.simulated), ORANGE)]
    if diagnosis.is_extended:
        models.append(("extended model", diagnosis.correlations(diagnosis.extended), BLUE))
    rows = max(len(found) for _, found, _ in models)
    step = diagnosis.data.sampling_time
    with style():
        figure = Figure(figsize=(WIDTH, 0.4 + 1.35 * rows), layout="constrained")
        panels = figure.subplots(rows, len(models), sharey=True, squeeze=False)
        for column, (name, found, colour) in zip(panels.T, models, strict=True):
            for axes, one in zip(column, found, strict=False):
                draw_correlation(axes, one, step, colour)
            column[0].set_title(name, loc="left", fontsize=8)
        for axes, one in zip(panels[:, 0], models[0][1], strict=False):
            axes.set_ylabel(f"with {one.against}" if one.against else "with its past")
    return figure


def _draw(diagnosis: Diagnosis, top: Axes, below: Axes, time: Array, curves: tuple[Array, Array, Array]) -> None:
    """Draw measured, base and extended output on top, and the errors below."""
    measured, base, extended = curves
    better, bound = diagnosis.is_extended, diagnosis.misfit.noise_bound
    unit = f" [{diagnosis.unit}]" if diagnosis.unit else ""
    if bound is not None:
        below.axhspan(-bound, bound, color=SKY, alpha=0.45, linewidth=0, label="± noise bound")
    top.plot(time, measured, color=INK, linewidth=2.2, alpha=0.3, label="measured")
    for free, colour, name in [(base, ORANGE, "base model"), (extended, BLUE, "extended model")][: 1 + better]:
        top.plot(time, free, color=colour, linewidth=1.0, label=name)
        below.plot(time, measured - free, color=colour, linewidth=0.7)
    top.set_ylabel(f"{diagnosis.output}{unit}")
    below.set_ylabel(f"error{unit}")
    for panel in (top, below):
        panel.grid(True, linewidth=0.4, color=GRID)
        panel.margins(x=0.01)


def _legend(figure: Figure, top: Axes, below: Axes) -> None:
    figure.align_ylabels()
    found = [axes.get_legend_handles_labels() for axes in (top, below)]
    handles, labels = ([*first, *second] for first, second in zip(*found, strict=True))
    figure.legend(handles, labels, loc="outside upper center", ncols=5, columnspacing=1.2)


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
        figure = Figure(figsize=(WIDTH, 0.62 + 0.26 * len(bars)), layout="constrained")
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
    for first, after in stretches(held):
        axes.axvspan(time[first], time[after - 1], color=SHADE, alpha=0.8, linewidth=0, zorder=0, label=label)
        label = "_"


def _worst_stretch(diagnosis: Diagnosis) -> tuple[int, slice]:
    """Return the experiment and the part of its test part with the largest error of the base model."""
    found = []
    for number, (run, free, held) in enumerate(
        zip(diagnosis.data.experiments, diagnosis.simulated, diagnosis.test, strict=True)
    ):
        inside = np.flatnonzero(held)
        if not inside.size:
            continue
        count = inside.size if inside.size <= _LONG else _CLOSE
        error = np.where(held, run.values[diagnosis.output] - free, 0.0)[inside[0] : inside[-1] + 1]
        power = np.convolve(np.nan_to_num(error) ** 2, np.ones(count), "valid") / count
        first = int(inside[0] + np.argmax(power))
        found.append((float(power.max()), number, slice(first, first + count)))
    _, number, part = max(found, key=lambda one: one[0])
    return number, part
