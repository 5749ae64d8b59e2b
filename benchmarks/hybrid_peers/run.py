"""Train one library's arm on a record from a file, and write its free runs: ``python run.py NAME RECORD RESULT``.

It imports numpy and the library only, so it also runs in an environment without smid.
"""

from __future__ import annotations

import importlib
import sys
import time

import numpy as np

if __name__ == "__main__":
    name, source, target = sys.argv[1:]
    given = dict(np.load(source))
    library = importlib.import_module(name)
    began = time.process_time()
    inertia, simulate = library.train(given["u"], given["y"], float(given["h"]), given["start"])
    seconds = time.process_time() - began
    runs = {f"run{k}": np.asarray(simulate(given[f"check{k}"])) for k in range(2)}
    np.savez(target, inertia=inertia, seconds=seconds, **runs)
