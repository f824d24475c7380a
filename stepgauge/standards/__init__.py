"""Evaluation by standards: length measurement (ISO 10360-2), positioning (ISO 230-2), uncertainty (GUM)."""
