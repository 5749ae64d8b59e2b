"""A sensor as C99: no allocation, no other state than a struct, and a bounded number of operations at each update.

The C has the steps of the sensor's program in the same order, so its results are those of `predict` but for the last
digits of tanh and exp. Lost samples are bridged as `smid.sensors.stream` does it: their ranges go through the program,
and the instants since the last complete one, at most 20, are run again with each sample. A copy of the struct saves the
state.
"""

from __future__ import annotations

import re
from pathlib import Path

from relaxations.writing import check_writable, write_text
from smid.data import Channel, DataError
from smid.display.versions import versions
from smid.models import ModelError
from smid.sensors.bounded import BoundedSensor
from smid.sensors.c_ranges import c_numbers, used_functions
from smid.sensors.program import Code, Program
from smid.sensors.sensor import VirtualSensor, trained
from smid.sensors.trained_on import FASTER, LOST, SLACK, Signal, TrainedOn

__all__ = ["export_c"]

_HEADER = """\
/* {title}, written by smid {version}.
 *
 * Call {name}_reset once, then {name}_update every {interval!r} s, also where a sample is lost or late.
 *   u: {inputs}; NAN where the sample is lost or late
 *   y: {output}, and the lower and the upper end of its interval
 * {name}_update returns
 *   0  where all samples are known;
 *   2  where a lost sample still widens the interval;
 *   1  where a sample is infinite, or one of the first is lost: then y and the state stay the same.
 * The sensor was trained with {ranges}.
 */
#ifndef {guard}
#define {guard}

#ifdef __FAST_MATH__
#error "lost samples are NAN, and intervals are rounded: compile without -ffast-math"
#endif

typedef struct {{
  int started, bridged, age[{n_inputs}];
  double held[{n_inputs}], memory[{size}], low[{size}], high[{size}];
}} {name}_instant;

typedef struct {{
  {name}_instant start;
  int length;
  double window[{longest}][{n_inputs}];
}} {name}_state;

void {name}_reset({name}_state *state);
int {name}_update({name}_state *state, const double u[{n_inputs}], double y[3]);

#endif
"""

_SOURCE = """\
#include "{file}.h"

#include <float.h>
#include <math.h>
#include <stddef.h>

{functions}

{constants}

/* How far a lost sample may be from known ones; see trained_on.py. */
typedef struct {{
  double lower, upper;
  int n_travel, n_bend;
  double travel[{lost}], bend[{lost}][2];
}} channel;

static const channel channels[{n_inputs}] = {{
{channels}}};

static range after(const channel *c, double value, int age) {{
  range whole = {{smaller(c->lower, value), larger(c->upper, value)}};
  if (age > c->n_travel) return whole;
  range near = {{value - c->travel[age - 1], value + c->travel[age - 1]}};
  return meet(near, whole);
}}

/* The sample of an instant in the window: its value, its range, and what is held for the next instants. */
static double sample({name}_instant *now, const {name}_state *state, int place, int k, range *known) {{
  double value = state->window[place][k];
  int next = place + 1;
  if (!isnan(value)) {{
    known->lower = known->upper = now->held[k] = value;
    now->age[k] = 0;
    return value;
  }}
  value = now->held[k];
  const int age = ++now->age[k];
  *known = after(&channels[k], value, age);
  while (next < state->length && isnan(state->window[next][k])) next++;
  if (next == state->length) return value;
  const double later = state->window[next][k];
  const int left = next - place;
  const double line = value + (later - value) * age / (age + left);
  *known = meet(*known, after(&channels[k], later, left));
  if (age + left - 1 <= channels[k].n_bend) {{
    const double *bend = channels[k].bend[age + left - 2];
    const double reach = {faster!r} * (bend[0] + bend[1] * fabs(later - value));
    range near = {{line - reach, line + reach}};
    *known = meet(*known, near);
  }}
  return line;
}}

/* One instant; returns whether a lost sample widens its interval. */
static int advance({name}_instant *now, const {name}_state *state, int place, double y[3]) {{
  double u[{n_inputs}], *m = now->memory;
  range known[{n_inputs}];
  int lost = now->bridged;
  for (int k = 0; k < {n_inputs}; k++) {{
    u[k] = sample(now, state, place, k, &known[k]);
    lost |= known[k].upper > known[k].lower;
  }}
  if (lost && !now->bridged)
    for (int k = 0; k < {size}; k++) now->low[k] = now->high[k] = now->memory[k];
  const double {inputs};
  double {signals};
{steps}
  (void) m;
  now->started = 1;
  y[0] = {value};
  y[1] = {value} - {half};
  y[2] = {value} + {half};
  now->bridged = 0;
  if (!lost) return 0;
  double *low = now->low, *high = now->high;
  const range {range_inputs};
  range {range_signals};
{range_steps}
  (void) low;
  (void) high;
  y[1] = smaller(y[1], r{value}.lower - {range_half});
  y[2] = larger(y[2], r{value}.upper + {range_half});
  for (int k = 0; k < {size}; k++)
    if (now->high[k] - now->low[k] > 1e-12 * (1.0 + fabs(now->low[k]))) now->bridged = 1;
  return 1;
}}

void {name}_reset({name}_state *state) {{
  static const {name}_state empty;
  *state = empty;
}}

int {name}_update({name}_state *state, const double u[{n_inputs}], double y[3]) {{
  for (int k = 0; k < {n_inputs}; k++)
    if (isinf(u[k]) || (isnan(u[k]) && !state->start.started)) return 1;
  {name}_instant now = state->start;
  int found = 0, last = 0;
  for (int k = 0; k < {n_inputs}; k++) state->window[state->length][k] = u[k];
  state->length++;
  for (int place = 0; place < state->length; place++)
    for (int k = 0; k < {n_inputs}; k++)
      if (isnan(state->window[place][k])) last = place + 1;
  /* The window begins after the last complete instant, and not too long ago. */
  const int begin = last < state->length ? state->length : state->length > {lost} ? state->length - {lost} : 0;
  for (int place = 0; place < state->length; place++) {{
    found = advance(&now, state, place, y);
    if (place + 1 == begin) state->start = now;
  }}
  state->length -= begin;
  for (int place = 0; place < state->length; place++)
    for (int k = 0; k < {n_inputs}; k++) state->window[place][k] = state->window[place + begin][k];
  return found ? 2 : 0;
}}
"""


def export_c(sensor: VirtualSensor | BoundedSensor, path: str | Path) -> tuple[Path, Path]:
    """Write a trained sensor as C99, and return the paths of the source and of its header.

    Parameters
    ----------
    path
        Ends in ``.c``; the header is beside it. Names of functions begin with the name of the file.

    Raises
    ------
    DataError
        If the path does not end in ``.c``, or its name cannot be one of C.
    ModelError
        If the sensor is not trained, or C cannot hold it: it needs future samples, or a number is not finite.

    Examples
    --------
    >>> import tempfile
    >>> from smid.data.bundled import load_clutch
    >>> from smid.sensors import CFPX
    >>> sensor = CFPX(5).fit(load_clutch("20C_step_a"), seed=1)
    >>> source, header = export_c(sensor, Path(tempfile.mkdtemp()) / "position.c")
    >>> "int position_update(" in source.read_text(), header.name
    (True, 'position.h')
    """
    source = Path(path)
    name = source.stem
    if source.suffix != ".c":
        raise DataError(f"{path} is no name of a C file: give one that ends in .c, such as sensor.c")
    if not re.fullmatch(r"[A-Za-z]\w*", name, flags=re.ASCII):
        raise DataError(f"{name!r} cannot begin the name of a C function: take letters, digits and underscores")
    told, program = trained(sensor.trained_on, sensor), sensor.program()
    program.require_causal()
    inner = sensor.sensor if isinstance(sensor, BoundedSensor) else sensor
    header, code = _texts(name, type(inner).__name__, told, program)
    beside = source.with_suffix(".h")
    check_writable(beside)
    return write_text(source, code), write_text(beside, header)


def _texts(name: str, kind: str, told: TrainedOn, program: Program) -> tuple[str, str]:
    """Return the header and the source."""
    variables = {signal.name: f"u{k}" for k, signal in enumerate(told.inputs)}
    variables |= {step.signal: step.signal for step in program.steps}
    codes, ranges = list[Code](), list[Code]()
    for step in program.steps:
        reads = [variables[name] for name in step.reads]
        codes.append(step.block.code(step.signal, reads))
        if found := re.search(r"(?<![\w.])-?(inf|nan)\b", str(codes[-1])):
            raise ModelError(f"a number of the sensor is {found[0]}, which C cannot hold: train it again")
        ranges.append(step.block.range_code(f"r{step.signal}", [f"r{read}" for read in reads]))
    sizes = [code.size for code in codes]
    starts = [sum(sizes[:k]) for k in range(len(sizes))]
    value, half = variables[program.output], program.half_width
    numbers = range(len(told.inputs))
    unit = f" [{told.output.unit}]" * bool(told.output.unit)
    filled = {
        "title": f"Virtual sensor {kind} of {told.output.name}",
        "version": versions()["smid"],
        "file": name,
        "name": name,
        "guard": f"{name.upper()}_H",
        "interval": told.sampling_time,
        "size": max(1, sum(sizes)),
        "n_inputs": len(told.inputs),
        "output": f"{told.output.name}{unit}",
        "ranges": "; ".join(f"{s.name} from {s.lower:g} to {s.upper:g} {s.unit}".rstrip() for s in told.inputs),
        "longest": LOST + 1,
        "lost": LOST,
    }
    shown = ", ".join(str(Channel(s.name, s.unit)) for s in told.inputs)
    header = _HEADER.format(**filled, inputs=shown)
    constants = [code.constants for pair in zip(codes, ranges, strict=True) for code in pair if code.constants]
    source = _SOURCE.format(
        **filled,
        faster=FASTER,
        functions="{functions}",
        constants="\n".join(constants),
        channels=",\n".join(map(_channel, told.inputs)),
        inputs=", ".join(f"u{k} = u[{k}]" for k in numbers),
        signals=", ".join(step.signal for step in program.steps),
        steps="\n".join(map(_step, codes, starts)),
        value=value,
        half=half or "0.0",
        range_inputs=", ".join(f"ru{k} = known[{k}]" for k in numbers),
        range_signals=", ".join(f"r{step.signal}" for step in program.steps),
        range_steps="\n".join(map(_range_step, codes, ranges, starts)),
        range_half=f"r{half}.upper" if half else "0.0",
    )
    source = source.replace("{functions}", used_functions(source), 1)
    return header.replace("*/", "* /", header.count("*/") - 1), source


def _channel(signal: Signal) -> str:
    """Return the initialiser of a channel."""
    slack = SLACK * (signal.upper - signal.lower)
    travel = [FASTER * reach for reach in signal.travel] or [0.0]
    bend = [c_numbers(list(pair)) for pair in signal.bend] or ["{0.0, 0.0}"]
    sizes = f"{len(signal.travel)}, {len(signal.bend)}"
    return (
        f"  {{{signal.lower - slack!r}, {signal.upper + slack!r}, {sizes},\n   {c_numbers(travel)},\n"
        f"   {{{', '.join(bend)}}}}}"
    )


def _step(code: Code, offset: int) -> str:
    """Return the statements of a step, with its part of the memory."""
    lines = code.update.splitlines()
    if code.size:
        lines = [f"m = now->memory + {offset};", f"if (!now->started) {{ {code.rest} }}", *lines]
    return "\n".join(f"  {line}" for line in lines)


def _range_step(code: Code, ranges: Code, offset: int) -> str:
    """Return the statements of a step for ranges, with both ends of its part of the memory."""
    lines = ranges.update.splitlines()
    if code.size:
        lines = [f"low = now->low + {offset};", f"high = now->high + {offset};", *lines]
    return "\n".join(f"  {line}" for line in lines)
