"""The single sensor of the clutch in C and with lost samples: equal to `predict`, how fast, how often inside.

Trains PTX on ``ramp_a`` and ``step_a`` of three temperatures. Each other record is left out of the error bound in turn.
Then: the largest difference between the exported C and `predict`, and with 10 % of the samples lost that between the C
and the stream in Python; the time of one update in C, compiled by gcc; and coverage and width with 0 and 10 % of the
samples of each channel lost. Takes some minutes on one core:

    python -m benchmarks sensor_export
"""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.data.bundled import load_clutch
from smid.display.table import Table
from smid.sensors import BoundedSensor, bound_error, check_sensor, export_c, trained_range
from smid.theses.clutch.sensor_study import HELD_OUT, train_single_sensor

SHARES = (0.0, 0.1)

MAIN = """\
#define _POSIX_C_SOURCE 199309L
#include "sensor.h"
#include <stdio.h>
#include <time.h>
int main(void) {
  sensor_state state;
  double u[2], y[3], took;
  struct timespec a, b;
  sensor_reset(&state);
  while (fread(u, sizeof u, 1, stdin) == 1) {
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &a);
    sensor_update(&state, u, y);
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &b);
    took = 1e9 * (b.tv_sec - a.tv_sec) + (b.tv_nsec - a.tv_nsec);
    fwrite(y, sizeof y, 1, stdout);
    fwrite(&took, sizeof took, 1, stdout);
  }
  return 0;
}
"""


def exported(sensor: BoundedSensor) -> str:
    """Return how the compiled C compares with `predict` and with the stream, and the time of its updates."""
    lines = []
    with TemporaryDirectory() as folder:
        export_c(sensor, Path(folder) / "sensor.c")
        (Path(folder) / "main.c").write_text(MAIN)
        command = ["gcc", "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror", "-O2", "sensor.c", "main.c", "-lm"]
        subprocess.run(command, cwd=folder, check=True)
        for share, compared in ((0.0, None), (SHARES[1], 1000)):
            differences, times, count = [], [], 0
            for seed, name in enumerate(HELD_OUT):
                data = load_clutch(name)
                samples = np.stack([data.values("pressure"), data.values("temperature")], axis=1)
                samples[1:][np.random.default_rng(seed).random((len(samples) - 1, 2)) < share] = np.nan
                found = subprocess.run(
                    [Path(folder) / "a.out"], input=samples.tobytes(), capture_output=True, check=True
                )
                rows = np.frombuffer(found.stdout).reshape(-1, 4)
                expected = expect(sensor, data, samples[:compared])
                differences.append(np.abs(rows[:compared, :3] - expected).max())
                times.append(rows[:, 3])
                count += len(expected)
            took = np.concatenate(times)
            lines.append(
                f"C99, {100 * share:.0f} % lost: {count} samples compared, largest difference "
                f"{max(differences):.2g} mm.\n"
                f"One update, with the reading of the clock: median {np.median(took):.0f} ns, 99.9 % within "
                f"{np.quantile(took, 0.999) / 1e3:.1f} us, worst {took.max() / 1e3:.1f} us."
            )
    return "\n".join(lines)


def expect(sensor: BoundedSensor, data: Dataset, samples: Array) -> Array:
    """Return position, lower and upper end as `predict` says, or as the stream where samples are lost."""
    if np.isfinite(samples).all():
        said = sensor.predict(data)
        return np.stack([said.position[0], said.lower[0], said.upper[0]], axis=1)
    stream, interval = sensor.stream(), data.sampling_time
    found = [stream.update(k * interval, pressure=p, temperature=t) for k, (p, t) in enumerate(samples.tolist())]
    return np.array([(now.position, now.lower, now.upper) for now in found])


def run() -> str:
    """Return all results."""
    print("training", file=sys.stderr, flush=True)
    sensor = train_single_sensor(starts=2)
    rows = []
    for name in HELD_OUT:
        bounded, data = bound_error(sensor, load_clutch([n for n in HELD_OUT if n != name])), load_clutch(name)
        cells = [name]
        for share in SHARES:
            begun = time.process_time()
            score = check_sensor(bounded, data, lose=share, seed=7).scores[0]
            cells.append(f"{100 * score.coverage:.3f} % in {score.mean_width:.2f} mm")
            print(f"{name}, {share:g} lost: {time.process_time() - begun:.0f} s", file=sys.stderr, flush=True)
        rows.append(tuple(cells))
    header = ("left out", *(f"{100 * share:.0f} % lost" for share in SHARES))
    table = Table(
        "Coverage and mean width, the samples of each channel lost at random.",
        header,
        tuple(rows),
        "l" + "r" * len(SHARES),
    )
    whole = bound_error(sensor, load_clutch(HELD_OUT))
    parts = (table, exported(whole), trained_range(whole))
    return "## Virtual sensors in real time\n\n```\n" + "\n\n".join(map(str, parts)) + "\n```"
