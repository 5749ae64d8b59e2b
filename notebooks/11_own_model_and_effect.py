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
# The models that come with smid are lists of equations, and so is yours. Written once, it is simulated, differentiated,
# fitted, bounded and diagnosed like any other. An effect, what a model may lack, is a function that rewrites such a
# list. This page writes both: for a hot water tank that stands outdoors, of which the library knows nothing.

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
# Per sample the tank loses a share of its heat, and the flow $u$ replaces a share of its water by hot water:
#
# $$\theta_t = \theta_{t-1} - \ell\, \theta_{t-1} + m\, u_{t-1} (40 - \theta_{t-1}), \qquad y_t = \theta_t + \eta_t .$$
#
# The product of flow and temperature makes it bilinear, so no transfer function will do. Parameters get finite boxes
# where something is known of them: nothing certified can be said about a set that may reach to infinity.

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
# Five days, a sample every quarter of an hour, by a loop that shares nothing with the model above.

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
# The complicating parameters were found by themselves, the gradients too. On the days after:

# %%
print(smid.validate(estimate.model, indoors.crop(80), NOISE))

# %% [markdown]
# ## A model file
#
# For a model that comes with smid no Python is needed, on the command line (`smid identify DATA.csv --model MODEL.toml
# ...`) or here. A file names a class and its fields; what is wrong in it is told with the key.

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
# Is the bilinear model needed at all? A linear one is refuted by the same record:

# %%
try:
    smid.identify(linear, indoors.crop(0, 80), NOISE)
except smid.EmptyFeasibleSetError as proof:
    print(fill(str(proof), 110))

# %% [markdown]
# ## Outdoors
#
# Now the tank stands in the sun, which nobody told the model. It is proven that its parameters do not explain the
# record. What does the library say?

# %%
rays = np.maximum(0, np.sin(2 * np.pi * STEP * np.arange(N) / DAY))
outdoors = record(measured(0.5 * rays, seed=5))
library = smid.diagnose(tank, outdoors, NOISE, workers=1)
show(library)
assert library.verdict == "none"

# %% [markdown]
# More than noise is left, and nothing that it knows carries over to the held-out part. It sees a line in the spectrum
# at one period a day, but a sinusoid at the sensor is not what the sun does: it shines half the day, and what it
# brings is stored in the tank.
#
# ## An effect
#
# That is knowledge of yours, put into a function. It gets a model, any model, and a site that tells what may be known
# of the record; it gives the extended model with values to start a fit from. The new parameter has a *null* value, at
# which the old model comes back. Names must be free, for the effect may be put on a model that has it already.


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
# The contract is checked on base models of all kinds, on top of other effects and of itself. It is silent where it is
# kept, and says what is broken where not, here in a careless version whose parameter cannot be switched off:

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
# It is registered by being listed, here beside all effects of the library, which compete with it. (An effect of a
# notebook cell is tried in this process; one that lives in a module can use several.)

# %%
found = smid.diagnose(tank, outdoors, NOISE, effects=[*EFFECTS, sunshine], workers=1)
show(found)
assert [cause.effect for cause in found.causes] == ["sunshine"]

# %%
found.plot()

# %% [markdown]
# ## Into the model
#
# Once its cause is known, the sun is an input like any other. With a channel for it the model is polynomial, and how
# strong the sun is gets a certified interval, too.

# %%
sun = Parameter("sun", -5, 5, "K")
sunny = tank.add_term("theta", sun.symbol * signal("rays")[t], [sun])
proven = smid.identify(sunny, record(outdoors.values("temperature"), rays=rays).crop(0, 80), NOISE)
print(proven)
assert all(proven[name].lower <= value <= proven[name].upper for name, value in {**TRUTH, "sun": 0.5}.items())

# %% [markdown]
# **Try next:** a second node for the tank's wall; `rate=True` in a `Line` is d/dt; an effect with two variants under
# two labels. More: [how to extend](../docs/extend.md). Then: [a study on a cluster](12_study_on_a_cluster.ipynb).
