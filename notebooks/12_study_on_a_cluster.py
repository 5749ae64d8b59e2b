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
# # A study on a cluster
#
# A study shows how intervals depend on the noise bound, the number of samples, the order and the method of the
# relaxation. It is a grid of independent identifications. It may take days, and must survive a reboot.
#
# `smid.order_study` runs such a grid in processes or on a Dask cluster. It saves every result as soon as it is
# computed, and it can resume.

# %%
# %matplotlib inline
import logging
import os
from functools import partial
from pathlib import Path
from tempfile import mkdtemp
from textwrap import fill

import numpy as np
from distributed import Client, LocalCluster
from IPython.display import display
from scipy.signal import lfilter

import smid
from smid.study import StudyError

# %% [markdown]
# ## The question
#
# A plant with one pole, errors in variables. How much narrower do more samples make the intervals? How much does a
# better sensor help? Which relaxation is worth its cost: the lift or the sparse hierarchy, of order 1 or 2? Every
# combination is one *run*; the code and the progress call it a *cell*.

# %%
TRUTH = {"a1": -0.8, "b0": 1.0}
SAMPLES = 12
generator = np.random.default_rng(3)
u = smid.signals.prbs(SAMPLES, seed=3, clock_period=2.0)
w = lfilter([TRUTH["b0"]], [1, TRUTH["a1"]], u)
u_measured, y_measured = (channel + generator.uniform(-0.05, 0.05, SAMPLES) for channel in (u, w))
record = smid.Dataset.from_arrays(input={"u": u_measured}, output={"y": y_measured}, sampling_time=1.0)

model = smid.ErrorsInVariables(na=1, stable=True, bounds={"b0": (0, 3)})
folder = Path(mkdtemp()) / "study"
run = partial(
    smid.order_study,
    model,
    {"run": record},
    orders=(1, 2),
    methods=("lift", "sparse"),
    sample_sizes=(6, 9, 12),
    tolerance=1e-3,
    folder=folder,
)
careful, sharp = ({"u": bound, "y": bound} for bound in (0.1, 0.05))

# %% [markdown]
# ## The cluster
#
# Here two worker processes with one thread each run on this machine. On a real cluster, `dask scheduler` and `dask
# worker` run on its nodes, and the client gets the address of the scheduler. Nothing else changes. (In a script, put
# code that starts processes under `if __name__ == "__main__":`.)

# %%
cluster = LocalCluster(
    n_workers=2,
    threads_per_worker=1,
    host="127.0.0.1",
    dashboard_address=None,
    silence_logs=logging.ERROR,  # a worker that is slow to leave is no matter
)
client = Client(cluster)
executor = client.get_executor(pure=False)
processes = client.run(os.getpid)  # on every worker
assert os.getpid() not in processes.values()
print(f"{len(processes)} workers, each in a process of its own")

# %% [markdown]
# ## Interrupted
#
# Ctrl-C ends the study and returns the finished runs. Here the program interrupts itself after a third of the runs:


# %%
def interrupt(line):
    done = int(line.split()[0])
    if done >= 4:
        print(line)
        raise KeyboardInterrupt


part = run(careful, executor=executor, progress=interrupt)
print(part.conclusion)
assert part.interrupted

# %% [markdown]
# ## Resumed
#
# A file in the folder of the study holds the finished runs. `resume=True` loads them and computes the rest. Data,
# model, settings and versions must be the same. Otherwise `order_study` raises an error.


# %%
def ends(study):
    return {cell: [(i.lower, i.upper) for i in outcome.intervals] for cell, outcome in study.done}


begun = []
study = run(careful, executor=executor, resume=True, progress=begun.append)
print(f"begun at {begun[0]}; {study.conclusion}")
assert ends(part).items() <= ends(study).items()

# %%
try:
    smid.order_study(model, {"run": record.crop(1)}, careful, tolerance=1e-3, folder=folder, resume=True)
except StudyError as error:
    print(fill(str(error).replace(f"{folder}", folder.name), 110))

# %% [markdown]
# The combinations may differ. With a second noise bound, for a sensor twice as good, only the new runs are computed:

# %%
begun.clear()
study = run([careful, sharp], executor=executor, resume=True, progress=begun.append)
print(f"begun at {begun[0]}; {study.conclusion}")
client.close()
cluster.close()

# %% [markdown]
# ## The result

# %%
display(study)

# %%
study.plot()

# %% [markdown]
# Thin lines are certified intervals, thick lines end at verified points. Where they meet, no relaxation can give a
# tighter interval. A pandas frame answers other questions: do all intervals contain the true parameters, and how do
# gaps and times compare?

# %%
frame = study.to_pandas()
true = frame.parameter.map(TRUTH)
assert ((frame.lower <= true) & (true <= frame.upper)).all()
print(f"the truth lies inside all {len(frame)} intervals")
a1 = frame[frame.parameter == "a1"].rename(columns={"bound of y": "bound"})
print(a1.pivot(index="samples", columns=["bound", "method", "order"], values="width").round(4), end="\n\n")
a1 = a1.assign(share=a1.gap / a1.width)
print(a1.groupby(["method", "order"]).agg(largest_gap_of_width=("share", "max"), seconds=("seconds", "sum")))

# %% [markdown]
# ## The report

# %%
page = smid.report(study, folder / "study.html", settings={"cluster": "two processes"})
beside = sorted(file.name for file in folder.iterdir() if file != page)
print(f"{page.name}: {page.stat().st_size // 1000} kB, beside {', '.join(beside)}")

# %% [markdown]
# The same on the command line: `smid study DATA.csv --model MODEL.toml --orders 1,2 --noise-bounds 0.3,0.36 --samples
# 40,80 --dask tcp://10.0.0.1:8786 --folder study --report study.html`. Use `--resume study`, in place of `--folder
# study`, after an interrupt or a kill.
#
# **Try next:** `orders=(1, 2, 3)`, which takes longer; several records in the mapping; `workers=2` instead of a
# cluster. `smid.diagnose` takes an `executor`, too.
