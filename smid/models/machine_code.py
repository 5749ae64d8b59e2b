"""Lines of a model as machine code that fills their signals sample by sample.

Each line becomes instructions of LLVM: a node of its expression tree is computed once, and what parameters alone decide
is computed before the loop over time. Nothing is reordered or fused, so results do not depend on the processor, but for
the last digits of the C library's functions. A sample takes some nanoseconds a line, where a loop over Python floats
takes a microsecond, and to compile takes a few milliseconds either way.

Reference: Lattner and Adve, LLVM: a compilation framework for lifelong program analysis and transformation, CGO 2004.
"""

from __future__ import annotations

import ctypes
import sys
from array import array
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, reduce
from itertools import count
from typing import Any

import llvmlite.binding as llvm
import numpy as np
import sympy
from llvmlite import ir
from sympy.core.relational import Relational
from sympy.logic.boolalg import BooleanAtom, BooleanFunction

from relaxations.algebra.arrays import Array
from smid.models.errors import ModelError
from smid.models.parts import Line
from smid.models.symbols import plain_symbols, signal, t

__all__ = ["MOST_LOOPS", "Loop", "LoopCode", "Value", "Writer", "call", "compile_loop", "number"]

_DOUBLE, _INT, _BIT = ir.DoubleType(), ir.IntType(64), ir.IntType(1)
_VECTOR = _DOUBLE.as_pointer()
_INTS = _INT.as_pointer()
_SIGNATURE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64, ctypes.c_void_p)

# Functions of the C library, by their names there.
_SAME = "exp log sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh erf erfc floor"
_LIBRARY = {sympy.ceiling: "ceil", **{getattr(sympy, name): name for name in _SAME.split()}}
_RELATIONS = {sympy.Gt: ">", sympy.Ge: ">=", sympy.Lt: "<", sympy.Le: "<=", sympy.Eq: "==", sympy.Ne: "!="}
_NUMBERS = count()
_SHARED = 64  # loops in an engine
MOST_LOOPS = 1024
"""Loops that are kept, in case they are needed again."""
_LARGEST_PRODUCT = 8  # a power up to here is a product

Value = tuple[ir.Value, bool]
"""An instruction's result, and whether parameters alone decide it."""


@dataclass(frozen=True, eq=False)
class Loop:
    """Compiled lines: what the function takes, and a signal that it fills."""

    parameters: tuple[str, ...]
    rows: tuple[str, ...]
    filled: str
    function: Callable[..., None]

    def run(self, known: Mapping[str, Array], values: Mapping[str, Any], start: int) -> None:
        """Fill the signals from sample `start` on, in place.

        Parameters
        ----------
        known
            Every signal that is read or filled. The filled ones are contiguous, of shape (n,) or (B, n).
        values
            Parameter values, scalars or of shape (B,).
        """
        *batch, count = known[self.filled].shape
        rows = [(np.ascontiguousarray(known[name]), 1) for name in self.rows]
        call(self.function, batch, self.parameters, values, rows, start, count)


def call(
    function: Callable[..., None],
    batch: Sequence[int],
    parameters: Sequence[str],
    values: Mapping[str, Any],
    rows: Sequence[tuple[Array, int]],
    start: int,
    count: int,
    columns: int | None = None,
) -> None:
    """Call a compiled function for one run, or for each of a batch.

    Parameters
    ----------
    rows
        Contiguous arrays, each with the dimensions it has in one run. A row without a batch serves all runs.
    columns
        Address of the columns of the derivatives, see `smid.models.machine_slopes`.
    """
    given = [values[name] for name in parameters]
    places = [(_address(row), row.strides[0] if row.ndim > single else 0) for row, single in rows]
    for k in range(batch[0] if batch else 1):
        constants = array("d", [value[k] if isinstance(value, np.ndarray) else value for value in given])
        begins = array("q", [begin + k * step for begin, step in places])
        function(constants.buffer_info()[0], begins.buffer_info()[0], start, count, columns)


def _address(row: Array) -> int:
    """Return where the samples of a contiguous array begin."""
    try:
        return ctypes.addressof(ctypes.c_char.from_buffer(row.data))
    except (TypeError, ValueError):  # read-only or empty; this way is slower
        return int(row.__array_interface__["data"][0])


# Edits of a model leave most of its lines as they are: those are not compiled again.
@lru_cache(maxsize=MOST_LOOPS)
def compile_loop(lines: tuple[Line, ...]) -> Loop:
    """Compile lines in causal order: what one reads at the same time is known or defined by a line before it."""
    parameters = tuple(sorted(set().union(*(plain_symbols(line.expression) for line in lines))))
    reads = set().union(*(line.reads for line in lines))
    rows = tuple(sorted({*(name for name, _ in reads), *(line.signal for line in lines)}))
    code = LoopCode(parameters, rows)
    defined = {line.signal for line in lines}
    code.read((name, lag) for name, lag in sorted(reads) if lag or name not in defined)
    for line in lines:
        value, _ = code.writer.known[signal(line.signal)[t]] = code.writer.write(line.expression)
        code.each.store(value, code.each.gep(code.row[line.signal], [code.now]))
    return Loop(parameters, rows, lines[0].signal, code.compiled())


class LoopCode:
    """A function being written: what parameters alone decide, then a loop over the samples.

    Parameters
    ----------
    parameters
        What the function takes as its first argument.
    rows
        Names of the arrays that it takes as its second.
    """

    def __init__(self, parameters: Sequence[str], rows: Sequence[Any]) -> None:
        self.module = ir.Module()
        kind = ir.FunctionType(ir.VoidType(), [_VECTOR, _VECTOR.as_pointer(), _INT, _INT, _INTS])
        self.number = next(_NUMBERS)
        self.function = ir.Function(self.module, kind, f"loop{self.number}")
        values, table, self._start, self._count, self.columns = self.function.args
        self._blocks = [self.function.append_basic_block(name) for name in ("once", "test", "each")]
        self.once, self._test, self.each = map(ir.IRBuilder, self._blocks)
        self.writer = Writer(self.module, self.once, self.each)
        for k, name in enumerate(parameters):
            value = self.once.load(self.once.gep(values, [ir.Constant(_INT, k)]))
            self.writer.known[sympy.Symbol(name, real=True)] = value, True
        self.row = {name: self.once.load(self.once.gep(table, [ir.Constant(_INT, k)])) for k, name in enumerate(rows)}
        self.now = self._test.phi(_INT)

    def read(self, reads: Iterable[tuple[str, int]]) -> None:
        """Load signals at lags."""
        for name, lag in reads:
            place = self.each.gep(self.row[name], [self.each.sub(self.now, ir.Constant(_INT, lag))])
            self.writer.known[signal(name)[t - lag]] = self.each.load(place), False

    def compiled(self) -> Callable[..., None]:
        """Close the loop and compile the function."""
        end = self.function.append_basic_block("end")
        once, test, each = self._blocks
        self.once.branch(test)
        self.now.add_incoming(self._start, once)
        self.now.add_incoming(self.each.add(self.now, ir.Constant(_INT, 1)), self.each.block)
        self.each.branch(test)
        self._test.cbranch(self._test.icmp_signed("<", self.now, self._count), each, end)
        ir.IRBuilder(end).ret_void()
        engine, module = _engine(self.number // _SHARED), llvm.parse_assembly(str(self.module))
        engine.add_module(module)
        engine.finalize_object()
        function = _SIGNATURE(engine.get_function_address(self.function.name))
        # What was compiled stays with its engine; what it was compiled from takes more memory.
        engine.remove_module(module)
        function.engine = engine  # type: ignore[attr-defined]
        return function


@lru_cache(maxsize=1)
def _engine(_number: int) -> Any:
    """Return a new engine, for this kind of processor without instructions that only some of it have.

    An engine for each loop would take twenty times the memory; one for all would keep what nobody calls any more.
    """
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    library = ctypes.CDLL("ucrtbase" if sys.platform == "win32" else None)
    for name in {*_LIBRARY.values(), "pow"}:
        address = ctypes.cast(getattr(library, name), ctypes.c_void_p).value
        llvm.add_symbol(name, address)
    machine = llvm.Target.from_default_triple().create_target_machine(opt=0, jit=True)
    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)


class Writer:
    """Instructions that compute every node of a tree once, before the loop or in it."""

    def __init__(self, module: ir.Module, once: ir.IRBuilder, each: ir.IRBuilder) -> None:
        self.module, self.once, self.each = module, once, each
        self.known: dict[sympy.Basic, Value] = {}

    def write(self, node: sympy.Basic) -> Value:
        """Return the value of an expression, with its instructions if there are none yet."""
        if node not in self.known:
            self.known[node] = self._written(node)
        return self.known[node]

    def put(self, instruction: str, *items: Value) -> Value:
        """Return the result of an instruction, before the loop if all its items are."""
        fixed = all(is_fixed for _, is_fixed in items)
        builder = self.once if fixed else self.each
        return getattr(builder, instruction)(*(value for value, _ in items)), fixed

    def call(self, name: str, *items: Value) -> Value:
        """Return the result of a function of LLVM or the C library."""
        kind = ir.FunctionType(_DOUBLE, [_DOUBLE] * len(items))
        function = self.module.globals.get(name) or ir.Function(self.module, kind, name)
        fixed = all(is_fixed for _, is_fixed in items)
        return (self.once if fixed else self.each).call(function, [value for value, _ in items]), fixed

    def compare(self, relation: str, a: Value, b: Value, kind: str = "ordered") -> Value:
        """Return whether a relation holds."""
        fixed = a[1] and b[1]
        return getattr(self.once if fixed else self.each, f"fcmp_{kind}")(relation, a[0], b[0]), fixed

    def _written(self, node: sympy.Basic) -> Value:
        if isinstance(node, BooleanAtom):
            return ir.Constant(_BIT, int(bool(node))), True
        if isinstance(node, sympy.Expr) and node.is_number:
            return number(float(node))
        if isinstance(node, sympy.Add):
            return self.fold("fadd", node.args)
        if isinstance(node, sympy.Mul):
            return self._product(node)
        if isinstance(node, sympy.Pow):
            return self.power(self.write(node.base), node.exp)
        if isinstance(node, sympy.Max | sympy.Min):
            relation = ">" if isinstance(node, sympy.Max) else "<"
            return reduce(lambda a, b: self.extreme(relation, a, b), map(self.write, node.args))
        if isinstance(node, sympy.Abs):
            return self.call("llvm.fabs.f64", self.write(node.args[0]))
        if isinstance(node, sympy.sign):
            x = self.write(node.args[0])
            # Zero and NaN stay what they are.
            unit = self.call("llvm.copysign.f64", number(1.0), x)
            return self.put("select", self.compare("==", x, number(0.0), "unordered"), x, unit)
        if isinstance(node, sympy.Piecewise):
            pieces = [(self.write(value), self.write(condition)) for value, condition in node.args]
            return reduce(
                lambda rest, piece: self.put("select", piece[1], piece[0], rest), reversed(pieces), number(np.nan)
            )
        if isinstance(node, Relational):
            a, b = map(self.write, node.args)
            return self.compare(_RELATIONS[node.func], a, b, "unordered" if node.func is sympy.Ne else "ordered")
        if isinstance(node, BooleanFunction) and node.func in (sympy.And, sympy.Or):
            return self.fold("and_" if node.func is sympy.And else "or_", node.args)
        if node.func in _LIBRARY:
            return self.call(_LIBRARY[node.func], *map(self.write, node.args))
        names = sorted({*(f.__name__ for f in _LIBRARY), "Abs", "Max", "Min", "Piecewise", "sign", "sqrt"})
        raise ModelError(f"a line of the model uses {node.func}: the functions known are {', '.join(names)}")

    def fold(self, instruction: str, items: Sequence[sympy.Basic]) -> Value:
        """Return expressions joined by an instruction."""
        # What is fixed comes first, so that it is joined before the loop.
        values = sorted(map(self.write, items), key=lambda value: not value[1])
        return reduce(lambda a, b: self.put(instruction, a, b), values)

    def _product(self, node: sympy.Mul) -> Value:
        below = [item for item in node.args if isinstance(item, sympy.Pow) and item.exp.could_extract_minus_sign()]
        if not below:
            return self.fold("fmul", node.args)
        above = [item for item in node.args if item not in below] or [sympy.Integer(1)]
        return self.put("fdiv", self.fold("fmul", above), self.fold("fmul", [1 / item for item in below]))

    def power(self, base: Value, exponent: sympy.Expr) -> Value:
        """Return a power."""
        if exponent.could_extract_minus_sign():
            return self.put("fdiv", number(1.0), self.power(base, -exponent))
        if exponent == sympy.S.Half:
            return self.call("llvm.sqrt.f64", base)
        if exponent.is_Integer and exponent <= _LARGEST_PRODUCT:
            return reduce(lambda a, b: self.put("fmul", a, b), [base] * int(exponent))
        return self.call("pow", base, self.write(exponent))

    def extreme(self, relation: str, a: Value, b: Value) -> Value:
        """Return the larger or the smaller; NaN if one of them is NaN."""
        chosen = self.put("select", self.compare(relation, a, b), a, b)
        return self.put("select", self.compare("ord", a, b), chosen, self.put("fadd", a, b))


def number(value: float) -> Value:
    """Return a constant."""
    return ir.Constant(_DOUBLE, value), True
