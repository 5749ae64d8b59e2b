"""Prove a name on a measured record: ``python -m benchmarks.measured_proof FOLDER``.

FOLDER holds the records, one folder each; they are not part of the project. A hobby servo (set ``servo_rate_limit``)
turns no faster than some speed. Four of its hundred runs are diagnosed with a lag and a delay of three samples as base
model and six effects to choose from, within a noise bound that the extended model keeps on every sample that may be
fitted. Then the base model, the extended one and the rivals are decided. The certificates of what is excluded are
checked by the program that does not import the rest.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

from benchmarks.machine import described
from benchmarks.processor_time import in_processor_time
from smid import OutputError, diagnose, report
from smid.data import load_record
from smid.diagnosis import certify_name, prove_name
from smid.fitting.binding import bind

RUNS = ("square_77", "chirp_0", "prbs_32", "triangle_65")
EFFECTS = ("rate_limit", "input_saturation", "output_saturation", "input_bias", "gain", "extra_lag")
NOISE_BOUND = 0.04  # rad


def main() -> None:
    """Diagnose the record, prove the name, check the certificates, and write the page."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.measured_proof", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("folder", type=Path, help="folder of the measured records")
    parser.add_argument("--seconds", type=float, default=300.0, help="processor time of the proofs, and of the files")
    parser.add_argument("--certificates", type=Path, default=Path(".cache/measured_proof"))
    parser.add_argument("--report", type=Path, help="HTML page to write")
    given = parser.parse_args()

    data = load_record("servo_rate_limit", given.folder).select(RUNS)
    model = bind(OutputError(1, 0, delay=3, offset=True), data)
    with in_processor_time():
        found = diagnose(model, data, NOISE_BOUND, effects=EFFECTS, workers=1)
        print(found, flush=True)
        found = prove_name(found, NOISE_BOUND, given.seconds)
        print(found.name_proof, flush=True)
        found = certify_name(found, NOISE_BOUND, given.certificates, given.seconds)
    assert found.name_proof is not None
    if given.report:
        report(found, given.report)
    for name, decision in found.name_proof.decisions:
        if decision.certificate:
            checked = subprocess.run(
                [sys.executable, "-m", "relaxations.check", decision.certificate], capture_output=True, text=True
            )
            said = (checked.stdout or checked.stderr).strip().splitlines()
            print(f"{name}: {said[0] if said else 'the checker says nothing'}", flush=True)
    print(described(("numpy", "scipy")))


if __name__ == "__main__":
    main()
