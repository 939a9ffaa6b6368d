"""Settings of the documentation's site: ``sphinx-build -W docs out/site``."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import kop_exudyn

sys.path.insert(0, str(Path(__file__).parent))

project = "kop_exudyn"
author = "the kop_exudyn contributors"
release = version = kop_exudyn.__version__

extensions = ["schema_tables", "mathml", "myst_parser", "sphinx.ext.autodoc"]
myst_enable_extensions = ["dollarmath", "amsmath", "deflist"]
myst_heading_anchors = 3
exclude_patterns = ["_build"]

html_theme = "furo"
html_title = "kop_exudyn"
html_copy_source = False
html_math_renderer = "mathml"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_copyright = False
smartquotes = False  # quotes in values are part of them

default_role = "literal"  # `name` in docstrings is code
autodoc_typehints = "signature"
autodoc_member_order = "bysource"


def _as_written(app, what, name, obj, options, lines: list[str]) -> None:
    """Docstrings are plain text, not reStructuredText: the first paragraph as text, all others as
    they are written."""
    end = lines.index("") if "" in lines else len(lines)
    summary = [
        re.sub(r"([\\*|]|_(?!\w))", r"\\\1", line.replace("``", "`")) for line in lines[:end]
    ]
    rest = [
        f"   {line}".replace("``", "`").replace("  # doctest: +SKIP", "")
        for line in lines[end + 1 :]
    ]
    lines[:] = [
        *summary,
        "",
        *([".. code-block:: text", "", *rest, ""] if any(line.strip() for line in rest) else []),
    ]


def setup(app) -> None:
    app.connect("autodoc-process-docstring", _as_written)
