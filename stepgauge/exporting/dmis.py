"""DMIS output: ``FA(C1F2)=FEAT/POINT,CART,..`` with cycle and face as the name and the outward normal."""

from __future__ import annotations

import re
import textwrap
from urllib.parse import quote

from stepgauge import __version__
from stepgauge.errors import InputError, naming
from stepgauge.exporting.options import DECIMALS, Export, ExportOptions, left_out, run_comments, tip_radius_mm
from stepgauge.files.controls import fixed, plain
from stepgauge.files.units import LENGTH_MM
from stepgauge.programs.dmis import ENCODED
from stepgauge.recording import Recording

UNITS = {"mm": "MM", "m": "M", "inch": "INCH"}
LINE = 78
SAFE = " /,;()[]=+#&<>!?@|"
"""Signs that need not be encoded; a colon ends the key."""


def render(recording: Recording, options: ExportOptions, _: str) -> Export:
    """The text of an output file; lines stay below 80 characters."""
    if options.unit not in UNITS:
        raise InputError(naming("length_unit"), "not a unit of DMIS", found=options.unit, expected=", ".join(UNITS))
    name = plain(recording.comments.get("gauge", "recording"))[:40]
    radius, factor = tip_radius_mm(recording, options), 1.0 / LENGTH_MM[options.unit]
    lines = [
        f"DMISMN/'{name}',05.2",
        f"$$ written by stepgauge {__version__}: {len(recording)} measured points",
        f"FILNAM/'{name}',05.2",
        f"UNITS/{UNITS[options.unit]},ANGDEC",
        "D(MCS)=DATSET/MCS",
    ]
    if radius is not None:
        diameter = fixed(2.0 * radius * factor, 9)
        lines.append(f"S(PROBE)=SNSDEF/PROBE,FIXED,CART,0.0,0.0,0.0,0.0,0.0,-1.0,{diameter}")
    lines.append("PRCOMP/ON" if options.surface else "PRCOMP/OFF")
    for key, value in run_comments(recording).items():
        lines += _said(key, value)
    lines += _points(recording, factor, DECIMALS[options.unit])
    lines.append("ENDFIL")
    return Export(("\n".join(lines) + "\n").encode("ascii"), left_out(recording, ()))


def _said(key: str, value: str) -> list[str]:
    """A comment of the recording; what DMIS cannot hold is percent-encoded behind ``key*`` (RFC 8187), and shown."""
    words = f"{key}: {value}"
    shown = re.sub(r"[^\x20-\x7e]|['$]", "_", words)
    if shown == words and not key.endswith(ENCODED):
        return _text(words)
    return [f"$$ {shown}"[:LINE], *_text(f"{quote(key, SAFE)}{ENCODED}: {quote(value, SAFE)}")]


def _text(words: str) -> list[str]:
    """A TEXT/OUTFIL statement, continued where it is long."""
    parts = textwrap.wrap(f"TEXT/OUTFIL,'{words}'", LINE, drop_whitespace=False, break_on_hyphens=False)
    return [*(line + "$" for line in parts[:-1]), parts[-1]]


def _points(recording: Recording, factor: float, decimals: int) -> list[str]:
    frame = recording.frame
    several = recording.placements != [1]
    lines = []
    for placement, cycle, face, position, approach in zip(
        frame["placement"], frame["cycle"], frame["face"], recording.position_mm, recording.approach, strict=True
    ):
        label = f"P{placement}C{cycle}F{face}" if several else f"C{cycle}F{face}"
        xyz = ",".join(fixed(value * factor, decimals) for value in position)
        lines += [f"FA({label})=FEAT/POINT,CART,{xyz},$", ",".join(fixed(-value, 10) for value in approach)]
    return lines
