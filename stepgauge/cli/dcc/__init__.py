"""Verbs on Digital Calibration Certificates."""
