"""Reports: figures, and one self-contained HTML page."""

from smid.reports.html import data_report
from smid.reports.report import report
from smid.reports.versions import versions
from smid.reports.writing import check_writable, write_text

__all__ = ["check_writable", "data_report", "report", "versions", "write_text"]
