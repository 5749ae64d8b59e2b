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
# One interval answers one question. Research asks how intervals depend on things: on the noise bound, the number of
# samples, the order and the method of the relaxation. That is a grid of identifications, each independent of the
# others, which may take days and must survive a reboot. `smid.order_study` runs such a grid on processes or on a Dask
# cluster, keeps every outcome as it comes, and resumes.

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
# A plant with one pole, errors in variables. What do more samples bring, what does a better sensor, and which
# relaxation should one pay for: the lift or the sparse hierarchy, of order 1 or 2? Every combination is one *cell*.

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
# Here two worker processes of one thread each, on this machine's loopback. On a real cluster `dask scheduler` and `dask
# worker` run on its nodes, and the client gets the scheduler's address; nothing else changes. (In a script, what starts
# processes belongs under `if __name__ == "__main__":`.)

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
# Ctrl-C returns what is done. Here it is pressed by the program, after a third of the cells:


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
# What was done is in a file in the study's folder. `resume=True` takes it and runs the rest. Data, model, settings and
# versions must be the same; with others nothing is mixed, but refused.


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
# The combinations may differ. A sharper bound, for a sensor twice as good, runs its own cells only:

# %%
begun.clear()
study = run([careful, sharp], executor=executor, resume=True, progress=begun.append)
print(f"begun at {begun[0]}; {study.conclusion}")
client.close()
cluster.close()

# %% [markdown]
# ## What it says

# %%
display(study)

# %%
study.plot()

# %% [markdown]
# Thin lines are certified, thick ones witnessed: where they meet, no relaxation can say more. A frame serves for any
# other question. Is the truth inside, always? What do gaps cost?

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
# ## The page

# %%
page = smid.report(study, folder / "study.html", settings={"cluster": "two processes"})
beside = sorted(file.name for file in folder.iterdir() if file != page)
print(f"{page.name}: {page.stat().st_size // 1000} kB, beside {', '.join(beside)}")

# %% [markdown]
# The same on the command line: `smid study DATA.csv --model MODEL.toml --orders 1,2 --noise-bounds 0.3,0.36 --samples
# 40,80 --dask tcp://10.0.0.1:8786 --folder study --report study.html`, and `--resume study` after an interrupt or a
# kill.
#
# **Try next:** `methods=("lift", "sparse")` with a time to spare; several records in the mapping; `workers=2` instead
# of a cluster. `smid.diagnose` takes an `executor`, too.
