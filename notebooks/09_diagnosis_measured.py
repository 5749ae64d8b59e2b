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
# # Diagnosis of measured data
#
# On simulated data, the result of a diagnosis can be compared with the hidden effect. On measured data the answer is
# not known, the noise has no known bound, and the model can lack several effects. This page treats two classical
# records. One has a cause that textbooks name. The other has no known cause.
#
# The records are public, but most licences do not allow us to distribute them. Put each record set into a folder with
# its own name, and all these folders into one folder. Set the environment variable `SMID_DATA` to the absolute path
# of this folder. **Without it this page also runs, and lists the missing files.** The outputs below are from a run
# with the records.

# %%
# %matplotlib inline
import os
from pathlib import Path
from textwrap import fill

import numpy as np
from matplotlib import pyplot as plt

import smid
from smid.data import RECORDS, load_record
from smid.display.style import style


def record(name):
    """Return a measured set, or None where it is absent, saying what would have to be there."""
    folder = Path(os.environ.get("SMID_DATA", "")) / name
    if "SMID_DATA" in os.environ and folder.is_dir():
        return load_record(name, folder)
    print(f"{name} is absent: {RECORDS[name].title}.")
    for file in RECORDS[name].files:
        print(f"Put {file.path} (MD5 {file.md5}) into $SMID_DATA/{name}/.")
    return None


def show(found):
    """Print a diagnosis, long lines folded."""
    print("\n".join(fill(line, 110, subsequent_indent="      ") for line in str(found).splitlines()))


# %% [markdown]
# The package `nonlinear_benchmarks` downloads other sets from nonlinearbenchmark.org:
#
# ```python
# import nonlinear_benchmarks  # pip install nonlinear_benchmarks
#
# train, test = nonlinear_benchmarks.Cascaded_Tanks()
# data = smid.Dataset.from_nonlinear_benchmarks([train, test])
# ```
#
# ## A gas furnace
#
# The record is series J of Box and Jenkins: the feed of methane, and the carbon dioxide in the outlet. The base model
# is linear, of order 2, with an offset and a delay of one sample. The noise bound of the sensor is not known, so we
# give none. Then there is no certificate. The last 20 % of the record are the test part, which the search does not see.

# %%
furnace = record("box_jenkins_gas_furnace")
if furnace is not None:
    gas, carbon_dioxide = furnace.inputs[0], furnace.outputs[0]
    channels = {"offset": True, "input": gas, "output": carbon_dioxide}
    found = smid.diagnose(smid.OutputError(2, 1, **channels), furnace, workers=1)
    show(found)
    assert found.verdict == "none"
    assert found.doubts["extra_lag"] > 0.5

# %% [markdown]
# Besides the verdict, read three things:
#
# - the *probability*, among all sets of effects that were fitted;
# - the *gain* on the test part: the noise of this record is slow, so even the right model reduces the error only
#   slightly;
# - the *last sentence*: whether the remaining error is more than noise.
#
# Box and Jenkins named a delay of three samples; the base model has one of them. The noise of this record is slow, and
# 237 samples of it do not tell the delay from a further lag, nor either of them from noise beyond doubt. So the
# diagnosis names nothing and says what is in doubt. Asked for a delay or a lag alone, it says:

# %%
if furnace is not None:
    asked = smid.diagnose(smid.OutputError(2, 1, **channels), furnace, effects=["input_delay", "extra_lag"], workers=1)
    print("With a delay of one sample in the base model:", asked.conclusion, dict(asked.doubts))
    delayed = smid.OutputError(2, 1, delay=3, **channels)
    again = smid.diagnose(delayed, furnace, effects=["input_delay", "extra_lag"], workers=1)
    print("With a delay of three samples in the base model:", again.conclusion)

# %% [markdown]
# ### A check with set membership
#
# Set membership gives an independent check of the delay, without a known noise bound. For each delay, we compute the
# least noise bound with which a model of order 1 fits the first samples. The lower end of each interval is proven: with
# a smaller bound, no parameters fit.

# %%
if furnace is not None:
    least = {}
    for delay in range(1, 6):
        model = smid.OutputError(1, 0, delay=delay, stable=True, **channels)
        least[delay] = smid.error_bound(model, furnace.crop(0, 80))
        print(f"delay {delay}: {least[delay].enclosure} {least[delay].unit}")
    best = min(least, key=lambda delay: least[delay].upper)
    others = min(bound.lower for delay, bound in least.items() if delay != best)
    print(f"Proven: any other of these delays needs {others / least[best].upper:.2f} times the bound of delay {best}.")

# %% [markdown]
# ## A lamp above a plate
#
# The record is DaISy's heating system: the voltage of a halogen lamp, and the temperature of a steel plate under it.
# Dullerud and Smith tested whether the record *refutes* a linear model; they did not name what the model lacks.
# Friction and backlash are impossible here. So we test only effects that a lamp, a plate and a thermocouple can have.

# %%
heating = record("daisy_heating_system")
thermal = (
    *("input_curve", "input_saturation", "input_delay", "extra_lag", "power_law", "operating_point"),
    *("output_curve", "sensor_bias", "hysteresis"),
)
if heating is not None:
    linear = smid.OutputError(2, 1, offset=True, input=heating.inputs[0], output=heating.outputs[0])
    unnamed = smid.diagnose(linear, heating, effects=thermal, workers=1)
    show(unnamed)
    assert unnamed.verdict == "none"
    assert unnamed.unexplained

# %% [markdown]
# The misfit is large and has structure. But what fits the first 80 % of the record hardly reduces the error on the test
# part: by less than its own spread. So the diagnosis names no cause, and lists these effects as details. A wrong name
# would be worse than no name.

# %%
if heating is not None:
    print(unnamed.misfit)
    with style():
        figure, axes = plt.subplots(figsize=(5.6, 2.4), layout="constrained")
        time, held = heating.time(0) / 60, unnamed.test[0]
        axes.plot(time, heating.values(unnamed.output) - unnamed.simulated[0])
        axes.axvspan(time[np.argmax(held)], time[-1], color="#e6e6e6", label="test part")
        axes.set_xlabel("time [min]")
        axes.set_ylabel(f"error of the free run [{unnamed.unit}]")
        axes.legend()

# %% [markdown]
# Set membership gives a certified answer to the question of Dullerud and Smith: the least noise bound of the
# thermocouple with which the linear model fits.

# %%
if heating is not None:
    thinned = heating.decimate(4, antialias=False)
    first = smid.OutputError(1, 0, offset=True, stable=True, input=heating.inputs[0], output=heating.outputs[0])
    print(f"one pole, every fourth sample: {smid.error_bound(first, thinned)}")

# %% [markdown]
# **Try next:** all thirty effects on the lamp (leave out `effects` and `workers`; this takes longer), and look at the
# probability of the result; other sets of `smid.data.RECORDS`. [Measured records](../docs/measured.md) shows the
# results on twelve records, with the failures. Then: [experiments that make intervals
# narrow](10_experiment_design.ipynb).
