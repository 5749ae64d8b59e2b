"""Draw the feasible set of two parameters, its certified intervals and verified points: feasible_set.svg.

``python docs/pictures/feasible_set.py`` draws the file again.
"""

from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.patches import Rectangle
from scipy.optimize import linprog

import smid
from smid.display.style import BLUE, GRID, INK, ORANGE, RED, style
from smid.models.simulate import simulate

A1, B0, NOISE_BOUND = -0.7, 0.5, 0.25
SAMPLES, SEED, SLICES = 12, 4, 400


def record():
    """Return input and measured output of the plant ``w[t] = 0.7 w[t-1] + 0.5 u[t-1]``."""
    u = np.repeat([1.0, -1.0, 1.0], 4)
    w = simulate(smid.OutputError(), {"u": u}, {"a1": A1, "b0": B0})["w"]
    return u, w, w + np.random.default_rng(SEED).uniform(-NOISE_BOUND, NOISE_BOUND, SAMPLES)


def slice_at(a1, u, y):
    """Return the range of b0 at a fixed a1, by a linear program in b0 and the first state; None where it is empty."""
    free = np.array([(-a1) ** t for t in range(SAMPLES)])
    forced = simulate(smid.OutputError(), {"u": u}, {"a1": a1, "b0": 1.0})["w"]
    rows = np.column_stack([forced, free])
    matrix, limits = np.vstack([rows, -rows]), np.concatenate([y + NOISE_BOUND, NOISE_BOUND - y])
    ends = [linprog([sign, 0], matrix, limits, bounds=(None, None)) for sign in (1, -1)]
    return (ends[0].fun, -ends[1].fun) if all(end.success for end in ends) else None


def draw():
    """Return the figure."""
    u, w, y = record()
    data = smid.Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    estimate = smid.identify(smid.OutputError(stable=True), data, NOISE_BOUND)
    a, b = estimate["a1"], estimate["b0"]
    grid = np.linspace(a.inner_lower, a.inner_upper, SLICES)
    slices = [(a1, *found) for a1 in grid if (found := slice_at(a1, u, y))]
    a1, low, high = np.array(slices).T

    figure, (left, right) = plt.subplots(1, 2, figsize=(8.2, 3.5), layout="constrained", width_ratios=(1, 1.25))
    time = np.arange(SAMPLES)
    label = f"measured, |noise| ≤ {NOISE_BOUND}"
    left.errorbar(time, y, NOISE_BOUND, fmt="o", color=INK, markersize=3, elinewidth=0.8, label=label)
    left.plot(time, w, color=RED, label="true output (unknown to smid)")
    left.set_xlabel("sample")
    left.set_ylabel("output y")
    left.set_ylim(-1.9, 2.6)
    left.legend(loc="upper center")
    left.set_title("Record with a noise bound")

    right.fill_between(a1, low, high, color=BLUE, alpha=0.25, linewidth=0, label="feasible set")
    right.plot(a1, low, color=BLUE)
    right.plot(a1, high, color=BLUE)
    box = Rectangle((a.lower, b.lower), a.width, b.width, fill=False, edgecolor=INK, label="certified intervals")
    right.add_patch(box)
    points = np.array([point[:2] for point in estimate.enclosure.witnesses])
    ends = np.array([points[pick(points[:, k])] for k in (0, 1) for pick in (np.argmin, np.argmax)])
    right.plot(*ends.T, "D", color=ORANGE, markersize=5, label="verified points")
    right.plot(A1, B0, "*", color=RED, markersize=10, label="true parameters")
    right.plot(a.centre, b.centre, "+", color=INK, markersize=8, label="central estimate")
    right.margins(0.12)
    right.set_ylim(b.lower - 0.12 * b.width, b.upper + 0.6 * b.width)
    right.grid(color=GRID, linewidth=0.4)
    right.set_axisbelow(True)
    right.locator_params(nbins=6)
    right.set_xlabel("$a_1$")
    right.set_ylabel("$b_0$")
    right.legend(loc="upper left", ncols=2)
    right.set_title("Parameters that fit the record")
    return figure


if __name__ == "__main__":
    with style():
        plt.rcParams["svg.hashsalt"] = "feasible set"  # the same drawing twice gives the same file
        draw().savefig(
            Path(__file__).with_suffix(".svg"), facecolor="white", metadata={"Date": None, "Creator": "feasible_set.py"}
        )
