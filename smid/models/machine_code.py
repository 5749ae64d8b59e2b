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
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, reduce
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

__all__ = ["Loop", "compile_loop"]

_DOUBLE, _INT, _BIT = ir.DoubleType(), ir.IntType(64), ir.IntType(1)
_VECTOR = _DOUBLE.as_pointer()
_SIGNATURE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64)

# Functions of the C library, by their names there.
_SAME = "exp log sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh erf erfc floor"
_LIBRARY = {sympy.ceiling: "ceil", **{getattr(sympy, name): name for name in _SAME.split()}}
_RELATIONS = {sympy.Gt: ">", sympy.Ge: ">=", sympy.Lt: "<", sympy.Le: "<=", sympy.Eq: "==", sympy.Ne: "!="}
_NUMBERS = count()
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
        size = batch[0] if batch else 1
        rows = [np.ascontiguousarray(known[name]) for name in self.rows]
        # Of each run, its parameters and where its rows begin; a row without a batch serves all runs.
        constants = np.empty((size, len(self.parameters)))
        for k, name in enumerate(self.parameters):
            constants[:, k] = values[name]
        steps = np.array([row.strides[0] if row.ndim > 1 else 0 for row in rows])
        begins = np.array([row.ctypes.data for row in rows]) + steps * np.arange(size)[:, np.newaxis]
        at, beside = constants.ctypes.data, begins.ctypes.data
        for k in range(size):
            self.function(at + k * constants.strides[0], beside + k * begins.strides[0], start, count)


# Edits of a model leave most of its lines as they are: those are not compiled again. The engine keeps all code.
@cache
def compile_loop(lines: tuple[Line, ...]) -> Loop:
    """Compile lines in causal order: what one reads at the same time is known or defined by a line before it."""
    parameters = tuple(sorted(set().union(*(plain_symbols(line.expression) for line in lines))))
    reads = set().union(*(line.reads for line in lines))
    rows = tuple(sorted({*(name for name, _ in reads), *(line.signal for line in lines)}))
    name, engine = f"loop{next(_NUMBERS)}", _engine()
    engine.add_module(llvm.parse_assembly(str(_module(name, lines, parameters, sorted(reads), rows))))
    engine.finalize_object()
    return Loop(parameters, rows, lines[0].signal, _SIGNATURE(engine.get_function_address(name)))


def _module(
    called: str,
    lines: Sequence[Line],
    parameters: Sequence[str],
    reads: Sequence[tuple[str, int]],
    rows: Sequence[str],
) -> ir.Module:
    module = ir.Module()
    function = ir.Function(module, ir.FunctionType(ir.VoidType(), [_VECTOR, _VECTOR.as_pointer(), _INT, _INT]), called)
    values, table, start, count = function.args
    blocks = [function.append_basic_block(name) for name in ("once", "test", "each", "end")]
    once, test, each, end = map(ir.IRBuilder, blocks)
    writer = _Writer(module, once, each)

    # Before the loop: the parameters, and where the rows begin.
    for k, name in enumerate(parameters):
        value = once.load(once.gep(values, [ir.Constant(_INT, k)]))
        writer.known[sympy.Symbol(name, real=True)] = value, True
    row = {name: once.load(once.gep(table, [ir.Constant(_INT, k)])) for k, name in enumerate(rows)}

    # At each sample: what is read from before, then line by line.
    now = test.phi(_INT)
    defined = {line.signal for line in lines}
    for name, lag in reads:
        if lag or name not in defined:
            place = each.gep(row[name], [each.sub(now, ir.Constant(_INT, lag))])
            writer.known[signal(name)[t - lag]] = each.load(place), False
    for line in lines:
        value, _ = writer.known[signal(line.signal)[t]] = writer.write(line.expression)
        each.store(value, each.gep(row[line.signal], [now]))

    once.branch(blocks[1])
    now.add_incoming(start, blocks[0])
    now.add_incoming(each.add(now, ir.Constant(_INT, 1)), blocks[2])
    each.branch(blocks[1])
    test.cbranch(test.icmp_signed("<", now, count), blocks[2], blocks[3])
    end.ret_void()
    return module


@cache
def _engine() -> Any:
    """Return the one engine, for this kind of processor without instructions that only some of it have.

    An engine for each loop would take twenty times the memory.
    """
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    library = ctypes.CDLL("ucrtbase" if sys.platform == "win32" else None)
    for name in {*_LIBRARY.values(), "pow"}:
        address = ctypes.cast(getattr(library, name), ctypes.c_void_p).value
        llvm.add_symbol(name, address)
    machine = llvm.Target.from_default_triple().create_target_machine(opt=1, jit=True)
    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)


class _Writer:
    """Instructions that compute every node of a tree once, before the loop or in it."""

    def __init__(self, module: ir.Module, once: ir.IRBuilder, each: ir.IRBuilder) -> None:
        self.module, self.once, self.each = module, once, each
        self.known: dict[sympy.Basic, Value] = {}

    def write(self, node: sympy.Basic) -> Value:
        if node not in self.known:
            self.known[node] = self._written(node)
        return self.known[node]

    def _put(self, instruction: str, *items: Value) -> Value:
        fixed = all(is_fixed for _, is_fixed in items)
        builder = self.once if fixed else self.each
        return getattr(builder, instruction)(*(value for value, _ in items)), fixed

    def _call(self, name: str, *items: Value) -> Value:
        kind = ir.FunctionType(_DOUBLE, [_DOUBLE] * len(items))
        function = self.module.globals.get(name) or ir.Function(self.module, kind, name)
        fixed = all(is_fixed for _, is_fixed in items)
        return (self.once if fixed else self.each).call(function, [value for value, _ in items]), fixed

    def _compare(self, relation: str, a: Value, b: Value, kind: str = "ordered") -> Value:
        fixed = a[1] and b[1]
        return getattr(self.once if fixed else self.each, f"fcmp_{kind}")(relation, a[0], b[0]), fixed

    def _written(self, node: sympy.Basic) -> Value:
        if isinstance(node, BooleanAtom):
            return ir.Constant(_BIT, int(bool(node))), True
        if isinstance(node, sympy.Expr) and node.is_number:
            return _number(float(node))
        if isinstance(node, sympy.Add):
            return self._fold("fadd", node.args)
        if isinstance(node, sympy.Mul):
            return self._product(node)
        if isinstance(node, sympy.Pow):
            return self._power(self.write(node.base), node.exp)
        if isinstance(node, sympy.Max | sympy.Min):
            relation = ">" if isinstance(node, sympy.Max) else "<"
            return reduce(lambda a, b: self._extreme(relation, a, b), map(self.write, node.args))
        if isinstance(node, sympy.Abs):
            return self._call("llvm.fabs.f64", self.write(node.args[0]))
        if isinstance(node, sympy.sign):
            x = self.write(node.args[0])
            # Zero and NaN stay what they are.
            unit = self._call("llvm.copysign.f64", _number(1.0), x)
            return self._put("select", self._compare("==", x, _number(0.0), "unordered"), x, unit)
        if isinstance(node, sympy.Piecewise):
            pieces = [(self.write(value), self.write(condition)) for value, condition in node.args]
            return reduce(
                lambda rest, piece: self._put("select", piece[1], piece[0], rest), reversed(pieces), _number(np.nan)
            )
        if isinstance(node, Relational):
            a, b = map(self.write, node.args)
            return self._compare(_RELATIONS[node.func], a, b, "unordered" if node.func is sympy.Ne else "ordered")
        if isinstance(node, BooleanFunction) and node.func in (sympy.And, sympy.Or):
            return self._fold("and_" if node.func is sympy.And else "or_", node.args)
        if node.func in _LIBRARY:
            return self._call(_LIBRARY[node.func], *map(self.write, node.args))
        names = sorted({*(f.__name__ for f in _LIBRARY), "Abs", "Max", "Min", "Piecewise", "sign", "sqrt"})
        raise ModelError(f"a line of the model uses {node.func}: the functions known are {', '.join(names)}")

    def _fold(self, instruction: str, items: Sequence[sympy.Basic]) -> Value:
        # What is fixed comes first, so that it is joined before the loop.
        values = sorted(map(self.write, items), key=lambda value: not value[1])
        return reduce(lambda a, b: self._put(instruction, a, b), values)

    def _product(self, node: sympy.Mul) -> Value:
        below = [item for item in node.args if isinstance(item, sympy.Pow) and item.exp.could_extract_minus_sign()]
        if not below:
            return self._fold("fmul", node.args)
        above = [item for item in node.args if item not in below] or [sympy.Integer(1)]
        return self._put("fdiv", self._fold("fmul", above), self._fold("fmul", [1 / item for item in below]))

    def _power(self, base: Value, exponent: sympy.Expr) -> Value:
        if exponent.could_extract_minus_sign():
            return self._put("fdiv", _number(1.0), self._power(base, -exponent))
        if exponent == sympy.S.Half:
            return self._call("llvm.sqrt.f64", base)
        if exponent.is_Integer and exponent <= _LARGEST_PRODUCT:
            return reduce(lambda a, b: self._put("fmul", a, b), [base] * int(exponent))
        return self._call("pow", base, self.write(exponent))

    def _extreme(self, relation: str, a: Value, b: Value) -> Value:
        """Return the larger or the smaller; NaN if one of them is NaN."""
        chosen = self._put("select", self._compare(relation, a, b), a, b)
        return self._put("select", self._compare("ord", a, b), chosen, self._put("fadd", a, b))


def _number(value: float) -> Value:
    return ir.Constant(_DOUBLE, value), True
