"""The documentation site: ``pip install '.[docs]'``, then ``sphinx-build -W docs site``."""

from __future__ import annotations

import re
import shutil
import sys
from pathlib import Path

from sphinx.application import Sphinx

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

from stepgauge import __version__  # noqa: E402

project = "stepgauge"
author = "the stepgauge team"
release = version = __version__
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "sphinx_gallery.gen_gallery",
]
myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 4
exclude_patterns = ["gallery", "figures"]
nitpicky = False
html_theme = "furo"
html_title = f"stepgauge {release}"
autodoc_typehints = "description"
autodoc_member_order = "bysource"
sphinx_gallery_conf = {
    "examples_dirs": ["gallery"],
    "gallery_dirs": ["_gallery"],
    "filename_pattern": "/plot_",
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_memory": False,
    "remove_config_comments": True,
    "backreferences_dir": "_gallery/backreferences",
    "doc_module": ("stepgauge",),
}
suppress_warnings = ["config.cache"]


def _write_reference(app: Sphinx) -> None:
    from reference import write_reference

    for name in ("_reference", "_gallery"):  # nothing of an earlier build stays
        shutil.rmtree(HERE / name, ignore_errors=True)
    write_reference(HERE / "_reference")


def _outside(app: Sphinx, name: str, source: list[str]) -> None:
    """Links to pages of the repository that are not part of the site become their paths in it."""
    source[0] = re.sub(r"\[([^\]]+)\]\(\.\./((?:examples|benchmarks)/[^)]+|README\.md[^)]*)\)", r"\1 (`\2`)", source[0])


def _drawings(app: Sphinx, what: str, name: str, one: object, options: object, lines: list[str]) -> None:
    """Paragraphs that are indented, before the first heading of a docstring, are drawings and tables: as they are."""
    end = next((i for i, line in enumerate(lines) if line.startswith("---")), len(lines))
    for i in range(end - 1, 0, -1):
        if lines[i].startswith("    ") and not lines[i - 1].strip() and not _is_indented_before(lines, i):
            lines[i:i] = ["::", ""]


def _is_indented_before(lines: list[str], i: int) -> bool:
    """Whether the last line with text above ``i`` is a part of the same drawing."""
    above = [line for line in lines[:i] if line.strip()]
    return bool(above) and above[-1].startswith("    ")


def setup(app: Sphinx) -> None:
    """Write the pages that follow from the code before Sphinx looks for pages."""
    app.connect("source-read", _outside)
    app.connect("autodoc-process-docstring", _drawings, priority=100)  # before napoleon
    app.connect("config-inited", lambda app, _: _write_reference(app))
