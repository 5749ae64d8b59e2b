"""Pieces of a record, each of which begins with unknown samples of the states (multiple shooting).

Of a hidden state little is known at first, so the enclosures of a long run say nothing. Those of short runs do. The run
of a piece ends where the next one begins, so what any sample says of a hidden state narrows all pieces.

Reference: Bock and Plitt, "A multiple shooting algorithm for direct solution of optimal control problems", IFAC
Proceedings 17 (1984) 1603-1608.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from relaxations.algebra.arrays import Array, Index, Mask
from smid.identification.inversion.free_run import NO_SAMPLE, ZERO
from smid.identification.inversion.tape import Tape

Ends = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Piece:
    """Some samples of an experiment, in a row.

    Parameters
    ----------
    experiment, first
        Which samples: from this one on.
    data
        Shape (channels, n).
    said
        Of which samples each measured output says something, shape (outputs, n).
    initial
        Shape (signals, samples): place of the initial sample in ``unknowns``, `ZERO` or `NO_SAMPLE`.
    unknowns
        Which of all unknowns the run reads: the parameters, then its own initial samples.
    links
        Shape (n, 3). A signal, a sample, and the unknown that the signal is there, with which the next piece begins.
    follows
        Place of the next piece; -1: none.
    """

    experiment: int
    first: int
    data: Array
    said: Mask
    initial: Index
    unknowns: Index
    links: Index
    follows: int


@dataclass(frozen=True, eq=False)
class Pieces:
    """The unknowns of a record, and its pieces.

    Parameters
    ----------
    names, lower, upper
        Of the parameters, of the initial samples of the experiments, and of those of the other pieces.
    wholes
        Each experiment as one piece.
    parts
        Those that the experiments begin with come first.
    """

    names: tuple[str, ...]
    lower: Array
    upper: Array
    wholes: tuple[Piece, ...]
    parts: tuple[Piece, ...]

    @staticmethod
    def of(
        tape: Tape,
        data: Sequence[Array],
        boxes: Sequence[Ends],
        start: Callable[[int, str, int], tuple[str, Ends]],
        length: int,
    ) -> Pieces:
        """Cut experiments into pieces.

        Parameters
        ----------
        data
            Of each experiment, shape (channels, n).
        boxes
            Of the parameters.
        start
            Gives name and ends of an initial sample, by experiment, signal and sample.
        length
            Samples of a piece; 0: each experiment is one.
        """
        first, states = tape.first, np.flatnonzero(tape.states).tolist()
        depth = int(first[states].max(initial=0))
        begins = [(e, 0) for e in range(len(data))]
        if length:
            begins += [(e, k) for e, own in enumerate(data) for k in range(length, own.shape[1] - depth, length)]
        # Each begins with initial samples of its own.
        names, ends = list(tape.parameters), list(boxes)
        tables: dict[tuple[int, int], Index] = {}
        for e, begin in begins:
            tables[e, begin] = table = np.full((len(tape.signals), max(int(first.max(initial=0)), 1)), NO_SAMPLE)
            for k in states:
                for now in range(first[k]):
                    table[k, now] = ZERO if tape.clocks[k] else len(names)
                    if not tape.clocks[k]:
                        name, own_ends = start(e, tape.signals[k], begin + now)
                        names.append(name)
                        ends.append(own_ends)
        lower, upper = (np.array(end, dtype=np.float64) for end in zip(*ends, strict=True))
        return Pieces(
            tuple(names),
            lower,
            upper,
            tuple(_piece(tape, data, e, 0, tables, None) for e in range(len(data))),
            tuple(_piece(tape, data, e, begin, tables, begin + length) for e, begin in begins),
        )


def _piece(
    tape: Tape, data: Sequence[Array], e: int, begin: int, tables: Mapping[tuple[int, int], Index], after: int | None
) -> Piece:
    """Return the piece up to the initial samples of the next one, if there is one, or the end of the experiment."""
    table, count = tables[e, begin], len(tape.parameters)
    own = table[table >= 0]
    links, end, follows = np.zeros((0, 3), dtype=np.int64), None, -1
    if after is not None and after > begin and (e, after) in tables:
        following = tables[e, after]
        there = np.argwhere(following >= 0)
        links = np.column_stack([there[:, 0], there[:, 1] + after - begin, following[following >= 0]])
        end, follows = after + int(tape.first[tape.states].max(initial=0)), list(tables).index((e, after))
    part = np.ascontiguousarray(data[e][:, begin:end])
    said = np.isfinite(part[tape.shown])
    # Before its first sample the model says nothing, but for the states that begin there.
    for row, (_, name) in zip(said, tape.measured, strict=True):
        k = tape.signals.index(name)
        row[: tape.first[k]] &= (table[k] != NO_SAMPLE)[: tape.first[k]][: part.shape[1]]
    return Piece(
        e,
        begin,
        part,
        said,
        np.where(table >= 0, np.searchsorted(own, table) + count, table),
        np.concatenate([np.arange(count), own]),
        links,
        follows,
    )
