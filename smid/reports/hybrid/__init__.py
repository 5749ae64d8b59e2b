"""A page for each part of the hybrid thesis, with its own figures of merit beside ours."""

from smid.reports.hybrid.arm_page import arm_page
from smid.reports.hybrid.inputs_page import inputs_page
from smid.reports.hybrid.reactor_page import reactor_page

__all__ = ["arm_page", "inputs_page", "reactor_page"]
