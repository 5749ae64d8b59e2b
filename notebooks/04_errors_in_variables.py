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
# The first pages took the input as exact. Often it is measured like the output, by a sensor that errs. Blaming all
# noise on the output then gives intervals that look good and are false. The errors-in-variables model puts a bound on
# each channel; what that costs, and how prior knowledge pays for it, is shown on simulated data, where the truth is
# known.

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
# ## The naive way
#
# Fifteen samples, both sensors good to 0.1. Take the recorded input for the true one:

# %%
data = experiment(seed=3, n=15)
output_error = smid.OutputError(na=1, delay=0, stable=True)
naive = smid.identify(output_error, data, noise_bound=BOUND)
print(naive)
print("the parameters that made the data are", "inside" if inside(naive) else "OUTSIDE")

# %% [markdown]
# Nothing warns: the set is not empty, the intervals are narrow, their ends are proven. They are theorems *about an
# exact input*, and this input is not exact.
#
# ## Both channels noisy
#
# The true input $u_t - \zeta_t$ takes the place of $u_t$, with $|\zeta_t| \le 0.1$. The product $b_0 \zeta_t$ makes
# $b_0$ a complicating parameter beside $a_1$.

# %%
noisy_input = smid.ErrorsInVariables(na=1, stable=True)
print(noisy_input, end="\n\n")
honest = smid.identify(noisy_input, data, noise_bound={"u": BOUND, "y": BOUND})
print(honest)
print("the parameters that made the data are", "inside" if inside(honest) else "OUTSIDE")
assert inside(honest)

# %% [markdown]
# ## A picture, by other means
#
# With one pole the set of possible parameters can be drawn without any optimisation. Given $(a_1, b_0)$, the states
# that are possible at $t$ form an interval: what the last one and the input allow, cut with $y_t \pm 0.1$. Where it
# stays nonempty to the end, the parameters are possible.


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
# The boxes fit around the sets, which were drawn without them. The naive set lies within the honest one and misses the
# truth. A line of constant DC gain crosses the honest set; that will be of use.
#
# ## How often
#
# One record proves little. A dozen:

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
# Mostly the data are merciful: they prove that no parameters explain them with an exact input, and a longer record
# proves it the sooner. The temptation then is to raise the output's bound until something is feasible, which turns the
# proof into a false interval:

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
# The honest intervals are wider, for more is possible. What else is known? The DC gain, often, from an experiment at
# rest: say 5, to 4 % or exactly. It leaves a strip of the set.

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
# A prior is part of the theorem. One that is false makes it one about another plant; sometimes the data refute it:

# %%
for gain in ((5.7, 6.0), (7.0, 9.0)):
    wrong = smid.ErrorsInVariables(na=1, stable=True, dc_gain=gain)
    try:
        estimate = smid.identify(wrong, data, {"u": BOUND, "y": BOUND})
        print(f"gain in {gain}: not refuted, and the truth is", "inside" if inside(estimate) else "OUTSIDE")
    except smid.EmptyFeasibleSetError as proof:
        print(f"gain in {gain}:", str(proof).split(". ")[0])

# %% [markdown]
# **Try next:** `na=2` has four complicating parameters and takes some seconds; halve the input's bound and see which
# intervals shrink. Then, a whole study: [the clutch](05_clutch_hammerstein.ipynb).
