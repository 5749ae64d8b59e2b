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
# # The reactor: first principles and a network, joined in four ways
#
# We model a stirred tank by $\tau \dot y + y = K(\tau) u$. The plant differs from this model in one known way. A
# network must learn the difference. It can stand in four places:
#
# - after the model (series),
# - beside it (parallel),
# - beside it, with $\tau$ estimated at the same time (simultaneous),
# - inside its balance (embedded).
#
# A hybrid model is an ordinary smid model: the network is an expression in its lines, and the weights are parameters.
# So it can be simulated, differentiated and fitted like any other model.

# %%
# %matplotlib inline
import warnings
from dataclasses import replace

import numpy as np
from matplotlib import pyplot as plt

from smid import Dataset
from smid.display.style import style
from smid.hybrid import EXTRA, SIMPLE, BackCouplingWarning, embedded, estimate, network_of, parallel, required, series
from smid.models import signal, simulate, t
from smid.signals import noisy_staircase
from smid.theses.hybrid import reactor_plant
from smid.theses.hybrid.cooled_reactor import arrhenius, cooled_reactor
from smid.theses.hybrid.reactor import (
    output_errors,
    reactor_record,
    requirement_study,
    time_constant_study,
    white_reactor,
)
from smid.theses.hybrid.reactor.records import free_run

# %% [markdown]
# ## Two networks with one past output each
#
# The plant has $\tau = 2$ s; the model has 4 s. Each network reads one past sample of its own output, as in the first
# attempts of the thesis.

# %%
data, held_out = reactor_record("time_constant"), reactor_record("time_constant", "constant")
white = white_reactor("time_constant")
print(series(white, SIMPLE, (1,)).model)

# %%
runs = {"plant": held_out.values("y")}
for join, couplings, name in (
    (series, SIMPLE, "series, simple"),
    (series, EXTRA, "series, extra"),
    (parallel, SIMPLE, "parallel, simple"),
):
    found = estimate(join(white, couplings), data, starts=2, iterations=150, seed=1)
    runs[name] = free_run(found.hybrid, held_out)
    print(found)

with style():
    figure, axes = plt.subplots(figsize=(5.6, 2.6), layout="constrained")
    for name, samples in runs.items():
        axes.plot(samples[:40], "ko" if name == "plant" else "-", markersize=2.5, label=name)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("concentration [mol/m³]")
    axes.legend()

# %% [markdown]
# ## What the network has to learn
#
# In series it has to learn $H_P / H_M$, in parallel $H_P - H_M$. Their z-transforms give the number of past samples
# that the network needs. In series, the simple network lacks one past input. In parallel, it lacks two past inputs
# and one past output.

# %%
for topology in ("series", "parallel"):
    print(required(reactor_plant("time_constant"), white, topology, 1.0), "\n")

# %% [markdown]
# If you pass `plant=`, `estimate` checks the back couplings and warns when too few are given:

# %%
with warnings.catch_warnings(record=True) as told:
    warnings.simplefilter("always", BackCouplingWarning)
    estimate(series(white, SIMPLE), data, plant=reactor_plant("time_constant"), error="prediction", starts=1, seed=1)
print(told[0].message)

# %% [markdown]
# Learned against required response, for the linear mismatches (table 6). Networks with the required number of back
# couplings lie on the dots.

# %%
requirements = requirement_study(starts=1, iterations=100)
print(requirements.table)

# %%
requirements.plot()

# %% [markdown]
# ## All mismatches (table 5)

# %%
errors = output_errors(starts=1, iterations=100)
print(errors)

# %%
errors.plot()

# %% [markdown]
# ## A time constant and a network at the same time
#
# The plant has $\tau = 2$ and twice the outflow of $y$; the estimate starts at 4. Only with a static network inside
# the balance is the estimate of $\tau$ correct. A dynamic network beside the model fits as well with a wrong $\tau$.
# The data cannot separate the dynamics of the network from those of the plant.

# %%
print(time_constant_study(starts=2))

# %% [markdown]
# ## A reaction rate from a network
#
# The designer of a cooled reactor knows the flows and the heat, but assumes a constant reaction rate. A network of
# the temperature replaces the rate in both balances. It learns Arrhenius's law.

# %%
plant = replace(cooled_reactor(known_rate=True), sampling_time=6.0)
q = noisy_staircase(1500, seed=3, period=50.0, steps=4, amplitude=8.0, offset=100.0, noise_amplitude=1.0)
run = simulate(plant, {"q": q}, initial={"c": [0.1], "theta": [438.5]})
record = Dataset.from_arrays(input={"q": q}, output={"Ca": run["Ca"], "T": run["T"]}, sampling_time=6.0)

believed = cooled_reactor(known_rate=False).bound(r=(0.16, 0.16))
c, temperature = signal("c")[t], signal("theta")[t]
hybrid = embedded(believed, {"c": -c, "theta": believed.parameter("h").symbol * c}, [(temperature - 440) / 10], (2,))
found = estimate(hybrid, record, [np.arange(1500) < 1000], starts=1, iterations=60, seed=1)
print(found)
for channel in ("Ca", "T"):
    print(channel, "RMSE of the free run, held out:", np.std(found.fit.residual(record, channel)[0][1000:]))

# %%
visited = np.linspace(run["T"].min(), run["T"].max(), 60)
learned = 0.16 + network_of(found.model, found.hybrid.term)((visited[:, None] - 440) / 10)
with style():
    figure, axes = plt.subplots(figsize=(4.8, 2.6), layout="constrained")
    axes.plot(visited, [float(arrhenius(value)) for value in visited], "ko", markersize=2.5, label="Arrhenius's law")
    axes.plot(visited, learned, label="network")
    axes.axhline(0.16, color="#c8c8c8", label="what its designer believes")
    axes.set_xlabel("temperature [K]")
    axes.set_ylabel("reaction rate [1/s]")
    axes.legend()

# %% [markdown]
# **Try next:** more neurons, fewer back couplings, another seed. Then: [the arm](07b_arm_local_minima.ipynb), where
# the estimation of an embedded network ends in local minima.
