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
# # The clutch, chapter 5: virtual sensors of the position
#
# In the car the position of the clutch is not measured. The thesis computes it from current and pressure, with one
# network for each temperature (CPX), a static network (PX) or a polynomial (CFPX) of the pressure. Our records are
# **simulated**; the thesis's are confidential and normalised, so errors are compared in kind, not in size.

# %%
# %matplotlib inline
from smid.data.bundled import load_clutch
from smid.theses.clutch.sensor_study import (
    cross_errors,
    interval_study,
    sensor_traces,
    table_5_3,
    train_single_sensor,
    train_thesis_sensors,
)

# %% [markdown]
# ## The thesis's sensors, and where they fail
#
# A sensor trained at one temperature fails at the others, and one trained on steps fails where there is hysteresis.

# %%
sensors = train_thesis_sensors(("CPX20", "CPX20 filtered", "PX20", "CFPX20 filtered"))
print(cross_errors(sensors))

# %%
sensor_traces("5.14", sensors).plot()

# %% [markdown]
# Polynomials of the pressure up to order 100, in a Chebyshev basis: a raw Vandermonde matrix would be singular to
# working precision long before.

# %%
print(table_5_3())

# %% [markdown]
# ## One sensor for all temperatures, with hysteresis
#
# The thesis's second wish. PTX takes pressure and temperature; play operators remember on which branch of the loop the
# clutch is. It has 28 parameters, a CPX has 61 for each temperature, and it needs no median filter and no delay.

# %%
single = train_single_sensor()
held_out = load_clutch(("20C_ramp_b", "20C_step_b", "60C_ramp_b", "60C_step_c", "m20C_step_c"))
print(cross_errors({"CPX20 filtered": sensors["CPX20 filtered"], "PTX": single}, held_out))

# %% [markdown]
# ## With an honest error bound
#
# Each held-out record is covered by intervals that were made from the other ones.

# %%
intervals = interval_study(single)
print(intervals)

# %%
intervals.plot()

# %% [markdown]
# **Try next:** `train_single_sensor(sensor=PTX(plays=1))`, with PTX of `smid.sensors`, and see which
# records suffer. Then: [the reactor](07_reactor_topologies.ipynb), where first principles are known in part.
