"""Certificates of the models that the proof of a name excludes: files that others can check.

The proof of a decision may be about a model with free coefficients, or in other coordinates than the model's, which a
certificate cannot state. So the samples are proven once more in the parameters themselves.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from relaxations.deadline import Progress, check_seconds, time_limit
from relaxations.search.enclosure import Reason
from smid.data import Dataset
from smid.data.window import Window, cut_all
from smid.diagnosis.diagnosis import Diagnosis
from smid.diagnosis.proof.posed import posed
from smid.diagnosis.proof.reached import spans
from smid.feasible.feasible_set import check_noise_bound
from smid.identification.certificates import write_certificates
from smid.identification.choice import encloser_for
from smid.identification.encloser import Settings
from smid.models import Model, ModelError
from smid.models.structure import is_clock


def certify_name(
    diagnosis: Diagnosis,
    noise_bound: float | Mapping[str, float],
    folder: str | Path,
    seconds: float = 60.0,
    progress: Progress | None = None,
) -> Diagnosis:
    """Write a certificate of each model that the proof of the name excludes; return the diagnosis that names the files.

    The files are ``base.json`` and one for each rival, called by its effect. :func:`smid.verify` checks them.

    Parameters
    ----------
    diagnosis
        As :func:`prove_name` returns it.
    noise_bound
        In the channel's unit, as for the proof.
    folder
        Is made where it is not there. Files of another proof in it are removed.
    seconds
        Time allowed for all files, wall clock. What takes longer has no file.
    progress
        Called with a line of text now and then.

    Raises
    ------
    ModelError
        For a diagnosis without a proof of its name, or a bad noise bound.
    ProblemError
        For a time that is not positive.
    OSError
        For a folder or a file that cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> from smid import verify
    >>> from smid.diagnosis import diagnose, prove_name
    >>> from smid.models import OutputError, simulate
    >>> u = np.random.default_rng(0).uniform(-1, 1, 300)
    >>> y = simulate(OutputError(), {"u": u}, {"a1": -0.8, "b0": 1.0})["y"] + 0.5
    >>> y = y + np.random.default_rng(1).uniform(-0.05, 0.05, 300)
    >>> data = Dataset.from_arrays(input={"u": u}, output={"y": y}, sampling_time=1.0)
    >>> found = prove_name(diagnose(OutputError(), data, 0.05, effects=["sensor_bias"], workers=1), 0.05)
    >>> certified = certify_name(found, 0.05, tempfile.mkdtemp())
    >>> verify(certified.name_proof.base.certificate, data).empty
    True
    """
    check_seconds(seconds)
    proof = diagnosis.name_proof
    if proof is None:
        raise ModelError("nothing is proven of the name, so there is nothing to write: call prove_name first")
    bounds = check_noise_bound(diagnosis.base, noise_bound, None)
    number = [run.name for run in diagnosis.data.experiments].index(proof.experiment)
    against = {r.effect: r.model for cause in diagnosis.causes for r in cause.rivals if cause.effect == proof.against}
    models, decisions = {"base": diagnosis.base, **against}, {"base": proof.base, **proof.rivals}
    files = {name: Path(folder) / f"{name}.json" for name in decisions}
    Path(folder).mkdir(parents=True, exist_ok=True)
    for file in files.values():
        file.unlink(missing_ok=True)
    excluded = [name for name, found in decisions.items() if found.excluded]
    end = time.monotonic() + seconds
    for done, name in enumerate(excluded):
        model, found = models[name], decisions[name]
        assert model is not None, "what acts on the noise is never excluded"
        if progress:
            progress(f"writing {files[name]}")
        window, share = Window(number, found.first, found.last), (end - time.monotonic()) / (len(excluded) - done)
        if write_exclusion(files[name], model, diagnosis.data, window, bounds, share):
            decisions[name] = replace(found, certificate=str(files[name]))
    base = decisions.pop("base")
    return replace(diagnosis, name_proof=replace(proof, base=base, rivals=decisions))


def write_exclusion(
    path: Path, model: Model, data: Dataset, window: Window, bounds: Mapping[str, float], seconds: float
) -> bool:
    """Prove that a model cannot explain a window, write the certificate, and return whether the time was enough."""
    # A clock is zero at the first sample.
    if any(is_clock(line) for line in model.lines):
        window = Window(window.experiment, 0, window.last)
    part = cut_all(data, [window])
    try:
        with time_limit(max(seconds, 1e-3)):
            model = posed(model, part, bounds, spans(data)).record.model
            encloser = encloser_for(model, part, bounds, Settings(tolerance=1.0, witnesses=False), True, windows=False)
            found = encloser.enclose()
            contents = encloser.certified(found).certificates if found.reason is Reason.EMPTY else ()
    except Exception:  # a proof that fails costs only its file
        return False
    if contents:
        write_certificates(path, contents, model, data, bounds, [window], 0)
    return bool(contents)
