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
# # Your own model, your own effect
#
# The models that come with smid are lists of equations, and your model is too. Write it once; then smid simulates,
# differentiates, fits, bounds and diagnoses it like any other model. An effect is something that a model may lack. In
# code it is a function that extends a list of equations.
#
# This page writes a model and an effect for an outdoor hot water tank, which is not in the library.

# %%
# %matplotlib inline
from pathlib import Path
from tempfile import mkdtemp
from textwrap import fill

import numpy as np
import sympy

import smid
from smid.diagnosis import EFFECTS, Effect, Extension, check_effect
from smid.diagnosis.effects.parts.clock import with_clock
from smid.diagnosis.effects.parts.naming import find, fresh
from smid.models import Line, Measurement, Model, ModelError, Parameter, load_model, signal, t

NOISE = 0.1  # K
HOT = 40  # K above the surroundings: the water that flows in
STEP, DAY = 900.0, 86400.0  # s

# %% [markdown]
# ## A model
#
# In each sampling interval, the tank loses a share of its heat, and the flow $u$ replaces a share of its water by hot
# water:
#
# $$\theta_t = \theta_{t-1} - \ell\, \theta_{t-1} + m\, u_{t-1} (40 - \theta_{t-1}), \qquad y_t = \theta_t + \eta_t .$$
#
# The product of flow and temperature makes the model bilinear, so it has no transfer function. Give parameters finite
# bounds where you know them. Nothing can be certified for a feasible set that may be unbounded.

# %%
loss = Parameter("loss", 0, 0.5, "1/sample")
mixing = Parameter("mixing", 0, 0.2, "min/l")
flow, theta = signal("flow"), signal("theta")
inflow = mixing.symbol * flow[t - 1] * (HOT - theta[t - 1])
balance = Line(theta[t], theta[t - 1] - loss.symbol * theta[t - 1] + inflow)
tank = Model("hot water tank", (loss, mixing), (balance,), (Measurement("temperature", "theta", "eta"),))
print(tank)

# %% [markdown]
# ## A record
#
# Five days, one sample every quarter of an hour. The loop below simulates the tank without the model above.

# %%
N = 480
TRUTH = {"loss": 0.05, "mixing": 0.03}
flows = smid.signals.qprs(N, seed=3, levels=(0, 1, 2, 4), periods=(4.0, 12.0, 30.0))


def measured(sunshine, seed):
    temperature = np.zeros(N)
    for k in range(1, N):
        before = temperature[k - 1]
        temperature[k] = before - 0.05 * before + 0.03 * flows[k - 1] * (HOT - before) + sunshine[k]
    return temperature + np.random.default_rng(seed).uniform(-NOISE, NOISE, N)


def record(y, **channels):
    units = {"flow": "l/min", "temperature": "K"}
    return smid.Dataset.from_arrays(
        input={"flow": flows, **channels}, output={"temperature": y}, sampling_time=STEP, units=units
    )


def show(diagnosis):
    """Print a diagnosis, long lines folded."""
    print("\n".join(fill(line, 110, subsequent_indent="      ") for line in str(diagnosis).splitlines()))


indoors = record(measured(np.zeros(N), seed=1))
estimate = smid.identify(tank, indoors.crop(0, 80), NOISE)
print(estimate)
assert all(estimate[name].lower <= value <= estimate[name].upper for name, value in TRUTH.items())

# %% [markdown]
# smid found the complicating parameters and the gradients automatically. Validation on the following days:

# %%
print(smid.validate(estimate.model, indoors.crop(80), NOISE))

# %% [markdown]
# ## A model file
#
# A model class of smid needs no Python: a model file names the class and its fields. Use the file on the command line
# (`smid identify DATA.csv --model MODEL.toml ...`) or here. The message about a mistake names the key.

# %%
folder = Path(mkdtemp())
(folder / "MODEL.toml").write_text(
    'class = "OutputError"\nna = 1\nstable = true\ninput = "flow"\noutput = "temperature"\n', encoding="utf-8"
)
linear = load_model(folder / "MODEL.toml")
(folder / "WRONG.toml").write_text('class = "OutputError"\npoles = 1\n', encoding="utf-8")
try:
    load_model(folder / "WRONG.toml")
except ModelError as error:
    print(fill(str(error).replace(f"{folder}/", ""), 110))

# %% [markdown]
# Is the bilinear model necessary? The same record refutes a linear model:

# %%
try:
    smid.identify(linear, indoors.crop(0, 80), NOISE)
except smid.EmptyFeasibleSetError as proof:
    print(fill(str(proof), 110))

# %% [markdown]
# ## Outdoors
#
# Now the sun warms the tank, and the model does not contain the sun. smid proves that no parameters of the model fit
# the record. The diagnosis with the library:

# %%
rays = np.maximum(0, np.sin(2 * np.pi * STEP * np.arange(N) / DAY))
outdoors = record(measured(0.5 * rays, seed=5))
library = smid.diagnose(tank, outdoors, NOISE, workers=1)
show(library)
assert library.unexplained
assert library.gain.rmse_after > 2 * NOISE

# %% [markdown]
# The library has no sun, and names a stand-in that swings once a day. It takes a part of the error on the test part
# away, but what remains is many times the noise, and the diagnosis says so. The period is the clue. A swing is not the
# effect of the sun: the sun shines half of the day, and the tank stores its heat.
#
# ## An effect
#
# We know about the sun, so we write a function for it. It takes any model, and a site with information about the
# record. It returns the extended model, with starting values for a fit. The new parameter has a *null* value, which
# switches the effect off. The names must be new, because the effect may be applied to a model that already has it.


# %%
def extend(model, site):
    sun = fresh(model, "sunshine", (-5, 5), site.unit(site.output), 0.0)
    timed, now = with_clock(model, site.sampling_time)
    shining = sun.symbol * sympy.Max(0, sympy.sin(2 * np.pi / DAY * now))
    yield Extension(timed.add_term(site.output, shining, [sun]), starts=({sun.name: 0.1}, {sun.name: 1.0}))


def describe(values, site):
    return f"At noon the sun adds {find(values, 'sunshine'):.3g} {site.unit(site.output)} per sample."


sunshine = Effect("sunshine", "the sun warms the plant by day", extend, describe)

# %% [markdown]
# `check_effect` tests the effect on base models of all kinds, on top of other effects and of itself. It raises an
# error if the effect breaks a rule. Here is an effect whose parameter cannot be switched off:

# %%
check_effect(sunshine)


def careless(model, site):
    sun = Parameter("sunshine", -5, 5)
    yield Extension(model.add_term(site.output, sun.symbol, [sun]), starts=({"sunshine": 0.1},))


try:
    check_effect(Effect("careless", "the sun never sets", careless, describe))
except AssertionError as broken:
    print(broken)

# %% [markdown]
# To register the effect, put it into the list of effects. Here it competes with all effects of the library. (An
# effect from a notebook cell runs in this process only. An effect from a module can use several processes.)

# %%
found = smid.diagnose(tank, outdoors, NOISE, effects=[*EFFECTS, sunshine], workers=1)
show(found)
assert [cause.effect for cause in found.causes] == ["sunshine"]

# %%
found.plot()

# %% [markdown]
# ## Into the model
#
# When the cause is known, the sun becomes an input. With a channel for it the model is polynomial, and the strength
# of the sun gets a certified interval.

# %%
sun = Parameter("sun", -5, 5, "K")
sunny = tank.add_term("theta", sun.symbol * signal("rays")[t], [sun])
proven = smid.identify(sunny, record(outdoors.values("temperature"), rays=rays).crop(0, 80), NOISE)
print(proven)
assert all(proven[name].lower <= value <= proven[name].upper for name, value in {**TRUTH, "sun": 0.5}.items())

# %% [markdown]
# **Try next:** a second node for the wall of the tank; `rate=True` in a `Line` means d/dt; an effect with two
# variants under two labels. More: [how to extend](../docs/extend.md). Then: [a study on a
# cluster](12_study_on_a_cluster.ipynb).
