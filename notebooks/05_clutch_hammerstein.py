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
# # The clutch, section 3.2: a Hammerstein model and its limits
#
# A dual clutch actuator turns a current (mA) into a pressure (bar). The thesis of [the clutch](../README.md)
# identified a static curve followed by one pole,
#
# $$x_t = \gamma_1 v_t^5 + \gamma_2 v_t^4 + \gamma_3 v_t^3, \qquad
#   w_t = -\alpha w_{t-1} + (1 + \alpha) x_{t-1}, \qquad y_t = w_t + \eta_t,\ |\eta_t| \le D,$$
#
# in three phases: the least noise bound, parameter intervals, validation. The records of the thesis are confidential.
# Ours have the same names and are **simulated**. The simulated plant has the effects that the thesis found: dead
# zones, hysteresis, a pole that depends on pressure and direction, three temperatures.

# %%
# %matplotlib inline
import matplotlib.pyplot as plt

from smid.data.bundled import load_clutch
from smid.theses.clutch.hammerstein_study import PART, hammerstein_study
from smid.theses.clutch.overview import record_overview

# %%
records = load_clutch()
print(record_overview())

# %%
figure, rows = plt.subplots(3, 2, figsize=(11, 6), sharex=True, layout="constrained")
for column, name in enumerate(("20C_ramp_a", "20C_step_a")):
    run = records.select(name).experiments[0]
    for row, channel in enumerate(("current", "pressure", "position")):
        rows[row, column].plot(run.values[channel], linewidth=0.8)
        rows[row, column].set_ylabel(str(records.channel(channel)))
    rows[0, column].set_title(name)
    rows[2, column].set_xlabel("sample (2 ms)")

# %% [markdown]
# ## The three phases
#
# We identify on a part of `20C_ramp_a` that covers all levels. Every interval is certified, at every order. A higher
# order can only make it tighter.

# %%
study = hammerstein_study()
print("identified on samples", PART)
print(study.bound)
print()
print(study.orders)

# %% [markdown]
# ## The thesis's intervals, and what the certificates show
#
# The thesis prints an interval for $\gamma_1$ whose lower end is above its upper end. The pole of the thesis's model
# lies outside the interval printed for it. A solver's status does not show such errors; a certificate does.

# %%
print(study.printed)

# %% [markdown]
# ## Validation: ramps and steps
#
# The free run follows the ramps and fails on the steps, as in figures 3.3 and 3.4 of the thesis. For comparison, a
# Hammerstein model with all powers up to five is fitted by least squares (the thesis's HS20).

# %%
print(study.runs)

# %%
study.plot()

# %% [markdown]
# ## Width against the noise bound
#
# At the least noise bound the intervals shrink to a point *whatever the true parameters are*. If the noise bound
# comes from the data, a narrow interval is no evidence of accuracy.

# %%
print(study.widths)
study.widths.plot()

# %% [markdown]
# ## Conclusion

# %%
print(study.conclusion)

# %% [markdown]
# **Try next:** another part of the record (`PART`), or your own record: `smid phases` does the three phases for
# any record. [Diagnosis](08_diagnosis_simulated.ipynb) shows how to find the reason for a misfit like
# the one on the steps. Then: [the same plant, sample by sample](05b_clutch_recursive.ipynb).
