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
# # The clutch, section 3.3: recursive estimation, and what an error of 2e-14 means
#
# Where a model with constant parameters fails, the thesis estimates them again at every sample. It reports errors of
# $2 \cdot 10^{-14}$ bar. Three errors must be distinguished:
#
# - *a posteriori*: the parameters were updated with this sample,
# - *one step ahead*: the parameters were updated with the previous samples only,
# - *free run*: the last parameters are kept constant.

# %%
# %matplotlib inline
from smid.data.bundled import load_clutch
from smid.theses.clutch.recursive_study import recursive_study
from smid.theses.clutch.set_study import set_study

# %%
study = recursive_study(load_clutch(("20C_ramp_a", "20C_step_a", "20C_step_b")))
print(study.meaning)

# %%
print(study.summary)

# %%
study.plot()

# %% [markdown]
# Errors against the adaptation gain (figure 3.12 of the thesis). With gain 1 the a posteriori error is zero by
# construction, for any data.

# %%
print(study.gains)
study.gains.plot()

# %% [markdown]
# The unnormalised gradient at all gains, on the record of figure 3.11. The thesis found it useless for all gains. Here
# the best gain is hardly better one step ahead than holding the last pressure, and gain 1 diverges.

# %%
print(study.unnormalised)
study.unnormalised.plot()

# %% [markdown]
# ## Recursive set membership, the thesis's first proposal
#
# At every sample smid updates a certified outer set of the parameters. If the set becomes empty, no constant
# parameters fit the samples. This proves that the plant has changed, and gives the time of the change.

# %%
sets = set_study()
print(sets)

# %%
sets.plot()

# %% [markdown]
# **Try next:** `track(Arx(), ForgettingFactor(0.99), data)` of `smid.recursive` on your own record, and look at the
# free run. Then: [virtual sensors](06_virtual_sensors.ipynb).
