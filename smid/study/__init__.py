"""Studies: one identification for each combination of record, sample size, noise bound, method and order.

The three phases of one identification, from the error bound to the validation, are in `smid.study.phases`.
"""

from smid.study.cell import Cell, Settings
from smid.study.cluster import dask_executor
from smid.study.errors import StudyError
from smid.study.order_study import order_study
from smid.study.outcome import Outcome, Status
from smid.study.phases import Phases, phases
from smid.study.study import Study

__all__ = [
    "Cell",
    "Outcome",
    "Phases",
    "Settings",
    "Status",
    "Study",
    "StudyError",
    "dask_executor",
    "order_study",
    "phases",
]
