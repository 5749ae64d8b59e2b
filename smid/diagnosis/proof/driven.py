"""Signals that the inputs alone drive, as few free numbers, whatever they are functions of.

A static curve has one value at each *level* of its inputs. A backlash or a hysteresis of an input moves only while the
input moves: it has one value on each *hold*, the samples in which the inputs stay as they are. Such numbers enter a
linear plant linearly, where thresholds and memories need cuts without end.

Reference: Visintin, Differential Models of Hysteresis, Springer (1994), chapter III (rate independence).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
import sympy

from relaxations.algebra.arrays import Array
from smid.diagnosis.proof.posed import with_channel
from smid.diagnosis.proof.reached import driven_lines
from smid.identification.inversion.record import Record
from smid.models import Line, Measurement, Parameter, signal, t
from smid.models.symbols import inlined, number, plain_symbols, references, unused

__all__ = ["Driven", "driven_signals", "upstream"]

MOST = 40
"""Numbers for a signal: with more of them little is left that a window could contradict."""


@dataclass(frozen=True, eq=False)
class Driven:
    """A signal by its numbers.

    Parameters
    ----------
    values
        The numbers; those of a hold are ``parameters``.
    samples
        Of each experiment which number each sample has, shape (n, values): one or zero.
    own
        How many parameters only this signal depends on.
    """

    signal: str
    values: tuple[sympy.Expr, ...]
    samples: tuple[Array, ...]
    own: int
    parameters: tuple[Parameter, ...] = ()

    @property
    def few(self) -> bool:
        """Whether the numbers hardly say less than the parameters do."""
        return len(self.values) <= self.own + 1


def driven_signals(record: Record) -> Iterator[Driven]:
    """Yield the signals that the inputs drive through parameters of their own, and that other lines read."""
    model = record.model
    lines = driven_lines(model)
    others = [line for line in model.lines if line.signal not in lines]
    read = {name for line in others for name, _ in line.reads}
    elsewhere = {name for line in others for name in plain_symbols(line.expression)}
    for name in lines:
        needed = {own: lines[own] for own in upstream(lines, {name})}
        own = len({p for line in needed.values() for p in plain_symbols(line)} - elsewhere)
        if name in read and own:
            static = not any(lag for line in needed.values() for _, lag in references(line))
            found = (_by_level if static else _by_hold)(record, name, needed, own)
            if found is not None:
                yield found


def upstream(lines: Mapping[str, sympy.Expr], names: set[str]) -> set[str]:
    """Return some signals and all that they read, of those that lines define."""
    found, waiting = set[str](), sorted(names & set(lines))
    while waiting:
        own = waiting.pop()
        if own not in found:
            found.add(own)
            waiting += [read for read, _ in references(lines[own]) if read in lines]
    return found


def _by_level(record: Record, name: str, needed: Mapping[str, sympy.Expr], own: int) -> Driven | None:
    """Return a static signal by its values at the levels of its inputs; None where these are many.

    A polynomial has few coefficients, which is more than is known of as many levels.
    """
    expression = inlined(needed[name], needed)
    atoms = sorted(expression.atoms(sympy.Indexed), key=str)
    channels = [str(atom.base.label) for atom in atoms]
    runs = [np.column_stack([run.values[channel] for channel in channels]) for run in record.data.experiments]
    levels = np.unique(np.concatenate(runs), axis=0)
    if not np.isfinite(levels).all() or len(levels) > (own + 1 if expression.is_polynomial(*atoms) else MOST):
        return None
    values = [expression.xreplace(dict(zip(atoms, map(number, level), strict=True))) for level in levels.tolist()]
    samples = tuple((run[:, None, :] == levels[None]).all(axis=2).astype(np.float64) for run in runs)
    return Driven(name, tuple(values), samples, own)


def _by_hold(record: Record, name: str, needed: Mapping[str, sympy.Expr], own: int) -> Driven | None:
    """Return a signal that moves with its inputs alone by its values on the holds; None where it moves otherwise."""
    if not all(_stays(line, other) for other, line in needed.items()):
        return None
    channels = {read for line in needed.values() for read, _ in references(line) if read not in needed}
    first = int(record.tape.first[record.tape.signals.index(name)])
    numbers = [_holds([run.values[channel] for channel in sorted(channels)], first) for run in record.data.experiments]
    counts = [int(of_run[-1]) + 1 for of_run in numbers]
    if not channels or sum(counts) > MOST:
        return None
    ends = _ends(record, name, needed)
    taken, values, samples = set(record.model.names), list[Parameter](), []
    for e, (of_run, count) in enumerate(zip(numbers, counts, strict=True)):
        place = len(values)
        for k in range(count):
            low, high = (ends[e][of_run == k, side] for side in (0, 1))
            values.append(Parameter(unused(f"{name}_held_{place + k}", taken), float(low.min()), float(high.max())))
        samples.append((place + of_run[:, None] == np.arange(sum(counts))).astype(np.float64))
    return Driven(name, tuple(p.symbol for p in values), tuple(samples), own, tuple(values))


def _stays(expression: sympy.Expr, own: str) -> bool:
    """Return whether a signal is as it was a sample ago where all that it reads is.

    So is an own value through which all differences of the sample before vanish, and a value between limits of this
    sample, as of such a value: what is within them already stays.
    """
    past = [(name, lag) for name, lag in references(expression) if lag]
    if not past:
        return True
    if isinstance(expression, sympy.Max | sympy.Min):
        moving = [part for part in expression.args if any(lag for _, lag in references(part))]
        return len(moving) == 1 and _stays(moving[0], own)
    if any(lag > 1 for _, lag in past):
        return False
    still = {signal(name)[t - 1]: signal(name)[t] for name, _ in past if name != own}
    return bool(sympy.expand(expression.xreplace(still) - signal(own)[t - 1]) == 0)


def _holds(channels: list[Array], first: int) -> Array:
    """Return the number of the hold of each sample; each of the first, of which the line says nothing, has its own."""
    moved = np.any([np.diff(own) != 0 for own in channels], axis=0)
    moved[: max(first, 1)] = True
    return np.concatenate([[0], np.cumsum(moved)])


def _ends(record: Record, name: str, needed: Mapping[str, sympy.Expr]) -> list[Array]:
    """Return the least and the largest value of a signal over the boxes, for each experiment, shape (n, 2)."""
    model, taken = record.model, {*record.model.names, *record.data.names}
    seen, channel = unused("seen", taken), unused("zero", taken)
    alone = replace(
        model,
        lines=(*(line for line in model.lines if line.signal in needed), Line(signal(seen)[t], signal(name)[t])),
        measurements=(Measurement(channel, seen, None),),
        bounds={own: ends for own, ends in model.bounds.items() if own in needed},
        constraints=(),
        origins={},
    )
    data = with_channel(record.data, channel, [np.zeros(run.n_samples) for run in record.data.experiments])
    return Record(alone, data, {}, whole=True).output_ends(seen)
