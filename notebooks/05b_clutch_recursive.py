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
# Where a model with constant parameters fails, the thesis estimates them anew at every sample and reports errors of
# $2 \cdot 10^{-14}$ bar. Three errors have to be told apart:
#
# - *a posteriori*: with parameters that have seen this very sample,
# - *one step ahead*: with parameters that have seen the samples before it,
# - *free run*: with the last parameters frozen.

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
# The adaptation gain (figure 3.12): with gain 1 the a posteriori error vanishes by construction, for any data.

# %%
print(study.gains)
study.gains.plot()

# %% [markdown]
# ## Recursive set-membership: the thesis's first wish
#
# At every sample a certified outer set of the parameters. If it becomes empty, no constant parameters explain the
# samples: the plant has changed, proven, and we know when.

# %%
sets = set_study()
print(sets)

# %%
sets.plot()

# %% [markdown]
# **Try next:** `track(Arx(), ForgettingFactor(0.99), data)` of `smid.recursive` on your own record, and look at the
# free run. Then: [virtual sensors](06_virtual_sensors.ipynb).
