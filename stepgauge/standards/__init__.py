"""Limits and evaluations as the standards have them."""
