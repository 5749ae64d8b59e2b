"""A page for each part of the hybrid thesis, with its own figures of merit beside ours."""

from smid.reports.hybrid.reactor_page import reactor_page

__all__ = ["reactor_page"]
