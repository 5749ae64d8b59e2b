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
# # Design of experiments: inputs that make intervals narrow
#
# The thesis ends with two proposals (7.4): an optimisation that handles local minima, and experiments designed by
# Fisher information and physical insight. For the white model of the arm, both can be done without a starting value,
# with *certified intervals* of all constants. The best input is the one with the narrowest intervals.

# %%
# %matplotlib inline
from functools import partial

import numpy as np

from smid import Dataset, identify
from smid.design import d_optimal, model_information, shrinking_input
from smid.models import Reactor
from smid.signals import prbs, qprts, sine
from smid.theses.hybrid import simulate_reactor
from smid.theses.hybrid.arm import prove_arm
from smid.theses.hybrid.arm.exact_motion import ARM, exact_motion
from smid.theses.hybrid.inputs import arm_information, arm_inputs, arm_sines, arm_tailored, arm_widths, input_study
from smid.theses.hybrid.inputs.input_study import NARROW, TAILORED

H, N, NOISE = 0.02, 300, 0.002  # s, samples, rad

# %% [markdown]
# ## Certified intervals without a starting value
#
# `identify` proves the intervals of the arm's differential equation. For known speeds, its law is linear in $1/J$,
# $b/J$, $W_d/J$, $W_s/J$. Bounds on the constants give bounds on the speeds. Bounds on the speeds give linear programs
# for the constants, and each bound is certified. The prior covers three orders of magnitude.

# %%
u = arm_inputs(N)["tailored"]
motion = exact_motion(u, H)
y = motion[:, 0] + np.random.default_rng(0).uniform(-NOISE, NOISE, N)
found = prove_arm(Dataset.from_arrays(input=u, output=y, sampling_time=H), NOISE)
print(found)
print("the arm that made the data lies inside:", all(p.lower <= ARM[p.name] <= p.upper for p in found))

# %% [markdown]
# ## Fisher information
#
# A D-optimal sum of six sines within 1 V, for $1/J$, $b$ and $W_d$. The initial state is unknown too.

# %%
information = partial(arm_information, sampling_time=H, deviation=NOISE / np.sqrt(3), names=("theta", "b", "Wd"))
best = d_optimal(arm_sines(N, H), information, budget=300, seed=1)
print(best)
for name, signal in arm_inputs(N).items():
    within = signal / max(1.0, np.abs(signal).max())
    print(f"{name:18} log det {information(within).log_determinant:.2f}")

# %% [markdown]
# For a smooth model, the Fisher information follows from the analytic sensitivities of its free run. Here is the
# reactor, with three inputs.

# %%
reactor = Reactor(tau=None, a=None, sampling_time=1.0, substeps=4)
reactor_inputs = {
    "sine": sine(200, amplitude=0.4, offset=0.5),
    "PRBS": prbs(200, seed=1, amplitude=0.4, offset=0.5, clock_period=4.0),
    "QPRTS": qprts(200, seed=1),
}
for name, signal in reactor_inputs.items():
    told = model_information(reactor, {"u": signal}, {"tau": 2.0, "a": 1.0}, 0.005 / np.sqrt(3))
    print(name, [f"{name} {share:.2%}" for name, share in zip(told.names, told.relative_deviations, strict=True)])

# %% [markdown]
# ## The set-membership counterpart
#
# The input with the narrowest certified intervals, among tailored signals within 1 V. Each evaluation is a complete
# certification, so only a few signals are evaluated.

# %%
widths = partial(arm_widths, sampling_time=H, noise_bound=NOISE, prior=dict(NARROW))
shrinking = shrinking_input(arm_tailored(N, H), widths, budget=8, starts=[TAILORED])
print(shrinking)

# %%
inputs = {name: signal for name, signal in arm_inputs(N).items() if name in ("one_sine", "six_equal", "tailored")}
inputs |= {"D-optimal": best.input, "narrowest": shrinking.input}
study = input_study(inputs, noise_bound=NOISE, budget=0)
print(study)

# %%
study.plot_intervals()

# %%
study.plot_spread()

# %% [markdown]
# ## The same for the reactor
#
# $\tau$ and $a$ of the plants of table 2, from one record each, by `identify`. The scheme "enclosed" makes the
# intervals hold for the differential equation itself.

# %%
for plant, power in (("time_constant", 1), ("factor", 1), ("power", 3)):
    for name, signal in reactor_inputs.items():
        clean = simulate_reactor(plant, signal, 1.0)
        noisy = clean + np.random.default_rng(1).uniform(-0.005, 0.005, 200)
        data = Dataset.from_arrays(input=signal, output=noisy, sampling_time=1.0)
        steps = 1 if power == 1 else 20  # a linear rate is integrated exactly
        proven = identify(Reactor(None, None, power, scheme="enclosed", substeps=steps), data, 0.005, tolerance=0.2)
        tau, a = proven["tau"], proven["a"]
        print(f"{plant:14} {name:6} tau in [{tau.lower:.4f}, {tau.upper:.4f}] s, a in [{a.lower:.4f}, {a.upper:.4f}]")

# %% [markdown]
# **Try next:** a larger `budget`; another `NOISE`. The widths are nearly proportional to the noise bound, as long as
# it does not hide the static friction. Then: [input signals](10b_input_signals.ipynb).
