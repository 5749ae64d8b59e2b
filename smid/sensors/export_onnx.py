"""A sensor as an ONNX model of one update, whose memory is an input and an output of fixed size.

Each block states its update with `smid.sensors.tensor.Tensor`. All numbers are doubles, so the results are those of
`predict` but for the last digits. Lost samples are not bridged: the graph has no place for a window of past instants.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from relaxations.writing import write_bytes
from smid.data import Channel, DataError
from smid.display.versions import versions
from smid.models import ModelError
from smid.sensors.bounded import BoundedSensor
from smid.sensors.sensor import VirtualSensor, trained
from smid.sensors.tensor import Graph, Tensor

__all__ = ["export_onnx"]

OPSET = 17
IR_VERSION = 8  # of the same release of ONNX as the opset


def export_onnx(sensor: VirtualSensor | BoundedSensor, path: str | Path) -> Path:
    """Write a trained sensor as an ONNX model, and return the path.

    The inputs are ``u``, the samples of an instant in the order that the description of the model states, and
    ``memory``: NaN in the first update, then the output ``next_memory`` of the update before. The output ``y`` is the
    computed output; with an error bound, then the lower and the upper end of its interval.

    Parameters
    ----------
    path
        Ends in ``.onnx``.

    Raises
    ------
    DataError
        If the path does not end in ``.onnx``.
    ModelError
        If the sensor is not trained, ONNX cannot hold it, or the package onnx is missing.

    Examples
    --------
    >>> import tempfile
    >>> from smid.data.bundled import load_clutch
    >>> from smid.sensors import CFPX
    >>> sensor = CFPX(5).fit(load_clutch("20C_step_a"), seed=1)
    >>> export_onnx(sensor, Path(tempfile.mkdtemp()) / "position.onnx").name
    'position.onnx'
    """
    if Path(path).suffix != ".onnx":
        raise DataError(f"{path} is no name of an ONNX file: give one that ends in .onnx, such as sensor.onnx")
    told, program = trained(sensor.trained_on, sensor), sensor.program()
    program.require_causal()
    try:
        from onnx import TensorProto, checker, helper, numpy_helper
    except ModuleNotFoundError:
        raise ModelError('the package onnx is missing: pip install "smid[onnx]"') from None
    graph = Graph()
    u, memory = Tensor(graph, "u"), Tensor(graph, "memory")
    signals = {signal.name: u[k : k + 1] for k, signal in enumerate(told.inputs)}
    # A step of the lower ends of the inputs tells the size of each memory.
    _, lengths = program.advance({signal.name: np.array([signal.lower]) for signal in told.inputs})
    after, start = list[Tensor](), 0
    for step in program.steps:
        size = lengths[step.signal].size
        part = memory[start : start + size]
        signals[step.signal], renewed = step.block.onnx([signals[name] for name in step.reads], part)
        if size:
            after.append(renewed)
        start += size
    value = signals[program.output]
    half = None if program.half_width is None else signals[program.half_width]
    results = {"y": graph.join(value, *([] if half is None else [value - half, value + half]))}
    # A sensor without memory has one number of it that is never read.
    results["next_memory"] = graph.join(*after) if after else memory * 1.0
    nodes = [helper.make_node(operator, list(reads), [name], **more) for operator, reads, name, more in graph.nodes]
    nodes += [helper.make_node("Identity", [tensor.name], [name]) for name, tensor in results.items()]
    shapes = {
        "u": len(told.inputs),
        "memory": max(1, start),
        "y": 1 if half is None else 3,
        "next_memory": max(1, start),
    }
    u_info, memory_info, y_info, next_info = (
        helper.make_tensor_value_info(name, TensorProto.DOUBLE, [size]) for name, size in shapes.items()
    )
    constants = [numpy_helper.from_array(array, name) for name, array in graph.constants.items()]
    body = helper.make_graph(nodes, "sensor", [u_info, memory_info], [y_info, next_info], constants)
    model = helper.make_model(
        body, opset_imports=[helper.make_opsetid("", OPSET)], producer_name="smid", producer_version=versions()["smid"]
    )
    model.ir_version = IR_VERSION
    inputs = ", ".join(str(Channel(s.name, s.unit)) for s in told.inputs)
    model.doc_string = (
        f"Virtual sensor of {Channel(told.output.name, told.output.unit)}, one update every {told.sampling_time!r} s. "
        f"u: {inputs}. memory: NaN in the first update."
    )
    checker.check_model(model)
    return write_bytes(path, model.SerializeToString())
