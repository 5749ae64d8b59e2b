"""A data set as a figure: one axis per channel over time."""

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

if TYPE_CHECKING:
    from smid.data.dataset import Dataset

LARGEST_LEGEND = 8


def plot(dataset: "Dataset") -> Figure:
    """Draw outputs, inputs and the other channels from top to bottom, with all experiments in the same axes.

    The warm-up samples are shaded. The figure has no window; save it with `figure.savefig`.
    """
    others = [name for name in dataset.names if dataset.role(name) == ""]
    names = [*dataset.outputs, *dataset.inputs, *others]
    figure = Figure(figsize=(8.0, 1.0 + 1.8 * len(names)), layout="constrained")
    axes = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    one_run = len(dataset.experiments) == 1
    for axis, name in zip(axes, names, strict=True):
        is_output = name in dataset.outputs
        for k, run in enumerate(dataset.experiments):
            time = dataset.time(k)
            # Inputs are held between samples, so they are drawn as a staircase.
            axis.plot(
                time,
                run.values[name],
                drawstyle="steps-post" if name in dataset.inputs else "default",
                linewidth=0.9,
                color=("C0" if is_output else "C1" if name in dataset.inputs else "C2") if one_run else f"C{k % 10}",
                label=run.name,
            )
            if dataset.n_init and one_run:
                axis.axvspan(time[0], time[dataset.n_init], color="0.5", alpha=0.2, linewidth=0, zorder=0)
        axis.set_ylabel(str(dataset.channel(name)))
        axis.grid(True, linewidth=0.4, alpha=0.5)
        axis.margins(x=0)
    if not one_run and len(dataset.experiments) <= LARGEST_LEGEND:
        # Above the axes, where the legend hides no samples.
        handles, labels = axes[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper center", ncols=4, fontsize="small")
    axes[-1].set_xlabel("time [s]")
    return figure
