"""Reports: figures, and one self-contained page as HTML, PDF, Markdown or JSON."""

from relaxations.writing import check_writable, write_text
from smid.display.versions import versions
from smid.reports.estimate_page import data_report
from smid.reports.formats import check_report
from smid.reports.json_schemas import schemas
from smid.reports.load import load
from smid.reports.overview_page import overview_report
from smid.reports.pdf import PdfWarning
from smid.reports.report import report

__all__ = [
    "PdfWarning",
    "check_report",
    "check_writable",
    "data_report",
    "load",
    "overview_report",
    "report",
    "schemas",
    "versions",
    "write_text",
]
