"""The pages in the order of the navigation. A page is a module with ``ROUTES``; its first route is the page itself.

A module imports at its top what the first page needs at once and nothing heavy: numpy, plotly and the rest of stepgauge
are imported in the functions that use them, so that the first page is there within a second.
"""

from __future__ import annotations

from importlib import import_module

from starlette.routing import BaseRoute

PAGES = (
    *("project", "gauge", "machine", "locate", "plan", "run", "importing"),
    *("result", "diagnosis", "probe", "history", "report", "certificate"),
)
"""Modules of this package; ``nav.NAME`` is the text of each, ``/NAME`` its address, and the first is also ``/``."""


SECTIONS = {"probe": "machine", "certificate": "report"}
"""Pages that have no place of their own in the navigation, and that in which they are."""
NAVIGATION = tuple(name for name in PAGES if name not in SECTIONS)
"""The probe is a part of the machine, and a certificate is a report: their pages lead to them."""
PARTS = ("sources",)
"""Modules whose routes are parts of a page of another one: the sources of uncertainty are on that of the result."""


def all_routes() -> list[BaseRoute]:
    """The routes of all pages."""
    return [route for name in (*PAGES, *PARTS) for route in import_module(f"{__name__}.{name}").ROUTES]
