"""Configuration of the documentation: everything is made at build time, nothing fetched later."""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path

from sphinx.application import Sphinx

import flipflow

sys.path.insert(0, str(Path(__file__).parent / "_ext"))
# Cells that run a command find it beside the interpreter that builds these pages.
os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])

project = "flipflow"
author = "The flipflow developers"
copyright = "The flipflow developers"
version = release = flipflow.__version__

extensions = [
    "svgmath",
    "validation",
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
]
exclude_patterns = ["_build", "jupyter_execute"]
templates_path = ["_templates"]

# Mathematics: pictures drawn at build time.
html_math_renderer = "svg"
myst_enable_extensions = ["amsmath", "dollarmath"]
myst_heading_anchors = 3

# Notebooks: run anew at every build; a cell that fails ends it.
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_in_temp = True
nb_merge_streams = True
nb_execution_timeout = 600  # the first cell to need a kernel compiles it
nb_ipywidgets_js = {}

# The public face.
autosummary_generate = True
autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_attr_annotations = False

html_theme = "pydata_sphinx_theme"
html_title = "flipflow"
html_static_path = ["_static"]
html_sidebars = {
    page: []
    for page in (
        "index",
        "conventions",
        "why-exact",
        "coexistence",
        "gallery",
        "tutorials/*",
        "how-to/*",
    )
}
html_context = {"default_mode": "auto"}  # light or dark, as the reader's system is
html_css_files = ["flipflow.css"]
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {
    "show_prev_next": False,
    "header_links_before_dropdown": 6,
    "navbar_end": ["theme-switcher"],
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
}


properties: dict[str, list[str]] = {}


def keep_property(
    _app: Sphinx, what: str, name: str, _obj: object, _options: object, lines: list[str]
) -> None:
    """Set a property's docstring aside: napoleon would read what precedes a colon as a type."""
    if what == "property":
        properties[name] = list(lines)


def restore_and_escape(
    _app: Sphinx, _what: str, name: str, _obj: object, _options: object, lines: list[str]
) -> None:
    """Put it back, and keep |x| from being read as a reference to a substitution."""
    lines[:] = properties.pop(name, lines)
    lines[:] = [re.sub(r"(?<!\\)\|", r"\\|", line) for line in lines]


def setup(app: Sphinx) -> None:
    """Connect what this configuration adds to Sphinx, around napoleon's priority of 500."""
    app.connect("autodoc-process-docstring", keep_property, priority=400)
    app.connect("autodoc-process-docstring", restore_and_escape, priority=600)
