"""A recording in the forms that other programs read; what a form cannot hold is said.

A form is one module here with a function ``render(recording, options) -> Export``. What is written is read back by
:mod:`stepgauge.importing` as the same recording, to the printed digits.
"""

from __future__ import annotations

from importlib import import_module

from stepgauge.errors import InputError, naming
from stepgauge.exporting.options import Export, ExportOptions, prepared
from stepgauge.recording import Recording

FORMS = {"dmis": ".dmo", "ippdme": ".log", "linuxcnc": ".txt", "csv": ".csv", "xlsx": ".xlsx"}
"""Names of the forms and the usual endings of their files."""
_MODULES = {"csv": "table", "xlsx": "table"}

__all__ = ["FORMS", "Export", "ExportOptions", "export_recording"]


def export_recording(recording: Recording, form: str, options: ExportOptions | None = None) -> Export:
    """A recording in another form.

    Parameters
    ----------
    recording : tip centres
    form : name in :data:`FORMS`
    options : unit, marks, kind of points

    Raises
    ------
    InputError
        several placements in a form that has room for one, surface points without a tip radius, marks that clash
    """
    options = options or ExportOptions()
    if form not in FORMS:
        raise InputError(naming("to"), "not a form", found=form, expected=", ".join(FORMS))
    module = import_module(f"stepgauge.exporting.{_MODULES.get(form, form)}")
    export = module.render(prepared(recording, options), options, form)
    assert isinstance(export, Export)
    return export
