"""What a Typst template of somebody's own may read: the files that it names, beside it, in a folder of their own.

They are pictures and further Typst files. A link leads elsewhere, whatever it is called, and so do names above the
template's folder: what is at the end of them is in nobody's report.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from stepgauge.errors import InputError
from stepgauge.files.text import decode_text, read_bytes

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
