"""Fixtures and the profile of the property tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from stepgauge.gauge import Gauge, read_gauge
from stepgauge.machine_file import Machine, read_machine

# Tests use examples found once and for all on CI, and look for new ones on a developer's machine.
settings.register_profile(
    "stepgauge", deadline=None, derandomize="CI" in os.environ, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("stepgauge")

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture
def gauge() -> Gauge:
    """The shipped 420 mm gauge."""
    return read_gauge("step-gauge-420")


@pytest.fixture
def machine() -> Machine:
    """The shipped bridge CMM."""
    return read_machine("bridge-cmm")
