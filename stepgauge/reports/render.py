"""Content to pages: PDF through a Typst template, HTML and Markdown through Jinja ones, shipped or the user's own.

Typst gets the content as data, never as markup, so that no text in it can be taken for code. Jinja escapes every value
for HTML and runs in its sandbox; a name that the content does not have is an error in both. A user's own template has a
process and a budget of its own, and reads what it names beside it (:mod:`stepgauge.reports.render`).

What a Typst template of somebody's own may read: the files that it names, beside it, in a folder of their own.

They are pictures and further Typst files. A link leads elsewhere, whatever it is called, and so do names above the
template's folder: what is at the end of them is in nobody's report.
"""

from __future__ import annotations

import base64
import html
import json
import os
import posixpath
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal, NamedTuple

from stepgauge.errors import InputError
from stepgauge.figures.plotly_library import embedded_json
from stepgauge.figures.style import figure_svg
from stepgauge.files.notation import clean, printed
from stepgauge.files.resource_limits import work_within
from stepgauge.files.resources import folder
from stepgauge.files.templating import template_budget
from stepgauge.files.text import decode_text, read_bytes, read_text, replacing
from stepgauge.languages.messages import translate_printed

PDF_STANDARDS: tuple[Literal["a-3a", "1.7"], ...] = ("a-3a", "1.7")
"""Standards tried in turn: archival and accessible; plain where a character is in no font at hand."""


PDF_BUDGET, HTML_BUDGET = (30.0, 2000.0), (10.0, 600.0)
"""Processor time in s and memory in MB of a user's own template, besides what goes with the size of the report."""
NOWHERE = "http://127.0.0.1:9"
"""Where nobody answers: what Typst takes for the way into the network."""


class Pages(NamedTuple):
    """A rendered report, and what the person who asked for it should know of it."""

    data: bytes
    notes: tuple[str, ...] = ()


def write_report(path: str | Path, content: dict[str, Any], template: str | Path | None = None) -> tuple[str, ...]:
    """Write a report as ``.pdf`` or ``.html``; the file appears only when it is whole.

    Parameters
    ----------
    path : where to; its suffix decides the kind
    content : what :func:`stepgauge.reports.content.make_content` gives
    template : Typst (for PDF) or Jinja (for HTML) file to use instead of the shipped one

    Returns
    -------
    Notes on the file for the person who asked for it, mostly none.

    Raises
    ------
    InputError
        another suffix, or a template that fails, with its line where that is known
    """
    target = Path(path)
    render = renderer(target)
    pages = render(content, template)
    if content.get("end"):
        _check_issued(target, content, pages.data)
    with replacing(target) as beside:
        beside.write_bytes(pages.data)
    return pages.notes


def _check_issued(target: Path, content: dict[str, Any], data: bytes) -> None:
    """:class:`InputError` where a certificate would be lost, or two have one number (ISO/IEC 17025:2017, 7.8.8)."""
    for path in sorted(target.parent.glob(f"*{target.suffix}")):
        old = path.read_bytes() if path.is_file() else data
        found = _CERTIFICATE.search(old) if old != data else None
        number = None if found is None else html.unescape(found[1].decode("utf-8", "replace"))
        if number is not None and (path == target or number == content["number"]):
            what = f"certificate {number} is there already, and one that was issued is kept"
            expected = f"a number of its own, {number!r} stated as the certificate that it replaces, and another file"
            raise InputError(path, what, expected=expected)


_CERTIFICATE = re.compile(rb">(?:Calibration certificate|Kalibrierschein) ([^<]+)<")
"""The title of a file, as PDF/A and HTML have it."""


def renderer(path: str | Path) -> Callable[[dict[str, Any], str | Path | None], Pages]:
    """The renderer for a file name; :class:`InputError` where its suffix is neither .pdf nor .html."""
    kinds = {".pdf": render_pdf, ".html": render_html}
    suffix = Path(path).suffix.lower()
    if suffix not in kinds:
        raise InputError(path, "not a kind of report", found=repr(suffix), expected=" or ".join(kinds))
    return kinds[suffix]


def render_pdf(content: dict[str, Any], template: str | Path | None = None) -> Pages:
    """The report as PDF; fonts come with Typst, those of the system are asked only for characters it lacks.

    Archival (PDF/A-3, tagged) where every character has a font; otherwise plain, with a note that says why.
    """
    source = Path(template) if template else shipped_template(content, "typ")
    report = json.dumps(set_in_print(content))
    if template is None:
        pages = _typeset(source, report)
    else:
        with template_folder(source) as folder_of_its_own:
            given = {"source": str(source), "report": report, "folder": str(folder_of_its_own)}
            budget = template_budget(len(report), *PDF_BUDGET)
            pages = _unpacked(work_within(budget, _own_pdf, given, source))
    _check_use(source, r"sys\.inputs|#(import|include)\b", "a Typst file with sys.inputs.report")
    return pages


def _typeset(source: Path, report: str, **options: Any) -> Pages:
    """PDF by a Typst file that may read what is in its folder."""
    import typst

    reasons: list[str] = []
    for standard in PDF_STANDARDS:
        try:
            data = typst.compile(
                source.resolve(),
                root=source.resolve().parent,
                format="pdf",
                sys_inputs={"report": report},
                pdf_standards=[standard],
                **options,
            )
            return Pages(bytes(data), tuple(f"plain PDF, not for archives: {reason}" for reason in reasons))
        except typst.TypstError as error:
            reasons.append(getattr(error, "message", str(error)) + _typst_line(error))
    raise InputError(source, f"template: {reasons[-1]}")


def _own_pdf(given: dict[str, Any]) -> bytes:
    """A template of somebody's own, in a folder that has nothing but its files, without a way into a network."""
    source = Path(given["source"])
    os.environ.update(dict.fromkeys(("http_proxy", "https_proxy", "HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY"), NOWHERE))
    try:
        pages = _typeset(Path(given["folder"]) / source.name, given["report"], package_path=given["folder"])
    except InputError as error:
        raise error.at(source) from None
    return json.dumps(pages.notes).encode() + b"\n" + pages.data


def _unpacked(answer: bytes) -> Pages:
    notes, _, data = answer.partition(b"\n")
    return Pages(data, tuple(json.loads(notes)))


def set_in_print(content: dict[str, Any]) -> dict[str, Any]:
    """A page with its words and figures in its ``language``, of a story also as they are set in print.

    ``own`` is what people wrote: no language changes it.
    """
    content = {"language": "en", "own": [], **content, "words": {one: one for one in WORDS}}
    told = _changed(content, translator(content))
    return dict(_changed(told, printed) if content.get("layout") == "story" else told)


def translator(content: dict[str, Any]) -> Callable[[str], str]:
    """What puts a text of a page into its language."""
    return str if content["language"] == "en" else partial(translate_printed, own=frozenset(content["own"]))


WORDS = (
    *("not stated", "Not stated", "no number stated", "No.", "page", "pages", "of", "Remarks", "Verdict", "Signed for"),
    *("Method of evaluation", "name, date, signature", "EXAMPLE CERTIFICATE"),
    *("EXAMPLE CERTIFICATE – not a real calibration", "Simulated recording: no machine was measured."),
    "The results this report was made from",
)
"""The words of the templates themselves."""
_NO_WORDS = {"data", "layout", "kind", "language", "version", "own"}


def _changed(value: Any, change: Callable[[str], str]) -> Any:
    """All words of a page; nothing in what is to be copied or read by a program, and no picture."""
    if isinstance(value, dict):
        kept = value if value.get("kind") == "code" else _NO_WORDS
        return {key: one if key in kept else _changed(one, change) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_changed(one, change) for one in value]
    if isinstance(value, str):
        return value if value.startswith(("<svg", "<?xml")) else change(value)
    return figure_svg(value, change) if hasattr(value, "savefig") else value


def shipped_template(content: dict[str, Any], suffix: str) -> Path:
    """The template of what is to be printed: ``report`` for what is measured, ``story`` for a diagnosis."""
    return folder("templates") / "reports" / f"{content.get('layout', 'report')}.{suffix}"


def markdown(content: dict[str, Any]) -> str:
    """A story as Markdown, its figures by their names."""
    environment = _environment(autoescape=False)
    environment.filters["cell"] = cell
    text = shipped_template(content, "md.j2").read_text(encoding="utf-8")
    return str(environment.from_string(text).render(report=content))


def cell(text: object) -> str:
    """Text escaped for a cell of a table in Markdown."""
    return clean(text).replace("\n", " ").replace("|", "\\|").replace("`", "'")


def _check_use(source: Path, pattern: str, expected: str) -> None:
    """Another file given for a template prints itself, whatever was measured."""
    if not re.search(pattern, read_text(source)):
        raise InputError(source, "template: it prints nothing of the report", expected=expected)


def _typst_line(error: Exception) -> str:
    """`` (line N)`` of a Typst error that says where."""
    found = re.search(r":(\d+):\d+", getattr(error, "diagnostic", ""))
    return f" (line {found[1]})" if found else ""


def render_html(content: dict[str, Any], template: str | Path | None = None) -> Pages:
    """The report as one HTML file without links to others."""
    source = Path(template) if template else shipped_template(content, "html.j2")
    given = {"text": read_text(source), "source": str(source), "report": set_in_print(content)}
    if template is None:
        page = _html(given)
    else:
        page = work_within(template_budget(len(json.dumps(given)), *HTML_BUDGET), _html, given, source)
    _check_use(source, r"\breport\b", "a Jinja file with {{ report }}")
    return Pages(page)


def _html(given: dict[str, Any]) -> bytes:
    """The page; for a template of somebody's own in a process that is for it alone."""
    import jinja2

    from stepgauge.files.sandbox import template_line

    source = given["source"]
    environment = _environment(autoescape=True)
    environment.filters.update(image=svg_address, symbols=format_indices, json=json_element)
    try:
        return str(environment.from_string(given["text"]).render(report=given["report"])).encode("utf-8")
    except jinja2.TemplateSyntaxError as error:
        raise InputError(f"{source}:{error.lineno}", f"template: {error.message}") from None
    except MemoryError:
        raise
    except Exception as error:  # whatever a user's template does is the template's fault: name its line
        raise InputError(f"{source}:{template_line(error)}", f"template: {error}") from None


def _environment(autoescape: bool) -> Any:
    import jinja2
    from jinja2.sandbox import ImmutableSandboxedEnvironment

    return ImmutableSandboxedEnvironment(
        autoescape=autoescape,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=not autoescape,
    )


SYMBOLS = re.compile(r"\b(R_eff|[ER]_0,MP[EL]|E_150|[ER]_0|P_(?:Form|Size)|L_Dia|d_(?:60|t))\b")


def format_indices(text: str) -> Any:
    """Text for HTML, escaped, its symbols with an index (the same ones as in ``report.typ``)."""
    from markupsafe import Markup, escape

    parts = SYMBOLS.split(text)
    shown = [
        Markup("{}<sub>{}</sub>").format(*part.split("_", 1)) if i % 2 else escape(part) for i, part in enumerate(parts)
    ]
    return Markup("").join(shown)


def json_element(value: object) -> Any:
    """JSON for a script element: nothing in it can end the element."""
    from markupsafe import Markup

    return Markup(embedded_json(json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))))


def svg_address(svg: str) -> str:
    """A figure as an address that holds it: shown as an image, it cannot run anything."""
    return "data:image/svg+xml;base64," + base64.b64encode(svg.encode("utf-8")).decode("ascii")


MOST_FILES = 100
MOST_BYTES = 20_000_000
_NAMED = re.compile(r'"([^"\\\n]+\.(?:typ|png|jpe?g|gif|svg|webp))"', re.IGNORECASE)


@contextmanager
def template_folder(source: Path) -> Iterator[Path]:
    """A folder with copies of a template and of what it names; it is gone after the block.

    :class:`InputError` for links, packages of the network, and more than :data:`MOST_FILES` or :data:`MOST_BYTES`.
    """
    with TemporaryDirectory(prefix="stepgauge-") as private:
        for name, data in _files(source).items():
            copy = Path(private) / name
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes(data)
        yield Path(private)


def check_packages(text: str, source: str | Path) -> None:
    """:class:`InputError` where a Typst file loads a package of the network."""
    if re.search(r"@preview\b", text):
        raise InputError(source, "template: packages from the network are not loaded", found="@preview")


def _files(source: Path) -> dict[str, bytes]:
    """The content of the template and of all that it and its parts name, by the ways from its folder."""
    found = {source.name: read_bytes(source)}
    parts = [source.name]
    while parts:
        part = parts.pop()
        text = decode_text(found[part], source.parent / part)
        check_packages(text, source.parent / part)
        for name in _names(text, part):
            if name not in found and (source.parent / name).exists():
                found[name] = _read_beside(source, name)
                parts += [name] if name.lower().endswith(".typ") else []
        if len(found) > MOST_FILES or sum(map(len, found.values())) > MOST_BYTES:
            expected = f"at most {MOST_FILES} files of {MOST_BYTES / 1e6:.0f} MB in all"
            raise InputError(source, "template: it uses too many files", expected=expected)
    return found


def _names(text: str, part: str) -> list[str]:
    """Ways from the template's folder to what a part of it names, none that leads out of it."""
    ways = (posixpath.normpath(posixpath.join(posixpath.dirname(part), one)) for one in _NAMED.findall(text))
    return [way for one in ways if not (way := one.lstrip("/")).startswith("..")]


def _read_beside(source: Path, name: str) -> bytes:
    place = source.parent / name
    if place.resolve() != source.parent.resolve() / name or not place.is_file():
        expected = "a copy of the file beside the template"
        raise InputError(source, "template: what it names is a link", found=name, expected=expected)
    return read_bytes(place)
