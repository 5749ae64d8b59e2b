"""How the documentation is built: ``make docs``, warnings as errors, notebooks shown with their kept outputs."""

import inspect
import re
from importlib import import_module
from importlib.metadata import version as installed
from pathlib import Path

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.util.logging import getLogger
from sphinx.writers.html5 import HTML5Translator

project = "smid"
author = "the smid developers"
project_copyright = "the smid developers, MIT licence"
version = release = installed("smid")

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
]
exclude_patterns = ["_build", "README.md", "**/.ipynb_checkpoints"]
templates_path = ["_templates"]
default_role = "literal"  # docstrings write names in single backticks, of which few are importable

# docs/notebooks is a link to ../notebooks; `make notebooks` runs them.
nb_execution_mode = "off"
nb_merge_streams = True
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 3

autosummary_generate = True
autodoc_typehints = "none"  # numpydoc shows the types of the Parameters sections
autodoc_member_order = "bysource"
numpydoc_show_class_members = False

html_math_renderer = "mathml"  # MathJax would come from the network
html_theme = "furo"
html_title = f"smid {version}"
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#0b5394", "color-brand-content": "#0b5394"},
    "dark_css_variables": {"color-brand-primary": "#8ab8e6", "color-brand-content": "#8ab8e6"},
}

PAGES = sorted(set(re.findall(r"^   ([a-z_.]+)$", Path(__file__).with_name("api.md").read_text("utf-8"), re.MULTILINE)))
"""The modules that have a page."""


def exported(module: str) -> dict[str, object]:
    """Return what a module offers: its ``__all__``, or without one what it defines under names without underscore."""
    found = import_module(module)
    if hasattr(found, "__all__"):
        return {name: getattr(found, name) for name in found.__all__}  # smid imports a name when it is asked for
    own = {name: item for name, item in vars(found).items() if getattr(item, "__module__", None) == module}
    return {name: item for name, item in own.items() if not name.startswith("_")}


def public(module: str) -> list[tuple[str, str, str]]:
    """Return directive, name and home of what a module offers: its home is the deepest page that offers it too."""
    listed = []
    for name, item in sorted(exported(module).items()):
        if not (inspect.isclass(item) or inspect.isfunction(item)):
            continue
        kind = "function" if inspect.isfunction(item) else "exception" if issubclass(item, Exception) else "class"
        homes = [page for page in PAGES if exported(page).get(name) is item]
        listed.append((f"auto{kind}", name, max(homes, key=lambda page: page.count("."))))
    return listed


autosummary_context = {"public": public}
suppress_warnings = [
    "config.cache",  # a function in the context has no pickle
    "myst.xref_missing",  # pages link to files beside docs/, too; tests/smid/test_documentation.py checks every link
]


def mathml(node: nodes.math | nodes.math_block, as_block: bool = False) -> str:
    """Return a formula as MathML; what cannot be told so is a warning with its place."""
    try:
        return tex2mathml(node.astext(), as_block=as_block)
    except MathError as error:
        getLogger(__name__).warning("%s", error, location=node)
        return ""


def write_inline(self: HTML5Translator, node: nodes.math) -> None:
    """Write a formula within a line."""
    self.body.append(mathml(node))
    raise nodes.SkipNode


def write_block(self: HTML5Translator, node: nodes.math_block) -> None:
    """Write a formula of its own."""
    self.body.append(f'<div class="math">{mathml(node, as_block=True)}</div>')
    raise nodes.SkipNode


def setup(app: Sphinx) -> None:
    """Let browsers set formulas themselves."""
    app.add_html_math_renderer("mathml", (write_inline, None), (write_block, None))
