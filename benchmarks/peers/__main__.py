"""Compare linear ARX, FROLS of SysIdentPy and the recurrent network of jax-sysid with smid on measured records.

    python -m benchmarks.peers FOLDER [--only RECORD ...] [--smid FILE] [--output docs/peers.md]

FILE is a page that `python -m benchmarks.measured_diagnosis FOLDER --output FILE` wrote: the figures of smid come from
there, and without it their columns are empty. The peers come with `pip install "smid[peers]"`.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
os.environ.update(dict.fromkeys(THREADS, "1"))  # read once, when numpy is imported
os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false")

import numpy as np  # noqa: E402

from benchmarks.machine import described  # noqa: E402
from benchmarks.measured_diagnosis import CASES, START, Case  # noqa: E402
from benchmarks.peers import protocol  # noqa: E402
from benchmarks.peers.protocol import Peer, Run  # noqa: E402
from smid.data import load_record  # noqa: E402
from smid.diagnosis.parts import split  # noqa: E402
from smid.fitting.binding import bind  # noqa: E402

PEERS = ("arx", "frols", "recurrent_network")
SMID_HEAD = "| record | known to be missing | named, in order | test RMSE: base | extended | s |"
HEAD = """# Comparison with other identification tools on measured records

This page compares the RMSE of free runs on the test part of public measured records. No fit and no choice uses the test
part. `{command}` writes the page. The records are not part of the project. [Diagnosis of measured records](measured.md)
describes the records, the test parts and the base models.

{protocol}

The free run of a peer is called divergent where its error exceeds {limit:.0f} times the range of the output. The seconds
of a peer contain the choice of its settings, its fit and its simulations.

"""
"""

"""


def peers() -> list[Peer]:
    """Import the peers."""
    try:
        return [import_module(f"benchmarks.peers.{name}").PEER for name in PEERS]
    except ModuleNotFoundError as missing:
        raise SystemExit(f'{missing.name} is not installed: pip install "smid[peers]"') from missing
