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
# Least squares returns the parameters that fit best. Set membership returns *all* parameters that fit, given the
# largest error of the sensor. The result is a certified interval for each parameter: no value outside it fits the
# data.
#
# This page computes certified intervals for the pressure of a clutch actuator. It explains how to read them, and
# validates the model on other records.

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
# A current drives a valve, and the valve sets a pressure. The record comes with the package. It is **simulated**, so
# the true parameters are known. For your own record, give the path of your CSV file.

# %%
record = smid.Dataset.from_file(record_path("hammerstein_20C_ramp_a"), input="current", output="pressure")
print(record)

# %% [markdown]
# A few samples with large changes carry more information than many samples at rest. We identify on the first two
# ramps, and keep the rest for validation.

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
# A static curve turns the current into a pressure, and the pressure follows with one pole. This is a Hammerstein
# model. We assume its structure, and identify its four parameters.

# %%
model = smid.Hammerstein(poles=1, powers=(5, 4, 3), input_scale=0.01, unit_dc_gain=True, stable=True)
print(model)

# %% [markdown]
# ## The intervals
#
# smid also needs the noise bound, the largest error of the sensor. Here it is 0.3 bar. smid assumes nothing about the
# mean or the distribution of the noise.

# %%
estimate = smid.identify(model, data, noise_bound=0.3)
print(estimate)

# %% [markdown]
# How to read the table:
#
# - **lower, upper**: no parameter outside this interval fits the record. The proof includes all rounding errors.
# - **gap**: the interval could be too wide by this much at most. For each end, smid verified parameters that fit the
#   record; the output calls them a *witness*. The gap is the distance from the end to this verified point. Here it is
#   negligible.
# - **centre**: the midpoint of the interval. The central model uses these values.
#
# The record is simulated, so the true parameters are known. They must lie inside.

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
# ## What the interval means
#
# Fix the pole and identify again. A pole just inside the interval fits the record. A pole just outside does not fit,
# and smid proves it. The message lists the samples with most influence on the proof.

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
# Take the noise bound from the sensor: from its data sheet, or from a record at rest. `smid.error_bound` computes the
# least noise bound with which the model fits the data:

# %%
bound = smid.error_bound(model, data)
print(bound)

# %% [markdown]
# Do not identify with the least noise bound. With that bound the intervals shrink to a point, *whatever the true
# parameters are*:

# %%
for factor in (1.001, 1.2):
    narrow = smid.identify(model, data, noise_bound=factor * bound.upper)["alpha"]
    where = "inside" if narrow.lower <= truth["alpha"] <= narrow.upper else "OUTSIDE"
    print(f"{factor:5.3f} x least bound: alpha in an interval {narrow.width:.1e} wide, the truth is {where}")

# %% [markdown]
# ## Other samples, other records
#
# The intervals are valid if the model and the noise bound are correct. A free run shows whether the model predicts:
# it simulates the pressure from the current alone.

# %%
validations = [smid.validate(estimate.model, rest, noise_bound=0.3)]
for name in ("hammerstein_20C_ramp_b", "hammerstein_60C_ramp_a", "varying_pole_20C_steps"):
    other = smid.Dataset.from_file(record_path(name), input="current", output="pressure")
    validations.append(smid.validate(estimate.model, other, noise_bound=0.3))
for validation in validations:
    print(f"{validation}\n")

# %% [markdown]
# - **Same plant, same temperature**: the error is close to the noise.
# - **60 degC**: the curve and the pole are different.
# - **Steps**: this model does not describe the plant that made the record. [Diagnosis](08_diagnosis_simulated.ipynb)
#   shows how to find the reason.
#
# ## A report

# %%
with TemporaryDirectory() as folder:
    page = smid.report(estimate, Path(folder) / "report.html", bound, validations, truth=truth)
    print(f"{page.name}: {page.stat().st_size // 1000} kB, tables and figures, to open in any browser")

# %% [markdown]
# **Try next:** `record.crop(0, 60)` (fewer samples, wider intervals); `noise_bound=0.6`; your own CSV file. Then:
# [why a solver's answer is not a proof](02_solver_is_no_proof.ipynb).
