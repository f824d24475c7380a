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
html_static_path = ["static"]
html_css_files = ["site.css"]
napoleon_use_rtype = False
autodoc_typehints = "none"  # the sentence of a parameter says what it takes
autodoc_member_order = "bysource"
sphinx_gallery_conf = {
    "examples_dirs": ["gallery"],
    "gallery_dirs": ["_gallery"],
    "filename_pattern": "/plot_",
    "within_subsection_order": "FileNameSortKey",
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


def _docstring(app: Sphinx, what: str, name: str, one: object, options: object, lines: list[str]) -> None:
    """Our docstrings as napoleon wants them: drawings and commands as they are, what a parameter is in its own line."""
    heads = [i for i in range(1, len(lines)) if lines[i] and set(lines[i]) == {"-"}]
    parts = {lines[i - 1]: lines[i + 1 : end - 1] for i, end in zip(heads, [*heads[1:], len(lines) + 1], strict=False)}
    first = lines[: heads[0] - 1] if heads else list(lines)
    made = _verbatim(first)
    for title, part in parts.items():
        if title == "Parameters":
            part = [re.sub(r"^(\S[^:]*?) : (.*)$", r"\1\n    \2", line) for line in part]
        elif title == "Examples" and part and part[0].startswith("stepgauge "):
            part = ["::", "", *(f"    {line}" for line in part)]
        made += ["", title, "-" * len(title), *"\n".join(part).split("\n")]
    lines[:] = made


def _verbatim(lines: list[str]) -> list[str]:
    """Indented paragraphs are drawings: the first of each is announced as a literal block."""
    made: list[str] = []
    last = ""
    for line in lines:
        if line.startswith("    ") and not last.startswith("    "):
            made += ["::", ""]
        made.append(line)
        last = line or last
    return made


def setup(app: Sphinx) -> None:
    """Write the pages that follow from the code before Sphinx looks for pages."""
    app.connect("source-read", _outside)
    app.connect("autodoc-process-docstring", _docstring, priority=100)  # before napoleon
    app.connect("config-inited", lambda app, _: _write_reference(app))
