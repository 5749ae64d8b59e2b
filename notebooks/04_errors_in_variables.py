# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Errors in variables: when the input is noisy too
#
# The previous pages take the input as exact. Often a sensor with noise measures the input too. If the model assigns
# all noise to the output, the intervals can be narrow and wrong. The errors-in-variables model has a noise bound for
# each channel.
#
# This page shows on simulated data how much wider its intervals are, and how prior knowledge makes them narrower.

# %%
# %matplotlib inline
from collections import Counter
from textwrap import fill

import numpy as np
from matplotlib import pyplot as plt

import smid
from smid.display.style import BLUE, GREEN, INK, RED, style

TRUTH = {"a1": -0.8, "b0": 1.0}
BOUND = 0.1  # of each sensor


def experiment(seed, n):
    """Return what two sensors show of a plant with one pole; the input is a PRBS."""
    generator = np.random.default_rng(seed)
    u = smid.signals.prbs(n, seed=seed, clock_period=2.0)
    w = np.empty(n)
    w[0] = TRUTH["b0"] * u[0]
    for t in range(1, n):
        w[t] = -TRUTH["a1"] * w[t - 1] + TRUTH["b0"] * u[t]
    u_measured, y_measured = (signal + generator.uniform(-BOUND, BOUND, n) for signal in (u, w))
    return smid.Dataset.from_arrays(input={"u": u_measured}, output={"y": y_measured}, sampling_time=1.0)


def inside(estimate):
    """Return whether the true parameters lie in all intervals."""
    return all(estimate[name].lower <= value <= estimate[name].upper for name, value in TRUTH.items())


# %% [markdown]
# ## Input taken as exact
#
# We take fifteen samples, with a noise bound of 0.1 for both sensors, and use the recorded input as if it were exact:

# %%
data = experiment(seed=3, n=15)
output_error = smid.OutputError(na=1, delay=0, stable=True)
naive = smid.identify(output_error, data, noise_bound=BOUND)
print(naive)
print("the parameters that made the data are", "inside" if inside(naive) else "OUTSIDE")

# %% [markdown]
# There is no warning: the feasible set is not empty, the intervals are narrow, and their ends are proven. The proof
# assumes *an exact input*, and this input is not exact.
#
# ## Both channels noisy
#
# The true input $u_t - \zeta_t$ replaces $u_t$, with $|\zeta_t| \le 0.1$. Because of the product $b_0 \zeta_t$, $b_0$
# is a complicating parameter, as $a_1$ is.

# %%
noisy_input = smid.ErrorsInVariables(na=1, stable=True)
print(noisy_input, end="\n\n")
honest = smid.identify(noisy_input, data, noise_bound={"u": BOUND, "y": BOUND})
print(honest)
print("the parameters that made the data are", "inside" if inside(honest) else "OUTSIDE")
assert inside(honest)

# %% [markdown]
# ## An independent check
#
# With one pole, the feasible set of the parameters can be drawn without optimisation. For given $(a_1, b_0)$, the
# possible states at $t$ form an interval. It follows from the previous interval and the input, and is intersected
# with $y_t \pm 0.1$. The parameters are feasible if no interval is empty.


# %%
def possible(a1, b0, input_bound):
    """Return where on a grid the record is explained: an interval of states is carried through the samples."""
    u, y = data.values("u"), data.values("y")
    low, high = np.full_like(a1, y[0] - BOUND), np.full_like(a1, y[0] + BOUND)
    for t in range(1, len(y)):
        # -a1 and b0 are positive here.
        low = np.maximum(-a1 * low + b0 * (u[t] - input_bound), y[t] - BOUND)
        high = np.minimum(-a1 * high + b0 * (u[t] + input_bound), y[t] + BOUND)
        high = np.where(low > high, np.nan, high)
    return ~np.isnan(high)


a1, b0 = np.meshgrid(np.linspace(-0.86, -0.73, 500), np.linspace(0.84, 1.16, 500))
sets = {"errors in variables": (0.1, honest, BLUE), "input taken as exact": (0.0, naive, RED)}
with style():
    figure, axes = plt.subplots(figsize=(5.0, 3.8), layout="constrained")
    for name, (bound, estimate, colour) in sets.items():
        axes.contourf(a1, b0, possible(a1, b0, bound), levels=(0.5, 1.5), colors=[colour], alpha=0.5)
        i, j = estimate["a1"], estimate["b0"]
        corners = (i.lower, i.upper, i.upper, i.lower, i.lower), (j.lower, j.lower, j.upper, j.upper, j.lower)
        axes.plot(*corners, color=colour, label=f"{name}: set, certified box")
    axes.plot(TRUTH["a1"], TRUTH["b0"], "*", color=INK, markersize=9, label="truth")
    axes.plot(a1[0], 5 * (1 + a1[0]), "--", color=GREEN, label="DC gain 5")
    axes.set_ylim(b0[0, 0], b0[-1, 0])
    axes.set_xlabel("a1")
    axes.set_ylabel("b0")
    figure.legend(loc="outside upper center", ncols=2)

# %% [markdown]
# The certified boxes fit the drawn sets closely. The set with the exact input lies within the errors-in-variables set
# and does not contain the true parameters. A line of constant DC gain crosses the errors-in-variables set; the last
# section uses it.
#
# ## Repeat on twelve records

# %%
ways = {"exact input": (output_error, {"y": BOUND}), "errors in variables": (noisy_input, {"u": BOUND, "y": BOUND})}
counts = {name: Counter() for name in ways}
for seed in range(12):
    for name, (model, bounds) in ways.items():
        try:
            estimate = smid.identify(model, experiment(seed, n=15), bounds, tolerance=1e-2)
            counts[name]["truth inside" if inside(estimate) else "truth OUTSIDE"] += 1
        except smid.EmptyFeasibleSetError:
            counts[name]["proven empty"] += 1
for name, count in counts.items():
    print(f"{name}: {dict(count)}")
assert counts["errors in variables"] == {"truth inside": 12}

# %% [markdown]
# For most records, smid proves that no parameters fit the data with an exact input. A longer record makes this more
# likely. Do not raise the output's noise bound until the set becomes feasible. The intervals can then exclude the
# true parameters:

# %%
longer = experiment(seed=4, n=25)
try:
    smid.identify(output_error, longer, noise_bound=BOUND)
except smid.EmptyFeasibleSetError as proof:
    print(f"{fill(str(proof), 110)}\n")
    least = proof.least_bound
for factor in (1.05, 1.2, 1.5):
    blown = smid.identify(output_error, longer, noise_bound=factor * least)
    where = "inside" if inside(blown) else "OUTSIDE"
    print(f"output's bound {factor:4} x the least one: a1 in an interval {blown['a1'].width:.3f} wide, truth {where}")

# %% [markdown]
# ## Prior knowledge
#
# The errors-in-variables intervals are wider because more parameters fit. Prior knowledge makes them narrower. Often
# the DC gain is known from an experiment at rest, here 5, within 4 % or exactly. It keeps only a strip of the
# feasible set.

# %%
estimates = {
    "nothing more": honest,
    "DC gain 4.8 to 5.2": smid.identify(
        smid.ErrorsInVariables(na=1, stable=True, dc_gain=(4.8, 5.2)), data, {"u": BOUND, "y": BOUND}
    ),
}
for name, estimate in estimates.items():
    assert inside(estimate)
    widths = ", ".join(f"{i.name} {i.width:.4f} wide" for i in estimate.intervals)
    print(f"{name:20} {widths}")
exact = smid.identify(smid.ErrorsInVariables(na=1, stable=True, dc_gain=5.0), data, {"u": BOUND, "y": BOUND})
print(f"{'DC gain 5':20} a1 {exact['a1'].width:.4f} wide, b0 = 5 (1 + a1)")

# %% [markdown]
# The proof holds only if the prior is true. With a false prior, the intervals can exclude the true parameters.
# Sometimes the data refute a false prior:

# %%
for gain in ((5.7, 6.0), (7.0, 9.0)):
    wrong = smid.ErrorsInVariables(na=1, stable=True, dc_gain=gain)
    try:
        estimate = smid.identify(wrong, data, {"u": BOUND, "y": BOUND})
        print(f"gain in {gain}: not refuted, and the truth is", "inside" if inside(estimate) else "OUTSIDE")
    except smid.EmptyFeasibleSetError as proof:
        print(f"gain in {gain}:", str(proof).split(". ")[0])

# %% [markdown]
# **Try next:** `na=2` has four complicating parameters and takes some seconds; halve the input's noise bound and see
# which intervals shrink. Then, a whole study: [the clutch](05_clutch_hammerstein.ipynb).
