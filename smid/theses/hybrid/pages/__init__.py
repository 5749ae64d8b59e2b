"""A page for each part of the hybrid thesis, with its own figures of merit beside ours."""

from smid.theses.hybrid.pages.arm_page import arm_page
from smid.theses.hybrid.pages.inputs_page import inputs_page
from smid.theses.hybrid.pages.reactor_page import reactor_page

__all__ = ["arm_page", "inputs_page", "reactor_page"]
