"""Certificates of a small measurement, and where the schema lies that the tests validate against."""

from __future__ import annotations

import os
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from stepgauge.dcc.elements import to_bytes
from stepgauge.dcc.gauge_write import gauge_certificate
from stepgauge.dcc.write import machine_certificate
from stepgauge.evaluation.evaluate import evaluate
from stepgauge.evaluation.files import evaluation_to_dict
from stepgauge.gauge.certified import Gauge
from stepgauge.montecarlo import recording_model
from stepgauge.recording import Recording, join_recordings
from stepgauge.reports.certificate_file import Laboratory, read_laboratory
from stepgauge.standards.budget import make_budget
from stepgauge.standards.budget_files import StoredBudget, stored_budget
from tests.conftest import ROOT
from tests.measured import ALONG_X, named, run, shipped

SCHEMA = Path(os.environ.get("STEPGAUGE_DCC_SCHEMA", ROOT.parent / "shared/data/dcc/dcc-3.2.0.xsd"))
needs_schema = pytest.mark.skipif(
    not SCHEMA.is_file(),
    reason=f"the DCC schema 3.2.0 is not at {SCHEMA.name} beside the checkout; STEPGAUGE_DCC_SCHEMA=dcc.xsd names it",
)
SAID = ROOT / "examples/certificate/certificate.toml"


def laboratory() -> Laboratory:
    return read_laboratory(SAID)


def measured(placements: int = 1) -> Recording:
    return one_recording() if placements == 1 else named(join_recordings([run(3).recording, run(2, ALONG_X).recording]))


@cache
def one_recording() -> Recording:
    return named(run(3).recording)


@cache
def evaluated(placements: int = 1) -> tuple[dict[str, Any], StoredBudget]:
    """The evaluation of a measurement, and its budget as it is read back."""
    gauge, machine = shipped()
    recording = measured(placements)
    model = recording_model(recording, machine, gauge, 0.1)
    stored = stored_budget(model, make_budget(model), 0)
    return evaluation_to_dict(evaluate(recording, gauge)), stored


@cache
def machine_xml(placements: int = 1) -> str:
    """The certificate of the machine."""
    evaluation, budget = evaluated(placements)
    gauge, machine = shipped()
    return to_bytes(machine_certificate(evaluation, budget, laboratory(), gauge, machine)).decode()


def gauge_xml(gauge: Gauge | None = None) -> str:
    """The certificate of the shipped gauge."""
    gauge = gauge or shipped()[0]
    return to_bytes(gauge_certificate(gauge, gauge_laboratory(gauge))).decode()


def gauge_laboratory(gauge: Gauge) -> Laboratory:
    """What the laboratory of the gauge states."""
    said, own = laboratory(), gauge.certificate
    day = dict.fromkeys(("received", "performed_from", "performed_to", "issued"), own.date)
    head = said.certificate.model_copy(update={"number": own.number, **day})
    return replace(said, certificate=head, item=said.item.model_copy(update={"serial": None}))
