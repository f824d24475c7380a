"""Moves of the tip, the bodies that it could touch, and the sweep that finds whether it does."""
