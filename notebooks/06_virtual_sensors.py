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
# In the car, no sensor measures the position of the clutch. The thesis computes it from current and pressure. It uses
# one network for each temperature (CPX), a static network (PX), or a polynomial of the pressure (CFPX).
#
# Our records are **simulated**. Those of the thesis are confidential and normalised, so only the kind of the errors
# can be compared, not their size.

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
# A sensor that was trained at one temperature fails at the others. A sensor that was trained on steps fails where
# there is hysteresis.

# %%
sensors = train_thesis_sensors(("CPX20", "CPX20 filtered", "PX20", "CFPX20 filtered"))
print(cross_errors(sensors))

# %%
sensor_traces("5.14", sensors).plot()

# %% [markdown]
# Polynomials of the pressure up to order 100, in a Chebyshev basis. A raw Vandermonde matrix would be numerically
# singular long before this order.

# %%
print(table_5_3())

# %% [markdown]
# ## One sensor for all temperatures, with hysteresis
#
# This is the thesis's second proposal. The sensor PTX takes pressure and temperature. Play operators store the branch
# of the hysteresis loop. PTX has 28 parameters, a CPX has 61 for each temperature. PTX needs no median filter and no
# delay.

# %%
single = train_single_sensor()
held_out = load_clutch(("20C_ramp_b", "20C_step_b", "60C_ramp_b", "60C_step_c", "m20C_step_c"))
print(cross_errors({"CPX20 filtered": sensors["CPX20 filtered"], "PTX": single}, held_out))

# %% [markdown]
# ## Error bounds on held-out records
#
# The error bound for each held-out record comes from the other records.

# %%
intervals = interval_study(single)
print(intervals)

# %%
intervals.plot()

# %% [markdown]
# **Try next:** `train_single_sensor(sensor=PTX(plays=1))`, with PTX of `smid.sensors`; compare the errors of the
# records. Then: [the reactor](07_reactor_topologies.ipynb), where first principles are partly known.
