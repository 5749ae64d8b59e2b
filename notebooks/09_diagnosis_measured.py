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
# On simulated data a diagnosis can be checked against what was hidden. On measured data nobody hid anything, the noise
# has no known bound, and several things are wrong at once. Two classical records: one has a cause that textbooks name,
# the other has none that is known.
#
# The records are public but do not come with smid, since most licences do not allow passing them on. Put them into one
# folder, each set in a folder under its own name, and name it in the environment variable `SMID_DATA` (an absolute
# path). **Without it this page runs too, and tells what is missing.** The outputs below are from a run with the
# records.

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
# Other sets come by the package `nonlinear_benchmarks`, which downloads them from nonlinearbenchmark.org:
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
# Box and Jenkins's series J: the feed of methane, and the carbon dioxide in the outlet. The base model is linear, of
# order 2, with an offset and the usual one sample of delay. No bound of the sensor is known, so none is given; then
# there is no certificate, and the judgement rests on the last 30 % of the record, which no fit has seen.

# %%
furnace = record("box_jenkins_gas_furnace")
if furnace is not None:
    gas, carbon_dioxide = furnace.inputs[0], furnace.outputs[0]
    channels = {"offset": True, "input": gas, "output": carbon_dioxide}
    found = smid.diagnose(smid.OutputError(2, 1, **channels), furnace, workers=1)
    show(found)
    assert [cause.effect for cause in found.causes] == ["input_delay"]

# %% [markdown]
# Three things to read beside the name. The *confidence*, against all other effects of the library. The *gain* on
# held-out data: this record's noise is slow, so even the right model follows it little better. And the *last
# sentence*: whether what is left is more than noise. Box and Jenkins named a delay of three samples, one of which the
# base model has:

# %%
if furnace is not None:
    for cause in found.causes:
        print(cause.sentence)
    delayed = smid.OutputError(2, 1, delay=3, **channels)
    again = smid.diagnose(delayed, furnace, effects=["input_delay", "extra_lag"], workers=1)
    print("With a delay of three samples in the base model:", again.conclusion)

# %% [markdown]
# ### A second witness
#
# A fit, a bootstrap and a score have named the delay. Set membership can be asked too, and needs no noise bound: how
# wrong would the sensor have to be for a model of order 1 to explain the first samples? The lower end of each enclosure
# is proven: with a smaller bound there are no parameters.

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
# ## A lamp under a plate
#
# DaISy's heating system: the voltage of a halogen lamp, and the temperature of a steel plate under it. Dullerud and
# Smith used it to ask whether a linear model can be *refuted*, and left unnamed what is missing. Friction or
# backlash cannot be in it, so only effects are tried that a lamp, a plate and a thermocouple can have.

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
# The misfit is large, and it has structure; that no effect is named is not for want of an error. But what fits the
# first 70 % of the record does not carry over to the rest. To say so is the honest answer: a wrong name is worse than
# none.

# %%
if heating is not None:
    print(unnamed.misfit)
    with style():
        figure, axes = plt.subplots(figsize=(5.6, 2.4), layout="constrained")
        time, held = heating.time(0) / 60, unnamed.held[0]
        axes.plot(time, heating.values(unnamed.output) - unnamed.simulated[0])
        axes.axvspan(time[np.argmax(held)], time[-1], color="#e6e6e6", label="held out")
        axes.set_xlabel("time [min]")
        axes.set_ylabel(f"error of the free run [{unnamed.unit}]")
        axes.legend()

# %% [markdown]
# Dullerud and Smith's question has a certified answer, too: how wrong would the thermocouple have to be?

# %%
if heating is not None:
    thinned = heating.decimate(4, antialias=False)
    first = smid.OutputError(1, 0, offset=True, stable=True, input=heating.inputs[0], output=heating.outputs[0])
    print(f"one pole, every fourth sample: {smid.error_bound(first, thinned)}")

# %% [markdown]
# **Try next:** all thirty effects on the lamp, which takes longer (leave out `effects` and `workers`), and look at the
# confidence of what is named; other sets of `smid.data.RECORDS`. Twelve records, failures included, are on
# [a page of their own](../docs/measured.md). Then: [experiments that shrink intervals](10_experiment_design.ipynb).
