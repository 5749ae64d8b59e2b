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
# # A day of data at 10 Hz
#
# A historian keeps every sample: a day at 10 Hz is 864,000 of them. Each end of an interval rests on a handful of
# these samples. So the intervals are proven on a few *windows* of the record, and hold for all of it. Points at their
# ends are verified on every sample.

# %%
# %matplotlib inline
import time
from pathlib import Path
from tempfile import mkdtemp

import matplotlib.pyplot as plt
import numpy as np
from IPython.display import display
from scipy.signal import lfilter

import smid

# %% [markdown]
# ## The record
#
# A valve sets the pressure in a small vessel. The command changes now and then; the pressure follows within a fraction
# of a second, and its sensor errs by at most 0.02 bar. The record is simulated, and written as a text file.

# %%
SAMPLES, BOUND = 864_000, 0.02
TRUTH = {"a1": -0.62, "b0": 0.19}
generator = np.random.default_rng(13)
hold = np.cumsum(generator.integers(20, 200, 20_000))
command = generator.uniform(1, 9, len(hold))[np.searchsorted(hold, np.arange(SAMPLES), side="right")]
pressure = lfilter([0, TRUTH["b0"]], [1, TRUTH["a1"]], command)
pressure += generator.uniform(-BOUND, BOUND, SAMPLES)

file = Path(mkdtemp()) / "day.csv"
columns = np.column_stack([np.arange(SAMPLES) / 10, command, pressure])
np.savetxt(file, columns, "%.7g", ",", header="time [s],command [V],pressure [bar]", comments="")
print(f"{file.name}: {file.stat().st_size / 1e6:.0f} MB")

# %% [markdown]
# ## Read it
#
# A text of this size takes some seconds. What was understood is printed before any model: `smid show day.csv` does the
# same.

# %%
began = time.perf_counter()
record = smid.Dataset.from_file(file, input="command", output="pressure")
print(record)
print(f"read in {time.perf_counter() - began:.0f} s")

# %% [markdown]
# ## Certified intervals
#
# The model has one pole and one gain. The noise bound is that of the sensor, with a little room for the digits of the
# file.

# %%
model = smid.OutputError(na=1, nb=0, stable=True)
began = time.perf_counter()
estimate = smid.identify(model, record, noise_bound=0.0201, certificate=file.with_name("proof.json"))
print(f"identified and proven in {time.perf_counter() - began:.0f} s")
display(estimate)

# %%
for name, true in TRUTH.items():
    interval = estimate[name]
    assert interval.lower <= true <= interval.upper
    print(f"{name}: {true} lies in [{interval.lower:.7f}, {interval.upper:.7f}]")

# %% [markdown]
# ## The windows
#
# The proof reads the samples in the windows, and no others. Fewer equations make the set of parameters larger: what
# holds for this larger set holds for the set of the whole record too.

# %%
held = sum(len(window) for window in estimate.windows)
print(f"{held} of {record.n_samples} samples in {len(estimate.windows)} windows")

figure, (whole, one) = plt.subplots(2, 1, figsize=(8, 5), layout="constrained")
hours = np.arange(SAMPLES)[::200] / 36_000
whole.plot(hours, record.values("pressure")[::200], color="0.7", linewidth=0.3)
for window in estimate.windows:
    whole.axvline(window.first / 36_000, color="#D55E00", linewidth=1)
whole.set(xlabel="time in h", ylabel="pressure in bar", title="Where the windows lie", xlim=(0, 24))
window = max(estimate.windows, key=len)
seconds = np.arange(len(window)) / 10
samples = slice(window.first, window.last + 1)
one.plot(seconds, record.values("pressure")[samples], ".-", color="#0072B2", label="pressure in bar")
one.plot(seconds, record.values("command")[samples], color="#009E73", drawstyle="steps-post", label="command in V")
one.set(xlabel="time in s, from its start", title="The longest of them")
one.legend()
plt.show()

# %% [markdown]
# ## And back
#
# The certificate contains the windows. `smid.verify` looks them up in the record, and proves the intervals again with
# exact fractions and code of its own.

# %%
proof = file.with_name("proof.json")
began = time.perf_counter()
verified = smid.verify(proof, record, model, 0.0201)
print(f"{proof.stat().st_size / 1e6:.1f} MB, checked in {time.perf_counter() - began:.0f} s")
print(verified)

# %% [markdown]
# ## One bad sample in a day
#
# A single sample that the model cannot explain leaves no parameters at all. The proof names the samples that contradict
# each other.

# %%
samples = record.values("pressure").copy()
samples[600_000] += 0.2
spoilt = smid.Dataset.from_arrays(
    input={"command": record.values("command")}, output={"pressure": samples}, sampling_time=0.1
)
try:
    smid.identify(model, spoilt, noise_bound=0.0201)
except smid.EmptyFeasibleSetError as proven:
    print(proven)

# %% [markdown]
# ## What to try next
#
# - Give `windows=False` for the first 20,000 samples, and compare the time.
# - Add noise to the command and take `smid.ErrorsInVariables`: the windows become shorter still.
# - Take a pole nearer to one. A window must be longer than the memory of the plant; from a pole of about 0.99 on the
#   windows are cut short. The intervals are then wider, and the estimate says so.
