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
# # First intervals in five minutes
#
# Least squares answers "which parameters fit best?". Set membership asks another question: *which parameters are
# possible at all*, given how wrong the sensor can be? The answer is an interval for each parameter, and its ends are
# theorems. This page gets them for the pressure of a clutch actuator, reads them, and tries them on other records.

# %%
# %matplotlib inline
from pathlib import Path
from tempfile import TemporaryDirectory
from textwrap import fill

from matplotlib import pyplot as plt

import smid
from smid.data.bundled import record_path, true_parameters
from smid.display.style import style

# %% [markdown]
# ## A record
#
# A current drives a valve, which sets a pressure. The record comes with the package and is **simulated**, so that what
# is found can be compared with what made it. With a record of your own, give the path of your file.

# %%
record = smid.Dataset.from_csv(record_path("hammerstein_20C_ramp_a"), input="current", output="pressure")
print(record)

# %% [markdown]
# A few samples with large changes tell more than many at rest: the first two ramps are enough. The rest is kept to try
# the model on.

# %%
data, rest = record.crop(0, 200), record.crop(200)
with style():
    figure, rows = plt.subplots(2, 1, figsize=(5.6, 2.8), sharex=True, layout="constrained")
    for axes, channel in zip(rows, ("current", "pressure"), strict=True):
        axes.plot(record.time(0), record.values(channel))
        axes.axvspan(0, data.time(0)[-1], color="#e6e6e6", label="identified on")
        axes.set_ylabel(str(record.channel(channel)))
    rows[0].legend()
    rows[1].set_xlabel("time [s]")

# %% [markdown]
# ## A model
#
# What do we know of the plant? That a static curve turns the current into a pressure, and that the pressure follows
# with one pole: a Hammerstein model. Its structure is assumed, its four parameters are asked for.

# %%
model = smid.Hammerstein(poles=1, powers=(5, 4, 3), input_scale=0.01, unit_dc_gain=True, stable=True)
print(model)

# %% [markdown]
# ## The intervals
#
# The other thing to know is how wrong the sensor can be. This one errs by 0.3 bar at most; nothing is said of the
# noise's mean or distribution.

# %%
estimate = smid.identify(model, data, noise_bound=0.3)
print(estimate)

# %% [markdown]
# How to read it:
#
# - **lower, upper**: no parameter outside explains the record. This is proven, with every rounding error accounted for.
# - **gap**: how much the interval could be too wide. Beside each proven end stands a *witness*, parameters that were
#   verified to explain the record; the gap is the distance between the two. Here it is nothing beside the width.
# - **centre**: the middle, a model to work with.
#
# The record is simulated, so the parameters that made it are known. They must lie inside.

# %%
truth = true_parameters("hammerstein_20C_ramp_a")
for name, value in truth.items():
    interval = estimate[name]
    assert interval.lower <= value <= interval.upper
    share = (value - interval.lower) / interval.width
    print(f"{name:7} = {value:<8g} lies inside, {share:.0%} of the way from the lower end to the upper")

# %%
estimate.plot()

# %% [markdown]
# ## What the interval says
#
# Take a pole by hand and ask whether the record allows it. Inside, near the end, it does. A little outside there is a
# proof that it does not, and the samples that tell:

# %%
alpha = estimate["alpha"]


def with_pole(value):
    return smid.Hammerstein(poles=1, powers=(5, 4, 3), input_scale=0.01, stable=True, fixed={"alpha": value})


inside, outside = alpha.upper - 0.01 * alpha.width, alpha.upper + 0.01 * alpha.width
gamma1 = smid.identify(with_pole(inside), data, noise_bound=0.3)["gamma1"]
print(f"{inside:.6f}: allowed, together with a gamma1 from {gamma1.lower:.7f} to {gamma1.upper:.7f}")
try:
    smid.identify(with_pole(outside), data, noise_bound=0.3)
except smid.EmptyFeasibleSetError as proof:
    print(fill(f"{outside:.6f}: {proof}", 110))

# %% [markdown]
# ## Where the noise bound comes from
#
# From the sensor: its data sheet, or a record at rest. It can be computed from the data how small it may be,

# %%
bound = smid.error_bound(model, data)
print(bound)

# %% [markdown]
# but never identify with that value. There the intervals shrink to a point, *whatever the truth is*:

# %%
for factor in (1.001, 1.2):
    narrow = smid.identify(model, data, noise_bound=factor * bound.upper)["alpha"]
    where = "inside" if narrow.lower <= truth["alpha"] <= narrow.upper else "OUTSIDE"
    print(f"{factor:5.3f} x least bound: alpha in an interval {narrow.width:.1e} wide, the truth is {where}")

# %% [markdown]
# ## Other samples, other records
#
# The intervals are as true as the model and the bound. Whether the model predicts is another question, answered by a
# free run: from the current alone, without looking at the pressure.

# %%
validations = [smid.validate(estimate.model, rest, noise_bound=0.3)]
for name in ("hammerstein_20C_ramp_b", "hammerstein_60C_ramp_a", "varying_pole_20C_steps"):
    other = smid.Dataset.from_csv(record_path(name), input="current", output="pressure")
    validations.append(smid.validate(estimate.model, other, noise_bound=0.3))
for validation in validations:
    print(f"{validation}\n")

# %% [markdown]
# The same plant at the same temperature: the error is noise. At 60 degrees the curve and the pole are others. The steps
# come from a plant that this model does not describe; why, [diagnosis](08_diagnosis_simulated.ipynb) tells.
#
# ## A page to pass on

# %%
with TemporaryDirectory() as folder:
    page = smid.report(estimate, Path(folder) / "report.html", bound, validations, truth=truth)
    print(f"{page.name}: {page.stat().st_size // 1000} kB, tables and figures, to open in any browser")

# %% [markdown]
# **Try next:** `record.crop(0, 60)` (fewer samples, wider intervals); `noise_bound=0.6`; your own CSV. Then:
# [why a solver's answer is not a proof](02_solver_is_no_proof.ipynb).
