"""The C99 of ranges: the formulas of `smid.sensors.ranges`, `curve` and ball arithmetic, function by function."""

from __future__ import annotations

import re

from relaxations.algebra.ball_arithmetic import Balls
from smid.sensors.ranges import Range

__all__ = ["c_ball", "c_numbers", "c_range", "used_functions"]

TYPES = """\
typedef struct { double lower, upper; } range;
typedef struct { double mid, rad; } ball;"""

FUNCTIONS = """\
static double larger(double a, double b) { return a > b ? a : b; }

static double smaller(double a, double b) { return a < b ? a : b; }

static range meet(range a, range b) {
  range found = {larger(a.lower, b.lower), smaller(a.upper, b.upper)};
  range hull = {smaller(a.lower, b.lower), larger(a.upper, b.upper)};
  return found.lower <= found.upper ? found : hull;
}

static ball exact(double x) { ball found = {x, 0.0}; return found; }

static ball balls(range x) {
  ball found = {0.5 * x.lower + 0.5 * x.upper, 0.0};
  double rad = larger(x.upper - found.mid, found.mid - x.lower);
  if (rad > 0) found.rad = rad * (1.0 + DBL_EPSILON) + DBL_MIN;
  return found;
}

static range bounds(ball x) {
  range found = {x.mid, x.mid};
  if (x.rad != 0) {
    found.lower = nextafter(x.mid - x.rad, -HUGE_VAL);
    found.upper = nextafter(x.mid + x.rad, HUGE_VAL);
  }
  return found;
}

static double magnitude(ball x) { return (fabs(x.mid) + x.rad) * (1.0 + 8 * DBL_EPSILON); }

static ball plus(ball a, ball b) {
  ball found = {a.mid + b.mid, 0.0};
  found.rad = (a.rad + b.rad + DBL_EPSILON * fabs(found.mid)) * (1.0 + 8 * DBL_EPSILON);
  return found;
}

static ball minus(ball a, ball b) { b.mid = -b.mid; return plus(a, b); }

static ball times(ball a, ball b) {
  ball found = {a.mid * b.mid, 0.0};
  double rad = fabs(a.mid) * b.rad + fabs(b.mid) * a.rad + a.rad * b.rad;
  if ((a.mid == 0 && a.rad == 0) || (b.mid == 0 && b.rad == 0)) return found;
  found.rad = (rad + DBL_EPSILON * fabs(found.mid) + DBL_MIN) * (1.0 + 8 * DBL_EPSILON) + DBL_MIN;
  return found;
}

static ball over(ball a, ball b) {
  double least = fabs(b.mid) - b.rad;
  ball found = {a.mid / b.mid, 0.0};
  double rad = (a.rad + fabs(found.mid) * b.rad + DBL_MIN) / (least * (1.0 - 4 * DBL_EPSILON));
  found.rad = (rad + DBL_EPSILON * fabs(found.mid) + DBL_MIN) * (1.0 + 8 * DBL_EPSILON);
  return found;
}

static range exp_range(range x) {
  range found = {exp(x.lower) * (1.0 - 4 * DBL_EPSILON), exp(x.upper) * (1.0 + 4 * DBL_EPSILON)};
  return found;
}

static ball exp_ball(ball x) { return balls(exp_range(bounds(x))); }

static range tanh_range(range x) {
  double lower = tanh(x.lower), upper = tanh(x.upper);
  lower -= 4 * DBL_EPSILON * fabs(lower);
  upper += 4 * DBL_EPSILON * fabs(upper);
  range found = {larger(lower, -1.0), smaller(upper, 1.0)};
  return found;
}

static range square_range(range x) {
  double a = x.lower * x.lower, b = x.upper * x.upper;
  range found = {smaller(a, b) * (1.0 - DBL_EPSILON), larger(a, b) * (1.0 + DBL_EPSILON)};
  if (x.lower < 0 && x.upper > 0) found.lower = 0.0;
  return found;
}

/* The mean of a signal and a memory, with a pole as weight; see lag.py. */
static range mixed(double pole, range signal, range memory) {
  return bounds(plus(times(minus(exact(1.0), exact(pole)), balls(signal)), times(exact(pole), balls(memory))));
}

/* The position of a pushed part; see play.py. */
static double clipped(double before, double s, double r) { return smaller(larger(before, s - r), s + r); }

/* Weights times balls, plus biases; the weight of row i and column k is w[i * down + k * right]. */
static void affine(int rows, int columns, const double *w, int down, int right, const double *b, const ball *x,
                   ball *y) {
  int terms = columns + 2;
  for (int i = 0; i < rows; i++) {
    double mid = b ? b[i] : 0.0, size = fabs(mid), rad = 0.0;
    for (int k = 0; k < columns; k++) {
      double weight = w[i * down + k * right];
      mid += weight * x[k].mid;
      size += fabs(weight * x[k].mid);
      rad += fabs(weight) * x[k].rad;
    }
    y[i].mid = mid;
    y[i].rad = (rad + terms * DBL_EPSILON * size + terms * DBL_MIN) * (1.0 + (terms + 8) * DBL_EPSILON);
  }
}

/* A part of a range that is cut into equal ones. */
static range part(range whole, int number, int parts) {
  double step = (whole.upper - whole.lower) / parts;
  range found = {whole.lower + number * step, number + 1 < parts ? whole.lower + (number + 1) * step : whole.upper};
  return found;
}

/* A Chebyshev series. */
static ball clenshaw(int n, const ball *coefficients, double at) {
  const ball x = exact(at);
  ball b1 = exact(0.0), b2 = b1;
  for (int k = n - 1; k > 0; k--) {
    const ball before = b1;
    b1 = minus(plus(coefficients[k], times(times(exact(2.0), x), b1)), b2);
    b2 = before;
  }
  return minus(plus(coefficients[0], times(x, b1)), b2);
}

/* Interpolation between knots, held at the ends. */
static double interpolated(double at, int n, const double *x, const double *y, const double *slope) {
  int k = 0;
  while (k < n - 2 && at >= x[k + 1]) k++;
  return at <= x[0] ? y[0] : at >= x[n - 1] ? y[n - 1] : slope[k] * (at - x[k]) + y[k];
}"""


def used_functions(code: str) -> str:
    """Return the types, and the functions that some code calls, in the order of their definition.

    Examples
    --------
    >>> "tanh_range" in used_functions("return exp_range(x);")
    False
    """
    kept = list[str]()
    for function in reversed(re.split(r"\n\n(?=static|/\*)", FUNCTIONS)):
        found = re.search(r"^static \w+ (\w+)\(", function, flags=re.MULTILINE)
        assert found is not None
        if re.search(rf"\b{found[1]}\(", "\n".join([code, *kept])):
            kept.append(function)
    return "\n\n".join([TYPES, *reversed(kept)])


def c_numbers(values: list[float]) -> str:
    """Return the initialiser of an array.

    Examples
    --------
    >>> c_numbers([0.1, 2.0])
    '{0.1, 2.0}'
    """
    return "{" + ", ".join(map(repr, values)) + "}"


def c_ball(found: Balls) -> str:
    """Return the initialiser of a constant ball.

    Examples
    --------
    >>> c_ball(Balls.exact(0.5))
    '{0.5, 0.0}'
    """
    return c_numbers([float(found.mid), float(found.rad)])


def c_range(name: str, found: Range) -> str:
    """Return the declaration of a constant range.

    Examples
    --------
    >>> c_range("poles", Range.exact(0.5))
    'const range poles = {0.5, 0.5};'
    """
    return f"const range {name} = {c_numbers([float(found.lower), float(found.upper)])};"
