"""Attacks that stepgauge must stand: damaged files, kills in the middle of a run, and a full disk."""
