"""Verbs on probes."""
