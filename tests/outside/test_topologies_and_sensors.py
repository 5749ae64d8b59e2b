"""Another package adds a topology and a virtual sensor without a change of smid."""

import textwrap
from dataclasses import dataclass, replace

import numpy as np
import pytest

from smid import load
from smid.data import DataError
from smid.data.bundled import load_clutch
from smid.hybrid import (
    EXTRA,
    SIMPLE,
    BackCouplingWarning,
    HybridModel,
    NeuralTerm,
    Placed,
    Topology,
    estimate,
    learned_response,
    network_alone,
    required,
)
from smid.hybrid.hybrid_model import HYBRID, measure_instead, output_measurement
from smid.models import ModelError, Reactor, signal, t
from smid.sensors import (
    CFPX,
    Block,
    DeadZone,
    Program,
    TrainedOn,
    VirtualSensor,
    save_sensor,
    sensor_from_dict,
    sensor_to_dict,
)
from smid.theses.hybrid.reactor import reactor_record


class Subtracting(Topology):
    """The output of the network is subtracted from that of the first principles."""

    name = "subtracting"

    @staticmethod
    def learned(plant, white):
        return white - plant

    @staticmethod
    def white_output(amplitude):  # noqa: ARG004
        return 0.0


def subtracting(white, couplings, hidden=()):
    shown = output_measurement(white, None)
    w, hybrid = signal(shown.signal)[t], signal(HYBRID)[t]
    term = NeuralTerm("N", couplings.samples([signal(item) for item in white.inputs], w - hybrid), hidden)
    model = measure_instead(white.with_line(HYBRID, w - term.expression, term.parameters), shown, HYBRID)
    return HybridModel(model, white, (Placed(term, Subtracting.name, couplings),))


@dataclass(frozen=True)
class Line:
    """A part of a sensor that is a class of its own."""

    slope: float
    offset: float


@dataclass(frozen=True, eq=False)
class StraightSensor(VirtualSensor):
    """Position as a straight line of the pressure, the mean of some samples."""

    window: tuple[int, ...] = (1, 2)
    line: Line | None = None
    trace: np.ndarray | None = None
    output: str = "position"
    trained_on: TrainedOn | None = None

    @property
    def channels(self):
        return ("pressure",)

    @property
    def n_parameters(self):
        return 2

    def fit(self, data, *, seed, starts=1, progress=None):  # noqa: ARG002
        slope, offset = np.polyfit(data.stacked("pressure"), data.stacked("position"), 1).tolist()
        return replace(
            self,
            line=Line(slope, offset),
            trace=np.arange(3.0),
            trained_on=TrainedOn.of(data, self.channels, self.output),
        )

    def program(self):
        return Program().then(StraightBlock(self.line), "pressure")


@dataclass(frozen=True)
class StraightBlock(Block):
    line: Line

    def rest(self, first):  # noqa: ARG002
        return np.zeros(0)

    def advance(self, signals, memory):
        return self.line.slope * signals[0] + self.line.offset, memory


def test_the_analysis_knows_a_topology_of_another_package():
    found = required(Reactor(2.0), Reactor(4.0), "subtracting", 1.0)
    parallel = required(Reactor(2.0), Reactor(4.0), "parallel", 1.0)
    assert (found.transfer + parallel.transfer).simplify() == 0
    assert found.couplings == parallel.couplings
    with pytest.raises(ModelError, match=r"unknown topology 'subtractin', did you mean 'subtracting'"):
        required(Reactor(2.0), Reactor(4.0), "subtractin", 1.0)


def test_a_model_of_such_a_topology_is_estimated_and_checked_against_the_plant():
    data = reactor_record("time_constant")
    hybrid = subtracting(Reactor(4.0), EXTRA)
    with pytest.warns(BackCouplingWarning):
        found = estimate(subtracting(Reactor(4.0), SIMPLE), data, plant=Reactor(2.0), starts=1, iterations=2, seed=1)
    assert found.to_dict()["networks"][0]["topology"] == "subtracting"
    weights = {parameter.name: 0.1 for parameter in hybrid.term.parameters}
    weighted = replace(subtracting(Reactor(4.0, sampling_time=1.0), EXTRA))
    weighted = replace(weighted, model=weighted.model.with_values(weights))
    assert network_alone(weighted).output_channels == ("y",)
    assert np.isfinite(learned_response(weighted, [0.0], count=4, amplitude=1.0)).all()


def test_a_sensor_of_another_package_is_written_and_read(tmp_path):
    data = load_clutch("20C_ramp_a")
    for sensor in (StraightSensor(), DeadZone(StraightSensor())):
        trained = sensor.fit(data, seed=1)
        save_sensor(trained, tmp_path / "sensor.json")
        again = load(tmp_path / "sensor.json")
        assert type(again) is type(sensor)
        assert (again.predict(data).position[0] == trained.predict(data).position[0]).all()
    again = sensor_from_dict(sensor_to_dict(StraightSensor().fit(data, seed=1)))
    assert again.window == (1, 2)
    assert isinstance(again.line, Line)
    assert again.trace.tolist() == [0.0, 1.0, 2.0]
    assert again.stream().update(0.0, pressure=1.0).position == pytest.approx(again.line.slope + again.line.offset)


def test_a_name_that_is_taken_is_refused():
    taken = type("PX", (StraightSensor,), {})
    with pytest.raises(DataError, match="two classes of sensors have the name PX"):
        sensor_to_dict(taken())


def test_an_entry_point_is_found_without_an_import(tmp_path, monkeypatch):
    (tmp_path / "far_away.py").write_text(
        textwrap.dedent(
            """
            from dataclasses import dataclass
            from smid.hybrid import Topology
            from smid.sensors import CFPX

            @dataclass(frozen=True, eq=False)
            class FarSensor(CFPX):
                far: float = 0.0

            class FarTopology(Topology):
                name = "far"

                @staticmethod
                def learned(plant, white):
                    return 2 * plant / white
            """
        )
    )
    info = tmp_path / "far_away-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: far-away\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(
        "[smid.sensors]\nFarSensor = far_away:FarSensor\n[smid.topologies]\nfar = far_away:FarTopology\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    sensor = sensor_from_dict({**sensor_to_dict(CFPX(3)), "kind": "FarSensor", "far": 2.5})
    assert (type(sensor).__name__, sensor.order, sensor.far) == ("FarSensor", 3, 2.5)
    assert required(Reactor(2.0), Reactor(2.0), "far", 1.0).transfer == 2
