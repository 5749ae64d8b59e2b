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
# # Input signals: what an input reveals about the plant
#
# Section 2.4 of the hybrid thesis requires *persistently exciting* signals. Its plots of input against output, the
# *spread*, show how much of the plane each signal covers. This page shows all its signals, and the signal that it
# recommends at its end (7.4). Each signal depends only on its options and its seed.

# %%
# %matplotlib inline
import numpy as np

from smid.data import DataError, Dataset, excitation, require_excitation
from smid.signals import (
    TABLE_F1,
    constant,
    noise,
    noisy_staircase,
    plot_spread,
    prbs,
    qprs,
    qprts,
    sine,
    staircase,
    tailored,
)
from smid.theses.hybrid import simulate_reactor
from smid.theses.hybrid.arm.exact_motion import exact_motion

# %% [markdown]
# ## Figure 2.5: the spread in a stirred tank
#
# The tank $2\dot y + y = 0.76 u$ with the inputs of the thesis, one sample per second.

# %%
n = 200
inputs = {
    "constant": constant(n, offset=0.5),
    "sine": sine(n, amplitude=0.4, offset=0.5),
    "noise": noise(n, seed=1, amplitude=0.4, offset=0.5),
    "staircase": staircase(n, amplitude=0.4, offset=0.5, steps=2),
    "noisy staircase": noisy_staircase(n, seed=1, amplitude=0.35, offset=0.5, noise_amplitude=0.05),
    "PRBS": prbs(n, seed=1, amplitude=0.4, offset=0.5),
    "QPRS, five levels": qprs(n, seed=1, levels=(0.1, 0.3, 0.5, 0.7, 0.9), periods=(1.0, 5.0, 20.0)),
    "QPRTS": qprts(n, seed=1),
}
plot_spread({name: (u, simulate_reactor("time_constant", u, 1.0, start=0.1)) for name, u in inputs.items()}, 1.0)

# %% [markdown]
# ## Persistence of excitation
#
# The order is the size of the largest covariance matrix that is positive definite. A constant has order 0, and a sine
# has order 2. A sum of $k$ sines has order $2k$. With too short a sampling time, rounding hides a part of this order.

# %%
for name, u in inputs.items():
    print(f"{name:18} order {excitation(u).order}")
print(excitation(inputs["QPRTS"]))

# %%
for sampling_time in (1.0, 0.02):
    orders = {name: excitation(s.signal(600, sampling_time)).order for name, s in TABLE_F1.items()}
    print(f"table F.1, every {sampling_time:g} s:", orders)

# %% [markdown]
# If the order of a signal is too low for a model, `require_excitation` raises an error with both orders.

# %%
data = Dataset.from_arrays(input=inputs["sine"], output=inputs["sine"], sampling_time=1.0)
try:
    require_excitation(data, 4)
except DataError as error:
    print(error)

# %% [markdown]
# ## The rotating arm: table F.1, and a tailored signal
#
# The order counts frequencies. It does not show *where* the input drives a nonlinear plant. The arm sticks only below
# 0.03 rad/s. A signal that passes zero speed quickly shows little static friction, whatever its order. The tailored
# signal brakes the arm. Then it keeps the arm in slow motion, with a voltage too small to break away.

# %%
arm = {name: TABLE_F1[name].signal(600, 0.02) for name in ("one_sine", "six_equal", "six_unequal")}
arm["tailored"] = tailored(
    600, sampling_time=0.02, frequency=1.5 / (2 * np.pi), amplitude=0.5, level=0.1, switching=-0.05, half_period=2.0
)
speeds = {name: exact_motion(u, 0.02)[:, 1] for name, u in arm.items()}
plot_spread(
    {name: (u, speeds[name]) for name, u in arm.items()}, 0.02, input_label="voltage [V]", output_label="speed [rad/s]"
)

# %%
for name, v in speeds.items():
    print(f"{name:12} sticks at {np.mean(np.abs(v) < 0.03):.0%} of the samples")

# %% [markdown]
# **Try next:** `excitation` of the input of your own record. Then: [your own model and your own
# effect](11_own_model_and_effect.ipynb).
