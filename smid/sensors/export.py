"""A sensor as C99: no allocation, no other state than a struct, and the same operations at each update.

The C has the steps of the sensor's program in the same order, so its results are those of `predict` but for the last
digits of tanh and exp. A copy of the struct saves the state. Loops have fixed bounds; the order of the median is the
longest one.
"""

from __future__ import annotations

import re
from pathlib import Path

from smid.data import Channel, DataError
from smid.display.versions import versions
from smid.models import ModelError
from smid.sensors.bounded import BoundedSensor
from smid.sensors.program import Code, Program
from smid.sensors.sensor import VirtualSensor, trained
from smid.sensors.trained_on import TrainedOn

__all__ = ["export_c"]

_HEADER = """\
/* {title}, written by smid {version}.
 *
 * Call {name}_reset once, then {name}_update every {interval!r} s.
 *   u: {inputs}
 *   y: {output}{ends}
 * {name}_update returns 0; or 1 where a sample is not finite: then y and the state stay the same.
 * The sensor was trained with {ranges}.
 */
#ifndef {guard}
#define {guard}

typedef struct {{
  int started;
  double memory[{size}];
}} {name}_state;

void {name}_reset({name}_state *state);
int {name}_update({name}_state *state, const double u[{n_inputs}], double y[{n_outputs}]);

#endif
"""

_SOURCE = """\
#include "{file}.h"

#include <math.h>

{constants}

void {name}_reset({name}_state *state) {{
  state->started = 0;
  for (int k = 0; k < {size}; k++) state->memory[k] = 0.0;
}}

int {name}_update({name}_state *state, const double u[{n_inputs}], double y[{n_outputs}]) {{
  for (int k = 0; k < {n_inputs}; k++)
    if (!isfinite(u[k])) return 1;
  const double {inputs};
  double {signals};
{steps}
  state->started = 1;
{results}
  return 0;
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
    if found := re.search(r"(?<![\w.])-?(inf|nan)\b", code):
        raise ModelError(f"a number of the sensor is {found[0]}, which C cannot hold: train it again")
    source.write_text(code, encoding="utf-8")
    beside = source.with_suffix(".h")
    beside.write_text(header, encoding="utf-8")
    return source, beside


def _texts(name: str, kind: str, told: TrainedOn, program: Program) -> tuple[str, str]:
    """Return the header and the source."""
    variables = {signal.name: f"u{k}" for k, signal in enumerate(told.inputs)}
    variables |= {step.signal: step.signal for step in program.steps}
    codes = [step.block.code(step.signal, [variables[name] for name in step.reads]) for step in program.steps]
    parts, size = list[str](), 0
    for code in codes:
        parts.append(_step(code, size))
        size += code.size
    results = [f"y[0] = {program.output};"]
    if program.half_width is not None:
        results += [f"y[{k}] = {program.output} {sign} {program.half_width};" for k, sign in ((1, "-"), (2, "+"))]
    unit = f" [{told.output.unit}]" * bool(told.output.unit)
    filled = {
        "title": f"Virtual sensor {kind} of {told.output.name}",
        "version": versions()["smid"],
        "file": name,
        "name": name,
        "guard": f"{name.upper()}_H",
        "interval": told.sampling_time,
        "size": max(1, size),
        "n_inputs": len(told.inputs),
        "n_outputs": len(results),
        "output": f"{told.output.name}{unit}",
        "ends": ", lower, upper" * (program.half_width is not None),
        "ranges": "; ".join(f"{s.name} from {s.lower:g} to {s.upper:g} {s.unit}".rstrip() for s in told.inputs),
    }
    shown = ", ".join(str(Channel(s.name, s.unit)) for s in told.inputs)
    header = _HEADER.format(**filled, inputs=shown)
    source = _SOURCE.format(
        **filled,
        inputs=", ".join(f"u{k} = u[{k}]" for k in range(len(told.inputs))),
        signals=", ".join(step.signal for step in program.steps),
        constants="\n".join(code.constants for code in codes if code.constants),
        steps="\n".join(parts),
        results="\n".join(f"  {line}" for line in results),
    )
    return header.replace("*/", "* /", header.count("*/") - 1), source


def _step(code: Code, offset: int) -> str:
    """Return the statements of a step, with its part of the memory."""
    lines = code.update.splitlines()
    if code.size:
        start = f"if (!state->started) {{ {code.rest} }}"
        lines = ["{", f"  double *m = state->memory + {offset};", f"  {start}", *(f"  {line}" for line in lines), "}"]
    return "\n".join(f"  {line}" for line in lines)
