"""The statement of a run certificate: a model, a record, and the box of the unknowns.

The *set* of a statement contains the values p of the parameters for which signals exist, real numbers at every sample
of every experiment, such that

- p lies in its box, and every constraint is real and not negative at p;
- a signal with a rate solves its differential equation from one sample to the next, from the sample before its first
  on: it is an absolutely continuous function of time whose derivative is at almost all times the rate, or between the
  values around a jump of the rate (Filippov). In a rate, ``x[t]`` is the state at that time, and what is read at
  samples before is held during the interval. Before its first sample it is as a signal that a line defines;
- a signal that a line defines has the line's value at every sample from its first on. Before that it is any number, but
  for the initial samples that are stated;
- a signal with bounds lies within them at every sample;
- a measured signal is what its channel shows of some noise within the bound: the value of ``inverse`` at the sample
  less the noise, or that difference itself where there is no inverse. A missing sample shows nothing;
- any other signal that a line reads is a channel whose samples are exact; a missing one is any number.

An experiment may be read in pieces: what holds of all its samples holds of some of them, whatever the signals are at
the first ones.

An expression has a value where each part that it needs is a real number; of a ``Piecewise``, the chosen branch alone. A
power of a negative number has one where the exponent is whole.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

from relaxations.check.arithmetic import Work
from relaxations.check.runs.affine import Form, Products, Range
from relaxations.check.runs.tape import Tape
from relaxations.check.runs.terms import Terms

Samples = list[Form | None]  # a missing sample is None


@dataclass(frozen=True)
class Measured:
    """A measurement of a signal.

    Parameters
    ----------
    row
        Operation that is zero where the signal is what the channel shows; None where the measurement defines it.
    defined
        Operation that defines the signal, where a line does and the channel shows it as it is; else None.
    within
        Whether no channel shows it, but it has bounds.
    """

    signal: str
    row: int | None
    defined: int | None
    within: bool


@dataclass(frozen=True)
class Piece:
    """Some samples of one experiment, in a row: at the first ones its states are unknown.

    Parameters
    ----------
    experiment, first, count
        Place of the experiment, and which of its samples.
    exact
        Of each channel.
    shown
        Of each measurement: its samples within the noise bound.
    initial
        Unknown of an initial sample, by signal and sample.
    """

    experiment: int
    first: int
    count: int
    exact: Mapping[str, Samples]
    shown: tuple[Samples, ...]
    initial: Mapping[tuple[str, int], int]


@dataclass(frozen=True)
class Stated:
    """A model and a record.

    Parameters
    ----------
    unknowns
        Names: the parameters, then the initial samples of states.
    box
        Ends of each unknown, in units.
    first
        First sample at which the line of each signal holds.
    bounds
        Of the noise of each measurement, in units.
    constraints
        Operations that are not negative.
    rates, interval, steps
        The signals that rates define, the seconds between two samples, and in how many steps a rate is integrated.
    lines
        The signals that rates or lines define.
    experiments
        Number of samples of each.
    runs
        All samples of each experiment, as one piece without unknowns.
    terms
        The rates as sums of products.
    begins
        Unknown of an initial sample, by experiment, signal and sample of the experiment.
    kept
        So many symbols of remainders are kept.
    products
        The symbols of products of unknowns, which follow those of the unknowns.
    """

    parameters: tuple[str, ...]
    unknowns: tuple[str, ...]
    box: tuple[Range, ...]
    tape: Tape
    first: Mapping[str, int]
    measured: tuple[Measured, ...]
    bounds: tuple[int, ...]
    constraints: tuple[int, ...]
    rates: tuple[str, ...]
    interval: Fraction
    steps: int
    lines: tuple[str, ...]
    experiments: Mapping[str, int]
    pieces: tuple[Piece, ...]
    runs: tuple[Piece, ...]
    terms: Terms
    begins: Mapping[tuple[int, str, int], int]
    kept: int
    products: Products
    work: Work

    @property
    def balanced(self) -> bool:
        """Whether there are rates, and channels show all their states as they are."""
        shown = {m.signal for m in self.measured if m.defined is not None and not m.within}
        return bool(self.rates) and shown.issuperset(self.rates)
