"""What a figure says."""

from __future__ import annotations

from pathlib import Path

from pypdf import PdfReader


def text_of(path: Path) -> str:
    """All text of a figure that was drawn as PDF."""
    return PdfReader(path).pages[0].extract_text()
