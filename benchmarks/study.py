"""Studies: two Dask workers beside one, and 60 cells killed again and again: ``python -m benchmarks.study``."""

from __future__ import annotations

import argparse
import os
import random
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np

from smid import Dataset, OutputError, order_study
from smid.processes import THREADS
from smid.study import Cell, Outcome, Study, dask_executor
from smid.study.store import FILE

MODEL = OutputError(na=1, stable=True)


def record(seed: int, count: int) -> Dataset:
    """Return a first-order plant's samples with noise within 0.1."""
    rng = np.random.default_rng(seed)
    u = rng.choice([-1.0, 1.0], count)
    w = np.zeros(count)
    for k in range(1, count):
        w[k] = 0.7 * w[k - 1] + 0.5 * u[k - 1]
    return Dataset.from_arrays(input={"u": u}, output={"y": w + rng.uniform(-0.1, 0.1, count)}, sampling_time=0.1)


def many_cells(folder: Path | None, progress: Callable[[str], None] | None = None) -> Study:
    """Run or resume a study of 60 small cells."""
    return order_study(
        MODEL,
        {"first": record(1, 7), "second": record(2, 7)},
        [0.1, 0.12, 0.15, 0.2, 0.25],
        orders=[1, 2],
        sample_sizes=[5, 6, 7],
        tolerance=0.5,
        rounds=1,
        folder=folder,
        resume=folder is not None and (folder / FILE).is_file(),
        progress=progress,
    )


def proven(study: Study) -> dict[Cell, Outcome]:
    """Return what a study proves, without what it took."""
    return {cell: replace(outcome, seconds=0.0, peak_memory=0.0) for cell, outcome in study.done}


def rows(folder: Path) -> dict[str, str]:
    """Return what is in the study's file."""
    if not (folder / FILE).is_file():
        return {}
    with closing(sqlite3.connect(folder / FILE)) as connection:
        if not connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]:
            return {}
        return dict(connection.execute("SELECT key, outcome FROM cells"))


def kills(count: int) -> str:
    """Kill a study at random moments, resume it, and compare it with one in a piece."""
    first: list[float] = []
    begun = time.perf_counter()
    whole = many_cells(None, lambda line: first.append(time.perf_counter()) if line.startswith("1 of") else None)
    started = first[0] - begun
    each = (time.perf_counter() - first[0]) / (len(whole.cells) - 1)
    chance = random.Random(2026)
    lost = repeated = 0
    steps = []
    with tempfile.TemporaryDirectory() as name:
        folder, before = Path(name), {}
        for _ in range(count):
            # From before the first cell, workers still starting, to some cells beyond.
            moment = chance.uniform(0, 2 * started + 8 * each)
            process = subprocess.Popen([sys.executable, "-m", "benchmarks.study", "--child", name])
            time.sleep(moment)
            process.send_signal(signal.SIGKILL)
            process.wait()
            now = rows(folder)
            lost += len(before.keys() - now.keys())
            repeated += sum(now[key] != text for key, text in before.items() if key in now)
            steps.append(len(now))
            before = now
        last = many_cells(folder)
        repeated += sum(rows(folder)[key] != text for key, text in before.items())
        kept = len(rows(folder))
    same = "equal to" if proven(last) == proven(whole) else "DIFFERENT from"
    return (
        f"## A study of {len(whole.cells)} cells, killed {count} times\n\n"
        f"Cells kept after each SIGKILL: {', '.join(map(str, steps))}; after the last resume {kept}. "
        f"Cells lost {lost}, repeated {repeated}; intervals {same} those of an uninterrupted study."
    )


def throughput(repeats: int) -> str:
    """Time the same independent cells on one Dask worker and on two, in turns."""
    from distributed import LocalCluster

    seconds: dict[int, list[float]] = {1: [], 2: []}
    found = []
    for _ in range(repeats):
        for workers, times in seconds.items():
            with (
                LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    processes=True,
                    dashboard_address=":0",
                    host="127.0.0.1",
                    silence_logs=50,
                ) as cluster,
                dask_executor(cluster.scheduler_address) as executor,
            ):
                run = lambda bounds: order_study(  # noqa: E731  the same twice
                    MODEL, record(1, 30), bounds, orders=[1], executor=executor
                )
                run([1.0 + k for k in range(2 * workers)])  # imports
                begun = time.perf_counter()
                found.append(run(np.linspace(0.12, 0.2, 24)))
                times.append(time.perf_counter() - begun)
    one, two = (float(np.median(times)) for times in seconds.values())
    cells = len(found[0].cells)
    same = all(proven(study) == proven(found[0]) for study in found)
    return (
        f"## {cells} independent cells on Dask, one thread a worker\n\n"
        f"One worker {one:.1f} s ({cells / one:.2f} cells/s), two workers {two:.1f} s ({cells / two:.2f} cells/s), "
        f"medians of {repeats}; throughput two / one = {one / two:.2f} (target: 1.6; load average "
        f"{os.getloadavg()[1]:.1f} on {os.cpu_count()} cores). The intervals are {'the same' if same else 'DIFFERENT'}."
    )


def main() -> None:
    """Read the arguments and print what they ask for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.study", description=__doc__)
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--only", choices=["kills", "throughput"])
    parser.add_argument("--child", help=argparse.SUPPRESS)
    given = parser.parse_args()
    os.environ.update(dict.fromkeys(THREADS, "1"))
    if given.child is not None:
        many_cells(Path(given.child))
        return
    if given.only != "throughput":
        print(kills(given.kills), flush=True)
    if given.only != "kills":
        print(f"\n{throughput(given.repeats)}", flush=True)


if __name__ == "__main__":
    main()
