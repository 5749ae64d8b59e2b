"""The diagnosis of a blind case, kept in a file: proofs, and a look at a failure, need no second search."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.blind.cases import Case
from benchmarks.processor_time import in_processor_time

if TYPE_CHECKING:
    from smid.diagnosis import Diagnosis

__all__ = ["SECONDS", "diagnosed"]

SECONDS = 180.0
"""Processor time allowed for a diagnosis: what two cores have in the 90 s that are asked for."""


def diagnosed(case: Case, kind: str, folder: Path) -> Diagnosis:
    """Read the diagnosis of a case, or diagnose it in this process, within `SECONDS`, and keep that.

    Parameters
    ----------
    case : Case
    kind : str
        Where it says "withheld", the noise bound is not given.
    folder : Path
        It must exist, and has to be emptied when the diagnosis has changed.

    Returns
    -------
    Diagnosis
    """
    import smid  # here, so that drawing cases does not need the diagnosis

    samples = case.data.experiments[0].n_samples
    file = folder / f"{kind.replace(', ', '_').replace(' ', '_')}_{case.seed}_{samples}.pickle"
    if file.exists():
        kept: Diagnosis = pickle.loads(file.read_bytes())
        return kept
    bound = None if "withheld" in kind else case.noise_bound
    with in_processor_time():
        found = smid.diagnose(case.model, case.data, bound, certify=False, workers=1, seconds=SECONDS)
    whole = file.with_suffix(".part")  # a file that was begun only is never read
    whole.write_bytes(pickle.dumps(found))
    whole.rename(file)
    return found
