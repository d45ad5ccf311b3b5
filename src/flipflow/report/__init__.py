"""Reports: blocks made from results, section by section, and their renderers."""

from flipflow.report import (  # noqa: F401  they register sections
    appendix,
    compare,
    design,
    details,
    first_page,
    foundation,
    parts,
    sensitivity,
    study,
    transients,
    weight,
)
from flipflow.report.html import write_html
from flipflow.report.terminal import summary

__all__ = ["summary", "write_html"]
