"""Forward sensitivities of lines as machine code.

For each line the derivatives by what it reads are written by reverse differentiation of its expression tree, each
common part once. A loop over the columns, the parameters and initial states, then sums them:

    S_i[t] = sum over reads (j, k) of  (df_i / dx_j[t-k]) S_j[t-k]  +  df_i / dp.

At the kinks of Max, Min and Abs the mean of the one-sided derivatives is taken; sign and floor have derivative zero.

Reference: Griewank and Walther, Evaluating Derivatives, 2nd ed. (2008), section 3.2.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

import numpy as np
import sympy
from llvmlite import ir

from relaxations.algebra.arrays import Array
from smid.models.machine_code import MOST_LOOPS, LoopCode, Value, Writer, call, number
from smid.models.parts import Line
from smid.models.symbols import plain_symbols, signal, swapped, t

__all__ = ["SlopesLoop", "compile_slopes"]

Reference = tuple[str, int]

_INT, _DOUBLE = ir.IntType(64), ir.DoubleType()
_STEPS = (sympy.sign, sympy.floor, sympy.ceiling)
_ONE = number(1.0)


@dataclass(frozen=True, eq=False)
class SlopesLoop:
    """Compiled derivatives of lines: what the function takes.

    Parameters
    ----------
    moving
        Signals whose derivatives are read or filled.
    columns
        Parameters by which the lines are differentiated.
    """

    parameters: tuple[str, ...]
    rows: tuple[str, ...]
    moving: tuple[str, ...]
    columns: tuple[str, ...]
    function: Callable[..., None]

    def run(
        self,
        known: Mapping[str, Array],
        values: Mapping[str, Any],
        found: Mapping[str, Array],
        column: Mapping[str, int],
        start: int,
    ) -> None:
        """Fill the derivatives from sample `start` on, in place.

        Parameters
        ----------
        known
            Signals, shape (n,) or (B, n).
        found
            Derivatives of the moving signals, contiguous, of shape (n, width) or (B, n, width).
        column
            Of each parameter, its place in the width.
        """
        *batch, count, width = found[self.moving[0]].shape
        rows = [(np.ascontiguousarray(known[name]), 1) for name in self.rows]
        rows += [(found[name], 2) for name in self.moving]
        columns = np.array([width, *(column[name] for name in self.columns)], dtype=np.int64)
        call(self.function, batch, self.parameters, values, rows, start, count, columns.ctypes.data)


# Of an edited model few lines are new.
@lru_cache(maxsize=MOST_LOOPS)
def compile_slopes(
    lines: tuple[Line, ...], varying: tuple[tuple[Reference, ...], ...], free: frozenset[str]
) -> SlopesLoop:
    """Compile the derivatives of lines in causal order along their trajectory.

    Parameters
    ----------
    varying
        Of each line, the reads that have derivatives.
    free
        Parameters that are differentiated by.
    """
    names = [sorted(plain_symbols(line.expression)) for line in lines]
    parameters = tuple(sorted({name for own in names for name in own}))
    columns = tuple(name for name in parameters if name in free)
    reads = sorted({read for line in lines for read in line.reads})
    rows = tuple(sorted({name for name, _ in reads}))
    moving = tuple(sorted({*(line.signal for line in lines), *(name for own in varying for name, _ in own)}))
    code = LoopCode(parameters, [*rows, *(("d", name) for name in moving)])
    code.read(reads)
    width, *places = (
        code.once.load(code.once.gep(code.columns, [ir.Constant(_INT, k)])) for k in range(1 + len(columns))
    )
    place = dict(zip(columns, places, strict=True))
    for line, own, held in zip(lines, varying, names, strict=True):
        # The derivatives along the trajectory, by reads and by parameters.
        by_read = [signal(name)[t - lag] for name, lag in own]
        by_parameter = [sympy.Symbol(name, real=True) for name in held if name in free]
        slopes = _gradient(code.writer, line.expression, [*by_read, *by_parameter])
        target = _sample(code, line.signal, 0, width)
        terms = [
            (_sample(code, name, lag, width), slope) for (name, lag), slope in zip(own, slopes, strict=False) if slope
        ]
        _add_up(code, target, terms, width)
        for symbol, slope in zip(by_parameter, slopes[len(own) :], strict=True):
            if slope:
                at = code.each.gep(target, [place[symbol.name]])
                code.each.store(code.each.fadd(code.each.load(at), slope[0]), at)
    return SlopesLoop(parameters, rows, moving, columns, code.compiled())


def _sample(code: LoopCode, name: str, lag: int, width: ir.Value) -> ir.Value:
    """Return where the derivatives of a signal at a lag begin."""
    sample = code.each.sub(code.now, ir.Constant(_INT, lag))
    return code.each.gep(code.row["d", name], [code.each.mul(sample, width)])


def _add_up(code: LoopCode, target: ir.Value, terms: Sequence[tuple[ir.Value, Value]], width: ir.Value) -> None:
    """Write a loop that fills the columns of a sample with a sum of scaled columns."""
    before = code.each.block
    test, body, after = (code.function.append_basic_block(name) for name in ("column", "sum", "next"))
    code.each.branch(test)
    code.each.position_at_end(test)
    k = code.each.phi(_INT)
    k.add_incoming(ir.Constant(_INT, 0), before)
    code.each.cbranch(code.each.icmp_signed("<", k, width), body, after)
    code.each.position_at_end(body)
    total: ir.Value = ir.Constant(_DOUBLE, 0.0)
    for source, (slope, _) in terms:
        total = code.each.fadd(total, code.each.fmul(slope, code.each.load(code.each.gep(source, [k]))))
    code.each.store(total, code.each.gep(target, [k]))
    k.add_incoming(code.each.add(k, ir.Constant(_INT, 1)), body)
    code.each.branch(test)
    code.each.position_at_end(after)


def _gradient(writer: Writer, expression: sympy.Expr, leaves: Sequence[sympy.Expr]) -> list[Value | None]:
    """Return the derivatives of an expression; None where it is zero everywhere."""
    order: dict[sympy.Basic, bool] = {}
    ends = frozenset(leaves)

    def visit(node: sympy.Basic) -> bool:
        if node not in order:
            inner = () if isinstance(node, sympy.Indexed) else node.args
            order[node] = any([visit(item) for item in inner]) or node in ends
        return order[node]

    visit(expression)
    found: dict[sympy.Basic, Value] = {expression: _ONE}
    for node in reversed(order):
        if order[node] and node in found and node not in ends:
            for item, slope in _partials(writer, node):
                if order[item]:
                    share = _product(writer, found[node], slope)
                    found[item] = writer.put("fadd", found[item], share) if item in found else share
    return [found.get(leaf) for leaf in leaves]


def _product(writer: Writer, a: Value, b: Value) -> Value:
    return b if a is _ONE else a if b is _ONE else writer.put("fmul", a, b)


def _partials(writer: Writer, node: sympy.Basic) -> Iterator[tuple[sympy.Basic, Value]]:
    """Yield the arguments of a node with the node's derivative by each."""
    if isinstance(node, sympy.Add):
        yield from ((item, _ONE) for item in node.args)
    elif isinstance(node, sympy.Mul):
        for k, item in enumerate(node.args):
            yield item, writer.fold("fmul", node.args[:k] + node.args[k + 1 :])
    elif isinstance(node, sympy.Max | sympy.Min):
        yield from zip(node.args, _shares(writer, node), strict=True)
    elif isinstance(node, sympy.Piecewise):
        left = _ONE
        for value, condition in node.args:
            holds = writer.write(condition)
            yield value, writer.put("select", holds, left, number(0.0))
            left = writer.put("select", holds, number(0.0), left)
    elif isinstance(node, sympy.Pow):
        base, exponent = map(writer.write, node.args)
        if node.exp.is_number:
            yield node.base, writer.put("fmul", exponent, writer.power(base, node.exp - 1))
        else:
            steep = writer.call("pow", base, writer.put("fsub", exponent, _ONE))
            yield node.base, writer.put("fmul", exponent, steep)
            yield node.exp, writer.put("fmul", writer.write(node), writer.call("log", base))
    elif isinstance(node, sympy.Function) and not isinstance(node, _STEPS):
        dummies, rules = _rules(node.func, len(node.args))
        given = dict(zip(dummies, node.args, strict=True))
        for item, rule in zip(node.args, rules, strict=True):
            yield item, writer.write(swapped(rule, given))


def _shares(writer: Writer, node: sympy.Max | sympy.Min) -> list[Value]:
    """Return 1 for the argument that is the extreme, 0 for the others; where two are equal they share it."""
    relation = ">" if isinstance(node, sympy.Max) else "<"
    value, shares = writer.write(node.args[0]), [_ONE]
    for item in node.args[1:]:
        other = writer.write(item)
        tied = writer.put("select", writer.compare("==", value, other), number(0.5), number(0.0))
        first = writer.put("select", writer.compare(relation, value, other), _ONE, tied)
        shares = [writer.put("fmul", share, first) for share in shares]
        shares.append(writer.put("fsub", _ONE, first))
        value = writer.extreme(relation, value, other)
    return shares


@cache
def _rules(function: Any, count: int) -> tuple[list[sympy.Dummy], list[sympy.Expr]]:
    """Return the derivatives of a function by its arguments, which are given first."""
    dummies = [sympy.Dummy(real=True) for _ in range(count)]
    return dummies, [function(*dummies).diff(dummy) for dummy in dummies]
