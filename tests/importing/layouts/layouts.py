"""All foreign layouts."""

from __future__ import annotations

from tests.importing.layouts import axes, forms, further, gauges, handed, interferometers, laser_files, reports, series
from tests.importing.layouts.judge import Layout

LAYOUTS: list[Layout] = [
    *laser_files.LAYOUTS,
    *interferometers.LAYOUTS,
    *reports.LAYOUTS,
    *series.LAYOUTS,
    *gauges.LAYOUTS,
    *handed.LAYOUTS,
    *axes.LAYOUTS,
    *further.LAYOUTS,
    *forms.LAYOUTS,
]
