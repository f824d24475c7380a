"""Probes: probe files, and the pre-travel and forces of the probe in any direction."""

from stepgauge.probes.base import ConstantProbe, LobedProbe, Probe
from stepgauge.probes.empirical import EmpiricalProbe
from stepgauge.probes.mechanical import KinematicProbe, MechanicalProbe, PiezoProbe
from stepgauge.probes.read import make_probe, probe_from_table, probe_table, read_probe
from stepgauge.probes.table import TableProbe

__all__ = [
    "ConstantProbe",
    "EmpiricalProbe",
    "KinematicProbe",
    "LobedProbe",
    "MechanicalProbe",
    "PiezoProbe",
    "Probe",
    "TableProbe",
    "make_probe",
    "probe_from_table",
    "probe_table",
    "read_probe",
]
