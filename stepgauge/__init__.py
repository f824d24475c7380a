"""stepgauge: calibrate coordinate measuring machines with a step gauge."""

__version__ = "0.1.0"
