"""Causal order of the lines of a model, loops through time, and how far back the lines read."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from heapq import heapify, heappop, heappush

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from smid.models.errors import ModelError
from smid.models.parts import Line
from smid.models.symbols import plain_symbols

__all__ = ["causal_order", "exogenous", "first_samples", "groups", "is_clock", "state_lags"]


def causal_order(lines: Iterable[Line]) -> tuple[Line, ...]:
    """Sort lines so that each reads only signals defined above it at the same time.

    A rate line waits for no other line: what it reads now decides its signal later.

    Examples
    --------
    >>> from smid.models.symbols import signal, t
    >>> u, v, w = signal("u"), signal("v"), signal("w")
    >>> [line.signal for line in causal_order([Line(w[t], v[t]), Line(v[t], u[t])])]
    ['v', 'w']
    """
    given = list(lines)
    defined = {line.signal for line in given}
    needs = [
        set() if line.rate else {name for name, lag in line.reads if lag == 0 and name in defined} for line in given
    ]
    users: dict[str, list[int]] = {name: [] for name in defined}
    for k, names in enumerate(needs):
        for name in names:
            users[name].append(k)
    ready = [k for k, names in enumerate(needs) if not names]
    ordered: list[Line] = []
    heapify(ready)
    while ready:
        line = given[heappop(ready)]
        ordered.append(line)
        for user in users[line.signal]:
            needs[user].discard(line.signal)
            if not needs[user]:
                heappush(ready, user)
    if len(ordered) < len(given):
        undefined = ", ".join(sorted(defined - {line.signal for line in ordered}))
        raise ModelError(f"algebraic loop at one time among {undefined}: delay one of them, as in w[t - 1]")
    return tuple(ordered)


def exogenous(lines: Sequence[Line]) -> tuple[str, ...]:
    """List the signals that are read but never defined, in the order of their first use.

    Examples
    --------
    >>> from smid.models.symbols import signal, t
    >>> exogenous([Line(signal("v")[t], 2 * signal("u")[t])])
    ('u',)
    """
    defined = {line.signal for line in lines}
    used = (name for line in lines for name, _ in sorted(line.reads))
    return tuple(dict.fromkeys(name for name in used if name not in defined))


def groups(lines: Sequence[Line]) -> tuple[tuple[tuple[Line, ...], bool], ...]:
    """Split lines into groups that can be computed one after another over all time.

    A group is one line, or all the lines on a common loop through time (a strongly connected component).

    Examples
    --------
    >>> from smid.models.symbols import signal, t
    >>> u, v, w = signal("u"), signal("v"), signal("w")
    >>> [recursive for _, recursive in groups([Line(v[t], u[t]), Line(w[t], w[t - 1] / 2 + v[t])])]
    [False, True]
    """
    place = {line.signal: k for k, line in enumerate(lines)}
    reads = [{place[name] for name, _ in line.reads if name in place} for line in lines]
    pairs = [(k, other) for k, read in enumerate(reads) for other in read]
    rows, columns = zip(*pairs, strict=True) if pairs else ((), ())
    graph = csr_array((np.ones(len(pairs)), (rows, columns)), shape=(len(lines), len(lines)))
    component = connected_components(graph, connection="strong")[1].tolist()
    members: dict[int, list[int]] = {}
    for k, own in enumerate(component):
        members.setdefault(own, []).append(k)
    needs = {own: {component[o] for k in group for o in reads[k]} - {own} for own, group in members.items()}
    # Of the groups whose needs are met, that of the first line comes next.
    ready = [group[0] for own, group in members.items() if not needs[own]]
    users: dict[int, list[int]] = {own: [] for own in members}
    for own, others in needs.items():
        for other in others:
            users[other].append(own)
    result: list[tuple[tuple[Line, ...], bool]] = []
    heapify(ready)
    while ready:
        own = component[heappop(ready)]
        group = members[own]
        result.append((tuple(lines[k] for k in group), any(component[o] == own for k in group for o in reads[k])))
        for user in users[own]:
            needs[user].discard(own)
            if not needs[user]:
                heappush(ready, members[user][0])
    return tuple(result)


def state_lags(lines: Sequence[Line]) -> dict[str, int]:
    """Return the states, the signals whose own past must be known, with the largest lag each is read at.

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
            for name, lag in sorted(line.reads):
                if name in members and lag > 0:
                    result[name] = max(lag, result.get(name, 0))
    return result


def first_samples(lines: Sequence[Line]) -> dict[str, int]:
    """Return the first sample at which each line can be evaluated from inputs and initial states alone.

    Lags add up along lines without memory: ``d[t] = u[t] - u[t-1]``, ``w[t] = d[t-2]`` looks three samples back. A
    state is known from its first sample on, so two states in succession look back no further than one state.

    Examples
    --------
    >>> from smid.models.symbols import signal, t
    >>> u, d, w = signal("u"), signal("d"), signal("w")
    >>> first_samples([Line(d[t], u[t] - u[t - 1]), Line(w[t], d[t - 2])])
    {'d': 1, 'w': 3}
    """
    first: dict[str, int] = {}
    known: dict[str, int] = {}
    for group, recursive in groups(lines):
        reads = [read for line in group for read in line.reads]
        start = max((known.get(name, 0) + lag for name, lag in reads), default=0)
        first.update({line.signal: start for line in group})
        known.update({line.signal: 0 if recursive else start for line in group})
    return first


def is_clock(line: Line) -> bool:
    """Return whether a line depends on its own past only: a clock, which is zero at sample 0.

    Examples
    --------
    >>> from smid.models.symbols import signal, t
    >>> is_clock(Line(signal("k")[t], signal("k")[t - 1] + 1))
    True
    """
    own = {name for name, _ in line.reads}
    return own == {line.signal} and not plain_symbols(line.expression)
