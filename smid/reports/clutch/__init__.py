"""A page for each chapter of the clutch thesis, with its own figures of merit beside those on our records."""

from smid.reports.clutch.hammerstein_page import hammerstein_page
from smid.reports.clutch.records_page import records_page
from smid.reports.clutch.recursive_page import recursive_page
from smid.reports.clutch.sensors_page import sensors_page

__all__ = ["hammerstein_page", "records_page", "recursive_page", "sensors_page"]
