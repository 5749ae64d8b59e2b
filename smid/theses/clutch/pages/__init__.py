"""A page for each chapter of the clutch thesis, with its own figures of merit beside those on our records."""

from smid.theses.clutch.pages.hammerstein_page import hammerstein_page
from smid.theses.clutch.pages.records_page import records_page
from smid.theses.clutch.pages.recursive_page import recursive_page
from smid.theses.clutch.pages.sensors_page import sensors_page

__all__ = ["hammerstein_page", "records_page", "recursive_page", "sensors_page"]
