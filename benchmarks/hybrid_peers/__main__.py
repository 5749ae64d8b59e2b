"""The embedded arm of five neurons in smid, diffrax, CasADi and PySINDy: error, seconds and lines of code.

    python -m benchmarks.hybrid_peers [--python PYTHON] [--inputs six_unequal six_equal] [--noise 0.002]

The record, the network, its start and the number of iterations (100) are the same for all. PySINDy has no network: it
chooses among terms that contain the law. ``--python`` is that of an environment with the libraries, ``pip install
smid[hybrid-peers]`` or their names alone; by default this one.

Errors are free runs against the exact motion, as shares of the span, over slower sines and a voltage of another kind,
each with the library's own integrator. Seconds are of the processor, with compilation. Lines are those of the library's
file without comments and blank lines. The start is the law-free search of smid, or random weights.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from relaxations.algebra.arrays import Array
from smid.display.table import Table
from smid.networks import nguyen_widrow
from smid.signals import TABLE_F1
from smid.theses.hybrid.arm import (
    embedded_arm,
    embedded_error,
    global_start,
    held_record,
    modulate_motion,
    other_kind,
    quiet_filter,
    slower,
)

FOLDER, LONGEST = Path(__file__).parent, 150  # s of the processor
PEERS = {
    "smid, linearly implicit": ("with_smid", {}),
    "diffrax, Kvaerno3": ("with_diffrax", {}),
    "CasADi, RK4 in 4 steps": ("with_casadi", {"CASADI_SCHEME": "rk"}),
    "CasADi, CVODES": ("with_casadi", {"CASADI_SCHEME": "cvodes"}),
    "PySINDy": ("with_pysindy", {}),
}


def lines_of(name: str) -> int:
    """Return the number of lines of a file without its docstring, comments and blank lines."""
    text = (FOLDER / f"{name}.py").read_text(encoding="utf-8").split("\n")[1:]
    return sum(bool(line.strip()) and not line.strip().startswith("#") for line in text)


def starts(input: str, noise: float, seed: int) -> dict[str, Array]:
    """Return the start without a law, and a random one."""
    record = held_record(TABLE_F1[input], noise_bound=noise, seed=seed)
    motion = modulate_motion(record, quiet_filter(noise, record.sampling_time))
    judge = embedded_error(embedded_arm((5,), scheme="rosenbrock"), record).errors
    return {
        "no law": global_start(motion, 5, judge=judge, seed=seed),
        "random": np.append(1.0, nguyen_widrow((1, 5), seed).weights),
    }


def _limit() -> None:
    resource.setrlimit(resource.RLIMIT_CPU, (LONGEST, LONGEST))


def compare(input: str, noise: float, python: str, seed: int = 1) -> Table:
    """Train every library from the same starts."""
    values = held_record(TABLE_F1[input], noise_bound=noise, seed=seed).experiments[0].values
    checks = [held_record(u).experiments[0].values for u in (slower(TABLE_F1[input]), other_kind(TABLE_F1[input]))]
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "record.npz", Path(folder) / "result.npz"
        for kind, start in starts(input, noise, seed).items():
            given = {f"check{k}": check["u"] for k, check in enumerate(checks)}
            np.savez(source, u=values["u"], y=values["y"], h=0.02, start=start, **given)
            for label, (name, settings) in PEERS.items():
                if name == "with_pysindy" and kind == "random":
                    continue  # it has no start
                print(f"{input}: {label}, {kind}", file=sys.stderr, flush=True)
                chosen = sys.executable if name == "with_smid" else python
                command = [chosen, str(FOLDER / "run.py"), name, str(source), str(target)]
                ended = subprocess.run(
                    command, env=os.environ | settings, preexec_fn=_limit, capture_output=True, text=True, check=False
                )
                words = ended.stderr.strip().splitlines() or [f"more than {LONGEST} s"]
                problem = words[-1] if ended.returncode else ""
                shown = ("-" if name == "with_pysindy" else kind, label)
                if problem:
                    rows.append((*shown, problem[:60], "-", "-", "-", str(lines_of(name))))
                    continue
                found = np.load(target)
                missed = [
                    f"{100 * np.sqrt(np.mean((found[f'run{k}'] - check['y']) ** 2)) / np.ptp(check['y']):.2g} %"
                    for k, check in enumerate(checks)
                ]
                rows.append(
                    (*shown, *missed, f"{found['inertia']:.2f}", f"{found['seconds']:.1f}", str(lines_of(name)))
                )
    header = ("start", "library", "slower", "other kind", "1/J", "s", "lines")
    return Table(f"{input}, {noise:g} rad of noise, plant's 1/J = 21.74.", header, tuple(rows), "llrrrrr")


def main() -> None:
    """Print a table for each input."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--python", default=sys.executable, help="of an environment with the libraries")
    parser.add_argument("--inputs", nargs="+", default=["six_unequal", "six_equal"], choices=list(TABLE_F1))
    parser.add_argument("--noise", type=float, default=0.002, help="bound of the uniform noise, in rad")
    options = parser.parse_args()
    for name in options.inputs:
        print(compare(name, options.noise, options.python), end="\n\n", flush=True)


if __name__ == "__main__":
    main()
