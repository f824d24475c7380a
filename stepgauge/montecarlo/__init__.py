"""Propagation of distributions through the virtual CMM and the evaluation (JCGM 101:2008)."""

from stepgauge.montecarlo.build import program_model, recording_model
from stepgauge.montecarlo.inputs import MonteCarloInputs, collect_inputs
from stepgauge.montecarlo.model import MonteCarloModel
from stepgauge.montecarlo.run import run_monte_carlo
from stepgauge.montecarlo.sources import ModelOptions, read_model
from stepgauge.montecarlo.summary import Summary

__all__ = [
    "ModelOptions",
    "MonteCarloInputs",
    "MonteCarloModel",
    "Summary",
    "collect_inputs",
    "program_model",
    "read_model",
    "recording_model",
    "run_monte_carlo",
]
