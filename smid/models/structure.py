"""What the lines of a model imply: causal order, loops through time, and how far back they look."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from smid.models.errors import ModelError
from smid.models.parts import Line
from smid.models.symbols import references

__all__ = ["causal_order", "exogenous", "first_samples", "groups", "state_lags"]


def causal_order(lines: Iterable[Line]) -> tuple[Line, ...]:
    """Sort lines so that each reads only signals defined above it at the same time.

    Parameters
    ----------
    lines : iterable of Line
        One line per signal, in any order; ties keep it.

    Returns
    -------
    tuple of Line
        The lines in causal order.

    Raises
    ------
    ModelError
        If signals depend on each other at the same time.

    Examples
    --------
    >>> from smid.models.symbols import signal, t
    >>> u, v, w = signal("u"), signal("v"), signal("w")
    >>> [line.signal for line in causal_order([Line(w[t], v[t]), Line(v[t], u[t])])]
    ['v', 'w']
    """
    waiting = list(lines)
    ordered: list[Line] = []
    while waiting:
        undefined = {line.signal for line in waiting}
        ready = [
            line
            for line in waiting
            if not any(lag == 0 and name in undefined for name, lag in references(line.expression))
        ]
        if not ready:
            names = ", ".join(sorted(undefined))
            raise ModelError(f"algebraic loop at one time among {names}: delay one of them, as in w[t - 1]")
        ordered.append(ready[0])
        waiting.remove(ready[0])
    return tuple(ordered)


def exogenous(lines: Sequence[Line]) -> tuple[str, ...]:
    """List the signals that are read but never defined, in the order of their first use.

    Parameters
    ----------
    lines : sequence of Line
        The lines of a model.

    Returns
    -------
    tuple of str
        Names of the inputs.

    Examples
    --------
    >>> from smid.models.symbols import signal, t
    >>> exogenous([Line(signal("v")[t], 2 * signal("u")[t])])
    ('u',)
    """
    defined = {line.signal for line in lines}
    used = (name for line in lines for name, _ in sorted(references(line.expression)))
    return tuple(dict.fromkeys(name for name in used if name not in defined))


def groups(lines: Sequence[Line]) -> tuple[tuple[tuple[Line, ...], bool], ...]:
    """Split lines into groups that can be computed one after another over all time.

    A group is one line, or all the lines on a common loop through time (a strongly connected component).

    Parameters
    ----------
    lines : sequence of Line
        Lines in causal order.

    Returns
    -------
    tuple of (tuple of Line, bool)
        The groups, each after those it reads, and whether it is recursive.

    Examples
    --------
    >>> from smid.models.symbols import signal, t
    >>> u, v, w = signal("u"), signal("v"), signal("w")
    >>> [recursive for _, recursive in groups([Line(v[t], u[t]), Line(w[t], w[t - 1] / 2 + v[t])])]
    [False, True]
    """
    reads = {line.signal: {name for name, _ in references(line.expression)} for line in lines}
    reach = {name: read & reads.keys() for name, read in reads.items()}
    for via in reads:
        for name in reads:
            if via in reach[name]:
                reach[name] = reach[name] | reach[via]
    waiting = list(lines)
    result: list[tuple[tuple[Line, ...], bool]] = []
    while waiting:
        names = {line.signal for line in waiting}
        # The first line all of whose unfinished ancestors lie on its own loop heads the next group.
        head = next(line for line in waiting if all(line.signal in reach[name] for name in reach[line.signal] & names))
        loop = {name for name in reach[head.signal] if head.signal in reach[name]} | {head.signal}
        result.append((tuple(line for line in waiting if line.signal in loop), head.signal in reach[head.signal]))
        waiting = [line for line in waiting if line.signal not in loop]
    return tuple(result)


def state_lags(lines: Sequence[Line]) -> dict[str, int]:
    """Give the states, the signals whose own past must be known, with the largest lag each is read at.

    Parameters
    ----------
    lines : sequence of Line
        Lines in causal order.

    Returns
    -------
    dict of str to int
        Largest lag of each state.

    Examples
    --------
    >>> from smid.models.symbols import signal, t
    >>> w = signal("w")
    >>> state_lags([Line(w[t], w[t - 2] / 2 + signal("u")[t - 5])])
    {'w': 2}
    """
    result: dict[str, int] = {}
    for group, recursive in groups(lines):
        members = {line.signal for line in group}
        for line in group if recursive else ():
            for name, lag in sorted(references(line.expression)):
                if name in members and lag > 0:
                    result[name] = max(lag, result.get(name, 0))
    return result


def first_samples(lines: Sequence[Line]) -> dict[str, int]:
    """Give the first sample at which each line can be evaluated from inputs and initial states alone.

    Lags add up along the lines: ``d[t] = u[t] - u[t-1]``, ``w[t] = d[t-2]`` looks three samples back.

    Parameters
    ----------
    lines : sequence of Line
        Lines in causal order.

    Returns
    -------
    dict of str to int
        Sample number, counted from zero, per defined signal.

    Examples
    --------
    >>> from smid.models.symbols import signal, t
    >>> u, d, w = signal("u"), signal("d"), signal("w")
    >>> first_samples([Line(d[t], u[t] - u[t - 1]), Line(w[t], d[t - 2])])
    {'d': 1, 'w': 3}
    """
    first: dict[str, int] = {}
    for group, _ in groups(lines):
        reads = [read for line in group for read in references(line.expression)]
        start = max((first.get(name, 0) + lag for name, lag in reads), default=0)
        first.update({line.signal: start for line in group})
    return first
