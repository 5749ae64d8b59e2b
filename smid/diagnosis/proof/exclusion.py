"""The certificate that a model cannot explain a window of a record: a file that others can check.

The proof of a decision may be about a model with free coefficients, or in other coordinates than the model's, which a
certificate cannot state. So the window is proven once more in the parameters themselves.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from relaxations.deadline import TimeIsUp, time_limit
from relaxations.errors import ProblemError
from relaxations.search.enclosure import Reason
from smid.data import DataError, Dataset
from smid.data.window import Window, cut_all
from smid.diagnosis.proof.posed import posed
from smid.identification.certificates import write_certificates
from smid.identification.choice import encloser_for
from smid.identification.encloser import Settings
from smid.models import Model, ModelError
from smid.models.structure import is_clock


def write_exclusion(
    path: str | Path, model: Model, data: Dataset, window: Window, bounds: Mapping[str, float], seconds: float
) -> bool:
    """Prove that a model cannot explain a window, write the certificate, and return whether the time was enough."""
    # A clock is zero at the first sample.
    if any(is_clock(line) for line in model.lines):
        window = Window(window.experiment, 0, window.last)
    part = cut_all(data, [window])
    try:
        with time_limit(max(seconds, 1e-3)):
            model = posed(model, part, bounds)[0].model
            encloser = encloser_for(model, part, bounds, Settings(tolerance=1.0, witnesses=False), True, windows=False)
            found = encloser.enclose()
            if found.reason is not Reason.EMPTY:
                return False
            contents = encloser.certified(found).certificates
    except (ModelError, DataError, ProblemError, TimeIsUp):
        return False
    if contents:
        write_certificates(path, contents, model, data, bounds, [window], 0)
    return bool(contents)
