"""Tests by standards: each from recordings to values, their decision, and the standard's report."""
