"""The measured sets that `load_record` reads: files, columns, units, sampling times."""

from collections.abc import Mapping
from dataclasses import dataclass

from smid.data.channel import Channel
from smid.data.columns import split_unit


@dataclass(frozen=True)
class RecordPart:
    """One experiment within a file.

    ``columns`` are in the order of the channels ("0", "1", ... if the file has no header); ``start`` and ``stop`` are
    rows.
    """

    name: str
    columns: tuple[str, ...]
    start: int | None = None
    stop: int | None = None
    start_time: float = 0.0


@dataclass(frozen=True)
class RecordFile:
    """A file of a set with its MD5; ``parts`` is empty for a JSON file, which lists its runs itself."""

    path: str
    md5: str
    parts: tuple[RecordPart, ...]


@dataclass(frozen=True)
class RecordSpec:
    """A measured set; its channels are the inputs, then the outputs, then the others."""

    title: str
    channels: tuple[Channel, ...]
    n_inputs: int
    n_outputs: int
    sampling_time: float
    files: tuple[RecordFile, ...]
    n_init: int = 0


def _set(
    title: str,
    channels: str,
    sampling_time: float,
    files: tuple[RecordFile, ...],
    n_inputs: int = 1,
    n_outputs: int = 1,
    n_init: int = 0,
) -> RecordSpec:
    """Return a set whose channels are written as ``"name [unit], name [unit]"``."""
    named = tuple(Channel(*split_unit(channel)) for channel in channels.split(", "))
    return RecordSpec(title, named, n_inputs, n_outputs, sampling_time, files, n_init)


def _single(path: str, md5: str, *columns: str, start_time: float = 0.0) -> tuple[RecordFile, ...]:
    return (RecordFile(path, md5, (RecordPart("experiment", columns, start_time=start_time),)),)


_DAMPER_MD5 = (
    "6b9e36580d0c64ef3d9be5c0d2ce953d",
    "d3d5a6f7b92bf4e03e8a11cf565b243e",
    "5b4e71cb2074b4dcaade3bf494cf3068",
    "322e0caa939febbcafbdb93279ba6c30",
    "720f90ea0fcf571b9dcc523d3969dc0d",
    "0ccf42a085fe14a064e8777de7652a18",
    "f88d306aed45737b525a1468aaa5c033",
    "9825ba0c0e212f2d6900cfa7cc2c2ac7",
    "0cf47e85c40fd31c2ad71530cd638bb5",
    "8e3c7009d01b20386dbcf7b439af3ca0",
)

RECORDS: Mapping[str, RecordSpec] = {
    "daisy_hairdryer": _set(
        "laboratory hair dryer PT326 (DaISy 96-006)",
        "heater_voltage [V], air_temperature [V]",
        0.08,
        _single("dryer.dat", "966b8b32f248054988fdb82401c5fa09", "0", "1"),
    ),
    "box_jenkins_gas_furnace": _set(
        "gas furnace (Box and Jenkins, series J); the gas rate is centred",
        "gas_rate [cu ft/min], co2 [%]",
        9.0,
        _single("gas_furnace.csv", "4950b8ad0b048c453257747ea6e04078", "InputGasRate", "CO2"),
    ),
    "daisy_heating_system": _set(
        "halogen lamp and thermocouple under a steel plate (DaISy 99-001)",
        "lamp_voltage [V], temperature [degC]",
        2.0,
        _single("heating_system.dat", "4196267881e75c47b7ae441955d0babe", "1", "2"),
    ),
    "daisy_cstr": _set(
        "stirred tank reactor, simulated (DaISy 98-002)",
        "coolant_flow [l/min], concentration [mol/l], temperature [K]",
        6.0,
        _single("cstr.dat", "0546a0acb6cc40e89d48f23a2c8c1635", "1", "2", "3", start_time=6.0),
        n_outputs=2,
    ),
    "daisy_robot_arm": _set(
        "flexible robot arm (DaISy 96-009); units and sampling time are not published: 1 s is one sample",
        "reaction_torque, acceleration",
        1.0,
        _single("robot_arm.dat", "1bc4ef9ccea0e24c1a4a6f6e2ba05bb5", "0", "1"),
    ),
    "ced_prbs": _set(
        "coupled electric drives CE8, PRBS of three amplitudes (Wigren and Schoukens 2017)",
        "drive_voltage [V], pulley_speed [ticks/s]",
        0.02,
        (
            RecordFile(
                "ced_prbs.csv",
                "9d3efb7095aa34124cd75c10f388a492",
                tuple(RecordPart(f"prbs{k}", (f"u{k}", f"z{k}")) for k in (1, 2, 3)),
            ),
        ),
    ),
    "emps": _set(
        "electro-mechanical positioning system in closed loop (Janot, Gautier and Brunot 2019)",
        "controller_voltage [V], position [m], reference_position [m]",
        1e-3,
        _single("emps_train.csv", "6b3980a2003c21d0849220d5978cd8e0", "vir", "qm", "qg"),
    ),
    "cascaded_tanks": _set(
        "cascaded tanks with overflow (Schoukens and Noel 2017)",
        "pump_voltage [V], level [V]",
        4.0,
        (
            RecordFile(
                "dataBenchmark.csv",
                "5b595fcf42e0398d893ca971a2b45e7f",
                (RecordPart("estimation", ("uEst", "yEst")), RecordPart("validation", ("uVal", "yVal"))),
            ),
        ),
    ),
    "hydraulic_actuator": _set(
        "hydraulic crane actuator (Gunnarsson and Krus); normalised, sampling time as usual in papers",
        "valve, pressure, position",
        0.05,
        _single("actuator.csv", "901545dff9da5d8c7d5329c1300c194b", "u", "p", "x"),
    ),
    "mr_damper_labcontrol": _set(
        "shaking table with magnetorheological damper, ten shaker speeds (UTFPR Labcontrol)",
        "displacement [mm], velocity [mm/s], force [N]",
        0.01,
        tuple(
            RecordFile(f"ensaio_A.{k}.csv", md5, (RecordPart(f"A.{k}", ("disp_mm", "vel", "force_N")),))
            for k, md5 in enumerate(_DAMPER_MD5, start=1)
        ),
        n_inputs=2,
    ),
    "quarter_drone": _set(
        "quarter drone, one propeller on a pivoted arm, in closed loop (helonayala/sysid)",
        "thrust [%], angle [deg], reference_angle [deg]",
        0.01,
        tuple(
            RecordFile(f"{name}_closed_loop.csv", md5, (RecordPart(name, ("Controle_u", "Saida_y", "Referencia")),))
            for name, md5 in (
                ("multisine", "820f551ae41c515994005f3d6fd9356b"),
                ("semi_static", "6fe2e964bd8f3328137faddbdf191894"),
            )
        ),
    ),
    "servo_rate_limit": _set(
        "hobby servo, one hundred runs (mauicv/servo-sysid); drop runs end where the command ends",
        "commanded_angle [rad], angle [rad]",
        0.02,
        (RecordFile("dataset.json", "43544353f5c3c67f3765983be87b5a75", ()),),
    ),
    "silverbox": _set(
        "Silverbox, electronic Duffing oscillator (Wigren and Schoukens 2013), official parts of the record",
        "input_voltage [V], output_voltage [V]",
        2**14 / 1e7,
        (
            RecordFile(
                "SNLS80mV.csv",
                "682041335e23a99b6ee4612f2d36b6ba",
                (
                    RecordPart("multisine", ("V1", "V2"), 40650, 127400, 40650 * 2**14 / 1e7),
                    RecordPart("arrow", ("V1", "V2"), 100, 40575, 100 * 2**14 / 1e7),
                ),
            ),
        ),
        n_init=50,
    ),
}
"""The sets by the name of their folder."""
