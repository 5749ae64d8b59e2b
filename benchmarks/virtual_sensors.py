"""Chapter 5 of the clutch thesis on the bundled records, and the one sensor that its last chapter asks for.

Prints tables 5.1 to 5.4, the errors of the thesis's sensors on all records and behind its figures; the single sensor
beside every CPX with the median filter; what sensors of other sizes reach; its error bound; how it does on fresh
records at temperatures that trained it and at others; and how long an update takes.  Takes some minutes on one core:

    python -m benchmarks.virtual_sensors
"""

from __future__ import annotations

import sys
import time

import numpy as np

from relaxations.algebra.arrays import Array
from smid.data import Dataset
from smid.data.bundled import load_clutch
from smid.data.resample import resample
from smid.display.table import Table
from smid.sensors import PTX, BoundedSensor
from smid.theses.clutch import POSITION_NOISE_BOUND, simulate_clutch, simulate_position
from smid.theses.clutch.plant import NOISE_BOUND
from smid.theses.clutch.sensor_study import (
    HELD_OUT,
    THESIS_FIGURES,
    cross_errors,
    interval_study,
    sensor_traces,
    single_sensor_study,
    table_5_1,
    table_5_2,
    table_5_3,
    table_5_4,
    train_single_sensor,
    train_thesis_sensors,
)

OTHER_SIZES = ((0, 6), (1, 3), (1, 6), (2, 4), (3, 8))
TEMPERATURES = (-20.0, 0.0, 20.0, 40.0, 60.0, 75.0)
SAMPLES, TICKS, JITTER, TICK = 5000, 20, 5, 1e-4


def _tell(words: str) -> None:
    print(words, file=sys.stderr, flush=True)


def fresh_record(profile: str, temperature: float, seed: int) -> Dataset:
    """Return a record of the actuator with another current and noise, sampled irregularly as the bundled ones are."""
    generator = np.random.default_rng(seed)
    instants = np.arange(SAMPLES * TICKS)
    times, levels = [0.0], [0.0]
    while times[-1] < instants[-1]:
        times.append(times[-1] + TICKS * generator.uniform(40, 250))
        levels.append(0.0 if generator.random() < 0.12 else generator.uniform(250, 950))
    if profile == "ramp":
        current = np.interp(instants, times, levels)
    else:
        current = np.array(levels)[np.searchsorted(times, instants, side="right") - 1]
    pressure = simulate_clutch(current, temperature, sampling_time=TICK)
    position = simulate_position(pressure, temperature, sampling_time=TICK)
    stamps = TICKS * np.arange(SAMPLES) + generator.integers(-JITTER, JITTER + 1, SAMPLES)
    stamps[[0, -1]] = 0, TICKS * (SAMPLES - 1)
    measured = {
        "current": current[stamps],
        "pressure": pressure[stamps] + generator.uniform(-NOISE_BOUND, NOISE_BOUND, SAMPLES),
        "position": position[stamps] + generator.uniform(-POSITION_NOISE_BOUND, POSITION_NOISE_BOUND, SAMPLES),
    }
    values, _ = resample(stamps * TICK, measured, TICKS * TICK)
    return Dataset.from_arrays(
        input={"current": values["current"]},
        output={name: values[name] for name in ("pressure", "position")},
        sampling_time=TICKS * TICK,
        temperature=np.full(values["current"].size, temperature),
    )


def fresh(bounded: BoundedSensor) -> Table:
    """Return errors and coverage on fresh records."""
    rows = []
    for temperature in TEMPERATURES:
        for profile in ("ramp", "step"):
            records = [fresh_record(profile, temperature, 1000 * k + int(temperature) + 100) for k in range(3)]
            said = [bounded.predict(data) for data in records]
            errors = np.concatenate(
                [data.values("position") - s.position[0] for data, s in zip(records, said, strict=True)]
            )
            covered = np.mean([s.coverage(data)["experiment"] for data, s in zip(records, said, strict=True)])
            width = np.mean([s.mean_width for s in said])
            rows.append(
                (
                    f"{temperature:.0f}",
                    profile,
                    f"{np.sqrt(np.mean(errors**2)):.3f}",
                    f"{100 * covered:.3f} %",
                    f"{width:.2f}",
                    "extrapolated" if any(s.warnings for s in said) else "",
                )
            )
    return Table(
        "Fresh records, three of 10 s each: RMSE of PTX, coverage and mean width of its bound.",
        ("degC", "profile", "RMSE [mm]", "covered", "width [mm]", "warning"),
        tuple(rows),
        "rlrrrl",
    )


def other_sizes(sensor: PTX) -> Table:
    """Return what sensors of other sizes reach on the held-out records."""
    data = load_clutch(HELD_OUT)
    rows = []
    for plays, neurons in OTHER_SIZES:
        _tell(f"training PTX with {plays} plays and {neurons} neurons")
        rows.append((plays, neurons, train_single_sensor(sensor=PTX(hidden=(neurons,), plays=plays))))
    rows.append((sensor.plays, sensor.hidden[0], sensor))
    return Table(
        "RMSE in mm of PTX by size, on the held-out records.",
        ("plays", "neurons", "parameters", *HELD_OUT),
        tuple(
            (str(plays), str(neurons), str(s.n_parameters), *(f"{e:.3f}" for e in s.predict(data).rmse(data).values()))
            for plays, neurons, s in rows
        ),
        "r" * (3 + len(HELD_OUT)),
    )


def update_time(bounded: BoundedSensor) -> str:
    """Return how long a sample takes."""
    data = load_clutch(HELD_OUT[0])
    values, stream, seconds = data.experiments[0].values, bounded.stream(), []
    samples: list[tuple[Array, ...]] = list(zip(values["pressure"], values["temperature"], strict=True))
    for k, (pressure, temperature) in enumerate(samples):
        begun = time.perf_counter()
        stream.update(k * data.sampling_time, pressure=float(pressure), temperature=float(temperature))
        seconds.append(time.perf_counter() - begun)
    middle, late = 1e3 * np.quantile(seconds, [0.5, 0.999])
    return f"An update of PTX with its bound: median {middle:.2f} ms, 99.9 % within {late:.2f} ms; a sample lasts 2 ms."


def run() -> str:
    """Return all tables."""
    parts: list[object] = [table(progress=_tell) for table in (table_5_1, table_5_2, table_5_3, table_5_4)]
    sensors = train_thesis_sensors(progress=_tell)
    parts.append(cross_errors(sensors))
    rows = [
        (number, " and ".join(traces.records), name, f"{error:.3f}")
        for number in THESIS_FIGURES
        for traces in [sensor_traces(number, sensors)]
        for name, error in traces.rmse.items()
    ]
    parts.append(Table("Behind the figures.", ("figure", "record", "sensor", "RMSE [mm]"), tuple(rows), "lllr"))
    study = single_sensor_study(progress=_tell)
    intervals = interval_study(study.sensor)
    parts += [study, intervals, fresh(intervals.sensor), other_sizes(study.sensor), update_time(intervals.sensor)]
    return "## Virtual sensors\n\n```\n" + "\n\n".join(map(str, parts)) + "\n```"


if __name__ == "__main__":
    print(run())
