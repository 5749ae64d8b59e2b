"""Studies: one identification for each combination of record, sample size, noise bound, method and order."""

from smid.study.cell import Cell, Settings
from smid.study.cluster import dask_executor
from smid.study.errors import StudyError
from smid.study.order_study import order_study
from smid.study.outcome import Outcome, Status
from smid.study.study import Study

__all__ = ["Cell", "Outcome", "Settings", "Status", "Study", "StudyError", "dask_executor", "order_study"]
