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
# # Diagnosis: hide an effect, and test whether it is found
#
# If no parameters fit a record, the model lacks an effect. `smid.diagnose` extends the model with each effect of a
# library and fits again. It keeps an effect only if the record makes it probable. The gain is measured on a part of the
# record that nothing has seen.
#
# The diagnosis can be checked where the answer is known. So this page uses simulated plants, written without smid,
# with a hidden effect. A good diagnosis does three things:
#
# - It names the right effect.
# - It names nothing if the model is correct.
# - It says so if the data cannot decide.

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
# Our model is a linear motor with one pole. The diagnosis gets only this model, the noise bound and the record.

# %%
diagnose = partial(smid.diagnose, noise_bound=NOISE, workers=1)
model = smid.OutputError(1, 0, input="voltage", output="speed", stable=True, bounds={"b0": (0, 2)})
voltage = smid.signals.qprs(400, seed=5, levels=(-1, -0.6, -0.2, 0.2, 0.6, 1), periods=(3.0, 10.0, 30.0))

# %% [markdown]
# ## A dead zone
#
# Hidden effect: the amplifier gives no output below 0.15 V.


# %%
def dead_zone(v):
    return np.sign(v) * max(abs(v) - 0.15, 0)


found = diagnose(model, record(voltage, dead_zone))
show(found)

# %% [markdown]
# The output shows, in this order:
#
# 1. the error of the simulation, and the signals on which it depends;
# 2. the proof that no parameters of the base model fit the record;
# 3. the cause, its size, and why other effects were rejected;
# 4. the gain on the test part.

# %%
assert [cause.effect for cause in found.causes] == ["input_dead_zone"]
found.plot()

# %% [markdown]
# The next plot shows the error of the base model against every measured signal. A dead zone causes a step at zero
# voltage:

# %%
found.misfit.plot()

# %% [markdown]
# The intervals above are three standard deviations of a fit. The extended model is an ordinary smid model, so
# `prove_parameters` can replace them with certified intervals, from the first samples of the record:

# %%
proven = smid.diagnosis.prove_parameters(found, NOISE, samples=90)
for parameter in proven.causes[0].parameters:
    print(parameter)
    assert parameter.lower <= np.sign(parameter.value) * 0.15 <= parameter.upper

# %% [markdown]
# ## No hidden effect
#
# The same motor with a linear amplifier. The diagnosis tests thirty effects, and each of them can fit some of the
# noise. A wrong name is worse than no name:

# %%
clean = diagnose(model, record(voltage, lambda v: v))
show(clean)
assert clean.verdict == "none"
assert clean.proof is None

# %% [markdown]
# The largest error exceeds the noise bound slightly, because least squares does not use the bound. Only a proof shows
# that the model is wrong, and here there is none.
#
# ## The data cannot decide
#
# Hidden effect: an amplifier with soft saturation. The experiment is slow: one sine. With a slow input, a curve
# before the motor and a curve of the tachometer have the same effect.


# %%
def soft(v):
    return v - 0.3 * v**3


sine = smid.signals.sine(400, amplitude=0.9, frequency=1 / 200)
unsure = diagnose(model, record(sine, soft))
show(unsure)
assert unsure.verdict == "ambiguous"

# %% [markdown]
# The diagnosis names the rivals, and proposes an experiment on which their predictions differ most. The experiment
# stays within the voltages of the record. We run it on the simulated plant:

# %%
experiment = unsure.experiment
repeated = record(experiment.values, soft, seed=1)
alone = diagnose(model, repeated, effects=unsure.alternatives)
print(alone.conclusion)
assert alone.verdict == "none"

# %% [markdown]
# With the new record alone, nothing is wrong. A PRBS has two levels, and a straight line passes through two points.
# The new record separates the rivals only *together* with the first record:

# %%
runs = [replace(data.experiments[0], name=name) for data, name in ((unsure.data, "sine"), (repeated, "PRBS"))]
both = unsure.data.with_experiments(runs)
sure = diagnose(model, both)
show(sure)
assert [cause.effect for cause in sure.causes] == ["input_curve"]

# %%
sure.plot()

# %% [markdown]
# The extended model `sure.model` can be simulated, identified and reported.

# %%
print(sure.model)

# %% [markdown]
# **Try next:** two effects at once, `lambda v: soft(dead_zone(v))`; a tachometer with quantisation;
# `test=["PRBS"]`, to keep a whole run for the test. [Blind cases](../docs/diagnosis.md) count how often the name is
# right.
# Then: [measured data](09_diagnosis_measured.ipynb), where the answer is not known.
