"""The library that draws figures in a browser (plotly), as a page that needs no network carries it."""

from __future__ import annotations

import base64
import gzip


def packed_library() -> str:
    """Plotly's 4.8 MB of text, compressed and in base64: the browser unpacks it (``DecompressionStream``)."""
    from plotly.offline import get_plotlyjs

    return base64.b64encode(gzip.compress(get_plotlyjs().encode(), mtime=0)).decode("ascii")


def embedded_json(text: str) -> str:
    """JSON that may stand in a script element: nothing in it can end the element, nor begin a comment."""
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")
