"""How often an effect is there, against the probability that the diagnosis gives it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt
from scipy.stats import binomtest

from benchmarks.blind.score import BINS, CaseResult
from smid.display.style import BLUE, INK, style

__all__ = ["draw"]


def draw(results: Sequence[CaseResult], path: Path) -> None:
    """Write the picture: a point for each class of probabilities, with the 95 % interval of Wilson (1927)."""
    pairs = np.array([pair for result in results for pair in result.weighed], dtype=float).reshape(-1, 2)
    path.parent.mkdir(parents=True, exist_ok=True)
    with style():
        figure, axes = plt.subplots(figsize=(4.8, 4.4), layout="constrained")
        axes.plot([0, 1], [0, 1], color=INK, linewidth=0.8, linestyle="--")
        for low, high in BINS:
            given, there = pairs[(pairs[:, 0] >= low) & (pairs[:, 0] < high)].T
            if given.size:
                count, share = given.size, float(np.mean(there))
                interval = binomtest(int(there.sum()), count).proportion_ci(method="wilson")
                ends = [[share - interval.low], [interval.high - share]]
                axes.errorbar(np.mean(given), share, yerr=ends, fmt="o", color=BLUE, capsize=3)
                axes.annotate(
                    str(count), (float(np.mean(given)), share), (7, -3), textcoords="offset points", color=INK
                )
        axes.set(xlim=(-0.02, 1.06), ylim=(-0.02, 1.04), aspect="equal")
        axes.set(xlabel="probability given to an effect", ylabel="share of these effects that are there")
        figure.savefig(path)
        plt.close(figure)
