"""The misfit of a fitted model: the error of its free run, and what the error depends on.

The error is the measured output minus the free run. It is compared with the noise bound, and with every quantity that a
missing effect could depend on: time, level and direction of the input, level, velocity and its sign of the output,
further channels, and the past of error and input. Each share of the error variance is corrected for chance; see
`smid.diagnosis.evidence.structure` and `smid.diagnosis.evidence.time_correlation`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from relaxations.algebra.arrays import Array
from smid.data import DataError, Dataset
from smid.data.gaps import bridged
from smid.diagnosis.effects.parts.naming import quantity
from smid.diagnosis.evidence.structure import DIRECTIONS, Structure, binned, input_direction, level_codes
from smid.diagnosis.evidence.time_correlation import (
    frequency_structure,
    mean_structure,
    own_past_structure,
    past_inputs_structure,
)
from smid.display.from_plain import fields_from_plain
from smid.display.result import Part, Tabular, plain
from smid.display.table import Table
from smid.identification.estimate import open_end
from smid.validation.correlation import FEWEST

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SIGNS = ("falls", "rests", "rises")
_TIME_BINS = 6
_NAMED_INSTANTS = 5
_WORTH_SAYING = 0.03


@dataclass(frozen=True)
class Interval:
    """A time interval in which the error exceeds the noise bound.

    Parameters
    ----------
    start, stop
        Time of the first and of the last violation, in seconds.
    samples
        Violations inside.
    largest
        Largest absolute error inside, in the output's unit.
    """

    experiment: str
    start: float
    stop: float
    samples: int
    largest: float


@dataclass(frozen=True)
class Violations:
    """Where the error exceeds the noise bound.

    Parameters
    ----------
    share
        Of the samples compared.
    first
        Experiment and time in s of the first few.
    intervals
        Violations close to each other form one interval.
    """

    count: int
    share: float
    first: tuple[tuple[str, float], ...]
    intervals: tuple[Interval, ...]


@dataclass(frozen=True, eq=False, repr=False)
class Misfit(Tabular):
    """The error of a simulation and what it depends on.

    Parameters
    ----------
    channel, unit
        The output.
    samples
        Samples compared: missing ones are not.
    rmse
        In the output's unit.
    fit_percent
        ``100 (1 - ||y - y_sim|| / ||y - mean(y)||)``; minus infinity for a constant output.
    largest
        Largest absolute error, in the output's unit.
    violations
        None without a noise bound.
    structure
        What the error depends on, the largest share first.
    input
        Channel of the input that the error is compared with.
    residual
        Shape (N,). Output minus free run, per experiment, warm-up included; NaN where a sample is missing.
    start
        Samples at the start of each experiment that are not compared.
    """

    channel: str
    unit: str
    samples: int
    rmse: float
    fit_percent: float
    largest: float
    noise_bound: float | None
    violations: Violations | None
    structure: tuple[Structure, ...]
    input: str
    data: Dataset
    residual: tuple[Array, ...]
    start: int

    @property
    def sentence(self) -> str:
        """The misfit in one sentence, in words and units."""
        said = f"The simulation of {self.channel} misses by {quantity(self.rmse, self.unit)} (RMSE"
        said += f", fit {self.fit_percent:.1f} %" if np.isfinite(self.fit_percent) else ""
        said += f") and by {quantity(self.largest, self.unit)} at most"
        if self.violations is not None and self.noise_bound is not None:
            bound = quantity(self.noise_bound, self.unit)
            if self.violations.count:
                _, instant = self.violations.first[0]
                said += (
                    f", and exceeds the noise bound of {bound} in {self.violations.count} of {self.samples} samples "
                    f"({_percent(self.violations.share)}), first at {quantity(instant, 's')}"
                )
            else:
                said += f", and stays within the noise bound of {bound}"
        worst = next((s for s in self.structure if s.share >= _WORTH_SAYING), None)
        # Any slow cause makes the error depend on its past; the other quantities are more specific.
        seen = [s for s in self.structure if s.kind != "own past" and s.share >= _WORTH_SAYING]
        told = seen[0] if seen else worst
        return f"{said}; {told.sentence if told else 'the error depends on nothing that was measured'}."

    def to_dict(self) -> dict[str, Any]:
        """Return plain data without the samples; what is not finite becomes None."""
        keys = ("channel", "unit", "samples", "rmse", "fit_percent", "largest", "noise_bound", "input")
        return {
            **{key: plain(getattr(self, key)) for key in keys},
            "sentence": self.sentence,
            "violations": plain(self.violations),
            "structure": plain(self.structure),
        }

    @staticmethod
    def from_dict(content: Mapping[str, Any], data: Dataset) -> Misfit:
        """Return the misfit that `to_dict` described, without the error of each sample."""
        fit = open_end(content, "fit_percent", -np.inf)
        found: Misfit = fields_from_plain(Misfit, content, fit_percent=fit, data=data, residual=(), start=0)
        return found

    def on(self, data: Dataset, residual: tuple[Array, ...]) -> Misfit:
        """Return a misfit that was loaded with the error of each sample."""
        return replace(self, data=data, residual=residual, start=data.n_init)

    def plot(self) -> Figure:
        """Return a figure of the error against time, spectrum, input, output, velocity and further channels."""
        from smid.diagnosis.evidence.misfit_figures import misfit_figure

        return misfit_figure(self)

    @property
    def table(self) -> Table:
        """Return the share of the error variance that each quantity explains, with its probability by chance."""
        rows = tuple((f"{s.kind} {s.against}".rstrip(), _percent(s.share), f"{s.chance:.1g}") for s in self.structure)
        return Table("", ("error against", "share", "chance"), rows, "lrr")

    def _content(self) -> Iterator[Part]:
        yield self.sentence
        yield self.table

    def _rows(self) -> Iterator[dict[str, Any]]:
        return ({k: v for k, v in asdict(s).items() if k != "bins"} for s in self.structure)


def misfit(
    data: Dataset,
    channel: str,
    simulated: Sequence[ArrayLike],
    noise_bound: float | None = None,
    skip: int = 0,
    input: str | None = None,
) -> Misfit:
    """Return the error of a free run, and what it depends on.

    Parameters
    ----------
    channel
        The output.
    simulated
        Shape (N,). The free run of the fitted model, per experiment, in the output's unit.
    noise_bound
        Largest absolute noise of the output, in its unit.
    skip
        Samples at the start of each experiment that start the simulation; the data's warm-up counts too.
    input
        The input to compare the error with; by default the first. Further inputs count as channels.

    Raises
    ------
    DataError
        For an unknown channel, a free run of another length, one that is not finite, a noise bound that is not
        positive, or no sample left.

    Notes
    -----
    Missing samples are left out of all figures. Lines across them bridge the error where it is compared with the past
    and by frequency.

    Examples
    --------
    >>> random = np.random.default_rng(0)
    >>> u = np.repeat(random.uniform(0, 1, 20), 20)
    >>> simulated = 2 * u
    >>> y = simulated + 0.3 * (u > 0.7) + random.uniform(-0.1, 0.1, 400)
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=0.1, units={"u": "A", "y": "bar"})
    >>> found = misfit(data, "y", [simulated], noise_bound=0.1)
    >>> found.structure[0].kind, found.violations.count > 50
    ('input level', True)
    """
    if data.role(channel) != "output":
        raise DataError(f"{channel!r} is no output of the data; choose among {', '.join(data.outputs)}")
    name = data.inputs[0] if input is None else data.channel(input).name
    start = max(skip, data.n_init)
    runs = _free_runs(data, channel, simulated, start)
    if noise_bound is not None and not (np.isfinite(noise_bound) and noise_bound > 0):
        raise DataError(f"noise_bound = {noise_bound} is not positive; give it in the unit of {channel!r}")
    residual = tuple(run.values[channel] - free for run, free in zip(data.experiments, runs, strict=True))
    there = [~np.isnan(e[start:]) for e in residual]
    if not any(one.any() for one in there):
        raise DataError(f"every sample of {channel!r} that could be compared is missing: take a longer record")
    error = np.concatenate([e[start:][one] for e, one in zip(residual, there, strict=True)])
    measured = [run.values[channel][start:][one] for run, one in zip(data.experiments, there, strict=True) if one.any()]
    spread = float(np.sqrt(sum(np.sum((y - y.mean()) ** 2) for y in measured)))
    norm = float(np.linalg.norm(error))
    return Misfit(
        channel=channel,
        unit=data.channel(channel).unit,
        samples=error.size,
        rmse=norm / float(np.sqrt(error.size)),
        fit_percent=100 * (1 - norm / spread) if spread > 0 else -np.inf,
        largest=float(np.abs(error).max()),
        noise_bound=noise_bound,
        violations=None if noise_bound is None else _violations(data, residual, noise_bound, start),
        structure=_structure(data, channel, name, runs, [bridged(e) for e in residual], start),
        input=name,
        data=data,
        residual=residual,
        start=start,
    )


def check_finite(experiment: str, free: Array) -> None:
    """Refuse a free run that leaves the finite range."""
    if not np.all(np.isfinite(free)):
        raise DataError(
            f"the free run of experiment {experiment!r} is not finite; the model is unstable: fit it with stable=True"
        )


def _free_runs(data: Dataset, channel: str, simulated: Sequence[ArrayLike], start: int) -> list[Array]:
    runs = [np.asarray(one, dtype=np.float64) for one in simulated]
    if len(runs) != len(data.experiments):
        raise DataError(f"{len(runs)} free runs for {len(data.experiments)} experiments; give one for each")
    for free, run in zip(runs, data.experiments, strict=True):
        if free.shape != (run.n_samples,):
            raise DataError(
                f"the free run of experiment {run.name!r} has shape {free.shape}; give one value of {channel!r} for "
                f"each of its {run.n_samples} samples"
            )
        check_finite(run.name, free[start:])
        if run.n_samples <= start:
            raise DataError(
                f"experiment {run.name!r} has {run.n_samples} samples, none after the first {start} that start the "
                "simulation: take a longer record"
            )
    return runs


def _violations(data: Dataset, residual: Sequence[Array], bound: float, start: int) -> Violations:
    count, compared = 0, 0
    first: list[tuple[str, float]] = []
    intervals: list[Interval] = []
    for number, (run, error) in enumerate(zip(data.experiments, residual, strict=True)):
        time = data.time(number)
        outside = start + np.flatnonzero(np.abs(error[start:]) > bound)
        count, compared = count + outside.size, compared + int((~np.isnan(error[start:])).sum())
        if not outside.size:
            continue
        first += [(run.name, float(time[k])) for k in outside[:_NAMED_INSTANTS]]
        # Noise brings the error below the bound briefly: the interval does not end there.
        apart = max(3, error.size // 100)
        for part in np.split(outside, np.flatnonzero(np.diff(outside) > apart) + 1):
            largest = float(np.nanmax(np.abs(error[part])))
            intervals.append(Interval(run.name, float(time[part[0]]), float(time[part[-1]]), part.size, largest))
    return Violations(count, count / compared, tuple(first[:_NAMED_INSTANTS]), tuple(intervals))


def _structure(
    data: Dataset, channel: str, name: str, runs: Sequence[Array], residual: Sequence[Array], start: int
) -> tuple[Structure, ...]:
    def joined(parts: Sequence[Array]) -> Array:
        return np.concatenate([part[start:] for part in parts])

    error, unit = joined(residual), data.channel(channel).unit
    # Rounding errors of the simulation are correlated too, but no misfit.
    if error.size < FEWEST or np.abs(error).max() <= 1e-12 * np.abs(joined(runs)).max():
        return ()
    inputs = [run.values[name] for run in data.experiments]
    moves = [np.gradient(free) / data.sampling_time if free.size > 1 else np.zeros(1) for free in runs]
    u, y, v = joined(inputs), joined(runs), joined(moves)
    u_unit, step = data.channel(name).unit, data.sampling_time
    directions = np.concatenate([input_direction(values)[start:] for values in inputs])
    still = 1e-3 * np.abs(v).max()
    signs = np.where(v > still, 2, np.where(v < -still, 0, 1))
    found = [
        mean_structure(error, unit),
        _time_structure(data, residual, start, unit),
        binned("input level", name, error, u, level_codes(u), None, name, (u_unit, unit)),
        binned(
            "input direction",
            name,
            error,
            None,
            directions,
            [f"{name} {d}" for d in DIRECTIONS],
            f"the direction of {name}",
            ("", unit),
        ),
        binned("output level", channel, error, y, level_codes(y), None, f"simulated {channel}", (unit, unit)),
        binned(
            "velocity",
            channel,
            error,
            v,
            level_codes(v),
            None,
            f"the velocity of {channel}",
            (f"{unit}/s" if unit else "", unit),
        ),
        binned(
            "velocity sign",
            channel,
            error,
            None,
            signs,
            [f"simulated {channel} {s}" for s in SIGNS],
            f"the sign of the velocity of {channel}",
            ("", unit),
        ),
        *(
            binned("channel", other.name, error, x, level_codes(x), None, other.name, (other.unit, unit))
            for other in data.channels
            if other.name not in (name, channel)
            for x in [joined([bridged(run.values[other.name]) for run in data.experiments])]
        ),
        frequency_structure(error, step),
        own_past_structure(error, step),
        past_inputs_structure([e[start:] for e in residual], [x[start:] for x in inputs], name, step),
    ]
    return tuple(sorted((s for s in found if s is not None), key=lambda s: (-s.share, s.chance)))


def _time_structure(data: Dataset, residual: Sequence[Array], start: int, unit: str) -> Structure | None:
    """Bins of time inside each experiment: an error that differs between experiments shows too."""
    total = sum(e.size - start for e in residual)
    codes: list[NDArray[np.int64]] = []
    labels: list[str] = []
    for number, (run, error) in enumerate(zip(data.experiments, residual, strict=True)):
        n, time = error.size - start, data.time(number)[start:]
        count = max(1, min(round(_TIME_BINS * n / total), n // 10))
        parts = np.arange(n) * count // n
        codes.append(parts + len(labels))
        for part in range(count):
            inside = time[parts == part]
            where = f" of {run.name}" if len(residual) > 1 else ""
            labels.append(f"time{where} is {inside[0]:.4g} to {quantity(float(inside[-1]), 's')}")
    e = np.concatenate([one[start:] for one in residual])
    return binned("time", "", e, None, np.concatenate(codes), labels, "time", ("s", unit))


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"
