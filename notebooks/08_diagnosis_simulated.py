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
# # Diagnosis: hide an effect, and see whether it is found
#
# When no parameters explain a record, the model lacks something. `smid.diagnose` looks for what: it extends the model
# with each effect of a library in turn, fits again, and keeps what pays off on data that no fit has seen. Whether the
# name it gives is right can be checked where the answer is known. So here is a plant, written without smid, with
# something hidden in it. Three things are wanted: the right name; no name where nothing is wrong; and where the data
# cannot tell, that it says so.

# %%
# %matplotlib inline
from dataclasses import replace
from functools import partial
from textwrap import fill

import numpy as np

import smid

NOISE = 0.05  # rad/s, the tachometer's bound


def motor(voltage, amplifier, seed):
    """Return the speed of a motor behind an amplifier, every second: many small Euler steps, then noise."""
    speed, shown = 0.0, []
    for v in voltage:
        shown.append(speed)
        for _ in range(50):
            speed += 0.02 * (2.0 * amplifier(v) - speed) / 4.0
    return np.array(shown) + np.random.default_rng(seed).uniform(-NOISE, NOISE, len(shown))


def record(voltage, amplifier, seed=0):
    return smid.Dataset.from_arrays(
        input={"voltage": voltage},
        output={"speed": motor(voltage, amplifier, seed)},
        sampling_time=1.0,
        units={"voltage": "V", "speed": "rad/s"},
    )


def show(found):
    """Print a diagnosis, long lines folded."""
    print("\n".join(fill(line, 110, subsequent_indent="      ") for line in str(found).splitlines()))


# %% [markdown]
# What we believe: a linear motor, one pole. This, the noise bound and the record is all that the diagnosis is told.

# %%
diagnose = partial(smid.diagnose, noise_bound=NOISE, workers=1)
model = smid.OutputError(1, 0, input="voltage", output="speed", stable=True, bounds={"b0": (0, 2)})
voltage = smid.signals.qprs(400, seed=5, levels=(-1, -0.6, -0.2, 0.2, 0.6, 1), periods=(3.0, 10.0, 30.0))

# %% [markdown]
# ## A dead zone
#
# Hidden: the amplifier does nothing below 0.15 V.


# %%
def dead_zone(v):
    return np.sign(v) * max(abs(v) - 0.15, 0)


found = diagnose(model, record(voltage, dead_zone))
show(found)

# %% [markdown]
# In this order: what the simulation gets wrong and on what the error depends; the certificate that no parameters of the
# base model explain the record; the cause, how large it is, and why others were not taken; the gain on held-out data.

# %%
assert [cause.effect for cause in found.causes] == ["input_dead_zone"]
found.plot()

# %% [markdown]
# The error before, against everything that was measured. A step at zero voltage is what a dead zone looks like:

# %%
found.misfit.plot()

# %% [markdown]
# The intervals above are three standard deviations of a fit. The extended model is a model like any other, so they can
# be replaced by certified ones, from the first samples of the record:

# %%
proven = smid.diagnosis.prove_parameters(found, NOISE, samples=90)
for parameter in proven.causes[0].parameters:
    print(parameter)
    assert parameter.lower <= np.sign(parameter.value) * 0.15 <= parameter.upper

# %% [markdown]
# ## Nothing hidden
#
# The same motor behind a straight amplifier. Thirty effects are tried, and every one of them has parameters that fit
# some of the noise. A wrong name is worse than no name:

# %%
clean = diagnose(model, record(voltage, lambda v: v))
show(clean)
assert clean.verdict == "none"
assert clean.proof is None

# %% [markdown]
# The largest error exceeds the bound by a little: least squares does not know of bounds. A certificate decides whether
# that matters, and there is none here.
#
# ## Where the data cannot tell
#
# Hidden: an amplifier that saturates softly. The experiment is slow, one sine. Behind a slow enough input it makes no
# difference whether a curve lies before the motor or in the tachometer behind it.


# %%
def soft(v):
    return v - 0.3 * v**3


sine = smid.signals.sine(400, amplitude=0.9, frequency=1 / 200)
unsure = diagnose(model, record(sine, soft))
show(unsure)
assert unsure.verdict == "ambiguous"

# %% [markdown]
# It names the rivals and an experiment on which their predictions differ most, within the voltages that the plant has
# seen. So go and do it. On a simulated plant that is one line:

# %%
experiment = unsure.experiment
repeated = record(experiment.values, soft, seed=1)
alone = diagnose(model, repeated, effects=unsure.alternatives)
print(alone.conclusion)
assert alone.verdict == "none"

# %% [markdown]
# On the new record alone nothing is wrong! A PRBS has two levels, and through two points there is a straight line. It
# tells the rivals apart only *together* with the record on which they were found:

# %%
runs = [replace(data.experiments[0], name=name) for data, name in ((unsure.data, "sine"), (repeated, "PRBS"))]
both = unsure.data.with_experiments(runs)
sure = diagnose(model, both)
show(sure)
assert [cause.effect for cause in sure.causes] == ["input_curve"]

# %%
sure.plot()

# %% [markdown]
# The model that is left can be used: `sure.model` simulates, is identified, is reported.

# %%
print(sure.model)

# %% [markdown]
# **Try next:** two effects at once, `lambda v: soft(dead_zone(v))`; a tachometer that is quantised; `holdout=["PRBS"]`,
# a whole run that no fit may see. How often the name is right is counted on [blind cases](../docs/diagnosis.md). Then:
# [measured data](09_diagnosis_measured.ipynb), where nobody knows the answer.
