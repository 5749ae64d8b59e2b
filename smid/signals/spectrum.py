r"""Power spectra of a record's inputs and outputs, and the coherence from each input to each output, by Welch's method.

Each experiment is cut into segments of half overlap, with their mean removed and a Hann window on them. The spectra of
all segments are averaged, :math:`S_{yy}(f)` one-sided and per Hz, so that its integral is the variance. The coherence

.. math::  C_{uy}(f) = |S_{uy}(f)|^2 / (S_{uu}(f) \, S_{yy}(f))

is the share of the output's power at f that the input explains linearly. K segments of half overlap are worth
:math:`18 K^2 / (19 K - 1)` independent ones, K' below. The coherence of independent signals is below
:math:`1 - 0.01^{1/(K' - 1)}` at 99 % of the frequencies, and the spectrum of white noise lies between the quantiles of
:math:`\chi^2_{2 K'} / (2 K')`, times its level.

Reference: Bendat and Piersol, Random Data, 4th ed., sections 9.2 and 11.5; Welch, IEEE Trans. Audio Electroacoust. 15
(1967).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import csd
from scipy.stats import chi2

from relaxations.algebra.arrays import Array
from smid.data import DataError, Dataset
from smid.data.dataset import check_dataset
from smid.display.from_plain import Plain, fields_from_plain, read
from smid.display.result import Part, Tabular
from smid.display.table import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHORTEST = 16  # samples of a segment


@dataclass(frozen=True, eq=False, repr=False)
class Spectrum(Tabular):
    """Spectra of the inputs and outputs of a record.

    Parameters
    ----------
    frequency
        Shape (m,). In Hz; without the mean, at 0 Hz.
    density
        By channel, shape (m,). Power per Hz, one-sided, in the channel's unit squared per Hz.
    coherence
        By input and output, shape (m,). From 0 to 1.
    segment
        Samples of a segment.
    segments
        Number of independent segments that the overlapping ones are worth.
    """

    data: Dataset
    frequency: Array
    density: Mapping[str, Array]
    coherence: Mapping[tuple[str, str], Array]
    segment: int
    segments: float

    @property
    def level(self) -> float:
        """Coherence that independent signals exceed at 1 % of the frequencies."""
        return float(1 - 0.01 ** (1 / (self.segments - 1)))

    @property
    def white(self) -> tuple[float, float]:
        """Factors of a white signal's level between which 99 % of its spectrum lies."""
        freedom = 2 * self.segments
        return float(chi2.ppf(0.005, freedom)) / freedom, float(chi2.ppf(0.995, freedom)) / freedom

    def _power_below(self, channel: str, share: float) -> float:
        """Return the frequency below which this share of the channel's power lies."""
        power = np.cumsum(self.density[channel])
        return float(self.frequency[np.searchsorted(power, share * power[-1])])

    @property
    def table(self) -> Table:
        """Return a table with one row for each input and output."""
        rows = []
        for name, density in self.density.items():
            channel = self.data.channel(name)
            there = density.max() > 0
            rows.append(
                (
                    str(channel),
                    self.data.role(name),
                    *(f"{self._power_below(name, share):.4g}" if there else "-" for share in (0.5, 0.9)),
                    f"{self.frequency[np.argmax(density)]:.4g}" if there else "-",
                )
            )
        caption = f"Welch spectra of {self.segment} samples per segment, {self.segments:.3g} independent segments."
        header = ("channel", "role", "half the power below [Hz]", "90 % below [Hz]", "largest at [Hz]")
        return Table(caption, header, tuple(rows), "llrrr")

    @property
    def coherence_table(self) -> Table:
        """Return a table with one row for each pair of input and output."""
        rows = tuple(
            (
                u,
                y,
                f"{100 * np.mean(values > self.level):.0f} %",
                f"{values.max():.2f}",
                f"{self.frequency[np.argmax(values)]:.4g}",
            )
            for (u, y), values in self.coherence.items()
        )
        caption = f"Coherence; independent signals exceed {self.level:.2f} at 1 % of the frequencies."
        return Table(caption, ("input", "output", "frequencies above", "largest", "at [Hz]"), rows, "llrrr")

    def _content(self) -> Iterator[Part]:
        yield self.table
        yield self.coherence_table

    def _rows(self) -> Iterator[dict[str, Any]]:
        columns = dict(self.density)
        columns |= {f"coherence {u} -> {y}": values for (u, y), values in self.coherence.items()}
        for k, frequency in enumerate(self.frequency):
            yield {"frequency": float(frequency), **{name: float(values[k]) for name, values in columns.items()}}

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "frequency": self.frequency.tolist(),
            "density": {name: values.tolist() for name, values in self.density.items()},
            "coherence": [
                {"input": u, "output": y, "values": values.tolist()} for (u, y), values in self.coherence.items()
            ],
            "coherence_level": self.level,
            "segment": self.segment,
            "segments": self.segments,
        }

    @staticmethod
    def from_dict(content: Mapping[str, Any], data: Dataset) -> Spectrum:
        """Return the spectra that `to_dict` described, of these data."""
        pairs = read(content, "coherence", tuple[Plain, ...])
        coherence = {(read(p, "input", str), read(p, "output", str)): read(p, "values", Array) for p in pairs}
        found: Spectrum = fields_from_plain(Spectrum, content, data=data, coherence=coherence)
        return found

    def plot(self) -> Figure:
        """Draw the spectrum of each output and input, and the coherences with the level that chance exceeds in 1 %."""
        from smid.signals.figures import spectrum_figure

        return spectrum_figure(self)


def spectrum(data: Dataset, segment: int | None = None) -> Spectrum:
    """Return the spectra of the inputs and outputs of a record, and their coherence.

    Parameters
    ----------
    segment
        Samples of a segment: long ones resolve close frequencies, short ones average more. By default an eighth of the
        longest experiment. Shorter experiments are left out.

    Raises
    ------
    DataError
        If an output is constant, or if the record has fewer than two segments.

    Examples
    --------
    >>> t = 0.1 * np.arange(2000)
    >>> u = np.sin(2 * np.pi * 1.0 * t) + np.random.default_rng(0).standard_normal(2000)
    >>> found = spectrum(Dataset.from_arrays(input={"u": u}, output={"y": 2 * u}, sampling_time=0.1))
    >>> float(found.frequency[np.argmax(found.density["u"])])
    1.0
    >>> round(float(found.coherence["u", "y"].min()), 6)
    1.0
    """
    check_dataset(data)
    data = data.without_gaps()
    longest = max(run.n_samples for run in data.experiments)
    length = max(SHORTEST, longest // 8) if segment is None else segment
    if length < SHORTEST:
        raise DataError(f"segment = {length} is too short for a spectrum: give at least {SHORTEST} samples")
    step = length - length // 2
    count = {run.name: (run.n_samples - length) // step + 1 for run in data.experiments if run.n_samples >= length}
    total = sum(count.values())
    if total < 2:
        raise DataError(
            f"the longest experiment has {longest} samples, and a spectrum needs two segments of {length}: take a "
            "longer record" + ("" if segment is None else ", or a shorter segment")
        )
    rate = 1 / data.sampling_time
    runs = [run for run in data.experiments if run.name in count]
    varying = {name: np.ptp(data.stacked(name)) > 1e-12 * np.abs(data.stacked(name)).max() for name in data.names}
    for name in data.outputs:
        if not varying[name]:
            raise DataError(f"the output {name!r} is constant: it has no spectrum")

    def averaged(x: str, y: str) -> NDArray[np.complex128]:
        """Return the cross spectrum, averaged over the segments of all experiments, without the mean at 0 Hz."""
        spectra = np.array(
            [
                csd(run.values[x], run.values[y], rate, nperseg=length, noverlap=length // 2)[1][1:] * count[run.name]
                for run in runs
            ]
        )
        return np.asarray(spectra.sum(axis=0) / total, dtype=np.complex128)

    # The rounding of a constant is no power.
    density = {name: averaged(name, name).real * varying[name] for name in (*data.outputs, *data.inputs)}
    coherence = {}
    for u in data.inputs:
        for y in data.outputs:
            product = density[u] * density[y]
            squared = np.abs(averaged(u, y)) ** 2
            coherence[u, y] = np.divide(squared, product, out=np.zeros_like(product), where=product > 0)
    frequency = np.arange(1, length // 2 + 1) / (length * data.sampling_time)
    return Spectrum(data, frequency, density, coherence, length, 18 * total**2 / (19 * total - 1))
