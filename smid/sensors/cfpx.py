"""CFPX: the position from the pressure of the same instant, by a polynomial.

    x_t = sum_j c_j T_j((P_t - centre) / half_range),    j = 0..order

The thesis has powers of P. Powers of 30 bar up to order 100 lose all digits, so Chebyshev polynomials over the range of
the records are used: they span the same functions and stay within [-1, 1]. Beyond that range the polynomial is held at
its end value.

Reference: clutch thesis, (5.11) and table 5.3; Trefethen, "Approximation Theory and Approximation Practice", chapter 3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Self

import numpy as np
from numpy.polynomial import chebyshev

from relaxations.algebra.arrays import Array
from relaxations.algebra.ball_arithmetic import Balls
from smid.data import DataError, Dataset
from smid.models import ModelError
from smid.networks import ProgressCallback
from smid.sensors.c_ranges import c_ball
from smid.sensors.curve import cells_of
from smid.sensors.program import CELLS, Block, Code, Program
from smid.sensors.ranges import Range
from smid.sensors.sensor import VirtualSensor, require_training_data, trained, training_rows
from smid.sensors.tensor import Tensor
from smid.sensors.trained_on import TrainedOn

__all__ = ["CFPX", "scale_pressure"]


@dataclass(frozen=True, eq=False)
class CFPX(VirtualSensor):
    """Pressure to position by a polynomial.

    Parameters
    ----------
    pressure, output
        Names of the channels.
    coefficients
        Shape (order + 1,). Of the Chebyshev polynomials on the trained range; None before training.

    Raises
    ------
    ModelError
        If the order is negative.

    Examples
    --------
    >>> from smid.data.bundled import load_clutch
    >>> data = load_clutch("20C_step_a")
    >>> errors = [CFPX(order).fit(data, seed=1).predict(data).mse(data) for order in (5, 20, 100)]
    >>> sorted(errors, reverse=True) == errors
    True
    """

    order: int = 20
    pressure: str = "pressure"
    output: str = "position"
    coefficients: Array | None = None
    trained_on: TrainedOn | None = None

    def __post_init__(self) -> None:
        if self.order < 0:
            raise ModelError(f"order = {self.order}: give the order of a polynomial, 0 or more")

    @property
    def channels(self) -> tuple[str, ...]:
        """The pressure."""
        return (self.pressure,)

    @property
    def n_parameters(self) -> int:
        """Number of coefficients."""
        return self.order + 1

    def fit(
        self,
        data: Dataset,
        *,
        seed: int | np.random.Generator,  # noqa: ARG002
        starts: int = 1,  # noqa: ARG002
        progress: ProgressCallback | None = None,  # noqa: ARG002
    ) -> Self:
        """Return this sensor, fitted by linear least squares; see `VirtualSensor.fit`."""
        require_training_data(data, self.channels, self.output)
        rows = training_rows(data)
        if self.n_parameters > rows.size:
            raise DataError(
                f"{self.n_parameters} coefficients but {rows.size} samples: give more samples, or a lower order"
            )
        pressure, target = data.stacked(self.pressure), data.stacked(self.output)
        pressure_range = float(pressure.min()), float(pressure.max())
        basis = chebyshev.chebvander(scale_pressure(pressure[rows], pressure_range), self.order)
        coefficients = np.asarray(np.linalg.lstsq(basis, target[rows], rcond=None)[0], dtype=np.float64)
        told = TrainedOn.of(data, self.channels, self.output)
        return replace(self, coefficients=coefficients, trained_on=told)

    def program(self) -> Program:
        """Return the polynomial; see `VirtualSensor.program`."""
        signal = trained(self.trained_on, self).inputs[0]
        return Program().then(Chebyshev((signal.lower, signal.upper), trained(self.coefficients, self)), self.pressure)


@dataclass(frozen=True, eq=False)
class Chebyshev(Block):
    """A polynomial of a pressure that is scaled to its range and held at the ends.

    Over a cell of half width d around c it lies within ``p(c) +- (|p'(c)| d + max |p''| d^2 / 2)``.
    """

    pressure_range: tuple[float, float]
    coefficients: Array

    def rest(self, first: Sequence[Array]) -> Array:  # noqa: ARG002
        """Return no memory; see `Block.rest`."""
        return np.zeros(0)

    def advance(self, signals: Sequence[Array], memory: Array) -> tuple[Array, Array]:
        """Return the values; see `Block.advance`."""
        return np.asarray(chebyshev.chebval(scale_pressure(signals[0], self.pressure_range), self.coefficients)), memory

    def enclose(self, signals: Sequence[Range], memory: Range, cells: int) -> tuple[Range, Range]:
        """Return the range over the cells; see `Block.enclose`."""
        low, high = (Balls.exact(end) for end in self.pressure_range)
        half = Balls.exact(0.5)
        clipped = Range(*(np.clip(end, *self.pressure_range) for end in (signals[0].lower, signals[0].upper)))
        centre = half * (low + high)
        ends = [Range.of((Balls.exact(e) - centre) / (half * (high - low))) for e in (clipped.lower, clipped.upper)]
        box = cells_of([Range(np.maximum(ends[0].lower, -1.0), np.minimum(ends[1].upper, 1.0))], cells)[0]
        middle = 0.5 * box.lower + 0.5 * box.upper
        first, second = _derivatives(self.coefficients)
        reach = (box.balls - Balls.exact(middle)).magnitude()
        slope = _clenshaw(first, middle).magnitude()
        # |T_j| <= 1 bounds the second derivative.
        spread = (slope * reach + 0.5 * float(second.magnitude().sum()) * reach**2) * (1.0 + 1e-14)
        value = _clenshaw(Balls.exact(self.coefficients), middle)
        found = Range.of(value + Balls(np.zeros_like(spread), spread))
        return Range(found.lower.min(), found.upper.max()), memory

    def onnx(self, signals: Sequence[Tensor], memory: Tensor) -> tuple[Tensor, Tensor]:
        """Return Clenshaw's recursion in the order of numpy; see `Block.onnx`."""
        low, high = self.pressure_range
        x = (signals[0].clip(low, high) - 0.5 * (low + high)) / (0.5 * (high - low))
        c = self.coefficients.tolist()
        c += [0.0] * (len(c) == 1)
        c0, c1 = x.graph.tensor(c[-2]), x.graph.tensor(c[-1])
        for k in range(len(c) - 3, -1, -1):
            c0, c1 = x.graph.tensor(c[k]) - c1, c0 + c1 * (2.0 * x)
        return c0 + c1 * x, memory

    def code(self, name: str, signals: Sequence[str]) -> Code:
        """Return Clenshaw's recursion in the order of numpy; see `Block.code`."""
        low, high = self.pressure_range
        c = self.coefficients.tolist()
        # numpy takes a missing last coefficient as zero
        c += [0.0] * (len(c) == 1)
        table = f"static const double {name}_c[{len(c)}] = {{{', '.join(map(repr, c))}}};"
        clip = f"{signals[0]} < {low!r} ? {low!r} : {signals[0]} > {high!r} ? {high!r} : {signals[0]}"
        return Code(
            update=(
                f"{{ double x = (({clip}) - ({0.5 * (low + high)!r})) / {0.5 * (high - low)!r};\n"
                f"  double c0 = {name}_c[{len(c) - 2}], c1 = {name}_c[{len(c) - 1}];\n"
                f"  for (int k = {len(c) - 3}; k >= 0; k--) {{\n"
                "    double before = c0;\n"
                f"    c0 = {name}_c[k] - c1;\n"
                "    c1 = before + c1 * (2.0 * x);\n"
                "  }\n"
                f"  {name} = c0 + c1 * x; }}"
            ),
            constants=table,
        )

    def range_code(self, name: str, signals: Sequence[str]) -> Code:
        """Return the cells, each with its Taylor form; see `Block.range_code`."""
        table, (low, high) = name.removeprefix("r"), self.pressure_range
        half = Balls.exact(0.5)
        centre, width = half * (Balls.exact(low) + Balls.exact(high)), half * (Balls.exact(high) - Balls.exact(low))
        first, second = _derivatives(self.coefficients)
        size = len(self.coefficients)
        tables = [
            f"static const ball {table}_{what}[{len(some)}] = {{{', '.join(some)}}};"
            for what, balls in (("value", Balls.exact(self.coefficients)), ("slope", first))
            for some in ([c_ball(balls[k]) for k in range(len(balls))],)
        ]
        x, ends = signals[0], list[str]()
        for end in ("lower", "upper"):
            clip = f"smaller(larger({x}.{end}, {low!r}), {high!r})"
            ends.append(f"bounds(over(minus(exact({clip}), centre), width))")
        return Code(
            f"{{ const ball centre = {c_ball(centre)}, width = {c_ball(width)};\n"
            f"  const range ends[] = {{{ends[0]},\n    {ends[1]}}};\n"
            "  const range box = {larger(ends[0].lower, -1.0), smaller(ends[1].upper, 1.0)};\n"
            f"  const int parts = box.upper > box.lower ? {CELLS} : 1;\n"
            f"  {name}.lower = HUGE_VAL; {name}.upper = -HUGE_VAL;\n"
            "  for (int number = 0; number < parts; number++) {\n"
            "    const range cell = part(box, number, parts);\n"
            "    const double middle = 0.5 * cell.lower + 0.5 * cell.upper;\n"
            "    const double reach = magnitude(minus(balls(cell), exact(middle)));\n"
            f"    const double slope = magnitude(clenshaw({len(first)}, {table}_slope, middle));\n"
            f"    const double bend = {0.5 * float(second.magnitude().sum())!r} * reach * reach;\n"
            "    const ball spread = {0.0, (slope * reach + bend) * (1.0 + 1e-14)};\n"
            f"    const range value = bounds(plus(clenshaw({size}, {table}_value, middle), spread));\n"
            f"    {name}.lower = smaller({name}.lower, value.lower);\n"
            f"    {name}.upper = larger({name}.upper, value.upper);\n"
            "  } }",
            constants="\n".join(tables),
        )


def _derivatives(coefficients: Array) -> tuple[Balls, Balls]:
    """Return the coefficients of the first and the second derivative, exact but for the last rounding."""

    def derivative(c: list[Fraction]) -> list[Fraction]:
        c, found = list(c), [Fraction(0)] * max(1, len(c) - 1)
        for j in range(len(c) - 1, 0, -1):
            found[j - 1] = (1 if j == 1 else 2 * j) * c[j]
            if j > 2:
                c[j - 2] += Fraction(j, j - 2) * c[j]
        return found

    first = derivative([Fraction(x) for x in coefficients.tolist()])
    enclosed = ([Balls.enclose(x) for x in some] for some in (first, derivative(first)))
    one, two = (Balls(np.array([b.mid for b in some]), np.array([b.rad for b in some])) for some in enclosed)
    return one, two


def _clenshaw(coefficients: Balls, points: Array) -> Balls:
    """Return a series at points of shape (n,), with the rounding errors."""
    x = Balls.exact(points)
    zero = Balls.exact(np.zeros_like(points))
    b1, b2 = zero, zero
    for k in range(len(coefficients) - 1, 0, -1):
        b1, b2 = coefficients[k] + Balls.exact(2.0) * x * b1 - b2, b1
    return coefficients[0] + x * b1 - b2


def scale_pressure(pressure: Array, pressure_range: tuple[float, float]) -> Array:
    """Return a pressure scaled to [-1, 1] and held at the ends of the range."""
    low, high = pressure_range
    return np.asarray((np.clip(pressure, low, high) - 0.5 * (low + high)) / (0.5 * (high - low)))
